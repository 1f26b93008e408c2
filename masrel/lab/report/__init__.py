"""The report of a study: tables, figures and pages.

In: a protocol, ratings and their analysis. Out: one self-contained HTML page, the
same as Markdown, tables as CSV, figures as PNG and SVG.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.lab.report._conduct import StudyConduct, study_conduct
    from masrel.lab.report._document import ReportFiles, write_report

__all__ = [
    "ReportFiles",
    "StudyConduct",
    "study_conduct",
    "write_report",
]


def __getattr__(name: str) -> object:
    if name in __all__:
        from masrel.lab.report import _conduct, _document

        return getattr(_conduct if "onduct" in name else _document, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

"""The report of a study: tables, figures and pages.

In: a protocol, ratings and their analysis. Out: one self-contained HTML page, the
same as Markdown, tables as CSV, figures as PNG and SVG.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.lab.report._conduct import StudyConduct, study_conduct
    from masrel.lab.report._document import ReportFiles, write_report
    from masrel.lab.report._published_numbers import PublishedClaims, published_claims

__all__ = [
    "PublishedClaims",
    "ReportFiles",
    "StudyConduct",
    "published_claims",
    "study_conduct",
    "write_report",
]


def __getattr__(name: str) -> object:
    if name in __all__:
        from masrel.lab.report import _conduct, _document, _published_numbers

        modules = (_conduct, _published_numbers, _document)
        return next(getattr(m, name) for m in modules if hasattr(m, name))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

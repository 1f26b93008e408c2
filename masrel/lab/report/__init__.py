"""The report of a study: tables, figures and pages.

In: a protocol, ratings and their analysis. Out: one self-contained HTML page, the
same as Markdown, tables as CSV, figures as PNG and SVG.
"""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from

if TYPE_CHECKING:
    from masrel.lab.report._conduct import StudyConduct, study_conduct
    from masrel.lab.report._document import ReportFiles, write_report

__all__ = [
    "ReportFiles",
    "StudyConduct",
    "study_conduct",
    "write_report",
]


_HOMES = {
    "ReportFiles": "_document",
    "StudyConduct": "_conduct",
    "study_conduct": "_conduct",
    "write_report": "_document",
}

__getattr__ = loaded_from(__name__, _HOMES)

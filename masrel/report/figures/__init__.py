"""Figures of the report: the only package that draws.

In: what to draw, as plain frozen values. Out: PNG and SVG, the same bytes for the
same values.
"""

from masrel.report.figures.forest import ForestRow, draw_forest
from masrel.report.figures.grades import GradeGrid, draw_grades
from masrel.report.figures.speeds import SpeedColumn, draw_speeds
from masrel.report.figures.style import Drawn
from masrel.report.figures.traces import TracePanel, draw_traces

__all__ = [
    "Drawn",
    "ForestRow",
    "GradeGrid",
    "SpeedColumn",
    "TracePanel",
    "draw_forest",
    "draw_grades",
    "draw_speeds",
    "draw_traces",
]

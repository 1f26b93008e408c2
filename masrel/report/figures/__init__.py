"""Figures of the report: the only package that draws.

In: what to draw, as plain frozen values. Out: PNG and SVG, or PDF, the same
bytes for the same values.
"""

from masrel.report.figures.forest import ForestRow, draw_forest, forest_file
from masrel.report.figures.grades import GradeGrid, draw_grades
from masrel.report.figures.speeds import SpeedColumn, draw_speeds
from masrel.report.figures.style import Drawn, Form
from masrel.report.figures.traces import TracePanel, draw_traces

__all__ = [
    "Drawn",
    "ForestRow",
    "Form",
    "GradeGrid",
    "SpeedColumn",
    "TracePanel",
    "draw_forest",
    "draw_grades",
    "draw_speeds",
    "draw_traces",
    "forest_file",
]

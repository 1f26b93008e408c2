"""Figures of the report: the only package that draws.

In: what to draw, as plain frozen values. Out: PNG and SVG, or PDF, the same
bytes for the same values.
"""

from masrel.report.figures.catches import CatchCurve, draw_catches
from masrel.report.figures.forest import ForestRow, draw_forest, forest_file
from masrel.report.figures.grades import GradeGrid, draw_grades
from masrel.report.figures.latent import (
    LatentScale,
    ScaleRow,
    draw_latent,
    latent_file,
)
from masrel.report.figures.schematic import CatchSchematic, draw_schematic
from masrel.report.figures.speeds import SpeedColumn, draw_speeds
from masrel.report.figures.stretches import (
    StretchLine,
    StretchPanel,
    draw_stretches,
)
from masrel.report.figures.style import Drawn, Form
from masrel.report.figures.traces import TracePanel, draw_traces

__all__ = [
    "CatchCurve",
    "CatchSchematic",
    "Drawn",
    "ForestRow",
    "Form",
    "GradeGrid",
    "LatentScale",
    "ScaleRow",
    "SpeedColumn",
    "StretchLine",
    "StretchPanel",
    "TracePanel",
    "draw_catches",
    "draw_forest",
    "draw_grades",
    "draw_latent",
    "draw_schematic",
    "draw_speeds",
    "draw_stretches",
    "draw_traces",
    "forest_file",
    "latent_file",
]

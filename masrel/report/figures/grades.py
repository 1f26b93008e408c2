"""The grid of one session's grades, as shaded cells."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from masrel.report.figures.style import (
    BLACK,
    GREY,
    VERMILLION,
    Drawn,
    finish,
    house_style,
)

__all__ = ["GradeGrid", "draw_grades"]

INTENDED_X = -1.3
"""Where the column of intended grades stands; raters are at 0, 1, 2, ..."""

_shades = LinearSegmentedColormap.from_list("grades", ["#F2F6FA", "#7FB6DA", "#003A5D"])


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeGrid:
    """Grades of one session, one row a model and one column a rater.

    Attributes
    ----------
    models, raters : tuple of str
        Names of the rows and columns.
    intended : tuple of str or None
        Intended grade of every model.
    grades : tuple of tuple of tuple of str
        The grades of every presentation, in order; none is missing.
    scale : tuple of str
        Every grade of the scale, least first.
    """

    models: tuple[str, ...]
    raters: tuple[str, ...]
    intended: tuple[str | None, ...]
    grades: tuple[tuple[tuple[str, ...], ...], ...]
    scale: tuple[str, ...]


def draw_grades(grid: GradeGrid, *, stamp: str) -> Drawn:
    """Draw grades as shaded cells with the grade written in each.

    Parameters
    ----------
    grid : GradeGrid
        The grades.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    Drawn
        The figure's files.
    """
    n_rows, n_columns = len(grid.models), len(grid.raters)
    size = (1.3 + 0.56 * (n_columns + 1.3), 1.15 + 0.34 * n_rows)
    with house_style():
        figure = Figure(figsize=size)
        axes = figure.add_subplot()
        for row in range(n_rows):
            aim = grid.intended[row]
            own = () if aim is None else (aim,)
            _cell(axes, INTENDED_X, row, own, grid.scale, None)
            for column, grades in enumerate(grid.grades[row]):
                _cell(axes, column, row, grades, grid.scale, aim)
        _frame(axes, grid)
        return finish(figure, stamp)


def _frame(axes: Axes, grid: GradeGrid) -> None:
    n_rows, n_columns = len(grid.models), len(grid.raters)
    axes.set_xlim(INTENDED_X - 0.55, n_columns - 0.45)
    axes.set_ylim(n_rows - 0.4, -0.6)
    axes.set_xticks([INTENDED_X, *range(n_columns)], ["intended", *grid.raters])
    axes.set_yticks(range(n_rows), grid.models)
    axes.tick_params(length=0)
    axes.xaxis.tick_top()
    if n_columns > 12:
        axes.tick_params(axis="x", rotation=90)
    for spine in axes.spines.values():
        spine.set_visible(False)
    has_aim = any(intended is not None for intended in grid.intended)
    axes.set_xlabel("framed: not the intended grade" if has_aim else "rater")


def _cell(
    axes: Axes,
    x: float,
    y: float,
    grades: tuple[str, ...],
    scale: tuple[str, ...],
    intended: str | None,
) -> None:
    # Repeated presentations share the cell, each a part of its width.
    if not grades:
        axes.text(x, y, "–", ha="center", va="center", color=GREY)
        return
    width = 0.88 / len(grades)
    for part, grade in enumerate(grades):
        left = x - 0.44 + part * width
        shade = _shades(scale.index(grade) / max(len(scale) - 1, 1))
        differs = intended is not None and grade != intended
        _box(axes, left, y, width, facecolor=shade, edgecolor="none")
        if differs:
            look = {"facecolor": "none", "edgecolor": VERMILLION, "linewidth": 2.2}
            _box(axes, left, y, width, **look)
        # relative luminance (ITU-R BT.709) decides black or white letters
        luminance = float(np.dot(shade[:3], (0.2126, 0.7152, 0.0722)))
        axes.text(
            left + width / 2,
            y,
            grade,
            ha="center",
            va="center",
            color=BLACK if luminance > 0.45 else "white",
            weight="bold" if differs else "normal",
        )


def _box(axes: Axes, left: float, y: float, width: float, **look: object) -> None:
    box = Rectangle((left, y - 0.42), width, 0.84)
    box.set(**look)
    axes.add_patch(box)

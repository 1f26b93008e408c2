"""Grids of coloured cells with letters in them, and names of their rows and columns."""

import math
from collections.abc import Sequence
from typing import Any
from unicodedata import east_asian_width

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle
from matplotlib.transforms import blended_transform_factory
from numpy.typing import NDArray

from masrel.plots._style import (
    GREY,
    ON_CELL,
    PAGE,
    VERMILLION,
    inches_from,
    short_names,
)

LINE = 0.15
"""Inches of a line of letters of 9 points."""

_MANY = 20  # cells in a row or a column from which on lines between them are thin


def cells(
    axes: Axes,
    values: NDArray[Any],
    letters: NDArray[np.str_],
    *,
    framed: NDArray[Any] | None = None,
    n_columns: int | None = None,
    left: float = -0.5,
    frame: str = VERMILLION,
    **how: Any,
) -> AxesImage:
    """Draw a grid of cells; letters beyond them are grey."""
    # values (n, m), coloured by `how`, or colours (n, m, 4), m a multiple of n_columns,
    # which have gaps between them; letters, framed (n, m)
    n, m = values.shape[:2]
    across = m if n_columns is None else n_columns
    right, step = left + across, across / m
    drawn = axes.imshow(
        values,
        extent=(left, right, n - 0.5, -0.5),
        aspect="auto",
        interpolation="nearest",
        **how,
    )
    axes.spines[:].set_visible(False)
    width = 1.2 if max(n, m) <= _MANY else 0.4
    axes.hlines(np.arange(0.5, n - 1.0), left, right, PAGE, linewidth=width)
    axes.vlines(left + np.arange(1.0, across), -0.5, n - 0.5, PAGE, linewidth=width)
    colours = drawn.to_rgba(values)
    for (row, column), text in np.ndenumerate(letters):
        x = left + (column + 0.5) * step
        is_inside = row < n and column < m  # where no layout need make room
        if text:
            axes.text(
                x, row, text, ha="center", va="center", fontsize=8,
                color=letters_on(colours[row, column]) if is_inside else GREY,
                in_layout=not is_inside,
            )  # fmt: skip
    for row, column in np.argwhere(np.zeros((n, m)) if framed is None else framed):
        corner = left + column * step, row - 0.5
        look: dict[str, Any] = {"edgecolor": frame, "linewidth": 1.2 * width}
        axes.add_patch(Rectangle(corner, step, 1.0, fill=False, zorder=3.0, **look))
    return drawn


def letters_on(colour: Sequence[float] | NDArray[np.float64]) -> str:
    """Return the colour of letters that can be read on one of red, green and blue."""
    # by relative luminance, as WCAG 2 has it: above some 0.18 dark ones stand out more
    parts = ((np.array(colour[:3]) + 0.055) / 1.055) ** 2.4
    return ON_CELL[int(parts @ (0.2126, 0.7152, 0.0722) < 0.18)]


def inches_of(text: str) -> float:
    """Return how long a text is, in letters of 9 points, some of which are wide."""
    return 0.075 * sum(1 + (east_asian_width(letter) in "WF") for letter in text)


def room_of(names: Sequence[str]) -> float:
    """Return the inches of names at the left of rows, or standing above columns."""
    return 0.3 + max(map(inches_of, short_names(names)))


def name_rows(axes: Axes, names: Sequence[str], cell: float) -> None:
    """Name rows that are so many inches high, as many as have room."""
    every = math.ceil(LINE / cell)
    axes.set_yticks(range(0, len(names), every), short_names(names)[::every])
    axes.tick_params(axis="y", length=0)


def name_columns(
    axes: Axes, names: Sequence[str], cell: float, places: Sequence[float]
) -> None:
    """Name columns that are so many inches wide, above them, upright where narrow."""
    names = short_names(names)
    is_narrow = max(map(inches_of, names)) + 0.06 > cell
    every = math.ceil(LINE / cell) if is_narrow else 1
    axes.set_xticks(places[::every], names[::every], rotation=90 * is_narrow)
    axes.tick_params(axis="x", length=0)
    axes.xaxis.tick_top()


def rows_of_shares(
    axes: Axes, names: Sequence[str], texts: Sequence[str], cell: float, label: str
) -> None:
    """Make axes of shares, a row a name, with a text at the right of each."""
    axes.set(xlim=(0.0, 1.0), ylim=(len(names) - 0.5, -0.5), xlabel=label)
    axes.spines["left"].set_visible(False)
    name_rows(axes, names, cell)
    place = blended_transform_factory(inches_from(axes, 1.0, 0.0), axes.transData)
    for row, text in enumerate(texts if cell >= LINE else ()):
        axes.text(0.08, row, text, transform=place, va="center", fontsize=8)

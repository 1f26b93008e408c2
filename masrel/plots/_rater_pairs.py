"""Agreement of every two raters as a heatmap, and what each rater adds beside it."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import blended_transform_factory
from numpy.typing import NDArray

from masrel.agreement import COEFFICIENTS
from masrel.plots._cells import cells
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    PAGE,
    Picture,
    colour_bar,
    inches_from,
    legend_below,
    short_names,
    shown,
)
from masrel.tables._tables import number, percent

if TYPE_CHECKING:
    from masrel.intervals import Diagnosis

_Floats = NDArray[np.float64]

# from little to full agreement: lighter to darker in a grey print, too
_COLOURS = LinearSegmentedColormap.from_list(
    "agreement", ["#F7FBFF", "#9ECAE1", "#4292C6", "#08519C", "#08306B"]
).with_extremes(bad="#E8E8E8", under="#F6C89F")

_CELLS = ((8, 0.42), (14, 0.33), (40, 0.2), (10_000, 0.13))  # raters, inches of a cell
_MAX_NUMBERS = 14  # raters up to which numbers are written in the cells
# inches: of the panel at the right, of what is below all, and of a letter of 9 points
_PANEL, _BELOW, _LETTER = 2.3, 1.1, 0.07
_GAP = 0.35  # inches between the heatmap and the panel

_DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "linestyle": "none"}
_LINE: dict[str, Any] = {"color": BLUE, "linewidth": 1.8}


def pairs(
    diagnosis: "Diagnosis", *, title: str | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the agreement of every two raters, and how it changes without each rater.

    Raters who agree best with the others come first. Colours go from 0 to 1 whatever
    the data, so that two pictures can be compared; what is below 0 has a colour of its
    own.

    Parameters
    ----------
    diagnosis : Diagnosis
        What `masrel.intervals.diagnose` returns.
    title : str, optional
        What the coefficient is called; its title unless given.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those of the heatmap; the panel beside it is an inset of them.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from masrel.intervals import diagnose
    >>> found = diagnose([[1, 1, 2], [2, 2, 2], [3, 3, 1]], raters=["A", "B", "C"])
    >>> ax = pairs(found, ax=Figure().add_subplot())
    >>> [label.get_text() for label in ax.get_yticklabels()]
    ['A', 'B', 'C']
    """
    name = title or COEFFICIENTS[diagnosis.estimate.coefficient].title
    return shown(pairs_picture(diagnosis, name), ax)


def pairs_picture(result: "Diagnosis", title: str) -> Picture:
    """Return a heatmap of pairs, with the change without each rater beside it."""
    n = len(result.raters)
    cell = next(inches for most, inches in _CELLS if n <= most)
    letters = 9.0 if cell > 0.25 else 7.5 if cell > 0.15 else 6.0
    order = np.argsort(-result.mean_values, kind="stable")
    others = () if result.reference is None else (result.reference,)
    names = short_names([*(result.raters[place] for place in order), *others])
    room = max(map(len, names)) * _LETTER * letters / 9.0 + 0.35
    width = cell * len(names)
    has_changes = bool(np.isfinite(result.changes).any())

    def draw(axes: Axes) -> None:
        _heatmap(axes, _pairs(result, order), names)
        axes.tick_params(length=0, labelsize=letters)
        extend = "min" if (_pairs(result, order) < 0.0).any() else "neither"
        colour_bar(axes, axes.images[0], f"{title} of pairs", extend=extend)
        if has_changes:
            right = inches_from(axes, 1.0, 0.0)
            place = blended_transform_factory(right, axes.transAxes)
            panel = axes.inset_axes((_GAP, 0.0, _PANEL, 1.0), transform=place)
            _influence(panel, result, order, cell)

    return Picture(
        room + width + has_changes * (_PANEL + _GAP), room + cell * n + _BELOW, draw
    )


def pairs_pictures(
    parts: "Sequence[tuple[str, Diagnosis]]", title: str
) -> list[tuple[str, Picture]]:
    """Return the pairs of every part, each as a picture."""
    return [(name, pairs_picture(result, title)) for name, result in parts]


def _pairs(result: "Diagnosis", order: NDArray[np.intp]) -> _Floats:
    # by rater, and then with the reference if there is one
    values = result.pair_values[np.ix_(order, order)]
    if result.reference is None:
        return values
    return np.column_stack([values, result.reference_values[order]])


def _heatmap(axes: Axes, values: _Floats, names: Sequence[str]) -> None:
    n_rows, n_columns = values.shape
    letters = [[_short(value) for value in row] for row in values.tolist()]
    shown = np.array(letters if n_rows <= _MAX_NUMBERS else [[]])
    cells(axes, values, shown, cmap=_COLOURS, vmin=0.0, vmax=1.0)
    axes.set_xticks(range(n_columns), names, rotation=90)
    axes.set_yticks(range(n_rows), names[:n_rows])
    axes.xaxis.tick_top()
    if n_columns > n_rows:
        axes.axvline(n_rows - 0.5, color=PAGE, linewidth=6.0)


def _short(value: float) -> str:
    return "" if math.isnan(value) else number(value, 2).replace("0.", ".", 1)


def _influence(
    axes: Axes, result: "Diagnosis", order: NDArray[np.intp], cell: float
) -> None:
    places = np.arange(len(order))
    ends = result.change_low[order], result.change_high[order]
    axes.hlines(places, *ends, **_LINE)
    axes.plot(result.changes[order], places, markersize=min(12.0 * cell, 4.5), **_DOT)
    axes.set_ylim(len(order) - 0.5, -0.5)
    axes.axvline(0.0, color=GREY, linewidth=0.8, linestyle=DASHES, zorder=0.5)
    axes.grid(axis="x")
    axes.set_yticks([])
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.spines["left"].set_visible(False)
    axes.margins(x=0.08)
    axes.set_xlabel("change without the rater\n(right of 0: the others agree better)")
    marks = [
        Line2D([], [], label="estimate", **_DOT),
        Line2D([], [], label=f"{percent(result.level)} % confidence interval", **_LINE),
    ]
    has_ends = bool(np.isfinite(result.change_low).any())
    legend_below(axes, marks[: 1 + has_ends])

"""Agreement of every two raters as a heatmap, and parts of the variance."""

import math
from collections.abc import Sequence
from typing import Any
from unicodedata import east_asian_width

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import blended_transform_factory
from numpy.typing import NDArray

from masrel.agreement import (
    COEFFICIENTS,
    Label,
    VarianceComponents,
    variance_components,
)
from masrel.intervals import Diagnosis
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ON_CELL,
    ORANGE,
    PAGE,
    VERMILLION,
    Picture,
    colour_bar,
    inches_from,
    legend_below,
    short_names,
    shown,
)
from masrel.tables._tables import number, percent

_PARTS = {"items": BLUE, "raters": ORANGE, "residual": "#999999"}


def components(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw what the variance of a rating is made of: items, raters and residual.

    Bars are shares of the three together, from 0 to 1 whatever the data; beside each
    is its standard deviation in the unit of the ratings. The share of items is
    ICC(A,1), unless mean squares estimate a variance as less than 0; a note says so.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> ax = components([[1, 2], [3, 3], [5, 7]], ax=Figure().add_subplot())
    >>> [round(float(bar.get_width()), 2) for bar in ax.patches]
    [0.86, 0.06, 0.09]
    """
    parts = variance_components(ratings, categories=categories)
    return shown(components_picture(parts), ax)


def components_picture(parts: VarianceComponents) -> Picture:
    """Return the variances as shares of their sum, with standard deviations."""
    total = parts.items + parts.raters + parts.residual or math.nan
    negative = " and ".join(parts.negative)
    note = f"{negative}: estimated below 0, shown as 0"
    if math.isnan(total):
        note = f"undefined: {parts.reason or 'all ratings are alike'}"
    elif not negative:
        note = "the share of items is ICC(A,1)"
    shares = {name: getattr(parts, name) / total for name in _PARTS}
    texts = [
        f"{number(share, 2)}, SD {number((share * total) ** 0.5, 2, in_units=True)}"
        for share in shares.values()
    ]
    label = f"share of the variance of a rating, by {parts.method}\n{note}"

    def draw(axes: Axes) -> None:
        axes.barh(range(3), list(shares.values()), 0.62, color=list(_PARTS.values()))
        axes.grid(axis="x")
        rows_of_shares(axes, list(shares), texts, 0.3, label)

    return Picture(5.6, 1.75, draw)


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
    """Return the length of a text in letters of 9 points; some letters are wide."""
    return 0.075 * sum(1 + (east_asian_width(letter) in "WF") for letter in text)


def room_of(names: Sequence[str]) -> float:
    """Return the inches of names at the left of rows, or upright above columns."""
    return 0.3 + max(map(inches_of, short_names(names)))


def name_rows(axes: Axes, names: Sequence[str], cell: float) -> None:
    """Name rows that are `cell` inches high, as many as have room."""
    every = math.ceil(LINE / cell)
    axes.set_yticks(range(0, len(names), every), short_names(names)[::every])
    axes.tick_params(axis="y", length=0)


def name_columns(
    axes: Axes, names: Sequence[str], cell: float, places: Sequence[float]
) -> None:
    """Name columns that are `cell` inches wide, above them, upright if narrow."""
    names = short_names(names)
    is_narrow = max(map(inches_of, names)) + 0.06 > cell
    every = math.ceil(LINE / cell) if is_narrow else 1
    axes.set_xticks(places[::every], names[::every], rotation=90 * is_narrow)
    axes.tick_params(axis="x", length=0)
    axes.xaxis.tick_top()


def rows_of_shares(
    axes: Axes, names: Sequence[str], texts: Sequence[str], cell: float, label: str
) -> None:
    """Make axes of shares, one row per name, with a text at the right of each."""
    axes.set(xlim=(0.0, 1.0), ylim=(len(names) - 0.5, -0.5), xlabel=label)
    axes.spines["left"].set_visible(False)
    name_rows(axes, names, cell)
    place = blended_transform_factory(inches_from(axes, 1.0, 0.0), axes.transData)
    for row, text in enumerate(texts if cell >= LINE else ()):
        axes.text(0.08, row, text, transform=place, va="center", fontsize=8)


Floats = NDArray[np.float64]

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
    diagnosis: Diagnosis, *, title: str | None = None, ax: Axes | None = None
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


def pairs_picture(result: Diagnosis, title: str) -> Picture:
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


def _pairs(result: Diagnosis, order: NDArray[np.intp]) -> Floats:
    # by rater, and then with the reference if there is one
    values = result.pair_values[np.ix_(order, order)]
    if result.reference is None:
        return values
    return np.column_stack([values, result.reference_values[order]])


def _heatmap(axes: Axes, values: Floats, names: Sequence[str]) -> None:
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
    axes: Axes, result: Diagnosis, order: NDArray[np.intp], cell: float
) -> None:
    places = np.arange(len(order))
    axes.hlines(places, result.change_low[order], result.change_high[order], **_LINE)
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
    legend_below(axes, marks[: 1 + bool(np.isfinite(result.change_low).any())])

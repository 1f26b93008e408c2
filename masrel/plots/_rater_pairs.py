"""Agreement of every two raters as a heatmap, and what each rater adds beside it."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation, blended_transform_factory
from numpy.typing import NDArray

from masrel.plots._style import BLACK, BLUE, DASHES, GREY, short_name
from masrel.tables._tables import number, percent

if TYPE_CHECKING:
    from masrel.intervals import Diagnosis

_Floats = NDArray[np.float64]

# from little to full agreement: lighter to darker in a grey print, too
_COLOURS = LinearSegmentedColormap.from_list(
    "agreement", ["#F7FBFF", "#9ECAE1", "#4292C6", "#08519C", "#08306B"]
).with_extremes(bad="#E8E8E8")

_CELLS = ((8, 0.42), (14, 0.33), (40, 0.2), (10_000, 0.13))  # raters, inches of a cell
_MAX_NUMBERS = 14  # raters up to which numbers are written in the cells
# inches: of the panel at the right, of what is below all, and of a letter of 9 points
_PANEL, _BELOW, _LETTER = 2.3, 1.1, 0.07

_DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "linestyle": "none"}
_LINE: dict[str, Any] = {"color": BLUE, "linewidth": 1.8}


def rater_figure(parts: "Sequence[tuple[str, Diagnosis]]", title: str) -> Figure:
    """Return a heatmap of pairs a group, with the change without each rater beside."""
    # parts: each with its name; title: the coefficient
    sizes = [len(result.raters) for _, result in parts]
    cell = next(inches for most, inches in _CELLS if max(sizes) <= most)
    letters = 9.0 if cell > 0.25 else 7.5 if cell > 0.15 else 6.0
    names = [short_name(name) for _, result in parts for name in result.raters]
    room = max(map(len, names)) * _LETTER * letters / 9.0 + 0.35
    changes = np.concatenate([result.changes for _, result in parts])
    widths = [cell * (max(sizes) + (parts[0][1].reference is not None))]
    widths += [_PANEL] if np.isfinite(changes).any() else []
    height = cell * sum(sizes) + room * len(parts) + _BELOW
    figure = Figure(figsize=(sum(widths) + room, height))
    grid = figure.subplots(
        len(parts), len(widths), squeeze=False, width_ratios=widths, height_ratios=sizes
    )
    orders = [np.argsort(-result.mean_values, kind="stable") for _, result in parts]
    values = [_pairs(part[1], order) for part, order in zip(parts, orders, strict=True)]
    lowest = math.floor(10.0 * min(np.nanmin(of, initial=0.9) for of in values)) / 10.0
    for (name, result), order, of_part, (axes, *panels) in zip(
        parts, orders, values, grid, strict=True
    ):
        raters = [short_name(result.raters[place]) for place in order]
        others = [] if result.reference is None else [short_name(result.reference)]
        image = _heatmap(axes, of_part, raters, others, lowest)
        axes.tick_params(length=0, labelsize=letters)
        axes.set_ylabel(name)
        for panel in panels:
            _influence(panel, result, order, cell)
    # as wide as the last map, and below it by inches
    below = figure.dpi_scale_trans + ScaledTranslation(0.0, 0.0, axes.transAxes)
    place = blended_transform_factory(axes.transAxes, below)
    bar = axes.inset_axes((0.0, -0.27, 1.0, 0.11), transform=place)
    figure.colorbar(image, cax=bar, orientation="horizontal", label=f"{title} of pairs")
    for panel in panels:
        panel.set_xlabel(
            "change without the rater\n(right of 0: the others agree better)"
        )
        level = percent(parts[0][1].level)
        figure.legend(
            handles=[
                Line2D([], [], label="estimate", **_DOT),
                Line2D([], [], label=f"{level} % confidence interval", **_LINE),
            ][: 1 + bool(np.isfinite(result.change_low).any())],
            loc="outside lower center",
            ncols=2,
            fontsize=8,
        )
    return figure


def _pairs(result: "Diagnosis", order: NDArray[np.intp]) -> _Floats:
    # by rater, and then with the reference if there is one
    values = result.pair_values[np.ix_(order, order)]
    if result.reference is None:
        return values
    return np.column_stack([values, result.reference_values[order]])


def _heatmap(
    axes: Axes,
    values: _Floats,
    raters: Sequence[str],
    others: Sequence[str],
    lowest: float,
) -> AxesImage:
    n_rows, n_columns = values.shape
    image = axes.imshow(
        values,
        cmap=_COLOURS,
        vmin=lowest,
        vmax=1.0,
        aspect="auto",
        interpolation="nearest",
    )
    axes.set_xticks(range(n_columns), [*raters, *others], rotation=90)
    axes.set_yticks(range(n_rows), raters)
    axes.xaxis.tick_top()
    axes.spines[:].set_visible(False)
    # white between the cells, so that each is seen by itself
    width = 1.0 if n_rows <= _MAX_NUMBERS else 0.4
    edges = np.arange(0.5, n_columns - 1.0)
    axes.hlines(edges[: n_rows - 1], -0.5, n_columns - 0.5, "w", linewidth=width)
    axes.vlines(edges, -0.5, n_rows - 0.5, "w", linewidth=width)
    if n_columns > n_rows:
        axes.axvline(n_rows - 0.5, color="w", linewidth=6.0)
    if n_rows <= _MAX_NUMBERS:
        for (row, column), value in np.ndenumerate(values):
            if not math.isnan(value):
                is_dark = value - lowest > 0.55 * (1.0 - lowest)
                axes.text(
                    column,
                    row,
                    number(float(value), 2).replace("0.", ".", 1),
                    ha="center",
                    va="center",
                    fontsize=8,
                    color="white" if is_dark else BLACK,
                )
    return image


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

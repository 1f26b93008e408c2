"""Differences of two raters against their mean, with the limits of agreement.

Items at one place are one dot, the larger the more there are. Where there are too many
places for dots the plane is in hexagons, the darker the more items are in each.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter
from numpy.typing import NDArray

from masrel.plots._style import BLACK, BLUE, DASHES, GREY, ORANGE
from masrel.tables._tables import counted, fixed_or_significant, percent

if TYPE_CHECKING:
    from masrel.agreement import LimitsOfAgreement

    # what a part is called, its two raters, and their limits
    Panel = tuple[str, tuple[Sequence[str], LimitsOfAgreement]]

_MOST_DOTS = 2000
_MOST_IN_A_ROW = 2
_ALPHA = 0.6
_SMALLEST, _LARGEST = 14.0, 160.0  # areas of dots, points²
_NAMES = ("upper limit", "mean", "lower limit")
_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": ORANGE, "linestyle": (0, (6, 2))},
    {"color": BLACK, "linestyle": "-"},
    {"color": ORANGE, "linestyle": (0, (6, 2))},
)
_SHADES = LinearSegmentedColormap.from_list("items", ["#D6E6F2", "#5BA3D0", "#003A5D"])


def limits_figure(panels: "Sequence[Panel]", unit: str) -> Figure:
    """Return the differences of every part, one panel each."""
    # unit: of the ratings, or nothing
    n, level = len(panels), panels[0][1][1].mean_interval.level
    columns = min(n, _MOST_IN_A_ROW)
    rows = -(-n // columns)
    figure = Figure(figsize=(5.2 if n == 1 else 3.9 * columns, 3.5 * rows + 0.3))
    places = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    dots = [_Dots.of(panel) for _, (_, panel) in panels]
    many = max(
        (int(of.freq.max()) for of in dots if of.are_shown and len(of.freq)), default=1
    )
    for axes, panel, of_panel in zip(places, panels, dots, strict=False):
        _draw(axes, panel, of_panel, unit, _area(dots, many))
    for axes in places[n:]:
        axes.set_visible(False)
    band = Line2D([], [], color=GREY, alpha=0.3, linewidth=6.0)
    band.set_label(f"{percent(level)} % confidence interval, exact")
    sizes = [1, many] if many > 1 else []
    figure.legend(
        handles=[*(_size_mark(size, _area(dots, many)) for size in sizes), band],
        loc="outside lower center",
        ncols=3,
        fontsize=8,
    )
    return figure


@dataclass(frozen=True, slots=True)
class _Dots:
    """Where items are, (n, 2), and how many at each place."""

    places: NDArray[np.float64]
    freq: NDArray[np.int64]

    @classmethod
    def of(cls, panel: "LimitsOfAgreement") -> "_Dots":
        points = np.column_stack([panel.averages, panel.differences])
        return cls(*np.unique(points, axis=0, return_counts=True))

    @property
    def are_shown(self) -> bool:
        return len(self.freq) <= _MOST_DOTS


def _area(dots: Sequence[_Dots], many: int) -> float:
    # of one item: points² on paper
    most = max(len(of.freq) for of in dots)
    single = _SMALLEST if most > 200 else 1.6 * _SMALLEST
    return single if many == 1 else min(single, _LARGEST / many)


def _size_mark(size: int, area: float) -> Line2D:
    return Line2D(
        [],
        [],
        linestyle="none",
        marker="o",
        markeredgewidth=0.0,
        color=BLUE,
        alpha=_ALPHA,
        markersize=(area * size) ** 0.5,
        label=counted(size, "item"),
    )


def _draw(axes: Axes, of_part: "Panel", dots: _Dots, unit: str, area: float) -> None:
    title, ((first, second), panel) = of_part
    _draw_lines(axes, panel)
    if dots.are_shown:
        axes.scatter(
            dots.places[:, 0],
            dots.places[:, 1],
            s=area * dots.freq,
            color=BLUE,
            alpha=_ALPHA,
            linewidths=0.0,
            zorder=3.0,
        )
    else:
        _draw_hexagons(axes, panel)
    of_unit = f" ({unit})" if unit else ""
    axes.set_xlabel(f"mean of {first} and {second}{of_unit}")
    axes.set_ylabel(f"{first} − {second}{of_unit}")
    if title:
        axes.set_title(title, loc="left")
    axes.margins(x=0.06, y=0.08)


def _draw_hexagons(axes: Axes, panel: "LimitsOfAgreement") -> None:
    drawn = axes.hexbin(
        panel.averages,
        panel.differences,
        gridsize=45,
        mincnt=1,
        bins="log",
        cmap=_SHADES,
        linewidths=0.1,
        zorder=1.5,
    )
    figure = axes.get_figure()
    if figure is not None:
        # above the axes: at its right are the names of the lines
        place = axes.inset_axes((0.5, 1.03, 0.5, 0.03))
        bar = figure.colorbar(drawn, cax=place, orientation="horizontal")
        place.xaxis.tick_top()
        place.xaxis.set_label_position("top")
        place.xaxis.set_major_formatter("{x:g}")
        place.xaxis.set_minor_formatter(LogFormatter())
        bar.set_label("items in a hexagon")


def _draw_lines(axes: Axes, panel: "LimitsOfAgreement") -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.7, linestyle=DASHES, zorder=1.0)
    if math.isnan(panel.mean):
        return
    lines = (
        (panel.upper, panel.upper_interval),
        (panel.mean, panel.mean_interval),
        (panel.lower, panel.lower_interval),
    )
    for (value, ends), name, look in zip(lines, _NAMES, _LOOKS, strict=True):
        axes.axhspan(
            ends.low, ends.high, color=GREY, alpha=0.16, linewidth=0.0, zorder=0.5
        )
        axes.axhline(value, linewidth=1.2, zorder=2.0, **look)
        text = fixed_or_significant(value, 2).replace("-", "−")
        axes.annotate(
            f"{name}\n{text}",
            (1.0, value),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
        )

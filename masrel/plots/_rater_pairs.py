"""Agreement of every two raters as a heatmap, and what each rater adds beside it."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.textpath import TextPath
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from masrel.plots._style import BLACK, BLUE, DASHES, GREY, short_name
from masrel.tables._tables import number, percent

if TYPE_CHECKING:
    from masrel.intervals import Diagnosis

_Floats = NDArray[np.float64]

# from little to full agreement: lighter to darker in a grey print, too
_COLOURS = LinearSegmentedColormap.from_list(
    "agreement", ["#F7FBFF", "#9ECAE1", "#4292C6", "#08519C", "#08306B"]
)
_NO_PAIR = "#E8E8E8"

_CELLS = ((8, 0.42), (14, 0.33), (40, 0.2), (10_000, 0.13))  # raters, inches of a cell
_MAX_NUMBERS = 14  # raters up to which numbers are written in the cells
# inches: of the panel at the right and what is before it, below and above both, and of
# the narrowest bar of colours
_PANEL, _BETWEEN, _BELOW, _STAMP, _MIN_BAR = 2.3, 0.35, 0.95, 0.25, 1.4
_GAP = 0.35  # of a cell, before the column of the reference

_DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "linestyle": "none"}
_ZERO: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHES}


@dataclass(frozen=True, slots=True, kw_only=True)
class RaterPairs:
    """How well every two raters of a group agree, and what each of them adds."""

    title: str  # the coefficient
    raters: tuple[str, ...]  # first on top
    # by rater and rater, and then with the reference if there is one; ``nan`` for none
    pairs: _Floats
    reference: str | None
    changes: _Floats  # by rater, of the coefficient of all without
    change_ends: _Floats  # (n_raters, 2)
    level: float  # of the intervals

    @classmethod
    def of(cls, title: str, result: "Diagnosis") -> "RaterPairs":
        """Return a diagnosis with the raters who agree best with the others first."""
        means = np.where(np.isnan(result.mean_values), -math.inf, result.mean_values)
        order = np.argsort(-means, kind="stable")
        pairs = result.pair_values[np.ix_(order, order)]
        if result.reference is not None:
            pairs = np.column_stack([pairs, result.reference_values[order]])
        ends = np.column_stack([result.change_low, result.change_high])
        return cls(
            title=title,
            raters=tuple(result.raters[place] for place in order),
            pairs=pairs,
            reference=result.reference,
            changes=result.changes[order],
            change_ends=ends[order],
            level=result.level,
        )


class _Layout:
    """Where the map of a group and the panel beside it are, in inches."""

    # so that cells stay square, and rows of both the same
    def __init__(self, group: RaterPairs) -> None:
        r = len(group.raters)
        self.cell = next(inches for most, inches in _CELLS if r <= most)
        self.letters = 9.0 if self.cell > 0.25 else 7.5 if self.cell > 0.15 else 6.0
        names = [*group.raters, *filter(None, [group.reference])]
        self.labels = [short_name(name) for name in names]
        self.room = max(_width(label, self.letters) for label in self.labels) + 0.12
        self.across = self.cell * (r if group.reference is None else r + 1.0 + _GAP)
        self.has_panel = bool(np.isfinite(group.changes).any())
        left = self.room + max(self.across, _MIN_BAR) + _BETWEEN
        self.width = left + _PANEL + 0.2 if self.has_panel else left
        above = max(self.room, 0.5 * self.has_panel) + _STAMP
        self.height = above + self.cell * r + _BELOW


def rater_figure(parts: "Sequence[tuple[str, Diagnosis]]", title: str) -> Figure:
    """Return a heatmap of pairs a group, with the change without each rater beside."""
    # parts: each with its name; title: the coefficient
    return pairs_figure(
        [
            RaterPairs.of(f"{title} ({name})" if name else title, result)
            for name, result in parts
        ]
    )


def pairs_figure(groups: Sequence[RaterPairs]) -> Figure:
    """Return the figure of groups."""
    layouts = [_Layout(group) for group in groups]
    below = sum(at.height for at in layouts)
    figure = Figure(figsize=(max(at.width for at in layouts), below))
    for group, at in zip(groups, layouts, strict=True):
        below -= at.height
        _group(figure, group, at, below)
    return figure


def _group(figure: Figure, group: RaterPairs, at: _Layout, below: float) -> None:
    # below: inches of the figure below the group
    width, height = figure.get_size_inches()
    high = at.cell * len(group.raters)

    def axes(left: float, bottom: float, wide: float, high: float) -> Axes:
        return figure.add_axes(
            (left / width, (below + bottom) / height, wide / width, high / height)
        )

    image = _heatmap(
        axes(at.room, _BELOW, at.across, high), group, at.labels, at.letters
    )
    bar = figure.colorbar(
        image,
        cax=axes(at.room, _BELOW - 0.27, max(at.across, _MIN_BAR), 0.12),
        orientation="horizontal",
    )
    bar.set_label(f"{group.title} of two raters")
    bar.outline.set_visible(False)
    if at.has_panel:
        left = at.room + max(at.across, 1.5) + _BETWEEN
        _influence(axes(left, _BELOW, _PANEL, high), group, at.cell)


def _width(text: str, size: float) -> float:
    # of a text in inches
    return float(TextPath((0.0, 0.0), text, size=size).get_extents().width) / 72.0


def _heatmap(
    axes: Axes, content: RaterPairs, labels: list[str], size: float
) -> AxesImage:
    r = len(content.raters)
    values = content.pairs
    every = values[~np.isnan(values)]
    lowest = math.floor(10.0 * min(every.min(initial=1.0), 0.9)) / 10.0
    look: dict[str, Any] = {
        "cmap": _COLOURS.with_extremes(bad=_NO_PAIR),
        "vmin": lowest,
        "vmax": 1.0,
        "aspect": "auto",
        "interpolation": "nearest",
    }
    image = axes.imshow(np.ma.masked_invalid(values[:, :r]), **look)
    places = list(map(float, range(r)))
    right = r - 0.5
    if content.reference is not None:
        start = r - 0.5 + _GAP
        axes.imshow(
            np.ma.masked_invalid(values[:, r:]),
            extent=(start, start + 1.0, r - 0.5, -0.5),
            **look,
        )
        places.append(start + 0.5)
        right = start + 1.0
    axes.set_xlim(-0.5, right)
    axes.set_ylim(r - 0.5, -0.5)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xticks(places, labels, rotation=90, fontsize=size)
    axes.set_yticks(range(r), labels[:r], fontsize=size)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    _lines(axes, r)
    if r <= _MAX_NUMBERS:
        _numbers(axes, values, places, lowest)
    return image


def _lines(axes: Axes, r: int) -> None:
    # white between the cells, so that each is seen by itself
    between = np.arange(0.5, r - 1.0)
    look: dict[str, Any] = {"color": "white", "linewidth": 1.0 if r <= 14 else 0.4}
    axes.hlines(between, *axes.get_xlim(), **look)
    axes.vlines(between, -0.5, r - 0.5, **look)


def _numbers(axes: Axes, values: _Floats, places: list[float], lowest: float) -> None:
    for row, of_row in enumerate(values):
        for place, value in zip(places, of_row.tolist(), strict=True):
            if math.isnan(value):
                continue
            is_dark = (value - lowest) / (1.0 - lowest) > 0.55
            axes.text(
                place,
                row,
                number(value, 2).replace("0.", ".", 1),
                ha="center",
                va="center",
                fontsize=8,
                color="white" if is_dark else BLACK,
            )


def _influence(axes: Axes, content: RaterPairs, cell: float) -> None:
    size = 4.5 if cell > 0.25 else 3.5
    for row, change in enumerate(content.changes):
        low, high = content.change_ends[row]
        if math.isfinite(low):
            axes.plot(
                [low, high],
                [row, row],
                color=BLUE,
                linewidth=1.8 if cell > 0.15 else 1.0,
            )
        if math.isfinite(change):
            axes.plot([change], [row], markersize=size, **_DOT)
    axes.set_ylim(len(content.changes) - 0.5, -0.5)
    axes.axvline(0.0, **_ZERO, zorder=0.5)
    axes.grid(axis="x")
    axes.set_yticks([])
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.spines["left"].set_visible(False)
    axes.margins(x=0.08)
    axes.set_xlabel(
        textwrap.fill(f"change of {content.title} without the rater", 38)
        + "\n(right of 0: the others agree better)"
    )
    if any(math.isfinite(low) for low, _ in content.change_ends):
        axes.legend(
            handles=[
                Line2D([], [], markersize=size, label="estimate", **_DOT),
                Line2D(
                    [],
                    [],
                    color=BLUE,
                    linewidth=1.8,
                    label=f"{percent(content.level)} % confidence interval",
                ),
            ],
            loc="lower center",
            bbox_to_anchor=(0.5, 1.0),
            fontsize=8,
        )

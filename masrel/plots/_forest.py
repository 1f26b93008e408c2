"""Estimates with their intervals and distributions, one below the other.

A distribution is a small ridge above its interval. A density is a filled curve.
Resamples are shares: a value that many of them have is a stem at its place, and all
others are put together in bars, of one width in a row, so that a point mass is never
smeared and a stem and a bar of one height are one share.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerLine2D
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from masrel.estimates import Distribution
from masrel.plots._drawn_values import Forest, ForestRow
from masrel.plots._style import BLACK, BLUE, DASHES, GREY, ORANGE
from masrel.tables._tables import percent

# Heights in inches: of a line of text, of a line below it, of a ridge and a heading.
_LINE, _DETAIL, _RIDGE, _GROUP = 0.25, 0.14, 0.34, 0.28

_LEFT, _RIGHT = -1.0, 1.03  # the axis goes no further: what does is an arrow at its end

_INTERVALS: dict[str, dict[str, Any]] = {
    "confidence": {
        "color": BLUE,
        "linewidth": 1.8,
        "marker": "|",
        "markersize": 8,
        "markeredgewidth": 1.8,
    },
    "credible": {"color": ORANGE, "linewidth": 5.0, "solid_capstyle": "butt"},
}
_DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "markersize": 5}
_ZERO: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHES}

_Floats = NDArray[np.float64]

# What a ridge is made of, its colour and its name in the legend.
_Part = Literal["density", "stems", "bars"]
_PART_COLOURS: dict[_Part, str] = {"density": ORANGE, "stems": BLUE, "bars": BLUE}
_PART_NAMES: dict[_Part, str] = {
    "density": "posterior density, each to its own height",
    "stems": "resamples of one value, each row to its own height",
    "bars": "resamples together in bars, each row to its own height",
}
_RIDGE_ALPHA = 0.35
_STEM_MARK: dict[str, Any] = {  # in the legend
    "linestyle": "none",
    "marker": "|",
    "markersize": 9,
    "markeredgewidth": 1.4,
}

_WIDTHS = (0.02, 0.01, 0.005, 0.002, 0.001)
_MIN_BARS = 12  # in the middle of the resamples
_MIDDLE = (0.005, 0.995)
_MAX_STEMS = 60  # up to as many values are all shown as stems
_STEM_SHARE = 0.05  # of the resamples, from which on one value is a stem
_FAINT = 0.01  # of the greatest height: what is below it needs no room
_SAME = 1e-9  # values as near as this are one value, computed in another order


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ridge:
    # places (of bars their edges) and heights of each part, all heights in one unit
    parts: dict[_Part, tuple[_Floats, _Floats]]
    lowest: float  # where it begins to be seen


@dataclass(frozen=True, slots=True, kw_only=True)
class _Placed:
    # a row, and how many inches from the top its parts are
    row: ForestRow
    ridge: _Ridge | None  # above its interval
    top: float
    line: float  # where its interval is
    bottom: float
    heading: float | None  # of its group, if it is the first of it


def forest_figure(forest: Forest) -> Figure:
    """Return a forest of estimates."""
    places = _placed(forest.rows)
    bottom = places[-1].bottom + 0.05
    handles = _legend_handles(places)
    figure = Figure(figsize=(7.2, bottom + 0.6 + 0.17 * len(handles)))
    axes = figure.add_subplot()
    values = [row.value for row in forest.rows if row.value is not None]
    ends = [row.interval.low for row in forest.rows if row.interval is not None]
    ridges = [place.ridge.lowest for place in places if place.ridge is not None]
    left = max(min([0.0, *values, *ends, *ridges]), _LEFT) - 0.05
    axes.set_xlim(left, _RIGHT)
    axes.set_ylim(bottom, 0.0)
    # where rows next to each other have a zero: one line for all of them
    for has_zero, group in groupby(places, key=attrgetter("row.has_zero")):
        if has_zero:
            run = list(group)
            axes.plot([0.0, 0.0], [run[0].top, run[-1].bottom], **_ZERO, zorder=1.0)
    for place in places:
        if place.heading is not None:
            _at_left(axes, place.heading, place.row.group, weight="bold")
        _draw_row(axes, place, left)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x")
    axes.set_xlabel(forest.axis_label)
    # each kind of interval with two marks, and a dot with one
    dots = [h for h in handles if isinstance(h, Line2D) and h.get_linestyle() == "None"]
    figure.legend(
        handles=handles,
        loc="outside lower center",
        fontsize=8,
        borderaxespad=0.2,
        numpoints=2,
        handler_map={dot: HandlerLine2D(numpoints=1) for dot in dots},
    )
    return figure


def _placed(rows: Sequence[ForestRow]) -> list[_Placed]:
    # every row with its place, from the top down
    places: list[_Placed] = []
    bottom, group = 0.0, ""
    for row in rows:
        top, heading = bottom, None
        if row.group and row.group != group:
            heading = bottom + 0.6 * _GROUP
            bottom += _GROUP
        group = row.group
        text = _LINE + (_DETAIL if row.detail else 0.0)
        shown = None if row.interval is None else row.interval.distribution
        bottom += text + (0.0 if shown is None else _RIDGE)
        places.append(
            _Placed(
                row=row,
                ridge=None if shown is None else _ridge(shown),
                top=top,
                line=bottom - 0.5 * text,
                bottom=bottom,
                heading=heading,
            )
        )
    return places


def _draw_row(axes: Axes, place: _Placed, left: float) -> None:
    row, y, interval = place.row, place.line, place.row.interval
    if place.ridge is not None:
        base, top = y - 0.3 * _LINE, y - 0.3 * _LINE - 0.95 * _RIDGE
        _draw_ridge(axes, place.ridge, base=base, top=top)
    if interval is not None:
        look = _INTERVALS[interval.kind]
        axes.plot([max(interval.low, left), interval.high], [y, y], **look)
        if interval.low < left:
            arrow = {"marker": "<", "markersize": 7, "color": look["color"]}
            axes.plot([left], [y], clip_on=False, **arrow)
    if row.value is not None:
        inside = min(max(row.value, left), _RIGHT)
        marker = "o" if inside == row.value else "<" if row.value < left else ">"
        axes.plot([inside], [y], clip_on=False, **{**_DOT, "marker": marker})
    _at_left(axes, y, row.label, lifted=5.0 if row.detail else 0.0)
    if row.detail:
        _at_left(axes, y, row.detail, lifted=-5.5, color=GREY, fontsize=7.5)
    axes.annotate(
        row.text,
        (1.0, y),
        xycoords=("axes fraction", "data"),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        color=GREY if row.value is None else BLACK,
        style="italic" if row.value is None else "normal",
    )


def _at_left(
    axes: Axes, y: float, text: str, *, lifted: float = 0.0, **look: Any
) -> None:
    axes.annotate(
        text,
        (0.0, y),
        xycoords=("axes fraction", "data"),
        xytext=(-8, lifted),
        textcoords="offset points",
        ha="right",
        va="center",
        **look,
    )


def _legend_handles(places: Sequence[_Placed]) -> list[Artist]:
    # what the legend explains, each mark once
    handles: dict[str, Artist] = {}
    if any(place.row.value is not None for place in places):
        handles["estimate"] = Line2D([], [], linestyle="none", **_DOT)
    for place in places:
        if place.row.interval is not None:
            interval = place.row.interval
            label = f"{percent(interval.level)} % {interval.kind} interval"
            handles[label] = Line2D([], [], **_INTERVALS[interval.kind])
        for part in () if place.ridge is None else place.ridge.parts:
            colour = _PART_COLOURS[part]
            handles[_PART_NAMES[part]] = (
                Line2D([], [], color=colour, **_STEM_MARK)
                if part == "stems"
                else Patch(
                    facecolor=(colour, _RIDGE_ALPHA), edgecolor=colour, linewidth=0.8
                )
            )
    for label, handle in handles.items():
        handle.set_label(label)
    return list(handles.values())


def _draw_ridge(axes: Axes, ridge: _Ridge, *, base: float, top: float) -> None:
    """Draw a ridge between two heights; its own greatest height is the top."""
    highest = max(heights.max() for _, heights in ridge.parts.values())
    # stems come last: they stand in front of bars
    for part, (places, heights) in reversed(ridge.parts.items()):
        colour, tops = _PART_COLOURS[part], base + (top - base) * heights / highest
        line: dict[str, Any] = {"color": colour, "linewidth": 0.8}
        face: dict[str, Any] = {"color": colour, "alpha": _RIDGE_ALPHA}
        if part == "density":
            axes.fill_between(places, base, tops, linewidth=0.0, **face)
            axes.plot(places, tops, **line)
        elif part == "stems":
            axes.vlines(places, base, tops, color=colour, linewidth=1.4)
        else:
            axes.stairs(tops, places, baseline=base, fill=True, **face)
            axes.stairs(tops, places, baseline=base, **line)


def _ridge(distribution: Distribution) -> _Ridge:
    """Return what is drawn of a distribution."""
    parts: dict[_Part, tuple[_Floats, _Floats]] = {}
    if distribution.continuous:
        places, heights = distribution.values, distribution.weights
        parts["density"] = places, heights
    else:
        # every value once, with its share of the finite ones: both (n_distinct,)
        finite = np.isfinite(distribution.values)
        values, weights = distribution.values[finite], distribution.weights[finite]
        starts = np.flatnonzero(np.diff(values, prepend=-np.inf) > _SAME)
        values, shares = values[starts], np.add.reduceat(weights, starts)
        single = (shares.size <= _MAX_STEMS) | (shares >= _STEM_SHARE)
        if single.any():
            parts["stems"] = values[single], shares[single]
        if not single.all():
            parts["bars"] = _bars(values[~single], shares[~single])
        edges, heights = _bars(values, shares)  # as if there were no stems
        places = edges[:-1]
    visible = places[heights > _FAINT * heights.max()]
    return _Ridge(parts=parts, lowest=float(visible.min()))


def _bars(values: _Floats, shares: _Floats) -> tuple[_Floats, _Floats]:
    # (n_bars + 1,), (n_bars,); a value on an edge belongs to the bar below, as 1 does
    cumulative = shares.cumsum() / shares.sum()
    low, high = values[np.searchsorted(cumulative, _MIDDLE).clip(0, values.size - 1)]
    # the widest that shows the shape of what is narrow, too
    enough = (width for width in _WIDTHS if _MIN_BARS * width <= high - low)
    width = next(enough, _WIDTHS[-1])
    at = np.ceil(values / width - _SAME).astype(np.int64)
    first = at[0]
    heights = np.bincount(at - first, weights=shares).astype(np.float64)
    edges = width * np.arange(first - 1, first + heights.size)
    return edges, heights

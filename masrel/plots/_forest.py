"""Estimates with their intervals and distributions, one below the other.

A distribution is a small ridge above its interval. A density is a filled curve.
Resamples are shares: a value that many of them have is a stem at its place, and all
others are put together in bars, of one width in a row, so that a point mass is never
smeared and a stem and a bar of one height are one share.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from operator import itemgetter
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.legend_handler import HandlerLine2D
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from masrel._input import refuse
from masrel.agreement import COEFFICIENTS
from masrel.agreement._engine import Floats
from masrel.estimates import Estimate, Interval
from masrel.plots._drawn_values import ForestRow
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    VERMILLION,
    Picture,
    legend_below,
    shown,
)
from masrel.tables._estimate_words import forest_row
from masrel.tables._tables import percent

# Inches: the width, whose letters can be read on a telephone; heights of a row, of each
# further line of its label and each of its detail, of a ridge and a heading
_WIDTH, _LINE, _MORE, _RIDGE, _GROUP = 5.4, 0.25, 0.14, 0.34, 0.28

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
_ZERO: dict[str, Any] = {
    "color": GREY,
    "linewidth": 0.8,
    "linestyle": DASHES,
    "zorder": 0.9,  # behind every ridge
}

_MARK: dict[str, Any] = {"color": VERMILLION, "linewidth": 1.2, "zorder": 0.9}


# What a ridge is made of: places (of bars their edges) and heights of each part, all
# heights in one unit.
_Part = Literal["density", "stems", "bars"]
_Ridge = dict[_Part, tuple[Floats, Floats]]
_PARTS: dict[_Part, tuple[str, str]] = {  # colour, and name in the legend
    "density": (ORANGE, "posterior density, scaled in each row"),
    "stems": (BLUE, "resamples by value, scaled in each row"),
    "bars": (BLUE, "resamples in bars, scaled in each row"),
}
_ALPHA = 0.35
_STEM: dict[str, Any] = {  # in the legend
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


def forest(
    estimates: Estimate | Sequence[Estimate],
    labels: Sequence[str] | None = None,
    *,
    groups: Sequence[str] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw estimates with their intervals, one below the other.

    Parameters
    ----------
    estimates : Estimate or sequence of Estimate
        What is drawn, first on top; an undefined one is marked as such.
    labels : sequence of str, optional
        What each is called; the title of its coefficient unless given.
    groups : sequence of str, optional
        The heading that each stands under; equal ones follow each other.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Raises
    ------
    ParameterError
        If labels or groups are not as many as estimates.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa
    >>> from matplotlib.figure import Figure
    >>> ax = forest(fleiss_kappa([[1, 1], [2, 1], [2, 2]]), ax=Figure().add_subplot())
    >>> ax.get_xlabel()
    'agreement (1 is perfect)'
    """
    several = [estimates] if isinstance(estimates, Estimate) else list(estimates)
    titles = [COEFFICIENTS[of.coefficient].title for of in several]
    names, heads = list(labels or titles), list(groups or [""] * len(several))
    needed = f"needs one for each of {len(several)} estimates, got"
    refuse(
        (len(names) != len(several), f"labels: {needed} {len(names)}"),
        (len(heads) != len(several), f"groups: {needed} {len(heads)}"),
    )
    rows = [
        forest_row(name, of, group=head)
        for name, of, head in zip(names, several, heads, strict=True)
    ]
    return shown(forest_picture(rows, "agreement (1 is perfect)"), ax)


def forest_picture(
    rows: Sequence[ForestRow],
    axis_label: str,
    right: float = _RIGHT,
    mark: tuple[float, str] | None = None,
) -> Picture:
    """Return estimates with their intervals as a picture."""
    # right: where the axis ends; mark: a value that has a line, and its name
    how: dict[str, Any] = {"break_on_hyphens": False}
    rows = [
        replace(
            row,
            label=textwrap.fill(row.label, 26, **how),
            detail=textwrap.fill(row.detail, 28, **how),
        )
        for row in rows
    ]
    ridges = [_ridge(row.interval) for row in rows]
    handles = _legend_handles(rows, ridges)
    if mark is not None:
        handles.append(Line2D([], [], label=mark[1], **_MARK))

    def draw(axes: Axes) -> None:
        values = [row.value for row in rows if row.value is not None]
        ends = [row.interval.low for row in rows if row.interval is not None]
        lowest = [  # where each ridge begins to be seen
            float(
                places[: heights.size][heights > _FAINT * _highest(ridge)].min(
                    initial=1.0
                )
            )
            for ridge in ridges
            for places, heights in ridge.values()
        ]
        axes.set_xlim(max(min([0.0, *values, *ends, *lowest]), _LEFT) - 0.05, right)
        axes.set_ylim(_draw_rows(axes, rows, ridges) + 0.05, 0.0)
        if mark is not None:
            axes.axvline(mark[0], **_MARK)
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
        axes.grid(axis="x")
        axes.set_xlabel(axis_label)
        # each kind of interval with two marks, and a dot with one
        lines = [handle for handle in handles if isinstance(handle, Line2D)]
        dots = {
            of: HandlerLine2D(numpoints=1)
            for of in lines
            if of.get_linestyle() == "None"
        }
        legend_below(axes, handles, numpoints=2, handler_map=dots)

    height = sum(_heights(rows, ridges)) + 0.65 + 0.17 * len(handles)
    return Picture(_WIDTH, height, draw)


def _beside(row: ForestRow) -> tuple[float, float]:
    # inches of a label, and of its detail
    return _LINE + _MORE * row.label.count("\n"), _MORE * len(row.detail.splitlines())


def _heights(rows: Sequence[ForestRow], ridges: Sequence[_Ridge]) -> list[float]:
    # inches of every row, with the heading above the first of a group
    groups = ["", *(row.group for row in rows)]
    return [
        sum(_beside(row))
        + (_RIDGE if ridge else 0.0)
        + (_GROUP if row.group and row.group != before else 0.0)
        for row, ridge, before in zip(rows, ridges, groups, strict=False)
    ]


def _draw_rows(
    axes: Axes, rows: Sequence[ForestRow], ridges: Sequence[_Ridge]
) -> float:
    # from the top down, in inches; how far they reach
    bottom, group, spans = 0.0, "", []
    for row, ridge, height in zip(rows, ridges, _heights(rows, ridges), strict=True):
        top, bottom = bottom, bottom + height
        if row.group and row.group != group:
            _at_left(axes, top + 0.6 * _GROUP, row.group, weight="bold")
        group = row.group
        _draw_row(axes, row, ridge, bottom - sum(_beside(row)) / 2.0)
        spans.append((row.has_zero, top, bottom))
    # where rows next to each other have a zero: one line for all of them
    for has_zero, of_both in groupby(spans, key=itemgetter(0)):
        if has_zero:
            _, tops, bottoms = zip(*of_both, strict=True)
            axes.plot([0.0, 0.0], [tops[0], bottoms[-1]], **_ZERO)
    return bottom


def _draw_row(axes: Axes, row: ForestRow, ridge: _Ridge, y: float) -> None:
    (left, right), interval = axes.get_xlim(), row.interval
    above, below = _beside(row)
    if ridge:
        base, top = y - 0.3 * _LINE, y - 0.3 * _LINE - 0.95 * _RIDGE
        _draw_ridge(axes, ridge, base=base, top=top)
    if interval is not None:
        look = _INTERVALS[interval.kind]
        axes.plot([max(interval.low, left), interval.high], [y, y], **look)
        if interval.low < left:
            arrow = {"marker": "<", "markersize": 7, "color": look["color"]}
            axes.plot([left], [y], clip_on=False, **arrow)
    if row.value is not None:
        inside = min(max(row.value, left), right)
        marker = "o" if inside == row.value else "<" if row.value < left else ">"
        axes.plot([inside], [y], clip_on=False, **{**_DOT, "marker": marker})
    _at_left(axes, y, row.label, lifted=36.0 * below)
    if row.detail:
        lifted = 3.5 - 36.0 * above
        _at_left(axes, y, row.detail, lifted=lifted, color=GREY, fontsize=7.5)
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


def _legend_handles(
    rows: Sequence[ForestRow], ridges: Sequence[_Ridge]
) -> list[Artist]:
    # what the legend explains, each mark once
    handles: dict[str, Artist] = {}
    if any(row.value is not None for row in rows):
        handles["estimate"] = Line2D([], [], linestyle="none", **_DOT)
    for row, ridge in zip(rows, ridges, strict=True):
        if row.interval is not None:
            label = f"{percent(row.interval.level)} % {row.interval.kind} interval"
            handles[label] = Line2D([], [], **_INTERVALS[row.interval.kind])
        for part in ridge:
            colour, label = _PARTS[part]
            handles[label] = (
                Line2D([], [], color=colour, **_STEM)
                if part == "stems"
                else Patch(facecolor=(colour, _ALPHA), edgecolor=colour, linewidth=0.8)
            )
    for label, handle in handles.items():
        handle.set_label(label)
    return list(handles.values())


def _draw_ridge(axes: Axes, ridge: _Ridge, *, base: float, top: float) -> None:
    # between two heights; its own greatest height is the top
    highest = _highest(ridge)
    # stems come last: they stand in front of bars
    for part, (places, heights) in reversed(ridge.items()):
        colour, tops = _PARTS[part][0], base + (top - base) * heights / highest
        line: dict[str, Any] = {"color": colour, "linewidth": 0.8}
        face: dict[str, Any] = {"color": colour, "alpha": _ALPHA}
        if part == "density":
            axes.fill_between(places, base, tops, linewidth=0.0, **face)
            axes.plot(places, tops, **line)
        elif part == "stems":
            axes.vlines(places, base, tops, color=colour, linewidth=1.4)
        else:
            axes.stairs(tops, places, baseline=base, fill=True, **face)
            axes.stairs(tops, places, baseline=base, **line)


def _highest(ridge: _Ridge) -> float:
    return max(float(heights.max()) for _, heights in ridge.values())


def _ridge(interval: Interval | None) -> _Ridge:
    # what is drawn of its distribution; nothing where it has none
    if interval is None or interval.distribution is None:
        return {}
    shown = interval.distribution
    if shown.continuous:
        return {"density": (shown.values, shown.weights)}
    # every value once, with its share of the finite ones: both (n_distinct,)
    finite = np.isfinite(shown.values)
    values, weights = shown.values[finite], shown.weights[finite]
    starts = np.flatnonzero(np.diff(values, prepend=-np.inf) > _SAME)
    values, shares = values[starts], np.add.reduceat(weights, starts)
    single = (shares.size <= _MAX_STEMS) | (shares >= _STEM_SHARE)
    ridge: _Ridge = {}
    if single.any():
        ridge["stems"] = values[single], shares[single]
    if not single.all():
        ridge["bars"] = _bars(values[~single], shares[~single])
    return ridge


def _bars(values: Floats, shares: Floats) -> tuple[Floats, Floats]:
    # (n_bars + 1,), (n_bars,); a value on an edge belongs to the bar below, as 1 does
    cumulative = shares.cumsum() / shares.sum()
    low, high = values[np.searchsorted(cumulative, _MIDDLE).clip(0, values.size - 1)]
    # the widest that shows the shape of what is narrow, too
    enough = (width for width in _WIDTHS if _MIN_BARS * width <= high - low)
    width = next(enough, _WIDTHS[-1])
    at = np.ceil(values / width - _SAME).astype(np.int64)
    first = at[0]
    heights = np.bincount(at - first, weights=shares).astype(np.float64)
    return width * np.arange(first - 1, first + heights.size), heights

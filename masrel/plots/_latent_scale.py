"""Items, thresholds and raters of a latent-trait model on one scale."""

import itertools
import math
from collections.abc import Sequence
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from masrel.plots._drawn_values import LatentScale, ScaleRow
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
)
from masrel.tables._tables import percent

_ROW = 0.22  # inches a row
_EDGE = 0.7  # rows of room above the first and below the last
_LETTER_WIDTH = 0.055  # share of the axis that a grade's name needs for a letter

_DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "markersize": 4.5}
_INTERVAL: dict[str, Any] = {"linewidth": 3.5, "solid_capstyle": "butt"}
_THRESHOLD: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHES}


def latent_figure(scale: LatentScale) -> Figure:
    """Return severities, thresholds and biases on one scale."""
    sizes = [
        len(rows) + _EDGE for rows in (scale.items, scale.thresholds, scale.raters)
    ]
    figure = Figure(figsize=(7.2, _ROW * sum(sizes) + 1.5))
    panels = figure.subplots(3, 1, sharex=True, height_ratios=sizes)
    left, right = _reach(scale)
    panels[0].set_xlim(left, right)
    _panel(panels[0], scale.items, ORANGE, "severity")
    _panel(panels[1], scale.thresholds, GREY, "thresholds")
    _panel(panels[2], scale.raters, BLUE, "bias of raters")
    for axes in panels[:2]:
        for threshold in scale.thresholds:
            axes.axvline(threshold.value, **_THRESHOLD, zorder=0.5)
    panels[2].axvline(0.0, **_THRESHOLD, zorder=0.5)
    figure.align_ylabels(panels)
    _name_grades(panels[0], scale, left, right)
    panels[2].set_xlabel(
        "latent scale, in standard deviations of a rating (0: mean of these items, "
        "or no bias)"
    )
    figure.legend(
        handles=_legend(scale.level),
        loc="outside lower center",
        ncols=3,
        fontsize=8,
        borderaxespad=0.2,
    )
    return figure


def _reach(scale: LatentScale) -> tuple[float, float]:
    # from end to end of what the ratings bear on: ends of unused grades are cut
    known = [*scale.items, *scale.raters]
    low = min(row.low - (row.noise or 0.0) for row in known)
    high = max(row.high + (row.noise or 0.0) for row in known)
    low = min(low, *(row.value for row in scale.thresholds))
    high = max(high, *(row.value for row in scale.thresholds))
    room = 0.06 * (high - low)
    return low - room, high + room


def _panel(axes: Axes, rows: Sequence[ScaleRow], colour: str, title: str) -> None:
    left, right = axes.get_xlim()
    for at, row in enumerate(rows):
        if row.noise is not None:
            ends = (row.value - row.noise, row.value + row.noise)
            axes.fill_betweenx([at - 0.34, at + 0.34], *ends, color=BLUE, alpha=0.18)
        axes.plot([row.low, row.high], [at, at], color=colour, **_INTERVAL)
        if row.low < left:
            axes.plot([left], [at], marker="<", color=colour, clip_on=False)
        if row.high > right:
            axes.plot([right], [at], marker=">", color=colour, clip_on=False)
        axes.plot([row.value], [at], **_DOT)
    axes.set_ylim(len(rows) - 0.5 + 0.5 * _EDGE, -0.5 - 0.5 * _EDGE)
    axes.set_yticks(range(len(rows)), [row.label for row in rows], fontsize=8)
    axes.tick_params(axis="y", length=0, pad=7)
    axes.set_ylabel(title)
    axes.grid(axis="x")


def _name_grades(axes: Axes, scale: LatentScale, left: float, right: float) -> None:
    # above the first panel, each grade between its thresholds; where there is no room
    # none
    ends = [left, *(row.value for row in scale.thresholds), right]
    for grade, (low, high) in zip(scale.grades, itertools.pairwise(ends), strict=True):
        share = (high - low) / (right - left)
        if share > 0.4 * _LETTER_WIDTH * math.sqrt(len(grade)):
            axes.annotate(
                grade,
                (0.5 * (low + high), 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 3),
                textcoords="offset points",
                ha="center",
                va="bottom",
                weight="bold",
            )


def _legend(level: float) -> list[Artist]:
    label = f"{percent(level)} % credible interval"
    return [
        Line2D([], [], linestyle="none", label="posterior median", **_DOT),
        Line2D([], [], color=BLACK, label=label, **_INTERVAL),
        Line2D([], [], label="threshold between grades", **_THRESHOLD),
        Patch(facecolor=BLUE, alpha=0.18, label="± the rater's noise"),
    ]

"""Items, thresholds and raters of a latent-trait model on one scale."""

import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from masrel.plots._style import BLACK, BLUE, DASHES, GREY, ORANGE
from masrel.tables._tables import percent

if TYPE_CHECKING:
    from masrel.intervals import LatentTrait, Quantity

_ROW = 0.22  # inches a row
_EDGE = 0.7  # rows of room above the first and below the last
_LETTER_WIDTH = 0.055  # share of the axis that a grade's name needs for a letter

_DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "markersize": 4.5}
_INTERVAL: dict[str, Any] = {"linewidth": 3.5, "solid_capstyle": "butt"}
_THRESHOLD: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHES}


def latent_figure(scale: "LatentTrait", grades: Sequence[str]) -> Figure:
    """Return severities, thresholds and biases on one scale, with noises of raters."""
    # grades: those of the scale
    sizes = [
        len(rows) + _EDGE for rows in (scale.items, scale.thresholds, scale.raters)
    ]
    noises = [noise.value for noise in scale.noises]
    figure = Figure(figsize=(7.2, _ROW * sum(sizes) + 1.5))
    panels = figure.subplots(3, 1, sharex=True, height_ratios=sizes)
    left, right = _reach(scale, noises)
    panels[0].set_xlim(left, right)
    _panel(panels[0], scale.items, ORANGE, "severity")
    _panel(panels[1], scale.thresholds, GREY, "thresholds")
    _panel(panels[2], scale.raters, BLUE, "bias of raters", noises)
    for axes in panels[:2]:
        for threshold in scale.thresholds:
            axes.axvline(threshold.value, **_THRESHOLD, zorder=0.5)
    panels[2].axvline(0.0, **_THRESHOLD, zorder=0.5)
    figure.align_ylabels(panels)
    ends = [left, *(threshold.value for threshold in scale.thresholds), right]
    _name_grades(panels[0], grades, ends)
    panels[2].set_xlabel(
        "latent scale, in standard deviations of a rating (0: mean of these items, "
        "or no bias)"
    )
    level = percent(scale.items[0].interval.level)
    credible = f"{level} % credible interval"
    figure.legend(
        handles=[
            Line2D([], [], linestyle="none", label="posterior median", **_DOT),
            Line2D([], [], color=BLACK, label=credible, **_INTERVAL),
            Line2D([], [], label="threshold between grades", **_THRESHOLD),
            Patch(facecolor=BLUE, alpha=0.18, label="± the rater's noise"),
        ],
        loc="outside lower center",
        ncols=3,
        fontsize=8,
        borderaxespad=0.2,
    )
    return figure


def _reach(scale: "LatentTrait", noises: Sequence[float]) -> tuple[float, float]:
    # from end to end of what the ratings bear on: ends of unused grades are cut
    known = [(row.interval, 0.0) for row in scale.items]
    known += [(row.interval, n) for row, n in zip(scale.raters, noises, strict=True)]
    places = [row.value for row in scale.thresholds]
    low = min(*(ends.low - noise for ends, noise in known), *places)
    high = max(*(ends.high + noise for ends, noise in known), *places)
    room = 0.06 * (high - low)
    return low - room, high + room


def _panel(
    axes: Axes,
    rows: "Sequence[Quantity]",
    colour: str,
    title: str,
    noises: Sequence[float] = (),
) -> None:
    # noises: of raters, how far the same item is perceived from one time to the next
    left, right = axes.get_xlim()
    for at, row in enumerate(rows):
        if noises:
            ends = (row.value - noises[at], row.value + noises[at])
            axes.fill_betweenx([at - 0.34, at + 0.34], *ends, color=BLUE, alpha=0.18)
        low, high = row.interval.low, row.interval.high
        axes.plot([low, high], [at, at], color=colour, **_INTERVAL)
        if low < left:
            axes.plot([left], [at], marker="<", color=colour, clip_on=False)
        if high > right:
            axes.plot([right], [at], marker=">", color=colour, clip_on=False)
        axes.plot([row.value], [at], **_DOT)
    axes.set_ylim(len(rows) - 0.5 + 0.5 * _EDGE, -0.5 - 0.5 * _EDGE)
    axes.set_yticks(range(len(rows)), [row.name for row in rows], fontsize=8)
    axes.tick_params(axis="y", length=0, pad=7)
    axes.set_ylabel(title)
    axes.grid(axis="x")


def _name_grades(axes: Axes, grades: Sequence[str], ends: Sequence[float]) -> None:
    # above the first panel, each grade between its thresholds; where there is no room
    # none
    left, right = axes.get_xlim()
    for grade, (low, high) in zip(grades, itertools.pairwise(ends), strict=True):
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

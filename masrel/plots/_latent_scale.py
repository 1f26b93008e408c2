"""Items, thresholds and raters of a latent-trait model on one scale."""

import itertools
import math
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from masrel.intervals import LatentTrait, Quantity
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    Picture,
    legend_below,
    shown,
)
from masrel.tables._tables import percent

_ROW = 0.22  # inches a row
_MOST = 14.0  # inches of all rows
_LETTER_WIDTH = 0.055  # share of the axis that a grade's name needs for a letter

_DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "markersize": 4.5}
_INTERVAL: dict[str, Any] = {"linewidth": 3.5, "solid_capstyle": "butt"}
_THRESHOLD: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHES}


def latent(
    trait: LatentTrait, grades: Sequence[str] = (), *, ax: Axes | None = None
) -> Axes:
    """Draw items, thresholds between grades and raters on the latent scale.

    Parameters
    ----------
    trait : LatentTrait
        What `masrel.intervals.latent_trait` returns.
    grades : sequence of str, optional
        The grades in order, which are named above between their thresholds.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Examples
    --------
    >>> ax = latent(trait, ["0", "1", "2"])  # doctest: +SKIP
    """
    return shown(latent_picture(trait, grades), ax)


def latent_picture(scale: LatentTrait, grades: Sequence[str]) -> Picture:
    """Return severities, thresholds and biases on one scale, with noises of raters."""
    # grades: those of the scale
    noises = [noise.value for noise in scale.noises]
    parts = (
        ("severity of items", scale.items, ORANGE, ()),
        ("thresholds", scale.thresholds, GREY, ()),
        ("bias of raters", scale.raters, BLUE, noises),
    )
    n_rows = sum(len(rows) + 1 for _, rows, _, _ in parts)
    row = min(_ROW, _MOST / n_rows)  # inches

    def draw(axes: Axes) -> None:
        left, right = _reach(scale, noises)
        axes.set_xlim(left, right)
        starts, names = [0], list[str]()
        for title, rows, colour, of_raters in parts:
            _draw_rows(axes, starts[-1] + 1, rows, colour, of_raters)
            names += [title, *(of.name for of in rows)]
            starts.append(starts[-1] + 1 + len(rows))
        axes.set_ylim(n_rows - 0.3, 0.3)
        axes.set_yticks(range(n_rows), names, fontsize=min(8.0, 40.0 * row))
        for place in starts[:-1]:
            axes.get_yticklabels()[place].set_fontweight("bold")
        axes.tick_params(axis="y", length=0, pad=7)
        axes.grid(axis="x")
        places = [threshold.value for threshold in scale.thresholds]
        axes.vlines(places, 0.5, starts[2] - 0.4, **_THRESHOLD, zorder=0.5)
        axes.vlines([0.0], starts[2] + 0.5, n_rows - 0.4, **_THRESHOLD, zorder=0.5)
        _name_grades(axes, grades, [left, *places, right])
        axes.set_xlabel(
            "latent scale, in standard deviations of a rating\n"
            "(0: mean of these items, or no bias)"
        )
        level = percent(scale.items[0].interval.level)
        legend_below(
            axes,
            [
                Line2D([], [], linestyle="none", label="posterior median", **_DOT),
                Line2D(
                    [],
                    [],
                    color=BLACK,
                    label=f"{level} % credible interval",
                    **_INTERVAL,
                ),
                Line2D([], [], label="threshold between grades", **_THRESHOLD),
                Patch(facecolor=BLUE, alpha=0.18, label="± the rater's noise"),
            ],
            ncols=2,
        )

    return Picture(7.2, row * n_rows + 1.3, draw)


def _reach(scale: LatentTrait, noises: Sequence[float]) -> tuple[float, float]:
    # from end to end of what the ratings bear on: ends of unused grades are cut
    known = [(row.interval, 0.0) for row in scale.items]
    known += [(row.interval, n) for row, n in zip(scale.raters, noises, strict=True)]
    places = [row.value for row in scale.thresholds]
    low = min(*(ends.low - noise for ends, noise in known), *places)
    high = max(*(ends.high + noise for ends, noise in known), *places)
    room = 0.06 * (high - low)
    return low - room, high + room


def _draw_rows(
    axes: Axes,
    start: int,
    rows: Sequence[Quantity],
    colour: str,
    noises: Sequence[float],
) -> None:
    # noises: of raters, how far the same item is perceived from one time to the next
    left, right = axes.get_xlim()
    for at, row in enumerate(rows, start):
        if noises:
            noise = noises[at - start]
            ends = (row.value - noise, row.value + noise)
            axes.fill_betweenx([at - 0.34, at + 0.34], *ends, color=BLUE, alpha=0.18)
        low, high = row.interval.low, row.interval.high
        axes.plot([low, high], [at, at], color=colour, **_INTERVAL)
        if low < left:
            axes.plot([left], [at], marker="<", color=colour, clip_on=False)
        if high > right:
            axes.plot([right], [at], marker=">", color=colour, clip_on=False)
        axes.plot([row.value], [at], **_DOT)


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

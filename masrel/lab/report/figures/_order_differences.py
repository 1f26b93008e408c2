"""Differences of grades by order: parts of sessions, and effects with intervals."""

import math
import textwrap
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from masrel.lab.report._figure_data import PlaceDots
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    VERMILLION,
    short_name,
)

_LOOKS = (("o", BLUE), ("s", ORANGE), ("^", VERMILLION), ("v", GREY))  # of sessions
_ZERO: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHES}
_LETTERS = 30  # of a line of what is compared
_LEAST_STEPS = 0.5  # to both sides of 0, so that little looks little


def difference_figure(
    parts: Sequence[PlaceDots], effects: Sequence[tuple[str, float, float, float]]
) -> Figure:
    """Return parts of sessions at the left if any, and effects at the right."""
    n_axes = 1 + bool(parts)
    high = max(1.0 + 0.42 * len(effects), 2.3)
    figure = Figure(figsize=(4.6 if n_axes == 1 else 7.6, high))
    *left, right = figure.subplots(1, n_axes, squeeze=False)[0]
    if left:
        _draw_parts(left[0], parts)
        if len(parts) > 1:
            figure.legend(
                *left[0].get_legend_handles_labels(),
                loc="outside lower center",
                ncols=4,
            )
    _draw_effects(right, effects)
    return figure


def _draw_parts(axes: Axes, parts: Sequence[PlaceDots]) -> None:
    axes.axhline(0.0, **_ZERO)
    furthest = _LEAST_STEPS
    for nth, part in enumerate(parts):
        marker, colour = _LOOKS[nth % len(_LOOKS)]
        axes.plot(
            range(len(part.places)), part.steps, color=colour, linewidth=1.0,
            marker=marker, markersize=5, label=short_name(part.session),
        )  # fmt: skip
        known = [abs(steps) for steps in part.steps if math.isfinite(steps)]
        furthest = max([furthest, *(1.1 * steps for steps in known)])
    longest = max(parts, key=lambda part: len(part.places))
    shared = {part.places for part in parts}
    names = longest.places if len(shared) == 1 else range(1, len(longest.places) + 1)
    axes.set_xticks(range(len(longest.places)), [str(name) for name in names])
    axes.set_xlim(-0.4, len(longest.places) - 0.6)
    axes.set_ylim(-furthest, furthest)
    axes.set_xlabel(
        "place in the session" if len(shared) == 1 else "part of the session"
    )
    axes.set_ylabel("steps from the mean\nof the model")
    axes.grid(axis="y")


def _draw_effects(
    axes: Axes, effects: Sequence[tuple[str, float, float, float]]
) -> None:
    axes.axvline(0.0, **_ZERO)
    furthest = _LEAST_STEPS
    for row, (_, mean, low, high) in enumerate(effects):
        ends = [end for end in (low, high) if math.isfinite(end)]
        if len(ends) == 2:
            axes.plot(ends, [row, row], color=BLUE, linewidth=1.8, marker="|")
        axes.plot([mean], [row], "o", color=BLACK, markersize=5)
        furthest = max([furthest, *(1.1 * abs(end) for end in (mean, *ends))])
    axes.set_xlim(-furthest, furthest)
    axes.set_ylim(len(effects) - 0.4, -0.6)
    names = [textwrap.fill(name, _LETTERS) for name, *_ in effects]
    axes.set_yticks(range(len(effects)), names, fontsize=8)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=5, min_n_ticks=3))
    axes.set_xlabel("difference (steps of the scale)")
    axes.grid(axis="x")

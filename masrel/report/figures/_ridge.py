"""The distribution of an estimate, as a small ridge above its interval.

A density is a filled curve. Resamples are shares: a value that many of them have is a
stem at its place, and all others are put together in bars, of one width in a row, so
that a point mass is never smeared and a stem and a bar of one height are one share.
"""

from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from masrel.estimates import Distribution
from masrel.report.figures._style import BLUE, ORANGE

Part = Literal["density", "stems", "bars"]
"""What a ridge is made of."""

RIDGE_COLOURS: dict[Part, str] = {"density": ORANGE, "stems": BLUE, "bars": BLUE}
"""Colour of each part."""

RIDGE_ALPHA = 0.35
"""How much of it a ridge's fill has."""

_WIDTHS = (0.02, 0.01, 0.005, 0.002, 0.001)
_MIN_BARS = 12  # in the middle of the resamples
_MIDDLE = (0.005, 0.995)
_MAX_STEMS = 60  # up to as many values are all shown as stems
_STEM_SHARE = 0.05  # of the resamples, from which on one value is a stem
_FAINT = 0.01  # of the greatest height: what is below it needs no room
_SAME = 1e-9  # values as near as this are one value, computed in another order


def draw_ridge(
    axes: Axes, distribution: Distribution, *, base: float, top: float
) -> None:
    """Draw a distribution between two heights; its own greatest height is the top."""
    if distribution.continuous:
        colour, highest = RIDGE_COLOURS["density"], distribution.weights.max()
        heights = base + (top - base) * distribution.weights / highest
        fill: dict[str, Any] = {"color": colour, "alpha": RIDGE_ALPHA, "linewidth": 0.0}
        axes.fill_between(distribution.values, base, heights, **fill)
        axes.plot(distribution.values, heights, color=colour, linewidth=0.8)
        return
    values, shares = _distinct(distribution)
    single = _is_single(shares)
    edges, binned = _bars(values[~single], shares[~single])
    unit = (top - base) / max([*shares[single], *binned])
    if binned.size:
        bars: dict[str, Any] = {"baseline": base, "color": RIDGE_COLOURS["bars"]}
        heights = base + unit * binned
        axes.stairs(heights, edges, fill=True, alpha=RIDGE_ALPHA, **bars)
        axes.stairs(heights, edges, linewidth=0.8, **bars)
    stems: dict[str, Any] = {"color": RIDGE_COLOURS["stems"], "linewidth": 1.4}
    axes.vlines(values[single], base, base + unit * shares[single], **stems)


def parts(distribution: Distribution) -> tuple[Part, ...]:
    """Return what the ridge of a distribution is made of."""
    if distribution.continuous:
        return ("density",)
    single = _is_single(_distinct(distribution)[1])
    present: dict[Part, bool] = {"stems": bool(single.any()), "bars": not single.all()}
    return tuple(part for part, there in present.items() if there)


def lowest_shown(distribution: Distribution) -> float:
    """Return where a ridge begins to be seen."""
    values, heights = distribution.values, distribution.weights
    if not distribution.continuous:
        values, heights = _distinct(distribution)
        edges, binned = _bars(values, heights)
        values, heights = edges[:-1], binned
    return float(values[heights > _FAINT * heights.max()].min())


def _distinct(
    distribution: Distribution,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # every value once, with its share of the finite ones: both (n_distinct,)
    finite = np.isfinite(distribution.values)
    values, weights = distribution.values[finite], distribution.weights[finite]
    starts = np.flatnonzero(np.diff(values, prepend=-np.inf) > _SAME)
    return values[starts], np.add.reduceat(weights, starts)


def _is_single(shares: NDArray[np.float64]) -> NDArray[np.bool_]:
    # which distinct values are stems, in their order
    return (shares.size <= _MAX_STEMS) | (shares >= _STEM_SHARE)


def _bars(
    values: NDArray[np.float64], shares: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # (n_bars + 1,), (n_bars,); a value on an edge belongs to the bar below, as 1 does
    if not values.size:
        return np.zeros(1), np.zeros(0)
    width = _width(values, shares)
    at = np.ceil(values / width - _SAME).astype(np.int64)
    first = at[0]
    heights = np.bincount(at - first, weights=shares).astype(np.float64)
    edges = width * np.arange(first - 1, first + heights.size)
    return edges, heights


def _width(values: NDArray[np.float64], shares: NDArray[np.float64]) -> float:
    # the widest that shows the shape of what is narrow, too
    cumulative = shares.cumsum() / shares.sum()
    low, high = values[np.searchsorted(cumulative, _MIDDLE).clip(0, values.size - 1)]
    enough = (width for width in _WIDTHS if _MIN_BARS * width <= high - low)
    return next(enough, _WIDTHS[-1])

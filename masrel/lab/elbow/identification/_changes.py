"""Where the torque of a stretch changes: the catch and its end, by least squares.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II and equations (3) to (5).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

_COARSE = 150
"""Candidates of the first search, whatever the number of samples."""

MIN_SIGNAL = 3.0
"""A rise or climb of less than so many standard deviations of the residuals is none."""

MIN_GAIN = 50.0
"""An end that takes less than so many residual variances off the sum of squares is
none: of the ends of white noise the best takes 2 ln n, about 15."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Changes:
    """The changes of one stretch, as places of its samples."""

    catch: int | None
    end: int | None
    residual_sd: float


class _Sums(NamedTuple):
    # Sums of products over samples before each place: any stretch of samples in O(1)
    torque: _Floats
    torque2: _Floats
    rest: _Floats  # torque - pre-catch law
    rest2: _Floats
    angle: _Floats
    angle2: _Floats
    later: _Floats  # torque - inertial torque, after the catch
    later2: _Floats
    later_angle: _Floats


def find_changes(
    torque: _Floats,
    pre_catch: _Floats,
    angle: _Floats,
    *,
    first: int,
    peak: int,
    additive: bool,
    pushed: _Floats | None = None,
    gaps: tuple[int, int] = (0, 0),
) -> Changes:
    """Return the catch of a stretch, by least squares over all pairs of instants.

    Every level is free: the pre-catch law up to a constant, one level for the `peak`
    samples of the peak, one after it, and a climb in proportion to the angle travelled
    after the end of the catch. No catch is before sample `first`. `additive` says that
    post-catch adds to the pre-catch law instead of going on from the residual torque;
    `gaps` samples after the start and the peak are left out, where torque takes time;
    `pushed` is m·θ̈ of (5), which post-catch has and the catch has not.

    A catch whose rise, or an end whose climb, is below `MIN_SIGNAL` standard deviations
    of the residuals is none; nor is an end that takes less than `MIN_GAIN` residual
    variances off the sum of squares. If post-catch is additive, that gain alone decides
    of an end.
    """
    angle = angle - angle.mean()
    torque, pre_catch = torque - torque.mean(), pre_catch - pre_catch.mean()
    # After the catch the level goes on, and with it, of what the law adds there:
    # m·θ̈ of (5), or the pre-catch law less what it was at the catch.
    offset = pre_catch if additive else np.zeros_like(torque)
    later = torque - pre_catch if additive else torque
    if pushed is not None and not additive:
        later = torque - pushed
    sums = _sums(torque, torque - pre_catch, later, angle)
    if torque.size - 2 <= first + 1:
        return Changes(catch=None, end=None, residual_sd=math.nan)
    best = _search(sums, angle, first, (peak, *gaps), offset)
    catch, end, n = best.catch, best.end, torque.size
    if not math.isfinite(best.squares) or best.catch >= best.end:
        return Changes(catch=None, end=None, residual_sd=math.nan)
    sd = math.sqrt(max(best.squares, 0.0) / max(n - 6, 1))
    if _rise(torque, pre_catch, catch, min(catch + peak, end)) < MIN_SIGNAL * sd:
        return Changes(catch=None, end=None, residual_sd=sd)
    if end == n:
        return Changes(catch=catch, end=None, residual_sd=sd)
    starts = best.starts
    endless = _squares(sums, angle, starts, np.array([n]), (peak, *gaps), offset)[:, 0]
    climbs = additive or (
        _climb(sums, angle, min(catch + peak, end), end) >= MIN_SIGNAL * sd
    )
    if climbs and float(endless.min()) - best.squares >= MIN_GAIN * sd**2:
        return Changes(catch=catch, end=end, residual_sd=sd)
    catch = int(starts[int(np.argmin(endless))])
    return Changes(catch=catch, end=None, residual_sd=sd)


@dataclass(frozen=True, slots=True)
class _Best:
    # the pair of least squares, and the starts near it
    catch: int
    end: int
    squares: float
    starts: _Ints


def _search(
    sums: _Sums,
    angle: _Floats,
    first: int,
    lengths: tuple[int, int, int],
    offset: _Floats,
) -> _Best:
    # First both coarsely, then the catch to the sample, then the end to the sample.
    n = angle.size
    step = max(1, n // _COARSE)
    starts = np.arange(first + 1, n - 2, step)
    ends = np.append(np.arange(first + 2, n - 1, step), n)
    peak, *gaps = lengths
    gap, last_gap = (max(step, each) for each in gaps)
    for finer in (False, True, True):
        squares = _squares(sums, angle, starts, ends, (peak, gap, last_gap), offset)
        place = np.unravel_index(int(np.argmin(squares)), squares.shape)
        catch, end = int(starts[place[0]]), int(ends[place[1]])
        reach = 2 if finer else 3 * step
        starts = np.arange(max(catch - reach, first + 1), min(catch + reach, n - 3) + 1)
        if finer:
            ends = np.append(np.arange(first + 2, n - 1), n)
        gap, last_gap = gaps
    return _Best(catch, end, float(squares[place]), starts)


def _sums(torque: _Floats, rest: _Floats, later: _Floats, angle: _Floats) -> _Sums:
    columns = [each for x in (torque, rest, angle, later) for each in (x, x * x)]
    return _Sums(*(np.append(0.0, np.cumsum(x)) for x in (*columns, later * angle)))


def _about_mean(one: _Floats, two: _Floats, low: _Ints, high: _Ints) -> _Floats:
    # Σ(x - mean)² over the samples from low to before high; 0 of none
    count = np.maximum(high - low, 1)
    return np.asarray(two[high] - two[low] - (one[high] - one[low]) ** 2 / count)


def _squares(
    sums: _Sums,
    angle: _Floats,
    starts: _Ints,
    ends: _Ints,
    lengths: tuple[int, int, int],
    offset: _Floats,
) -> _Floats:
    # residual sum of squares of every pair, shape (n_starts, n_ends); without `gap`
    # samples after a step, which then may be anywhere between two candidates, and
    # without the two around the end of the peak, whose length is no whole number
    n = angle.size
    peak, gap, last_gap = lengths
    i, e = starts[:, None], ends[None, :]
    step = np.minimum(i + peak, e)  # down, from the peak
    low = np.minimum(i + gap, step)
    total = _about_mean(sums.rest, sums.rest2, np.zeros_like(i), i)
    total = total + _about_mean(
        sums.torque, sums.torque2, low, np.maximum(step - 1, low)
    )
    after = np.minimum(step + max(last_gap, 1), n)
    end = np.maximum(e, after)
    total = total + _hinge(sums, angle, (after, end), offset[i])
    # an end just before that of the peak is the same as one just after it
    separate = (e > i + gap) & ((e < i + peak - 3) | (e > i + peak + 1))
    return np.where(separate, total, np.inf)


def _hinge(
    sums: _Sums, angle: _Floats, ends: tuple[_Ints, _Ints], offset: _Floats | float
) -> _Floats:
    # residuals of a level from `low` on that climbs with the angle from `end` on
    low, end = ends
    n = angle.size
    count, m = np.maximum(n - low, 1), n - end
    at = angle[np.minimum(end, n - 1)]
    later = sums.later[n] - sums.later[end]
    squares = sums.later2[n] - sums.later2[end] + offset * (2.0 * later + offset * m)
    later = later + offset * m
    total = sums.torque[end] - sums.torque[low] + later
    squares = squares + sums.torque2[end] - sums.torque2[low]
    moved = sums.angle[n] - sums.angle[end]
    h = moved - m * at  # Σ max(θ - θ_e, 0)
    h2 = sums.angle2[n] - sums.angle2[end] - 2.0 * at * moved + m * at**2
    cross = sums.later_angle[n] - sums.later_angle[end] + offset * moved - at * later
    whole = squares - total**2 / count
    return _left(whole, cross - total * h / count, h2 - h**2 / count)


def _left(whole: _Floats, along: _Floats, squares: _Floats) -> _Floats:
    usable = (squares > 0.0) & (along > 0.0)
    return whole - np.where(usable, along**2 / np.where(usable, squares, 1.0), 0.0)


def _rise(torque: _Floats, pre_catch: _Floats, catch: int, end: int) -> float:
    before = float((torque - pre_catch)[:catch].mean()) + float(pre_catch[catch])
    return float(torque[catch:end].mean()) - before


def _climb(sums: _Sums, angle: _Floats, low: int, end: int) -> float:
    # what the climb of a level from `low` on adds up to by the last sample
    h = np.maximum(angle[low:] - angle[end], 0.0)
    torque = np.append(np.diff(sums.torque[low : end + 1]), np.diff(sums.later[end:]))
    centred = h - h.mean()
    squares = float(centred @ centred)
    return float(h[-1]) * float(centred @ torque) / squares if squares else 0.0

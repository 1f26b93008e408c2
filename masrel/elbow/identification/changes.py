"""When a catch begins and ends: the change points of the torque of one stretch."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Changes", "find_changes"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

COARSE = 150
"""Candidates of the first search, whatever the number of samples."""

LEAST_SIGNAL = 3.0
"""A rise or climb of less than so many standard deviations of the residuals is none."""

LEAST_GAIN = 50.0
"""An end that takes less than so many residual variances off the sum of squares is
none: of the ends of white noise the best takes 2 ln n, about 15."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Changes:
    """The changes of one stretch, as places of its samples.

    Attributes
    ----------
    catch : int or None
        First sample of the catch, or None.
    end : int or None
        First sample after the catch, or None if it does not end.
    residual_sd : float
        Standard deviation of torque about the best of all pairs, N·m.
    """

    catch: int | None
    end: int | None
    residual_sd: float


@dataclass(frozen=True, slots=True)
class _Sums:
    # Sums of products over samples before each place: any stretch of samples in O(1)
    torque: Floats
    torque2: Floats
    rest: Floats  # torque - pre-catch law
    rest2: Floats
    angle: Floats
    angle2: Floats
    later: Floats  # torque - inertial torque, after the catch
    later2: Floats
    later_angle: Floats


def find_changes(
    torque: Floats,
    pre_catch: Floats,
    angle: Floats,
    *,
    first: int,
    peak: int,
    additive: bool,
    pushed: Floats | None = None,
) -> Changes:
    """Find the catch of a stretch by least squares.

    Parameters
    ----------
    torque : ndarray, shape (n_samples,)
        Torque, N·m.
    pre_catch : ndarray, shape (n_samples,)
        What the pre-catch law gives, up to a constant, N·m.
    angle : ndarray, shape (n_samples,)
        Smoothed angle, rad.
    first : int
        No catch before this sample: movement onset.
    peak : int
        Samples of the peak, ΔT_peak.
    additive : bool
        Whether post-catch adds to the pre-catch law, instead of going on from the
        residual torque.
    pushed : ndarray, shape (n_samples,), optional
        The inertial torque m·θ̈ of (5), which post-catch has and the catch has not,
        N·m; 0 unless given.

    Returns
    -------
    Changes
        Of all pairs of instants, those with the smallest residual sum of squares
        when every level is free: the pre-catch law up to a constant, one level for
        the peak, one after it, and a climb in proportion to the angle travelled
        after the end of the catch.

    Notes
    -----
    A catch whose rise, or an end whose climb, is below `LEAST_SIGNAL` standard
    deviations of the residuals is not told from noise, and is none; nor is an end
    that takes less than `LEAST_GAIN` residual variances off the sum of squares. If
    post-catch is additive, that gain alone decides of an end.
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
    found = _search(sums, angle, first, peak, offset)
    catch, end, n = found.catch, found.end, torque.size
    sd = math.sqrt(max(found.squares, 0.0) / max(n - 6, 1))
    if _rise(torque, pre_catch, catch, min(catch + peak, end)) < LEAST_SIGNAL * sd:
        return Changes(catch=None, end=None, residual_sd=sd)
    if end == n:
        return Changes(catch=catch, end=None, residual_sd=sd)
    starts = found.starts
    endless = _squares(sums, angle, starts, np.array([n]), (peak, 0), offset)[:, 0]
    climbs = additive or (
        _climb(sums, angle, min(catch + peak, end), end) >= LEAST_SIGNAL * sd
    )
    if climbs and float(endless.min()) - found.squares >= LEAST_GAIN * sd**2:
        return Changes(catch=catch, end=end, residual_sd=sd)
    catch = int(starts[int(np.argmin(endless))])
    return Changes(catch=catch, end=None, residual_sd=sd)


@dataclass(frozen=True, slots=True)
class _Best:
    # the pair of least squares, and the starts near it
    catch: int
    end: int
    squares: float
    starts: Ints


def _search(sums: _Sums, angle: Floats, first: int, peak: int, offset: Floats) -> _Best:
    # First both coarsely, then the catch to the sample, then the end to the sample.
    n = angle.size
    step = max(1, n // COARSE)
    starts = np.arange(first + 1, n - 2, step)
    ends = np.append(np.arange(first + 2, n - 1, step), n)
    gap = step
    for finer in (False, True, True):
        squares = _squares(sums, angle, starts, ends, (peak, gap), offset)
        place = np.unravel_index(int(np.argmin(squares)), squares.shape)
        catch, end = int(starts[place[0]]), int(ends[place[1]])
        reach = 2 if finer else 3 * step
        starts = np.arange(max(catch - reach, first + 1), min(catch + reach, n - 3) + 1)
        if finer:
            ends = np.append(np.arange(first + 2, n - 1), n)
        gap = 0
    return _Best(catch, end, float(squares[place]), starts)


def _sums(torque: Floats, rest: Floats, later: Floats, angle: Floats) -> _Sums:
    def before(values: Floats) -> Floats:
        return np.concatenate([[0.0], np.cumsum(values)])

    return _Sums(
        torque=before(torque),
        torque2=before(torque**2),
        rest=before(rest),
        rest2=before(rest**2),
        angle=before(angle),
        angle2=before(angle**2),
        later=before(later),
        later2=before(later**2),
        later_angle=before(later * angle),
    )


def _about_mean(one: Floats, two: Floats, low: Ints, high: Ints) -> Floats:
    # Σ(x - mean)² over the samples from low to before high; 0 of none
    count = np.maximum(high - low, 1)
    return np.asarray(two[high] - two[low] - (one[high] - one[low]) ** 2 / count)


def _squares(
    sums: _Sums,
    angle: Floats,
    starts: Ints,
    ends: Ints,
    lengths: tuple[int, int],
    offset: Floats,
) -> Floats:
    # residual sum of squares of every pair, shape (n_starts, n_ends); without `gap`
    # samples after a step, which then may be anywhere between two candidates, and
    # without the two around the end of the peak, whose length is no whole number
    n = angle.size
    peak, gap = lengths
    i, e = starts[:, None], ends[None, :]
    step = np.minimum(i + peak, e)  # down, from the peak
    low = np.minimum(i + gap, step)
    total = _about_mean(sums.rest, sums.rest2, np.zeros_like(i), i)
    total = total + _about_mean(
        sums.torque, sums.torque2, low, np.maximum(step - 1, low)
    )
    after = np.minimum(step + max(gap, 1), n)
    end = np.maximum(e, after)
    total = total + _hinge(sums, angle, (after, end), offset[i])
    # an end just before that of the peak is the same as one just after it
    apart = (e > i + gap) & ((e < i + peak - 3) | (e > i + peak + 1))
    return np.where(apart, total, np.inf)


def _hinge(
    sums: _Sums, angle: Floats, ends: tuple[Ints, Ints], offset: Floats | float
) -> Floats:
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


def _left(whole: Floats, along: Floats, spread: Floats) -> Floats:
    usable = (spread > 0.0) & (along > 0.0)
    return whole - np.where(usable, along**2 / np.where(usable, spread, 1.0), 0.0)


def _rise(torque: Floats, pre_catch: Floats, catch: int, end: int) -> float:
    before = float((torque - pre_catch)[:catch].mean()) + float(pre_catch[catch])
    return float(torque[catch:end].mean()) - before


def _climb(sums: _Sums, angle: Floats, low: int, end: int) -> float:
    # what the climb of a level from `low` on adds up to by the last sample
    h = np.maximum(angle[low:] - angle[end], 0.0)
    torque = np.append(np.diff(sums.torque[low : end + 1]), np.diff(sums.later[end:]))
    centred = h - h.mean()
    spread = float(centred @ centred)
    return float(h[-1]) * float(centred @ torque) / spread if spread else 0.0

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Changes:
    """The changes of one stretch, as places of its samples.

    Attributes
    ----------
    catch : int or None
        First sample of the catch, or None.
    end : int or None
        First sample after the catch, or None if it does not end.
    """

    catch: int | None
    end: int | None


@dataclass(frozen=True, slots=True)
class _Sums:
    # Sums of products over samples before each place: any stretch of samples in O(1)
    torque: Floats
    torque2: Floats
    rest: Floats  # torque - pre-catch law
    rest2: Floats
    angle: Floats
    angle2: Floats
    torque_angle: Floats
    rest_angle: Floats


def find_changes(
    torque: Floats,
    pre_catch: Floats,
    angle: Floats,
    *,
    first: int,
    peak: int,
    additive: bool,
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

    Returns
    -------
    Changes
        Of all pairs of instants, those with the smallest residual sum of squares
        when every level is free: the pre-catch law up to a constant, one level for
        the peak, one after it, and a climb in proportion to the angle travelled
        after the end of the catch.

    Notes
    -----
    A catch whose rise, or an end whose climb, is below three standard deviations of
    the residuals is not told from noise, and is none.
    """
    angle = angle - angle.mean()
    torque, pre_catch = torque - torque.mean(), pre_catch - pre_catch.mean()
    sums = _sums(torque, torque - pre_catch, angle)
    n = torque.size
    step = max(1, n // COARSE)
    starts = np.arange(first + 1, n - 2, step)
    ends = np.append(np.arange(first + 2, n - 1, step), n)
    if starts.size == 0:
        return Changes(catch=None, end=None)
    # First both coarsely, then the catch to the sample, then the end to the sample.
    gap = step
    for finer in (False, True, True):
        squares = _squares(sums, angle, starts, ends, (peak, gap), additive=additive)
        place = np.unravel_index(int(np.argmin(squares)), squares.shape)
        catch, end = int(starts[place[0]]), int(ends[place[1]])
        reach = 2 if finer else 3 * step
        starts = np.arange(max(catch - reach, first + 1), min(catch + reach, n - 3) + 1)
        if finer:
            ends = np.append(np.arange(first + 2, n - 1), n)
        gap = 0
    least = float(squares[place])
    sd = math.sqrt(max(least, 0.0) / max(n - 6, 1))
    if _rise(torque, pre_catch, catch, min(catch + peak, end)) < LEAST_SIGNAL * sd:
        return Changes(catch=None, end=None)
    if end < n and _climb(sums, angle, catch, end, peak, additive) < LEAST_SIGNAL * sd:
        lone = np.array([n])
        squares = _squares(sums, angle, starts, lone, (peak, 0), additive=additive)
        catch, end = int(starts[int(np.argmin(squares[:, 0]))]), n
    return Changes(catch=catch, end=None if end == n else end)


def _sums(torque: Floats, rest: Floats, angle: Floats) -> _Sums:
    def before(values: Floats) -> Floats:
        return np.concatenate([[0.0], np.cumsum(values)])

    return _Sums(
        torque=before(torque),
        torque2=before(torque**2),
        rest=before(rest),
        rest2=before(rest**2),
        angle=before(angle),
        angle2=before(angle**2),
        torque_angle=before(torque * angle),
        rest_angle=before(rest * angle),
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
    *,
    additive: bool,
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
    if additive:
        later = np.maximum(e, after)
        total = total + _about_mean(sums.torque, sums.torque2, after, later)
        total = total + _line(sums.rest, sums.rest2, sums.rest_angle, sums, later, n)
    else:
        total = total + _hinge(sums, angle, after, np.maximum(e, after), n)
    # an end just before that of the peak is the same as one just after it
    apart = (e > i + gap) & ((e < i + peak - 3) | (e > i + peak + 1))
    return np.where(apart, total, np.inf)


def _line(
    one: Floats, two: Floats, cross: Floats, sums: _Sums, low: Ints, n: int
) -> Floats:
    # residuals of a straight line in the angle over [low, n), its slope not negative
    count = np.maximum(n - low, 1)
    mean = (sums.angle[n] - sums.angle[low]) / count
    spread = sums.angle2[n] - sums.angle2[low] - count * mean**2
    along = cross[n] - cross[low] - mean * (one[n] - one[low])
    return _left(_about_mean(one, two, low, np.full_like(low, n)), along, spread)


def _hinge(sums: _Sums, angle: Floats, low: Ints, end: Ints, n: int) -> Floats:
    # residuals of a level over [low, end) that climbs with the angle over [end, n)
    count = np.maximum(n - low, 1)
    m = n - end
    at = angle[np.minimum(end, n - 1)]
    torque = sums.torque[n] - sums.torque[low]
    h = sums.angle[n] - sums.angle[end] - m * at  # Σ max(θ - θ_e, 0)
    h2 = sums.angle2[n] - sums.angle2[end]
    h2 = h2 - 2.0 * at * (sums.angle[n] - sums.angle[end]) + m * at**2
    cross = sums.torque_angle[n] - sums.torque_angle[end]
    cross = cross - at * (sums.torque[n] - sums.torque[end])
    whole = _about_mean(sums.torque, sums.torque2, low, np.full_like(low, n))
    return _left(whole, cross - torque * h / count, h2 - h**2 / count)


def _left(whole: Floats, along: Floats, spread: Floats) -> Floats:
    usable = (spread > 0.0) & (along > 0.0)
    return whole - np.where(usable, along**2 / np.where(usable, spread, 1.0), 0.0)


def _rise(torque: Floats, pre_catch: Floats, catch: int, end: int) -> float:
    before = float((torque - pre_catch)[:catch].mean()) + float(pre_catch[catch])
    return float(torque[catch:end].mean()) - before


def _climb(
    sums: _Sums, angle: Floats, catch: int, end: int, peak: int, additive: bool
) -> float:
    # what the fitted climb adds up to by the last sample
    n = angle.size
    if additive:
        return math.inf  # the step back to the pre-catch law is seen by itself
    low = min(catch + peak, end)
    h = np.maximum(angle[low:] - angle[end], 0.0)
    torque = np.diff(sums.torque[low:])
    centred = h - h.mean()
    spread = float(centred @ centred)
    return float(h[n - low - 1]) * float(centred @ torque) / spread if spread else 0.0

"""Slopes of the cubics between samples."""

from collections.abc import Iterator, Sequence
from decimal import Decimal
from itertools import pairwise
from typing import TypeVar

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.polynomial import ZERO

Number = TypeVar("Number", float, Decimal)

__all__ = ["chord_slopes", "exact_monotone_slopes", "monotone_slopes"]


def chord_slopes(width: Floats, rise: Floats) -> tuple[Floats, Floats]:
    """Return the slopes of lines between samples.

    Parameters
    ----------
    width : ndarray, shape (n_samples - 1,)
        Times between samples, s.
    rise : ndarray, shape (n_samples - 1,)
        Angles between samples, rad.

    Returns
    -------
    tuple of two ndarray, shape (n_samples - 1,)
        Slope at the first and at the last end of each interval, rad/s.
    """
    chord = rise / width
    return chord, chord


def monotone_slopes(width: Floats, rise: Floats) -> tuple[Floats, Floats]:
    """Return slopes with which cubics are monotone where the samples are.

    Parameters
    ----------
    width : ndarray, shape (n_samples - 1,)
        Times between samples, s.
    rise : ndarray, shape (n_samples - 1,)
        Angles between samples, rad.

    Returns
    -------
    tuple of two ndarray, shape (n_samples - 1,)
        Slope at the first and at the last end of each interval, rad/s; neighbours
        share theirs.

    References
    ----------
    .. [1] Fritsch, F. N., Butland, J. (1984). A method for constructing local monotone
       piecewise cubic interpolants. SIAM Journal on Scientific and Statistical
       Computing, 5(2), 300-304. https://doi.org/10.1137/0905021

    Examples
    --------
    Up, and level after that: no slope where it turns level.

    >>> import numpy as np
    >>> first, last = monotone_slopes(np.ones(2), np.array([1.0, 0.0]))
    >>> first.tolist(), last.tolist()
    ([1.5, 0.0], [0.0, 0.0])
    """
    chord = rise / width
    if chord.size == 1:
        return chord, chord
    slopes = np.zeros(width.size + 1)
    before, after = chord[:-1], chord[1:]
    wide, narrow = 2.0 * width[1:] + width[:-1], width[1:] + 2.0 * width[:-1]
    same = np.sign(before) * np.sign(after) > 0.0
    # weighted harmonic mean of the chords on both sides, 0 where they turn round
    weighted = wide[same] / before[same] + narrow[same] / after[same]
    slopes[1:-1][same] = (wide + narrow)[same] / weighted
    slopes[0] = _end_slope(width[0], width[1], chord[0], chord[1])
    slopes[-1] = _end_slope(width[-1], width[-2], chord[-1], chord[-2])
    return slopes[:-1], slopes[1:]


def exact_monotone_slopes(
    width: Sequence[Decimal], rise: Sequence[Decimal]
) -> Iterator[Decimal]:
    """Give the slopes of `monotone_slopes` to 50 digits, sample by sample.

    Parameters
    ----------
    width : sequence of Decimal, length n_samples - 1
        Times between samples, s.
    rise : sequence of Decimal, length n_samples - 1
        Angles between samples, rad.

    Yields
    ------
    Decimal
        The slope at the next sample, rad/s.
    """
    chord = [up / time for up, time in zip(rise, width, strict=True)]
    if len(chord) == 1:
        yield from (chord[0], chord[0])
        return
    yield _end_slope(width[0], width[1], chord[0], chord[1])
    for (one, other), (before, after) in zip(
        pairwise(width), pairwise(chord), strict=True
    ):
        wide, narrow = 2 * other + one, other + 2 * one
        if before * after > 0:
            yield (wide + narrow) / (wide / before + narrow / after)
        else:
            yield ZERO
    yield _end_slope(width[-1], width[-2], chord[-1], chord[-2])


def _end_slope(near: Number, far: Number, chord: Number, next_chord: Number) -> Number:
    # of the parabola through three samples, kept from overshooting
    slope = ((2 * near + far) * chord - near * next_chord) / (near + far)
    if slope * chord <= 0:
        return slope - slope  # 0 of its kind
    if chord * next_chord <= 0 and abs(slope) > 3 * abs(chord):
        return 3 * chord
    return slope

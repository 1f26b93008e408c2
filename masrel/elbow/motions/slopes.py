"""Slopes of the cubics between samples."""

import numpy as np

from masrel.elbow.motion import Floats

__all__ = ["chord_slopes", "monotone_slopes"]


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


def _end_slope(near: float, far: float, chord: float, next_chord: float) -> float:
    # of the parabola through three samples, kept from overshooting
    slope = ((2.0 * near + far) * chord - near * next_chord) / (near + far)
    if np.sign(slope) != np.sign(chord):
        return 0.0
    if np.sign(chord) != np.sign(next_chord) and abs(slope) > 3.0 * abs(chord):
        return 3.0 * chord
    return float(slope)

"""A movement as it was recorded: samples, and what happens between them."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from masrel.errors import ParameterError
from masrel.lab.elbow._motion import Floats, Motion, Piece, Rows
from masrel.lab.elbow._polynomials import bernstein, derivative

__all__ = ["Interpolation", "Recorded"]

Interpolation = Literal["pchip", "linear"]
"""What lies between two samples: a cubic that never overshoots, or a line."""


class Recorded(Motion):
    """A movement given by samples, evenly spaced or not, a `Motion`.

    Parameters
    ----------
    time : array_like, shape (n_samples,)
        Times, s, each after the one before. The motion begins at the first.
    angle : array_like, shape (n_samples,)
        Angles, rad.
    interpolation : {"pchip", "linear"}, optional
        Between two samples the angle is a cubic whose slopes at the samples are those
        of [1], so that it is monotone where the samples are, or a line.

    Attributes
    ----------
    interpolation : {"pchip", "linear"}
        As asked.

    Raises
    ------
    ParameterError
        If there are fewer than two samples, not as many times as angles, or one that
        is not finite, not in order, or outside 0 to 180 degrees; the message names the
        row, the first being 1.

    References
    ----------
    .. [1] Fritsch, F. N., Butland, J. (1984). A method for constructing local monotone
       piecewise cubic interpolants. SIAM Journal on Scientific and Statistical
       Computing, 5(2), 300-304. https://doi.org/10.1137/0905021

    Examples
    --------
    >>> motion = Recorded(time=[10.0, 11.0, 13.0], angle=[0.5, 1.0, 2.5])
    >>> motion.duration, float(motion.angle(1.0))
    (3.0, 1.0)
    """

    __slots__ = ("_angles", "_knots", "_pieces", "_rows", "interpolation")

    def __init__(
        self,
        *,
        time: ArrayLike,
        angle: ArrayLike,
        interpolation: Interpolation = "pchip",
    ) -> None:
        if interpolation not in ("pchip", "linear"):
            raise ParameterError(
                f"interpolation: needs one of pchip, linear, got {interpolation!r}"
            )
        times, angles = _checked(time, angle)
        self.interpolation = interpolation
        self._knots, self._angles = times - times[0], angles
        self._rows = Rows(self._knots[:-1], self._coefficients())
        self._pieces = self._laid()

    def _coefficients(self) -> Floats:
        # θ_i + u (first + u (c₂ + u c₃)), u the time since sample i
        width, rise = np.diff(self._knots), np.diff(self._angles)
        low, chord = self._angles[:-1] - self._angles[0], rise / width
        if self.interpolation == "linear":
            return np.stack([low, chord])
        slopes = _monotone_slopes(width, chord)
        begin, finish = slopes[:-1] - chord, slopes[1:] - chord
        square, cube = -(2.0 * begin + finish) / width, (begin + finish) / width / width
        return np.stack([low, slopes[:-1], square, cube])

    def _laid(self) -> list[Piece]:
        width = np.diff(self._knots)
        speeds = bernstein(derivative(list(self._rows.angle)), width)
        slowest, fastest = np.min(speeds, axis=0), np.max(speeds, axis=0)
        columns = (self._rows.start, width, self._rows.angle.T, slowest, fastest)
        return list(map(Piece._make, zip(*(c.tolist() for c in columns), strict=True)))

    @property
    def start(self) -> float:
        """Angle of the first sample, rad."""
        return float(self._angles[0])

    @property
    def end(self) -> float:
        """Angle of the last sample, rad."""
        return float(self._angles[-1])

    @property
    def duration(self) -> float:
        """From the first sample to the last, s."""
        return float(self._knots[-1])

    def pieces(self) -> list[Piece]:
        """Return the cubics, or lines, from sample to sample."""
        return self._pieces

    def rows(self) -> Rows:
        """Return the pieces as arrays."""
        return self._rows


def _monotone_slopes(width: Floats, chord: Floats) -> Floats:
    # (n_samples,): cubics with these slopes are monotone where the samples are
    if chord.size == 1:
        return np.repeat(chord, 2)
    slopes = np.zeros(width.size + 1)
    before, after = chord[:-1], chord[1:]
    wide, narrow = 2.0 * width[1:] + width[:-1], width[1:] + 2.0 * width[:-1]
    same = np.sign(before) * np.sign(after) > 0.0
    # weighted harmonic mean of the chords on both sides, 0 where they turn round
    weighted = wide[same] / before[same] + narrow[same] / after[same]
    slopes[1:-1][same] = (wide + narrow)[same] / weighted
    slopes[0] = _end_slope(width[0], width[1], chord[0], chord[1])
    slopes[-1] = _end_slope(width[-1], width[-2], chord[-1], chord[-2])
    return slopes


def _end_slope(near: float, far: float, chord: float, next_chord: float) -> float:
    # of the parabola through three samples, kept from overshooting
    slope = ((2 * near + far) * chord - near * next_chord) / (near + far)
    if slope * chord <= 0:
        return 0.0
    if chord * next_chord <= 0 and abs(slope) > 3 * abs(chord):
        return 3 * chord
    return slope


def _checked(time: ArrayLike, angle: ArrayLike) -> tuple[Floats, Floats]:
    times = np.array(time, dtype=np.float64)
    angles = np.array(angle, dtype=np.float64)
    if times.ndim != 1 or times.shape != angles.shape or times.size < 2:
        raise ParameterError(
            "time, angle: need two or more samples and as many times as angles, got "
            f"shapes {times.shape} and {angles.shape}"
        )
    for name, column in (("time", times), ("angle", angles)):
        _refuse(~np.isfinite(column), f"{name}: needs finite numbers", column)
    behind = np.diff(times, prepend=-np.inf) <= 1e-30
    _refuse(behind, "time: needs to grow from sample to sample", times)
    outside = (angles < 0.0) | (angles > np.pi)
    _refuse(outside, "angle: needs 0 to 180 degrees", np.degrees(angles))
    return times, angles


def _refuse(wrong: np.ndarray, needed: str, values: Floats) -> None:
    if wrong.any():
        row = int(wrong.argmax())
        raise ParameterError(f"{needed}, got {values[row]:g} in sample {row + 1}")

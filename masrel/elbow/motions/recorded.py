"""A movement as it was recorded: samples, and what happens between them."""

from collections.abc import Iterator
from decimal import Decimal
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from masrel.elbow.motion import Floats
from masrel.elbow.motions.slopes import (
    chord_slopes,
    exact_monotone_slopes,
    monotone_slopes,
)
from masrel.elbow.piece import Piece
from masrel.errors import ParameterError

__all__ = ["Interpolation", "Recorded"]

Interpolation = Literal["pchip", "linear"]
"""What lies between two samples: a cubic that never overshoots, or a line."""

_SLOPES = {"pchip": monotone_slopes, "linear": chord_slopes}


class Recorded:
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

    __slots__ = ("_angles", "_cubic", "_first", "_knots", "_last", "interpolation")

    def __init__(
        self,
        *,
        time: ArrayLike,
        angle: ArrayLike,
        interpolation: Interpolation = "pchip",
    ) -> None:
        if interpolation not in _SLOPES:
            raise ParameterError(
                f"interpolation: needs one of {', '.join(_SLOPES)}, "
                f"got {interpolation!r}"
            )
        times, angles = _checked(time, angle)
        self.interpolation = interpolation
        self._knots, self._angles = times - times[0], angles
        width, rise = np.diff(self._knots), np.diff(angles)
        self._first, self._last = _SLOPES[interpolation](width, rise)
        # θ_i + u (first + u (c₂ + u c₃)), u the time since sample i; of a line, exactly
        # 0 is left of the differences
        chord = rise / width
        begin, finish = self._first - chord, self._last - chord
        self._cubic = (
            -(2.0 * begin + finish) / width,
            (begin + finish) / width / width,
        )

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

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle at times within the duration, rad."""
        i, u = self._place(time)
        square, cube = self._cubic
        travel = u * (self._first[i] + u * (square[i] + u * cube[i]))
        return np.asarray((self._angles[i] - origin) + travel)

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity at times within the duration, rad/s."""
        i, u = self._place(time)
        square, cube = self._cubic
        return np.asarray(self._first[i] + u * (2.0 * square[i] + 3.0 * u * cube[i]))

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration at times within the duration, rad/s²."""
        i, u = self._place(time)
        square, cube = self._cubic
        return np.asarray(2.0 * square[i] + 6.0 * u * cube[i])

    def _place(self, time: Floats | float) -> tuple[np.ndarray, Floats]:
        # sample before each time, and the time since
        at = np.searchsorted(self._knots, time, side="right") - 1
        at = np.clip(at, 0, self._knots.size - 2)
        return at, np.asarray(time) - self._knots[at]

    def pieces(self) -> Iterator[Piece]:
        """Give the cubics, or lines, from sample to sample."""
        times, angles = (
            [Decimal(x) for x in column.tolist()]
            for column in (self._knots, self._angles)
        )
        widths = [high - low for low, high in pairwise(times)]
        rises = [high - low for low, high in pairwise(angles)]
        if self.interpolation == "linear":
            for width, low, rise in zip(widths, angles, rises, strict=False):
                yield Piece(length=width, angle=(low, rise))
            return
        slopes = pairwise(exact_monotone_slopes(widths, rises))
        for width, low, rise, (first, last) in zip(
            widths, angles, rises, slopes, strict=False
        ):
            begin, finish = width * first, width * last
            square, cube = 3 * rise - 2 * begin - finish, begin + finish - 2 * rise
            yield Piece(length=width, angle=(low, begin, square, cube))


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
    behind = np.diff(times, prepend=-np.inf) <= 0.0
    _refuse(behind, "time: needs to grow from sample to sample", times)
    outside = (angles < 0.0) | (angles > np.pi)
    _refuse(outside, "angle: needs 0 to 180 degrees", np.degrees(angles))
    return times, angles


def _refuse(wrong: np.ndarray, needed: str, values: Floats) -> None:
    if wrong.any():
        row = int(wrong.argmax())
        raise ParameterError(f"{needed}, got {values[row]:g} in sample {row + 1}")

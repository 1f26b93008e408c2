"""A stretch that speeds up, goes on at one speed, and slows down."""

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.motions.checks import check_stretch
from masrel.elbow.piece import Piece
from masrel.elbow.polynomial import ZERO
from masrel.errors import ParameterError

__all__ = ["Trapezoid"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trapezoid:
    """A stretch from rest to rest with a trapezoidal speed, a `Motion`.

    Attributes
    ----------
    start, end : float
        Angles, rad.
    speed : float
        Angular speed between the ramps, rad/s.
    acceleration_rate : float
        How fast the speed grows at the start and falls at the end, rad/s².

    Raises
    ------
    ParameterError
        As of `ConstantSpeed`, or if the way is too short to reach the speed: both
        ramps together take speed²/acceleration_rate.

    Examples
    --------
    Ramps of 0.5 s and 0.25 rad each, and 1.5 rad between them:

    >>> Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=2.0).duration
    2.5
    """

    start: float
    end: float
    speed: float
    acceleration_rate: float

    def __post_init__(self) -> None:
        check_stretch(
            self.start,
            self.end,
            speed=self.speed,
            acceleration_rate=self.acceleration_rate,
        )
        travel = Decimal(self.end) - Decimal(self.start)
        if Decimal(self.speed) ** 2 > travel * Decimal(self.acceleration_rate):
            least = np.degrees(self.speed**2 / (self.end - self.start))
            raise ParameterError(
                f"acceleration_rate: needs {least:g} deg/s² or more to reach "
                f"{np.degrees(self.speed):g} deg/s on the way, got "
                f"{np.degrees(self.acceleration_rate):g} deg/s²"
            )

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        ramp = self.speed / self.acceleration_rate
        return (self.end - self.start) / self.speed + ramp

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle at times within the duration, rad."""
        t, left, ramp = self._times(time)
        up = 0.5 * self.acceleration_rate * t * t
        level = self.speed * (t - 0.5 * ramp)
        down = (self.end - self.start) - 0.5 * self.acceleration_rate * left * left
        travel = np.where(t < ramp, up, np.where(left > ramp, level, down))
        return np.asarray((self.start - origin) + travel)

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity at times within the duration, rad/s."""
        t, left, ramp = self._times(time)
        slowed = np.where(left > ramp, self.speed, self.acceleration_rate * left)
        return np.where(t < ramp, self.acceleration_rate * t, slowed)

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration at times within the duration, rad/s²."""
        t, left, ramp = self._times(time)
        slowed = np.where(left > ramp, 0.0, -self.acceleration_rate)
        return np.where(t < ramp, self.acceleration_rate, slowed)

    def _times(self, time: Floats | float) -> tuple[Floats, Floats, float]:
        # since the start, until the end, and of a ramp
        t = np.asarray(time)
        ramp = self.speed / self.acceleration_rate
        return t, self.duration - t, ramp

    def pieces(self) -> Iterator[Piece]:
        """Give the ramp up, the line, if there is one, and the ramp down."""
        start, travel = Decimal(self.start), Decimal(self.end) - Decimal(self.start)
        speed = Decimal(self.speed)
        ramp = speed / Decimal(self.acceleration_rate)
        rise = speed * ramp / 2  # way of a ramp
        yield Piece(length=ramp, angle=(start, ZERO, rise))
        level = travel - 2 * rise
        if level > 0:
            yield Piece(length=level / speed, angle=(start + rise, level))
        yield Piece(length=ramp, angle=(start + travel - rise, 2 * rise, -rise))

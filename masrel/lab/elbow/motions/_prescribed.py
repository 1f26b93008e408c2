"""Movements given by a formula: at one speed, of minimum jerk, trapezoidal, held."""

import math
from dataclasses import dataclass

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.elbow._motion import Motion, Piece, piece_of
from masrel.lab.elbow._polynomials import Number, Polynomial

__all__ = ["ConstantSpeed", "Hold", "MinimumJerk", "Trapezoid"]

_UNITS = {"speed": "deg/s", "mean_speed": "deg/s", "acceleration_rate": "deg/s²"}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stretch(Motion):
    """From one angle to a larger one, at speeds that move the arm."""

    start: float
    end: float

    def __post_init__(self) -> None:
        start, end = self.start, self.end
        if not 0.0 <= start < end <= math.pi:
            raise ParameterError(
                "start, end: need 0 <= start < end <= 180 degrees, got "
                f"{math.degrees(start):g} and {math.degrees(end):g} degrees"
            )
        for name in self.__slots__:  # those that a kind adds
            rate, unit = getattr(self, name), _UNITS[name]
            if not 0.0 < rate < math.inf:
                raise ParameterError(
                    f"{name}: needs more than 0 and finite, got {math.degrees(rate):g} "
                    f"{unit}"
                )
            if not 1e-30 <= rate <= 1e30:  # whose tenth powers a float holds
                raise ParameterError(
                    f"{name}: needs a rate that some motion has, 1e-28 to 1e31 {unit}, "
                    f"got {math.degrees(rate):g} {unit}"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantSpeed(_Stretch):
    """A stretch at one speed from the first instant to the last, a `Motion`.

    Attributes
    ----------
    start, end : float
        Angles, rad.
    speed : float
        Angular speed, rad/s.

    Raises
    ------
    ParameterError
        If the angles are not in order within 0 to 180 degrees, or the speed is not
        more than 0, or beyond 1e-30 to 1e30 rad/s.

    Examples
    --------
    >>> ConstantSpeed(start=0.5, end=2.5, speed=1.0).duration
    2.0
    """

    speed: float

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return (self.end - self.start) / self.speed

    def pieces(self) -> list[Piece]:
        """Return the one piece, a line."""
        length = (self.end - self.start) / self.speed
        return [Piece(0.0, length, (0.0, self.speed), self.speed, self.speed)]


@dataclass(frozen=True, slots=True, kw_only=True)
class MinimumJerk(_Stretch):
    """A stretch from rest to rest with the least squared jerk, a `Motion`.

    Attributes
    ----------
    start, end : float
        Angles, rad.
    mean_speed : float
        Travel over duration, rad/s; the peak speed is 1.875 times that.

    Raises
    ------
    ParameterError
        As of `ConstantSpeed`.

    References
    ----------
    .. [1] Flash, T., Hogan, N. (1985). The coordination of arm movements. Journal
       of Neuroscience, 5(7), 1688-1703.
       https://doi.org/10.1523/JNEUROSCI.05-07-01688.1985

    Examples
    --------
    >>> motion = MinimumJerk(start=0.5, end=2.5, mean_speed=1.0)
    >>> float(motion.velocity(1.0))
    1.875
    """

    mean_speed: float

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return (self.end - self.start) / self.mean_speed

    def pieces(self) -> list[Piece]:
        """Return the two halves of the quintic of [1]."""
        laid = quintic(self.end - self.start, self.mean_speed)
        return [Piece(*of_time, 0.0, 1.875 * self.mean_speed) for of_time in laid]


def quintic(way: Number, mean_speed: Number) -> list[tuple[Number, Number, Polynomial]]:
    """Return start, length and angle of both halves of a minimum-jerk movement.

    Flash and Hogan's 10 s³ - 15 s⁴ + 6 s⁵, s the share of the time, is
    1/2 + 15/8 x - 5 x³ + 6 x⁵ with x = s - 1/2, which keeps its digits to the end.
    """
    length = way / mean_speed
    third = way / length / length / length
    fifth = third / length / length
    half = 0.5 * length
    return [
        (0.0, half, (0.0, 0.0, 0.0, 10.0 * third, -15.0 * third / length, 6.0 * fifth)),
        (
            half,
            half,
            (0.5 * way, 1.875 * mean_speed, 0.0, -5.0 * third, 0.0, 6.0 * fifth),
        ),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trapezoid(_Stretch):
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

    speed: float
    acceleration_rate: float

    def __post_init__(self) -> None:
        _Stretch.__post_init__(self)
        way = self.end - self.start
        if self.speed**2 > way * self.acceleration_rate * (1.0 + 1e-15):
            min_rate = np.degrees(self.speed**2 / way)
            raise ParameterError(
                f"acceleration_rate: needs {min_rate:g} deg/s² or more to reach "
                f"{np.degrees(self.speed):g} deg/s on the way, got "
                f"{np.degrees(self.acceleration_rate):g} deg/s²"
            )

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        ramp = self.speed / self.acceleration_rate
        return (self.end - self.start) / self.speed + ramp

    def pieces(self) -> list[Piece]:
        """Return the ramp up, the line, if there is one, and the ramp down."""
        laid = ramps(self.end - self.start, self.speed, self.acceleration_rate)
        return [piece_of(*of_time) for of_time in laid if of_time[1] > 0.0]


def ramps(
    way: Number, speed: Number, rate: Number
) -> list[tuple[Number, Number, Polynomial]]:
    """Return start, length and angle of the ramp up, the line and the ramp down."""
    ramp = speed / rate
    rise = 0.5 * speed * ramp
    level = way / speed - ramp
    return [
        (0.0, ramp, (0.0, 0.0, 0.5 * rate)),
        (ramp, level, (rise, speed)),
        (ramp + level, ramp, (way - rise, speed, -0.5 * rate)),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold(Motion):
    """An arm held still, a `Motion`.

    Attributes
    ----------
    start : float
        Where, rad.
    duration : float
        How long, s.

    Raises
    ------
    ParameterError
        If the angle is outside 0 to 180 degrees, or the duration is not more than 0.

    Examples
    --------
    >>> float(Hold(start=0.5, duration=2.0).velocity(1.0))
    0.0
    """

    start: float
    duration: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.start <= math.pi:
            raise ParameterError(
                f"start: needs 0 to 180 degrees, got {math.degrees(self.start):g}"
            )
        if not 0.0 < self.duration < math.inf:
            raise ParameterError(
                f"duration: needs more than 0 s and finite, got {self.duration:g}"
            )

    @property
    def end(self) -> float:
        """Where, rad."""
        return self.start

    def pieces(self) -> list[Piece]:
        """Return the one piece, a constant."""
        return [Piece(0.0, self.duration, (0.0,), 0.0, 0.0)]

"""Prescribed movements of the arm: constant speed and minimum jerk."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from masrel.errors import ParameterError

__all__ = ["ConstantSpeed", "MinimumJerk", "Motion", "first_true"]

Floats = NDArray[np.float64]


class Motion(Protocol):
    """A stretch in extension as a function of time; SI units.

    Events are sought for a speed that is constant, or that grows to one maximum in the
    middle of the duration and falls again.
    """

    @property
    def start(self) -> float:
        """Angle where it starts, rad."""
        ...

    @property
    def end(self) -> float:
        """Angle where it ends, rad."""
        ...

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        ...

    def angle(self, time: Floats | float) -> Floats:
        """Angle at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Angles, rad; the same bits for one time as for many at once.
        """
        ...

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Velocities, rad/s; never negative.
        """
        ...

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Accelerations, rad/s².
        """
        ...

    def time_at(self, angle: float) -> float:
        """Time at which an angle is reached.

        Parameters
        ----------
        angle : float
            Angle between `start` and `end`, rad.

        Returns
        -------
        float
            Time, s.
        """
        ...

    def times_above(self, speed: float) -> tuple[float, float] | None:
        """First and last time at which a speed is reached or exceeded.

        Parameters
        ----------
        speed : float
            Angular speed, rad/s.

        Returns
        -------
        tuple of two float, or None
            First and last time, s; None when the stretch is never that fast.
        """
        ...

    def turning_times(
        self, stiffness: float, damping: float, inertia: float
    ) -> tuple[float, ...]:
        """Return times with all at which kθ + bω + mα is stationary.

        Parameters
        ----------
        stiffness : float
            Factor k of the angle, N·m/rad.
        damping : float
            Factor b of the velocity, N·m·s/rad.
        inertia : float
            Factor m of the acceleration, kg·m².

        Returns
        -------
        tuple of float
            Times within the duration, s; none for a stretch at constant speed.
        """
        ...


def first_true(condition: Callable[[float], bool], low: float, high: float) -> float:
    """Return where a condition turns true, to the last bit.

    Parameters
    ----------
    condition : callable
        False at `low` and true at `high`, with one change between them.
    low, high : float
        The bracket.

    Returns
    -------
    float
        The smallest float of the bracket, within one, where it is true.

    Examples
    --------
    >>> first_true(lambda t: t * t >= 2.0, 1.0, 2.0)
    1.4142135623730951
    """
    while True:
        middle = low + 0.5 * (high - low)
        if not low < middle < high:
            return high
        if condition(middle):
            high = middle
        else:
            low = middle


def _check(start: float, end: float, speed: float, name: str) -> None:
    if not 0.0 <= start < end <= math.pi:
        raise ParameterError(
            "start, end: need 0 <= start < end <= 180 degrees, got "
            f"{math.degrees(start):g} and {math.degrees(end):g} degrees"
        )
    if not 0.0 < speed < math.inf:
        raise ParameterError(
            f"{name}: needs more than 0 and finite, got {math.degrees(speed):g} deg/s"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantSpeed:
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
        more than 0.

    Examples
    --------
    >>> ConstantSpeed(start=0.5, end=2.5, speed=1.0).duration
    2.0
    """

    start: float
    end: float
    speed: float

    def __post_init__(self) -> None:
        _check(self.start, self.end, self.speed, "speed")

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return (self.end - self.start) / self.speed

    def angle(self, time: Floats | float) -> Floats:
        """Angle at times within the duration, rad."""
        return np.asarray(self.start + self.speed * np.asarray(time))

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity, rad/s."""
        return np.full(np.shape(time), self.speed)

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration, rad/s²."""
        return np.zeros(np.shape(time))

    def time_at(self, angle: float) -> float:
        """Time at which an angle is reached, s."""
        return (angle - self.start) / self.speed

    def times_above(self, speed: float) -> tuple[float, float] | None:
        """First and last time at which the speed is at least `speed`, or None."""
        return (0.0, self.duration) if self.speed >= speed else None

    def turning_times(
        self,
        stiffness: float,  # noqa: ARG002 - the interface of every motion
        damping: float,  # noqa: ARG002 - the interface of every motion
        inertia: float,  # noqa: ARG002 - the interface of every motion
    ) -> tuple[float, ...]:
        """Return no time: kθ + bω + mα only grows."""
        return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MinimumJerk:
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

    start: float
    end: float
    mean_speed: float

    def __post_init__(self) -> None:
        _check(self.start, self.end, self.mean_speed, "mean_speed")

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return (self.end - self.start) / self.mean_speed

    def angle(self, time: Floats | float) -> Floats:
        """Angle at times within the duration, rad."""
        s = np.asarray(time) / self.duration
        # quintic of [1]; products, as powers of a number and of an array may differ
        share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        return np.asarray(self.start + (self.end - self.start) * share)

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity at times within the duration, rad/s."""
        s = np.asarray(time) / self.duration
        rest = s * (1.0 - s)
        return np.asarray(30.0 * self.mean_speed * rest * rest)

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration at times within the duration, rad/s²."""
        s = np.asarray(time) / self.duration
        rate = self.mean_speed / self.duration
        return np.asarray(60.0 * rate * s * (1.0 - s) * (1.0 - 2.0 * s))

    def time_at(self, angle: float) -> float:
        """Time at which an angle between start and end is reached, s."""
        return first_true(
            lambda time: bool(self.angle(time) >= angle), 0.0, self.duration
        )

    def times_above(self, speed: float) -> tuple[float, float] | None:
        """First and last time at which the speed is at least `speed`, or None."""
        c = math.sqrt(speed / (30.0 * self.mean_speed))  # s (1 - s) = c
        if 4.0 * c > 1.0:
            return None
        s = 2.0 * c / (1.0 + math.sqrt(1.0 - 4.0 * c))  # no cancellation
        return s * self.duration, (1.0 - s) * self.duration

    def turning_times(
        self, stiffness: float, damping: float, inertia: float
    ) -> tuple[float, ...]:
        """Return times with all at which kθ + bω + mα is stationary, s."""
        duration = self.duration
        share = np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
        force = stiffness * share
        force = force + damping / duration * share.deriv()
        force = force + inertia / duration**2 * share.deriv(2)
        slope = force.deriv()
        # A leading term that is nothing within 0 to 1 would spoil the other roots.
        slope = slope.trim(np.finfo(np.float64).eps * np.abs(slope.coef).max())
        # A complex root's real part is no stationary time, but a time all the same:
        # whoever takes the largest torque over these loses nothing by it.
        shares = slope.roots().real
        return tuple(float(s) * duration for s in shares if 0.0 < s < 1.0)

"""Hands that move a simulated arm: mass, spring and damper, and an intention."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from masrel.errors import ParameterError


class Hand(Protocol):
    """A hand as the simulated arm feels it: mass, spring and damper, an intention."""

    @property
    def stiffness(self) -> float:
        """Spring towards the intended angle, N·m/rad."""
        ...

    @property
    def damping(self) -> float:
        """Damper towards the intended speed, N·m·s/rad."""
        ...

    @property
    def inertia(self) -> float:
        """What of its own moves with the arm that it holds, kg·m²."""
        ...

    @property
    def slip_time(self) -> float:
        """When the hand lets go for good, s; infinite when it never does."""
        ...

    @property
    def start(self) -> float:
        """Where the arm is before the hand moves, rad."""
        ...

    @property
    def yields(self) -> bool:
        """Whether its intention depends on the torque it feels, which `feel` takes."""
        ...

    def intended(self, time_s: float) -> tuple[float, float]:
        """Return where the hand means to be.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s.

        Returns
        -------
        tuple of float
            Intended angle, rad, and speed, rad/s.
        """
        ...

    def feel(self, time_s: float, torque: float) -> None:
        """Take in what the hand feels now.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s; never earlier than the one before.
        torque : float
            Torque of its spring and damper, N·m.
        """
        ...


@dataclass(slots=True, kw_only=True)
class _Leg:
    """One way of a hand, there or back: a trapezoid of speed between two rests."""

    start: float  # rad
    end: float  # rad
    speed: float  # rad/s, negative on the way back
    ramp_up: float  # s
    ramp_down: float  # s
    delay: float  # when it leaves, s
    cruise_time: float  # and has its speed
    cruise_angle: float  # where it has it, rad
    brake_time: float  # when it begins to brake, s
    final_time: float  # when it is there, s
    since: float = -math.inf  # when it comes after the leg before, s
    until: float = math.inf  # and when the next one comes


def _leg(
    start: float,
    end: float,
    speed: float,
    *,
    delay: float,
    ramp_up: float,
    ramp_down: float,
) -> _Leg:
    # Raises ParameterError where the ramps leave nothing between them
    way = end - start
    speed = math.copysign(speed, way)
    ramps = 0.5 * speed * (ramp_up + ramp_down)
    cruise = way - ramps
    if cruise / speed <= 0.0:
        raise ParameterError(
            f"mean_speed: needs ramps shorter than the stretch, at {abs(speed)} "
            f"rad/s they take {abs(ramps):.3g} of {abs(way):.3g} rad"
        )
    cruise_time = delay + ramp_up
    brake_time = cruise_time + cruise / speed
    return _Leg(
        start=start,
        end=end,
        speed=speed,
        ramp_up=ramp_up,
        ramp_down=ramp_down,
        delay=delay,
        cruise_time=cruise_time,
        cruise_angle=start + 0.5 * speed * ramp_up,
        brake_time=brake_time,
        final_time=brake_time + ramp_down,
    )


class SimulatedHand:
    """A hand that stretches the arm at an intended speed, once or again and again.

    The intention is a trapezoid: rest for `delay`, a short ramp up, constant speed, a
    ramp down. For every speed in `again` it then rests, brings the arm back, rests and
    stretches once more; at last it holds, or brings it back. So the mean speed before
    the catch, which the catch angle depends on, falls at most 2 % short of the intended
    one. It is a clamp rather than a hand: the damper keeps the speed within 12 deg/s of
    the intention when the catch adds 7 N·m at once, and the spring lags by about 1 deg.
    It has no mass, does not tremble and does not react: `HumanHand` does.

    Parameters
    ----------
    start : float
        Where the stretch starts, rad.
    end : float
        Where it is meant to end, rad: the end of the range of motion.
    mean_speed : float
        Speed between the ramps, rad/s.
    slip_time : float or None, optional
        Time after the first reading at which the hand lets go, s; None for never.
    stiffness : float, optional
        N·m/rad.
    damping : float, optional
        N·m·s/rad.
    delay : float, optional
        Rest before the stretch, s.
    ramp_up, ramp_down : float, optional
        Duration of the ramps, s.
    follow_through : float, optional
        How far beyond `end` the hand intends to go, rad: it meets the joint's own
        end and presses against it, whatever the torque there.
    again : sequence of float, optional
        Speeds of the stretches after the first, rad/s.
    return_speed : float, optional
        Speed at which it brings the arm back between two of them, rad/s.
    rest : float, optional
        How long it rests at either end between them, s.
    returns : bool, optional
        Whether it rests and brings the arm back after the last stretch, too.

    Raises
    ------
    ParameterError
        If a value is outside its range or the ramps take more than the stretch.

    Examples
    --------
    >>> hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    >>> hand.intended(0.0)
    (0.5, 0.0)
    >>> hand.intended(1.0)[1]
    1.5
    """

    __slots__ = (
        "_delay",
        "_leg",
        "_legs",
        "_ramp_down",
        "_ramp_up",
        "damping",
        "end",
        "inertia",
        "mean_speed",
        "slip_time",
        "start",
        "stiffness",
    )

    yields: ClassVar[bool] = False

    def __init__(
        self,
        *,
        start: float,
        end: float,
        mean_speed: float,
        slip_time: float | None = None,
        stiffness: float = 600.0,
        damping: float = 40.0,
        delay: float = 0.05,
        ramp_up: float = 0.02,
        ramp_down: float = 0.1,
        follow_through: float = math.radians(2.5),
        again: Sequence[float] = (),
        return_speed: float = math.radians(60.0),
        rest: float = 0.3,
        returns: bool = False,
    ) -> None:
        self.start = start
        self.end = end
        self.mean_speed = mean_speed
        self.slip_time = math.inf if slip_time is None else slip_time
        self.stiffness = stiffness
        self.damping = damping
        self.inertia = 0.0
        self._delay = delay
        self._ramp_up = ramp_up
        self._ramp_down = ramp_down
        self._check(follow_through, again, return_speed, rest)
        final = end + follow_through
        ways = [(start, final, mean_speed)]  # there, and again back and there
        for speed in again:
            ways += [(final, start, return_speed), (start, final, speed)]
        if returns:
            ways.append((final, start, return_speed))
        self._legs: list[_Leg] = []
        for way in ways:
            # No hand is as brisk where it brings the arm back
            brisk = ramp_up if way[1] > way[0] else max(ramp_up, ramp_down)
            ramps = {"ramp_up": brisk, "ramp_down": ramp_down}
            leg = _leg(*way, delay=delay, **ramps)
            if self._legs:
                self._legs[-1].until = leg.since = delay
            self._legs.append(leg)
            delay = leg.final_time + rest
        self._leg = self._legs[0]

    def _check(
        self,
        follow_through: float,
        again: Sequence[float],
        return_speed: float,
        rest: float,
    ) -> None:
        positive = {
            "mean_speed": self.mean_speed,
            **{f"again[{n}]": speed for n, speed in enumerate(again)},
            "return_speed": return_speed,
            "stiffness": self.stiffness,
            "damping": self.damping,
            "ramp_up": self._ramp_up,
            "ramp_down": self._ramp_down,
        }
        for name, value in positive.items():
            if not 0.0 < value < math.inf:
                raise ParameterError(f"{name}: needs more than 0, got {value}")
        times = {"delay": self._delay, "follow_through": follow_through, "rest": rest}
        for name, value in times.items():
            if not 0.0 <= value < math.inf:
                raise ParameterError(f"{name}: needs 0 or more, got {value}")
        if not self.slip_time >= 0.0:
            raise ParameterError(f"slip_time: needs 0 or more, got {self.slip_time}")
        if not 0.0 <= self.start < self.end <= math.pi:
            raise ParameterError(
                "start, end: need 0 <= start < end <= 180 degrees, "
                f"got {self.start} and {self.end} rad"
            )

    @property
    def final_time(self) -> float:
        """When it means to have made its last way, s."""
        return self._legs[-1].final_time

    def intended(self, time_s: float) -> tuple[float, float]:
        """Return where the hand means to be.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s.

        Returns
        -------
        tuple of float
            Intended angle, rad, and speed, rad/s.
        """
        leg = self._leg
        if not leg.since <= time_s < leg.until:
            leg = self._leg = self._leg_at(time_s)
        speed = leg.speed
        if leg.cruise_time <= time_s < leg.brake_time:
            return leg.cruise_angle + speed * (time_s - leg.cruise_time), speed
        if time_s <= leg.delay:
            return leg.start, 0.0
        if time_s < leg.cruise_time:
            since = time_s - leg.delay
            rise = speed / leg.ramp_up
            return leg.start + 0.5 * rise * since * since, rise * since
        left = leg.final_time - time_s
        if left <= 0.0:
            return leg.end, 0.0
        fall = speed / leg.ramp_down
        return leg.end - 0.5 * fall * left * left, fall * left

    def _leg_at(self, time_s: float) -> _Leg:
        return next(leg for leg in self._legs if leg.since <= time_s < leg.until)

    def feel(self, time_s: float, torque: float) -> None:
        """Feel nothing: this hand goes on whatever the torque."""


class YieldingHand(SimulatedHand):
    """A hand that slows down where the arm resists, and speeds up where it gives.

    The intention of a `SimulatedHand` is gone through at a rate r between 0 and 1
    that follows 1 / (1 + `yielding`·|τ|) of the torque τ it feels, with a first-order
    lag of `reaction_time`. So the hand brakes after a catch, as a person's does who
    meets a resistance. It is still no model of a person.

    Parameters
    ----------
    start : float
        Where the stretch starts, rad.
    end : float
        Where it is meant to end, rad.
    mean_speed : float
        Speed between the ramps where nothing resists, rad/s.
    slip_time : float or None, optional
        Time after the first reading at which the hand lets go, s; None for never.
    yielding : float, optional
        1/(N·m); the default halves the speed at 10 N·m.
    reaction_time : float, optional
        In s; the default is a long-latency reflex rather than a decision.
    again : sequence of float, optional
        Speeds of the stretches after the first, rad/s.
    rest : float, optional
        How long it rests at either end between them where nothing resists, s.
    returns : bool, optional
        Whether it rests and brings the arm back after the last stretch, too.

    Raises
    ------
    ParameterError
        If a value is outside its range or the ramps take more than the stretch.

    Examples
    --------
    >>> hand = YieldingHand(start=0.5, end=2.5, mean_speed=1.5)
    >>> for tick in range(1000):
    ...     hand.feel(tick * 1e-3, 10.0)
    >>> round(hand.intended(1.0)[1], 2)
    0.75
    """

    __slots__ = ("_felt_at", "_intended_at", "_rate", "_reaction_time", "_yielding")

    yields: ClassVar[bool] = True

    def __init__(
        self,
        *,
        start: float,
        end: float,
        mean_speed: float,
        slip_time: float | None = None,
        yielding: float = 0.1,
        reaction_time: float = 0.08,
        again: Sequence[float] = (),
        rest: float = 0.1,
        returns: bool = False,
    ) -> None:
        super().__init__(
            start=start,
            end=end,
            mean_speed=mean_speed,
            slip_time=slip_time,
            again=again,
            rest=rest,
            returns=returns,
        )
        if not 0.0 <= yielding < math.inf:
            raise ParameterError(f"yielding: needs 0 or more, got {yielding}")
        if not 0.0 < reaction_time < math.inf:
            raise ParameterError(
                f"reaction_time: needs more than 0, got {reaction_time}"
            )
        self._yielding = yielding
        self._reaction_time = reaction_time
        self._rate = 1.0
        self._felt_at = 0.0  # s
        self._intended_at = 0.0  # how far it has gone through its intention, s

    def intended(self, time_s: float) -> tuple[float, float]:
        """Return where the hand means to be, as far as it has felt.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s.

        Returns
        -------
        tuple of float
            Intended angle, rad, and speed, rad/s.
        """
        since = time_s - self._felt_at
        angle, speed = super().intended(self._intended_at + self._rate * since)
        return angle, self._rate * speed

    def feel(self, time_s: float, torque: float) -> None:
        """Adapt the rate to a torque.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s; never earlier than the one before.
        torque : float
            Torque of its spring and damper, N·m.
        """
        since = time_s - self._felt_at
        self._intended_at += self._rate * since
        self._felt_at = time_s
        target = 1.0 / (1.0 + self._yielding * abs(torque))
        share = -math.expm1(-since / self._reaction_time)
        self._rate += share * (target - self._rate)

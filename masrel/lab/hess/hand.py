"""Hands that move a simulated arm: mass, spring and damper, and an intention."""

import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.hess.limits import _check_not_negative, _check_positive

# All of these are our choice: how gently the intended speed rises and falls, s; what
# the hand has learnt to expect, b and k of (1) and the inertia of device and arm, in
# N·m·s/rad, N·m/rad, kg·m²; what a correction adds at most, N·m.
_RAMP_S = 0.15
_EXPECTED_DAMPING, _EXPECTED_STIFFNESS, _EXPECTED_INERTIA = 1.26, 3.15, 0.06
_MOST_CORRECTION = 15.0


# The least and the largest value of what people's hands differ in, each uniform in its
# logarithm and independent of the others; docs/reference/driver.md has the sources.
_PEOPLE = {
    "stiffness": (10.0, 600.0),  # N·m/rad
    "damping_time": (0.03, 0.08),  # damping over stiffness, s
    "inertia": (0.03, 0.2),  # kg·m²
    "tremor": (0.005, 0.03),  # amplitude over the torque of the hand
    "tremor_hz": (8.0, 12.0),
    "reaction_delay": (0.07, 0.32),  # s
    "correction_time": (0.25, 1.0),  # s
}


class Hand(ABC):
    """What moves a simulated arm: mass, spring and damper, and an intention.

    Parameters
    ----------
    start : float
        Where the arm is before the hand moves, rad.
    stiffness : float
        Spring towards the intended angle, N·m/rad.
    damping : float
        Damper towards the intended speed, N·m·s/rad.
    slip_time : float or None
        Time after the first reading at which the hand lets go for good, s; None for
        never.

    Attributes
    ----------
    inertia : float
        What of its own moves with the arm that it holds, kg·m².
    yields : bool
        Whether its intention depends on the torque it feels, which `feel` takes.
    load : float
        Torque of a weight that hangs on the arm, held or not, N·m; positive extends it.

    Raises
    ------
    ParameterError
        If a value is outside its range.
    """

    inertia: float = 0.0
    load: float = 0.0
    yields: ClassVar[bool] = False

    def __init__(
        self,
        *,
        start: float,
        stiffness: float,
        damping: float,
        slip_time: float | None,
    ) -> None:
        _check_positive(stiffness=stiffness, damping=damping)
        if slip_time is not None and not slip_time >= 0.0:
            raise ParameterError(f"slip_time: needs 0 or more, got {slip_time}")
        self.start = start
        self.stiffness = stiffness
        self.damping = damping
        self.slip_time = math.inf if slip_time is None else slip_time

    @abstractmethod
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

    def feel(self, time_s: float, torque: float) -> None:  # noqa: B027 - most feel nothing
        """Take in what the hand feels now.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s; never earlier than the one before.
        torque : float
            Torque of its spring and damper, N·m.
        """


class _Piece(NamedTuple):
    """A piece of the intention with an even acceleration, until the next one begins."""

    begins_s: float
    time_s: float  # at which it has this angle and speed: where it begins or ends
    angle: float  # rad
    speed: float  # rad/s
    acceleration: float  # rad/s²


def _way(
    start: float,
    end: float,
    speed: float,
    *,
    leaves_s: float,
    ramp_up: float,
    ramp_down: float,
) -> list[_Piece]:
    # There or back: a trapezoid of speed, and rest at its end
    way = end - start
    speed = math.copysign(speed, way)  # negative on the way back
    ramps = 0.5 * speed * (ramp_up + ramp_down)
    cruise = way - ramps
    if cruise / speed <= 0.0:
        raise ParameterError(
            f"mean_speed: needs ramps shorter than the stretch, at {abs(speed)} "
            f"rad/s they take {abs(ramps):.3g} of {abs(way):.3g} rad"
        )
    cruise_s = leaves_s + ramp_up
    brake_s = cruise_s + cruise / speed
    rest_s = brake_s + ramp_down
    return [
        _Piece(leaves_s, leaves_s, start, 0.0, speed / ramp_up),
        _Piece(cruise_s, cruise_s, start + 0.5 * speed * ramp_up, speed, 0.0),
        _Piece(brake_s, rest_s, end, 0.0, -speed / ramp_down),
        _Piece(rest_s, rest_s, end, 0.0, 0.0),
    ]


class SimulatedHand(Hand):
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
        _check_positive(
            mean_speed=mean_speed,
            **{f"again[{n}]": speed for n, speed in enumerate(again)},
            return_speed=return_speed,
            ramp_up=ramp_up,
            ramp_down=ramp_down,
        )
        _check_not_negative(delay=delay, follow_through=follow_through, rest=rest)
        super().__init__(
            start=start, stiffness=stiffness, damping=damping, slip_time=slip_time
        )
        if not 0.0 <= start < end <= math.pi:
            raise ParameterError(
                "start, end: need 0 <= start < end <= 180 degrees, "
                f"got {start} and {end} rad"
            )
        self.end = end
        self.mean_speed = mean_speed
        final = end + follow_through
        ways = [(start, final, mean_speed)]  # there, and again back and there
        for speed in again:
            ways += [(final, start, return_speed), (start, final, speed)]
        if returns:
            ways.append((final, start, return_speed))
        self._pieces = [_Piece(-math.inf, 0.0, start, 0.0, 0.0)]  # at rest
        for from_angle, to_angle, speed in ways:
            # No hand is as brisk where it brings the arm back
            is_back = to_angle < from_angle
            self._pieces += _way(
                from_angle,
                to_angle,
                speed,
                leaves_s=delay,
                ramp_up=max(ramp_up, ramp_down) if is_back else ramp_up,
                ramp_down=ramp_down,
            )
            delay = self.final_time + rest
        self._begins = [piece.begins_s for piece in self._pieces]
        self._piece = self._pieces[0]  # the last that was asked for

    @property
    def final_time(self) -> float:
        """When it means to have made its last way, s."""
        return self._pieces[-1].begins_s

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
        self._piece = piece = self._pieces[bisect_right(self._begins, time_s) - 1]
        _, anchor_s, angle, speed, acceleration = piece
        since = time_s - anchor_s
        return (
            angle + (speed + 0.5 * acceleration * since) * since,
            speed + acceleration * since,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class HandTraits:
    """What one person's hand is like, seen from the elbow of the arm it moves.

    Attributes
    ----------
    stiffness : float, optional
        Spring towards the intended angle, N·m/rad.
    damping : float, optional
        Damper towards the intended speed, N·m·s/rad.
    inertia : float, optional
        Of hand and forearm, which move with the arm, kg·m².
    tremor : float, optional
        Amplitude of the tremor, as a share of the torque of the hand.
    tremor_hz : float, optional
        Its frequency, Hz.
    tremor_phase : float, optional
        Its phase at time 0, rad.
    reaction_delay : float, optional
        Time until the hand answers to where the arm is, s.
    correction_time : float, optional
        How long its correction takes to make up for a lag that stays, s.

    Raises
    ------
    ParameterError
        If a value is outside its range.

    Examples
    --------
    >>> HandTraits(stiffness=30.0, damping=1.5).tremor_hz
    9.0
    """

    stiffness: float = 80.0
    damping: float = 4.0
    inertia: float = 0.08
    tremor: float = 0.01
    tremor_hz: float = 9.0
    tremor_phase: float = 0.0
    reaction_delay: float = 0.15
    correction_time: float = 0.5

    def __post_init__(self) -> None:
        _check_not_negative(
            tremor=self.tremor,
            tremor_phase=self.tremor_phase,
            reaction_delay=self.reaction_delay,
        )
        _check_positive(
            stiffness=self.stiffness,
            damping=self.damping,
            inertia=self.inertia,
            tremor_hz=self.tremor_hz,
            correction_time=self.correction_time,
        )

    @classmethod
    def sample(cls, rng: np.random.Generator) -> Self:
        """Draw the hand of one person; ``docs/reference/driver.md`` has the ranges.

        Parameters
        ----------
        rng : numpy.random.Generator
            Where chance comes from.

        Returns
        -------
        HandTraits
            The hand, with a tremor of any phase.

        Examples
        --------
        >>> import numpy as np
        >>> 10.0 <= HandTraits.sample(np.random.default_rng(1)).stiffness <= 600.0
        True
        """
        drawn = {
            name: low * (high / low) ** rng.random()
            for name, (low, high) in _PEOPLE.items()
        }
        return cls(
            damping=drawn.pop("damping_time") * drawn["stiffness"],
            tremor_phase=2.0 * math.pi * rng.random(),
            **drawn,
        )


class HumanHand(SimulatedHand):
    """A hand that stretches the arm as a person might: soft, heavy and late.

    It intends the trapezoid of speed of a `SimulatedHand`, with ramps of 0.15 s. Its
    muscles give the torque it expects, that of an arm before its catch, and besides
    follow the intention through a spring and a damper only. So a catch comes as a
    surprise: the arm falls behind. The deviation is answered a reaction time
    later, by a correction that grows until the arm is where it should be; it adds at
    most 15 N·m. A tremor goes on all the time. The grip is lost at `slip_time` alone.

    Parameters
    ----------
    traits : HandTraits
        What the hand is like.
    start : float
        Where the stretch starts, rad.
    end : float
        Where it is meant to end, rad.
    mean_speed : float
        Speed between the ramps, rad/s.
    slip_time : float or None, optional
        Time after the first reading at which the hand lets go, s; None for never.
    again : sequence of float, optional
        Speeds of the stretches after the first, rad/s.
    return_speed : float, optional
        Speed at which it brings the arm back between two of them, rad/s.
    rest : float, optional
        How long it rests at either end between them, s.
    returns : bool, optional
        Whether it rests and brings the arm back after the last stretch, too.

    Attributes
    ----------
    inertia : float
        What of its own moves with the arm, kg·m².

    Raises
    ------
    ParameterError
        If a value is outside its range or the ramps take more than the stretch.

    Examples
    --------
    An arm that stays at rest has fallen behind; a reaction later the hand pushes more.

    >>> traits = HandTraits(stiffness=30.0, damping=1.5, tremor=0.0)
    >>> hand = HumanHand(traits, start=0.5, end=2.5, mean_speed=1.5)
    >>> soft = HumanHand(traits, start=0.5, end=2.5, mean_speed=1.5)
    >>> for tick in range(1000):
    ...     hand.feel(tick * 1e-3, 20.0)
    >>> hand.intended(1.0)[0] > soft.intended(1.0)[0]
    True
    """

    yields: ClassVar[bool] = True

    def __init__(
        self,
        traits: HandTraits,
        *,
        start: float,
        end: float,
        mean_speed: float,
        slip_time: float | None = None,
        again: Sequence[float] = (),
        return_speed: float = math.radians(60.0),
        rest: float = 0.5,
        returns: bool = False,
    ) -> None:
        super().__init__(
            start=start,
            end=end,
            mean_speed=mean_speed,
            slip_time=slip_time,
            stiffness=traits.stiffness,
            damping=traits.damping,
            ramp_up=_RAMP_S,
            ramp_down=_RAMP_S,
            again=again,
            return_speed=return_speed,
            rest=rest,
            returns=returns,
        )
        self.inertia = traits.inertia
        self._traits = traits
        self._felt_at = 0.0  # s
        self._lag = 0.0  # of the arm behind the intention, rad
        self._lags: deque[tuple[float, float]] = deque()  # when it answers, s; to, rad
        self._correction = 0.0  # N·m
        self._tremor = 0.0  # amplitude, N·m

    def intended(self, time_s: float) -> tuple[float, float]:
        """Return where spring and damper pull the arm.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s.

        Returns
        -------
        tuple of float
            Angle, rad, which has what the muscles give besides, and speed, rad/s.
        """
        angle, speed = super().intended(time_s)
        return angle + self._effort(time_s, angle, speed) / self.stiffness, speed

    def _effort(self, time_s: float, angle: float, speed: float) -> float:
        # What the muscles give besides spring and damper, N·m
        expected = _EXPECTED_DAMPING * speed + _EXPECTED_STIFFNESS * (
            angle - self.start
        )
        piece = self._piece  # of `intended` at this time
        if time_s > piece.begins_s:
            inertia = _EXPECTED_INERTIA + self.inertia
            expected += inertia * piece.acceleration
        turned = 2.0 * math.pi * self._traits.tremor_hz * time_s
        tremor = self._tremor * math.sin(turned + self._traits.tremor_phase)
        return expected + tremor + self._correction

    def feel(self, time_s: float, torque: float) -> None:
        """Feel where the arm is, and correct for where it was a reaction ago.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s; never earlier than the one before.
        torque : float
            Torque of its spring and damper, N·m.
        """
        traits = self._traits
        since = time_s - self._felt_at
        self._felt_at = time_s
        # torque - effort = K·lag + D·lag', which leads the lag on
        stretched = torque - self._effort(time_s, *super().intended(time_s))
        share = -math.expm1(-since * traits.stiffness / traits.damping)
        self._lag += share * (stretched / traits.stiffness - self._lag)
        self._tremor = traits.tremor * abs(torque)
        lags = self._lags
        lags.append((time_s + traits.reaction_delay, self._lag))
        rate = traits.stiffness / traits.correction_time
        while lags and lags[0][0] <= time_s:
            correction = self._correction + rate * since * lags.popleft()[1]
            self._correction = max(-_MOST_CORRECTION, min(correction, _MOST_CORRECTION))

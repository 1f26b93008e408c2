"""The hand of a person on a simulated arm: mass, tremor, and a correction that is late.

In: what the hand is like, or how people's hands are distributed. Out: a `Hand`.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.hess.hand import SimulatedHand

# All of these are our choice: how gently the intended speed rises and falls, s; what
# the hand has learnt to expect, b and k of (1) and the inertia of device and arm, in
# N·m·s/rad, N·m/rad, kg·m²; what a correction adds at most, N·m.
_RAMP_S = 0.15
_EXPECTED_DAMPING, _EXPECTED_STIFFNESS, _EXPECTED_INERTIA = 1.26, 3.15, 0.06
_MOST_CORRECTION = 15.0


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
        for name in ("tremor", "tremor_phase", "reaction_delay"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise ParameterError(f"{name}: needs 0 or more, got {value}")
        for name in ("stiffness", "damping", "inertia", "tremor_hz", "correction_time"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ParameterError(f"{name}: needs more than 0, got {value}")


@dataclass(frozen=True, slots=True, kw_only=True)
class HandDistribution:
    """How the hands of people differ.

    Each attribute is the least and the largest value of a quantity that is uniform in
    its logarithm, independently of the others; ``docs/driver.md`` has the sources.

    Attributes
    ----------
    stiffness : tuple of float, optional
        N·m/rad.
    damping_time : tuple of float, optional
        Damping over stiffness, s.
    inertia : tuple of float, optional
        In kg·m².
    tremor : tuple of float, optional
        Amplitude over the torque of the hand.
    tremor_hz : tuple of float, optional
        In Hz.
    reaction_delay, correction_time : tuple of float, optional
        In s.

    Raises
    ------
    ParameterError
        If a range is not of two finite values above 0 in this order.

    Examples
    --------
    >>> import numpy as np
    >>> traits = HandDistribution().sample(np.random.default_rng(1))
    >>> 10.0 <= traits.stiffness <= 600.0
    True
    """

    stiffness: tuple[float, float] = (10.0, 600.0)
    damping_time: tuple[float, float] = (0.03, 0.08)
    inertia: tuple[float, float] = (0.03, 0.2)
    tremor: tuple[float, float] = (0.005, 0.03)
    tremor_hz: tuple[float, float] = (8.0, 12.0)
    reaction_delay: tuple[float, float] = (0.07, 0.32)
    correction_time: tuple[float, float] = (0.25, 1.0)

    def __post_init__(self) -> None:
        for quantity in fields(self):
            low, high = getattr(self, quantity.name)
            if not 0.0 < low <= high < math.inf:
                raise ParameterError(
                    f"{quantity.name}: needs two finite values above 0 in order, "
                    f"got {low} and {high}"
                )

    def sample(self, rng: np.random.Generator) -> HandTraits:
        """Draw the hand of one person.

        Parameters
        ----------
        rng : numpy.random.Generator
            Where chance comes from.

        Returns
        -------
        HandTraits
            The hand, with a tremor of any phase.
        """
        drawn = {}
        for quantity in fields(self):
            low, high = getattr(self, quantity.name)
            drawn[quantity.name] = low * (high / low) ** rng.random()
        return HandTraits(
            damping=drawn.pop("damping_time") * drawn["stiffness"],
            tremor_phase=2.0 * math.pi * rng.random(),
            **drawn,
        )


class HumanHand(SimulatedHand):
    """A hand that stretches the arm as a person might: soft, heavy and late.

    It intends the trapezoid of speed of a `SimulatedHand`, with ramps of 0.15 s. Its
    muscles give the torque it expects, that of an arm before its catch, and besides
    follow the intention through a spring and a damper only. So a catch comes as a
    surprise: the arm falls behind. Where the hand has been is answered a reaction
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

    __slots__ = (
        "_correction",
        "_felt_at",
        "_lag",
        "_lags",
        "_traits",
        "_tremor",
    )

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
        expected += (_EXPECTED_INERTIA + self.inertia) * self._acceleration(time_s)
        turned = 2.0 * math.pi * self._traits.tremor_hz * time_s
        tremor = self._tremor * math.sin(turned + self._traits.tremor_phase)
        return expected + tremor + self._correction

    def _acceleration(self, time_s: float) -> float:
        leg = self._leg  # of `intended` at this time
        if leg.delay < time_s < leg.cruise_time:
            return leg.speed / leg.ramp_up
        if leg.brake_time < time_s < leg.final_time:
            return -leg.speed / leg.ramp_down
        return 0.0

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

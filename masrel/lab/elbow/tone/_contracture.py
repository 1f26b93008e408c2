"""Contracture: an early, firm end of the range that does not yield, at any speed."""

import math
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, Self

import numpy as np

from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow.tone._model import (
    ToneEvent,
    ToneModel,
    events_at,
    grade_of,
    quantity,
)
from masrel.lab.elbow.tone._passages import OneWay, spans

_FULL_RANGE = math.radians(146.0)
_SHORTENED_DEG = {"1": 10.0, "2": 20.0, "3": 30.0, "4": 40.0}
# A stretch that goes on so far beyond θ_e meets about 10 N·m: as far as a hand goes.
_BEYOND = math.radians(10.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Contracture(ToneModel):
    """A spring, a damper, and a spring that stiffens exponentially at the end.

    τ = K·(θ - θ_r) + B·ω + A·exp(κ·(θ - θ_e)), which goes on with the slope K_max
    beyond θ_cap = θ_e + ln(K_max/(A·κ))/κ.

    Attributes
    ----------
    end_angle : float
        θ_e, rad: where the end is felt. A choice of ours, not from a source.
    stiffness : float
        K, N·m/rad. A choice of ours, not from a source.
    damping : float
        B, N·m·s/rad. A choice of ours, not from a source.
    end_torque : float
        A, N·m: what the end adds at θ_e; 1 N·m as the pendulum model of [1]_ has it.
    end_steepness : float
        κ, 1/rad. A choice of ours, not from a source; that of [1]_ is 3.
    end_stiffness : float
        K_max, N·m/rad: the largest slope of the end. A choice of ours, not from a
        source.
    rest_angle : float
        θ_r, rad: where the spring has no torque. A choice of ours, not from a source.
    range_end : float
        End of the range of motion, rad: how far a hand is meant to go. A choice of
        ours, not from a source.
    speed_threshold : float
        Speed from which the arm counts as moving, rad/s; that of the spastic elbow.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range; the message names it.

    References
    ----------
    .. [1] The limits of the joint in ``pendulumStateDerivative.m`` of PenGulum, the
       pendulum model of De Groote et al. (2018) and Willaert et al. (2020):
       exp(κ(q - q_ref)) at both ends.

    Examples
    --------
    >>> from math import radians
    >>> joint = Contracture.of_severity(3).stepper(0.5)
    >>> round(joint.step(0.0, radians(90), 0.0), 3)
    2.099
    """

    kind: ClassVar[str] = "contracture"
    is_passive: ClassVar[bool] = True

    end_angle: float = quantity(math.radians(115.0), "rad", "angle")
    stiffness: float = quantity(2.0, "N·m/rad", "not negative")
    damping: float = quantity(0.3, "N·m·s/rad", "not negative")
    end_torque: float = quantity(1.0, "N·m", "positive", is_choice=False)
    end_steepness: float = quantity(12.0, "1/rad", "positive")
    end_stiffness: float = quantity(100.0, "N·m/rad", "positive")
    rest_angle: float = quantity(math.radians(30.0), "rad", "angle")
    range_end: float = quantity(math.radians(125.0), "rad", "angle")

    @classmethod
    def of_severity(cls, severity: int) -> Self:
        """Return one that takes 10, 20, 30 or 40 degrees away: a choice of ours.

        Its range of motion ends 10 degrees beyond the end that is felt.
        """
        shorter = math.radians(grade_of(_SHORTENED_DEG, severity, "severity"))
        end = _FULL_RANGE - shorter
        return cls(end_angle=end, range_end=end + _BEYOND)

    @property
    def cap_angle(self) -> float:
        """θ_cap, from which on the torque grows with K_max, rad."""
        logs = map(math.log, (self.end_torque, self.end_steepness))
        rises = math.log(self.end_stiffness) - sum(logs)
        return self.end_angle + rises / self.end_steepness

    def stepper(self, start_angle: float) -> "ContractureStepper":
        """Return the joint as a state machine that has not seen a sample yet."""
        del start_angle  # it has a rest angle of its own
        return ContractureStepper(self)

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        ends = [abs(self._law(at, 0.0)) for at in (start_angle, self.range_end)]
        return max(ends) + self.damping * speed

    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes, over angle and velocity: those at `range_end`."""
        del speed
        beyond = min(self.range_end, self.cap_angle) - self.end_angle
        steep = self.end_torque * self.end_steepness
        return self.stiffness + steep * math.exp(
            self.end_steepness * beyond
        ), self.damping

    def _law(self, angle: float, velocity: float) -> float:
        cap = self.cap_angle
        within = min(angle, cap) - self.end_angle
        end = self.end_torque * math.exp(self.end_steepness * within)
        if angle > cap:
            end += self.end_stiffness * (angle - cap)
        spring = self.stiffness * (angle - self.rest_angle)
        return spring + self.damping * velocity + end

    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return when a motion goes beyond θ_e and θ_cap, in order."""
        times: list[tuple[str, float]] = []
        for name, at in (("end", self.end_angle), ("cap", self.cap_angle)):
            for begun, until in spans(motion, partial(OneWay.beyond, angle=at)):
                times += [(name, begun), (f"{name} left", until)]
        return events_at(motion, times)

    def _torque(
        self, motion: Motion, times: Floats, angle: Floats, velocity: Floats
    ) -> Floats:
        del motion, times
        rows = zip(angle, velocity, strict=True)
        return np.array([self._law(*row) for row in rows])


class ContractureStepper:
    """A contracture at a sample; it has no memory, and nothing is ever triggered."""

    __slots__ = ("_model", "phase")

    def __init__(self, model: Contracture) -> None:
        self._model = model
        self.phase = 0

    def release(self) -> None:
        """Nothing to give up."""

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        del time_s
        return self._model._law(angle, velocity)

"""Dystonia: tone that rises with activity elsewhere, not with the stretch."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow.tone._model import ToneEvent, ToneModel, events_at, quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class Dystonia(ToneModel):
    """A spring towards a posture and a damper, scaled by an activation.

    τ = a·(K·(θ - θ_d) + B·ω), ȧ = (a∞ - a)/T. a∞ is a0 at rest and 1 during an episode,
    which stands for a movement or a touch elsewhere and comes at a fixed time after
    the first sample; T is T_up while the activation rises and T_down while it falls.

    Attributes
    ----------
    stiffness : float
        K, N·m/rad, at full activation. A choice of ours, not from a source.
    damping : float
        B, N·m·s/rad, at full activation. A choice of ours, not from a source.
    posture_angle : float
        θ_d, rad: where the joint is drawn to. A choice of ours, not from a source.
    resting_activation : float
        a0. A choice of ours, not from a source.
    rise_time, fall_time : float
        T_up and T_down, s. A choice of ours, not from a source.
    episode_start, episode_duration : float
        When an episode comes and how long it lasts, s. A choice of ours, not from a
        source.
    range_end, speed_threshold : float
        As of the spastic elbow, rad and rad/s.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range; the message names it.

    References
    ----------
    .. [1] The items of the Hypertonia Assessment Tool: tone or posture that increases
       with a touch or a purposeful movement of a distant part. No equation is known.

    Examples
    --------
    >>> joint = Dystonia().stepper(0.5)
    >>> round(joint.step(0.0, 0.5, 0.0), 4), round(joint.step(1.0, 0.5, 0.0), 4)
    (-0.2795, -0.9596)
    """

    kind: ClassVar[str] = "dystonia"

    stiffness: float = quantity(3.0, "N·m/rad", "not negative")
    damping: float = quantity(0.5, "N·m·s/rad", "not negative")
    posture_angle: float = quantity(math.radians(50.0), "rad", "angle")
    resting_activation: float = quantity(0.25, "", "share")
    rise_time: float = quantity(0.3, "s", "positive")
    fall_time: float = quantity(1.0, "s", "positive")
    episode_start: float = quantity(0.5, "s", "not negative")
    episode_duration: float = quantity(1.0, "s", "not negative")

    def stepper(self, start_angle: float) -> "DystoniaStepper":
        """Return the joint as a state machine that has not seen a sample yet."""
        del start_angle  # it has a posture of its own
        return DystoniaStepper(self)

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        ends = (start_angle, self.range_end)
        off = max(abs(end - self.posture_angle) for end in ends)
        return self.stiffness * off + self.damping * speed

    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes, over angle and velocity: at full activation."""
        del speed
        return self.stiffness, self.damping

    def _activation(self, since: float) -> float:
        # a, so long after the first sample, s: both halves of the solution
        rest, begun = self.resting_activation, since - self.episode_start
        if begun <= 0.0:
            return rest
        risen = min(begun, self.episode_duration)
        highest = 1.0 - (1.0 - rest) * math.exp(-risen / self.rise_time)
        return rest + (highest - rest) * math.exp((risen - begun) / self.fall_time)

    def _law(self, angle: float, velocity: float, activation: float) -> float:
        full = self.stiffness * (angle - self.posture_angle) + self.damping * velocity
        return activation * full

    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return when the episode begins and ends."""
        begun = self.episode_start
        until = begun + self.episode_duration
        return events_at(motion, [("episode", begun), ("episode ends", until)])

    def _torque(
        self, motion: Motion, times: Floats, angle: Floats, velocity: Floats
    ) -> Floats:
        del motion
        rows = zip(angle, velocity, times, strict=True)
        return np.array([self._law(a, v, self._activation(t)) for a, v, t in rows])


class DystoniaStepper:
    """Dystonia that sees one sample at a time."""

    __slots__ = ("_begun", "_is_given_up", "_model", "phase")

    def __init__(self, model: Dystonia) -> None:
        self._model = model
        self._begun = math.nan  # the first sample, s
        self._is_given_up = False
        self.phase = 0

    def release(self) -> None:
        """Go back to the resting activation, and stay there."""
        self._is_given_up = True
        self.phase = 0

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        model = self._model
        if math.isnan(self._begun):
            self._begun = time_s
        since = 0.0 if self._is_given_up else time_s - self._begun
        activation = model._activation(since)
        self.phase = int(activation > model.resting_activation)
        return model._law(angle, velocity, activation)

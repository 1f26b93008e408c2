"""Clonus: beats at a fixed rate after a brisk stretch that is held."""

import math
from dataclasses import dataclass
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
from masrel.lab.elbow.tone._passages import negative, one_way

_IDLE, _BEATS = 0, 1  # positions in masrel.lab.recording.PHASES: pre-catch, catch
_FADE_S = {"3": 2.0, "4": 0.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Clonus(ToneModel):
    """A constant torque, and beats that a fast stretch sets off.

    τ = τ0 + A·exp(-(t - t0)/T)·sin²(π·x/w) for x = frac(f·(t - t0)) < w, and τ0 else. A
    stretch as fast as ω_c at or beyond θ_c sets the beats off, t0 is a delay d later,
    and they go on as long as the stretch is held: until the arm is back by ρ from the
    farthest it has been since, or beyond θ_c. A beat itself throws it back by less.

    Attributes
    ----------
    beat_rate : float
        f, Hz. Clonus of the ankle beats at 3.8 to 5.8 Hz [1]_; the value within is a
        choice of ours, not from a source.
    beat_torque : float
        A, N·m. A choice of ours, not from a source.
    beat_share : float
        w: share of a period that is beat. A choice of ours, not from a source.
    base_torque : float
        τ0, N·m. A choice of ours, not from a source.
    fade_time : float
        T, s; 0 for beats that do not fade. A choice of ours, not from a source.
    trigger_speed : float
        ω_c, rad/s. A choice of ours, not from a source.
    trigger_angle : float
        θ_c, rad. A choice of ours, not from a source.
    return_travel : float
        ρ, rad. A choice of ours, not from a source.
    delay : float
        d, s. The reflex of the ankle follows a stretch after 50 to 70 ms [2]_.
    range_end : float
        End of the range of motion, rad; that of the spastic elbow.
    speed_threshold : float
        ν_th, rad/s; that of the spastic elbow.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range; the message names it.

    References
    ----------
    .. [1] Hidler, J. M. and Rymer, W. Z.: rate and load of clonus. Abstract only.
    .. [2] Agarwal, G. C.: EMG after a stretch. Abstract only.

    Examples
    --------
    >>> joint = Clonus().stepper(0.5)
    >>> joint.step(0.0, 0.5, 0.0), joint.phase
    (1.5, 0)
    """

    kind: ClassVar[str] = "clonus"
    catch_event: ClassVar[str | None] = "trigger"

    beat_rate: float = quantity(5.0, "Hz", "frequency")
    beat_torque: float = quantity(4.0, "N·m", "not negative")
    beat_share: float = quantity(0.4, "", "share")
    base_torque: float = quantity(1.5, "N·m", "not negative")
    fade_time: float = quantity(2.0, "s", "not negative")
    trigger_speed: float = quantity(math.radians(60.0), "rad/s", "positive")
    trigger_angle: float = quantity(math.radians(90.0), "rad", "angle")
    return_travel: float = quantity(math.radians(20.0), "rad", "angle")
    delay: float = quantity(0.060, "s", "not negative", is_choice=False)

    @classmethod
    def of_tardieu(cls, quality: int) -> Self:
        """Return clonus of Tardieu's quality 3, which fades, or 4: choices of ours."""
        return cls(fade_time=grade_of(_FADE_S, quality, "quality"))

    def stepper(self, start_angle: float) -> "ClonusStepper":
        """Return the joint as a state machine that has not seen a sample yet."""
        del start_angle  # it depends on the angle by its trigger only
        return ClonusStepper(self)

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        del start_angle, speed
        return self.base_torque + self.beat_torque

    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes, over angle and velocity: it changes in time."""
        del speed
        return 0.0, 0.0

    def _law(self, since: float) -> float:
        # so long after the first beat began, s
        if since < 0.0 or self.beat_share == 0.0:
            return self.base_torque
        x = math.fmod(since * self.beat_rate, 1.0) / self.beat_share
        if x >= 1.0:
            return self.base_torque
        left = math.exp(-since / self.fade_time) if self.fade_time else 1.0
        beat = math.sin(math.pi * x)
        return self.base_torque + self.beat_torque * left * beat * beat

    def _given_up(self, farthest: float) -> float:
        # where the stretch is given up that has been so far, rad
        return max(self.trigger_angle, farthest - self.return_travel)

    def _trains(self, motion: Motion) -> list[tuple[float, float]]:
        # when a stretch sets beats off and when it is given up, s
        trains: list[tuple[float, float]] = []
        begun, farthest = None, 0.0
        for part in one_way(motion):
            if part.direction > 0:
                if begun is None:
                    far = part.beyond(self.trigger_angle)
                    begun = part.reached(part.faster(self.trigger_speed, 1), far)
                    farthest = 0.0
                farthest = max(farthest, float(part.angle_at(part.end)))
            elif part.direction < 0 and begun is not None:
                until = part.reached(negative(part.beyond(self._given_up(farthest))))
                if until is not None:
                    trains.append((begun, until))
                    begun = None
        return trains if begun is None else [*trains, (begun, math.inf)]

    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return when beats are set off, each beat begins, and they stop."""
        times = []
        for begun, until in self._trains(motion):
            times += [("trigger", begun), ("stop", until)]
            first, last = begun + self.delay, min(until, motion.duration)
            for n in range(max(math.ceil((last - first) * self.beat_rate), 0)):
                times.append(("beat", first + n / self.beat_rate))
        return events_at(motion, times)

    def _torque(
        self, motion: Motion, times: Floats, angle: Floats, velocity: Floats
    ) -> Floats:
        del angle, velocity
        torque = np.full(times.size, self.base_torque)
        for begun, until in self._trains(motion):
            for i in np.flatnonzero((times >= begun) & (times < until)):
                torque[i] = self._law(float(times[i]) - begun - self.delay)
        return torque


class ClonusStepper:
    """Clonus that sees one sample at a time."""

    __slots__ = ("_begun", "_farthest", "_is_released", "_model", "phase")

    def __init__(self, model: Clonus) -> None:
        self._model = model
        self._begun = math.nan  # when the beats were set off, s
        self._farthest = 0.0  # that the arm has been since, rad
        self._is_released = False
        self.phase = _IDLE

    def release(self) -> None:
        """Stop the beats until the arm has been moved back."""
        self._is_released = True
        self.phase = _IDLE

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        model = self._model
        is_far = angle >= model.trigger_angle
        if self._is_released:
            self._is_released = is_far and velocity > -model.speed_threshold
        elif self.phase == _BEATS:
            self._farthest = max(self._farthest, angle)
            if angle < model._given_up(self._farthest):
                self.phase = _IDLE
        elif is_far and velocity >= model.trigger_speed:
            self.phase, self._begun, self._farthest = _BEATS, time_s, angle
        if self.phase == _IDLE:
            return model.base_torque
        return model._law(time_s - self._begun - model.delay)

"""Clasp-knife: resistance that builds with the stretch, then melts all at once."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow._polynomials import Polynomial
from masrel.lab.elbow.tone._model import ToneEvent, ToneModel, events_at, quantity
from masrel.lab.elbow.tone._passages import OneWay, negative, one_way, spans
from masrel.lab.recording import PHASES

_IDLE, _FIRED, _GIVES_WAY = (
    PHASES.index(name) for name in ("pre-catch", "catch", "post-catch")
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaspKnife(ToneModel):
    """A stretch reflex that is let go once its own torque is large enough.

    r = k·[θ - λ + μ·max(ω, 0)]+ is the reflex. Where it is first r_fire or more, at
    t_f and beyond θ_arm, a latch closes, and from t_f + d on the reflex is scaled by
    g = g∞ + (1 - g∞)·exp(-(t - t_f - d)/T): τ = k_p·(θ - θ0) + g·r. The latch opens
    where θ < θ_arm.

    Attributes
    ----------
    threshold : float
        λ, rad: where a stretch at no speed is first resisted. That of MAS 3 in
        `ThresholdReflex.of_mas`.
    threshold_slope : float
        μ, s: how much earlier a faster stretch is. As of MAS 3 there.
    reflex_stiffness : float
        k, N·m/rad. As of MAS 3 there, for a body of 70 kg.
    firing_torque : float
        r_fire, N·m. A choice of ours, not from a source.
    release_delay : float
        d, s. A choice of ours, not from a source.
    release_time : float
        T, s. A choice of ours, not from a source.
    residual_share : float
        g∞. A choice of ours, not from a source.
    arming_angle : float
        θ_arm, rad, at most λ: then nothing jumps where the latch opens. A choice of
        ours, not from a source.
    passive_stiffness : float
        k_p, N·m/rad. A choice of ours, not from a source.
    rest_angle : float or None
        θ0, rad; None means the angle where the stretch starts. A choice of ours, not
        from a source.
    range_end, speed_threshold : float
        As of the spastic elbow, rad and rad/s.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range, or θ_arm is beyond λ; the
        message names it.

    Examples
    --------
    >>> joint = ClaspKnife().stepper(0.5)
    >>> joint.step(0.0, 0.5, 0.0), joint.phase
    (0.0, 0)
    """

    kind: ClassVar[str] = "clasp-knife"
    catch_event: ClassVar[str | None] = "fire"

    threshold: float = quantity(math.radians(56.27), "rad", "angle", is_choice=False)
    threshold_slope: float = quantity(0.25, "s", "not negative", is_choice=False)
    reflex_stiffness: float = quantity(3.32, "N·m/rad", "positive", is_choice=False)
    firing_torque: float = quantity(3.0, "N·m", "positive")
    release_delay: float = quantity(0.050, "s", "not negative")
    release_time: float = quantity(0.120, "s", "positive")
    residual_share: float = quantity(0.2, "", "share")
    arming_angle: float = quantity(math.radians(50.0), "rad", "angle")
    passive_stiffness: float = quantity(0.65, "N·m/rad", "not negative")
    rest_angle: float | None = quantity(None, "rad", "angle")

    def _check_together(self) -> None:
        if self.arming_angle > self.threshold:
            raise ParameterError(
                f"arming_angle: needs at most threshold, {self.threshold:g} rad, "
                f"got {self.arming_angle:g} rad"
            )

    def stepper(self, start_angle: float) -> "ClaspKnifeStepper":
        """Return the joint as a state machine that has not seen a sample yet."""
        return ClaspKnifeStepper(self, start_angle)

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        rest = self._rest(start_angle)
        off = max(abs(start_angle - rest), abs(self.range_end - rest))
        return self.passive_stiffness * off + self._reflex(self.range_end, speed)

    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes, over angle and velocity: before the release."""
        del speed
        reflex = self.reflex_stiffness
        return self.passive_stiffness + reflex, reflex * self.threshold_slope

    def _rest(self, start_angle: float) -> float:
        return start_angle if self.rest_angle is None else self.rest_angle

    def _reflex(self, angle: float, velocity: float) -> float:
        early = self.threshold_slope * max(velocity, 0.0)
        return self.reflex_stiffness * max(angle - self.threshold + early, 0.0)

    def _scale(self, since: float) -> float:
        # g, so long after the latch closed, s
        released = since - self.release_delay
        if released <= 0.0:
            return 1.0
        left = math.exp(-released / self.release_time)
        return self.residual_share + (1.0 - self.residual_share) * left

    def _law(self, angle: float, velocity: float, rest: float, scale: float) -> float:
        passive = self.passive_stiffness * (angle - rest)
        return passive + scale * self._reflex(angle, velocity)

    def _beyond(self, part: OneWay, angle: float) -> Polynomial:
        # how far θ + μ·max(ω, 0) is beyond an angle
        lead = self.threshold_slope if part.direction > 0 else 0.0
        return part.beyond(angle, lead)

    def _latched(self, motion: Motion) -> list[tuple[float, float]]:
        # when the latch closes and opens, s; the last may never open
        latched: list[tuple[float, float]] = []
        closed: float | None = None
        fires_at = self.threshold + self.firing_torque / self.reflex_stiffness
        for part in one_way(motion):
            armed, since = part.beyond(self.arming_angle), part.start
            if closed is not None and part.direction < 0:
                opened = part.reached(negative(armed))
                if opened is not None:
                    latched.append((closed, opened))
                    closed, since = None, opened
            if closed is None:
                fires = self._beyond(part, fires_at)
                closed = part.reached(fires, armed, after=since)
        return latched if closed is None else [*latched, (closed, math.inf)]

    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return when the reflex sets in, fires, gives way, ends and is armed again."""
        times = []
        reflex = spans(motion, lambda part: self._beyond(part, self.threshold))
        for begun, until in reflex:
            times += [("reflex", begun), ("reflex ends", until)]
        for closed, opened in self._latched(motion):
            times += [("fire", closed), ("arm", opened)]
            if closed + self.release_delay < opened:
                times.append(("release", closed + self.release_delay))
        return events_at(motion, times)

    def _torque(
        self, motion: Motion, times: Floats, angle: Floats, velocity: Floats
    ) -> Floats:
        rest = self._rest(motion.start)
        scale = np.ones(times.size)
        for closed, opened in self._latched(motion):
            for i in np.flatnonzero((times >= closed) & (times < opened)):
                scale[i] = self._scale(float(times[i]) - closed)
        rows = zip(angle, velocity, scale, strict=True)
        return np.array([self._law(a, v, rest, g) for a, v, g in rows])


class ClaspKnifeStepper:
    """A clasp-knife that sees one sample at a time."""

    __slots__ = ("_fired", "_is_given_up", "_model", "_rest", "phase")

    def __init__(self, model: ClaspKnife, start_angle: float) -> None:
        self._model = model
        self._rest = model._rest(start_angle)
        self._fired = math.nan  # when the latch closed, s
        self._is_given_up = False
        self.phase = _IDLE

    def release(self) -> None:
        """Give the reflex up until the arm has been moved back beyond θ_arm."""
        self._is_given_up = True
        self.phase = _IDLE

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        model = self._model
        if angle < model.arming_angle:
            self.phase, self._is_given_up = _IDLE, False
        if self._is_given_up:
            return model._law(angle, velocity, self._rest, 0.0)
        if self.phase == _IDLE:
            force = model._reflex(angle, velocity)
            if angle < model.arming_angle or force < model.firing_torque:
                return model._law(angle, velocity, self._rest, 1.0)
            self._fired = time_s
        since = time_s - self._fired
        self.phase = _FIRED if since < model.release_delay else _GIVES_WAY
        return model._law(angle, velocity, self._rest, model._scale(since))

"""Threshold stretch reflex: nothing, then resistance, the earlier the faster."""

import math
from collections import deque
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow.tone._model import (
    ToneEvent,
    ToneModel,
    events_at,
    grade_of,
    quantity,
)
from masrel.lab.elbow.tone._passages import spans

_MAS = {"0": 0.0, "1": 1.0, "1+": 1.5, "2": 2.0, "3": 3.0, "4": 4.0}
_OFF, _ON = 0, 1  # positions in masrel.lab.recording.PHASES: pre-catch, catch
_ROUNDING_S = 1e-6  # a sample as old as the delay but for this is old enough


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdReflex(ToneModel):
    """A reflex beyond an angle that comes earlier the faster the stretch.

    τ = k_p·(θ - θ0) + b_p·ω + min((k + k_v·max(ω', 0))·[θ' - λ + μ·ω']+, τ_max), where
    θ' and ω' are those of a time d ago. λ - μ·ω is the dynamic threshold, λ the tonic
    one (TSRT). With k_v above 0 the reflex grows stiffer with the speed.

    Attributes
    ----------
    threshold : float
        λ, rad. The default is that of MAS 2 in [1]_.
    threshold_slope : float
        μ, s, of [1]_.
    reflex_stiffness : float
        k, N·m/rad; of [1]_ for MAS 2 and a body of 70 kg.
    stiffening : float
        k_v, N·m·s/rad²: by how much k grows with the speed. 0, as in [1]_.
    largest_reflex : float or None
        τ_max, N·m; None for no limit, as in [1]_.
    delay : float
        d, s. 30 ms, as two published simulators of spasticity set it.
    passive_stiffness : float
        k_p, N·m/rad. A choice of ours, not from a source.
    passive_damping : float
        b_p, N·m·s/rad. A choice of ours, not from a source.
    rest_angle : float or None
        θ0, rad; None means the angle where the stretch starts. A choice of ours, not
        from a source.
    range_end, speed_threshold : float
        As of the spastic elbow, rad and rad/s.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range; the message names it.

    References
    ----------
    .. [1] The text of a public model of the arm (``defineSpasticity.m``), which cites
       Levin and Feldman (2003) for λ and μ and McCrea et al. (2003) for k. There λ is
       counted from the start of the movement; the papers were not seen.

    Examples
    --------
    >>> joint = ThresholdReflex.of_mas("2").stepper(0.5)
    >>> joint.step(0.0, 0.5, 0.0), joint.phase
    (0.0, 0)
    """

    kind: ClassVar[str] = "threshold-stretch-reflex"
    catch_event: ClassVar[str | None] = "reflex"

    threshold: float = quantity(math.radians(61.97), "rad", "angle", is_choice=False)
    threshold_slope: float = quantity(0.25, "s", "not negative", is_choice=False)
    reflex_stiffness: float = quantity(
        2.430, "N·m/rad", "not negative", is_choice=False
    )
    stiffening: float = quantity(0.0, "N·m·s/rad²", "not negative", is_choice=False)
    largest_reflex: float | None = quantity(None, "N·m", "positive", is_choice=False)
    delay: float = quantity(0.030, "s", "not negative", is_choice=False)
    passive_stiffness: float = quantity(0.65, "N·m/rad", "not negative")
    passive_damping: float = quantity(0.1, "N·m·s/rad", "not negative")
    rest_angle: float | None = quantity(None, "rad", "angle")

    @classmethod
    def of_mas(cls, grade: str, *, body_mass: float = 70.0) -> Self:
        """Return the reflex of a grade of the MAS, and of a body of so many kg."""
        mas = grade_of(_MAS, grade, "grade")
        if not 0.0 < body_mass < math.inf:
            raise ParameterError(f"body_mass: needs more than 0, got {body_mass} kg")
        per_degree = (2.22e-4 * mas + 1.62e-4) * body_mass
        return cls(
            threshold=math.radians(73.37 - 5.70 * mas),
            reflex_stiffness=per_degree / math.radians(1.0),
        )

    @classmethod
    def stiffening_with_speed(cls) -> Self:
        """Return a reflex whose slope, not threshold, depends on the speed.

        The numbers are choices of ours, near a published curve of one elbow; that
        stiffness carries most of the dependence on speed is McPherson et al.'s (2018).
        """
        return cls(
            threshold=math.radians(96.4),
            threshold_slope=0.0,
            reflex_stiffness=4.0,
            stiffening=6.3,
            largest_reflex=7.2,
            passive_stiffness=0.0,
            passive_damping=0.0,
        )

    def stepper(self, start_angle: float) -> "ThresholdReflexStepper":
        """Return the joint as a state machine that has not seen a sample yet."""
        return ThresholdReflexStepper(self, start_angle)

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        rest = self._rest(start_angle)
        off = max(abs(start_angle - rest), abs(self.range_end - rest))
        passive = self.passive_stiffness * off + self.passive_damping * speed
        return passive + self._reflex(self.range_end, speed)

    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes, over angle and velocity, of those of a speed."""
        stiffness = self.reflex_stiffness + self.stiffening * speed
        over = max(self.range_end - self.threshold + self.threshold_slope * speed, 0.0)
        damping = stiffness * self.threshold_slope + self.stiffening * over
        return self.passive_stiffness + stiffness, self.passive_damping + damping

    def _rest(self, start_angle: float) -> float:
        return start_angle if self.rest_angle is None else self.rest_angle

    def _passive(self, angle: float, velocity: float, rest: float) -> float:
        return self.passive_stiffness * (angle - rest) + self.passive_damping * velocity

    def _reflex(self, angle: float, velocity: float) -> float:
        # of the late angle and velocity
        over = angle - self.threshold + self.threshold_slope * velocity
        if over <= 0.0:
            return 0.0
        stiffness = self.reflex_stiffness + self.stiffening * max(velocity, 0.0)
        torque = stiffness * over
        limit = self.largest_reflex
        return torque if limit is None else min(torque, limit)

    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return when the threshold is met and left, and the reflex a delay later."""
        times = []
        angle, lead = self.threshold, self.threshold_slope
        for begun, until in spans(motion, lambda part: part.beyond(angle, lead)):
            times += [("threshold", begun), ("reflex", begun + self.delay)]
            times += [("threshold left", until), ("reflex ends", until + self.delay)]
        return events_at(motion, times)

    def _torque(
        self, motion: Motion, times: Floats, angle: Floats, velocity: Floats
    ) -> Floats:
        rest, late = self._rest(motion.start), np.maximum(times - self.delay, 0.0)
        moved = times >= self.delay  # before that the arm rests where it starts
        late_velocity = np.where(moved, motion.velocity(late), 0.0)
        passive = zip(angle, velocity, strict=True)
        reflex = zip(motion.angle(late), late_velocity, strict=True)
        return np.array(
            [
                self._passive(a, v, rest) + self._reflex(*sample)
                for (a, v), sample in zip(passive, reflex, strict=True)
            ]
        )


class ThresholdReflexStepper:
    """A threshold reflex that sees one sample at a time."""

    __slots__ = ("_is_given_up", "_late", "_model", "_rest", "phase")

    def __init__(self, model: ThresholdReflex, start_angle: float) -> None:
        self._model = model
        self._rest = model._rest(start_angle)
        self._late = _DelayLine(model.delay)
        self._is_given_up = False
        self.phase = _OFF

    def release(self) -> None:
        """Give the reflex up until the arm has been back below its threshold."""
        self._is_given_up = True
        self.phase = _OFF

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        model = self._model
        reflex = model._reflex(*self._late.step(time_s, angle, velocity))
        if reflex == 0.0:
            self._is_given_up = False
        elif self._is_given_up:
            reflex = 0.0
        self.phase = _ON if reflex > 0.0 else _OFF
        return model._passive(angle, velocity, self._rest) + reflex


class _DelayLine:
    """Give the latest sample that is as old as the delay.

    At a regular rate that is a whole number of samples; after a missed tick the line
    is still right. Before the first sample is old enough the arm is taken to have
    rested where it was then.
    """

    __slots__ = ("_delay", "_late", "_samples")

    def __init__(self, delay: float) -> None:
        self._delay = delay - _ROUNDING_S
        self._samples: deque[tuple[float, float, float]] = deque()
        self._late: tuple[float, float] | None = None

    def step(self, time_s: float, angle: float, velocity: float) -> tuple[float, float]:
        """Take a sample in -> angle, rad, and velocity, rad/s, of the late one."""
        samples = self._samples
        samples.append((time_s, angle, velocity))
        late = self._late or (angle, 0.0)
        while samples and time_s - samples[0][0] >= self._delay:
            late = samples.popleft()[1:]
        self._late = late
        return late

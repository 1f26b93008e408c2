"""Other tone: laws of the joint besides the paper's spastic elbow; SI units inside.

Also all of them by name, and the Tardieu scale's angles of any.

Each is a frozen dataclass of its parameters with its law, `_law`: the torque of an
angle, a velocity, the rest angle, and what the joint remembers. What that is at a time
of a motion says `_memory`; what it is at a sample, `_sampled`, which keeps in between
what `_kept` lists.
"""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np

from masrel._input import refuse
from masrel.errors import ParameterError
from masrel.lab.elbow._events import events
from masrel.lab.elbow._polynomials import (
    Number,
    Polynomial,
    greatest,
    least,
    pick,
)
from masrel.lab.elbow.joint_model import (
    Quantity,
    ToneEvent,
    ToneModel,
    ToneStepper,
    grade_of,
    quantity,
)
from masrel.lab.elbow.motions import (
    ConstantSpeed,
    Floats,
    Motion,
    OneWay,
    latched,
    movements,
    one_way,
    spans,
)
from masrel.lab.elbow.parameters import (
    CATCH,
    POST_CATCH,
    PRE_CATCH,
    ElbowParameters,
)

__all__ = [
    "ClaspKnife",
    "Clonus",
    "Cogwheel",
    "Contracture",
    "Dystonia",
    "LeadPipe",
    "Quantity",
    "ThresholdReflex",
    "ToneEvent",
    "ToneModel",
]

# F N·m, K N·m/rad, B N·m·s/rad by the UPDRS score of rigidity: choices of ours
_BY_UPDRS = {
    "0": (0.0, 0.5, 0.05),
    "1": (0.4, 0.7, 0.10),
    "2": (0.8, 1.0, 0.15),
    "3": (1.6, 1.4, 0.20),
    "4": (3.2, 2.0, 0.30),
}
_MAS = {"0": 0.0, "1": 1.0, "1+": 1.5, "2": 2.0, "3": 3.0, "4": 4.0}
_FADE_S = {"3": 2.0, "4": 0.0}
_TARDIEU_SPEEDS = (math.radians(10.0), math.radians(100.0), math.radians(150.0))
_FULL_RANGE = math.radians(146.0)
_SHORTENED_DEG = {"1": 10.0, "2": 20.0, "3": 30.0, "4": 40.0}
# A stretch that goes on so far beyond θ_e meets about 10 N·m: as far as a hand goes.
_BEYOND = math.radians(10.0)


def _functions(number: Number) -> Any:
    # the module of functions such as exp, of a float or of a column
    return np if isinstance(number, np.ndarray) else math


def _farthest(joint: ToneModel, start_angle: float, rest: float) -> float:
    # from a rest angle, from there to the end of the range, rad
    return max(abs(start_angle - rest), abs(joint.range_end - rest))


def _since(latches: list[tuple[float, float]], times: Floats) -> Floats:
    # how long a latch is closed at times, s; -inf where none is
    since = np.full(times.size, -math.inf)
    for closed, opened in latches:
        mine = (times >= closed) & (times < opened)
        since[mine] = times[mine] - closed
    return since


@dataclass(frozen=True, slots=True, kw_only=True)
class LeadPipe(ToneModel):
    """Rigidity as a spring, a damper and a bristle that sticks and slips.

    τ = K·(θ - θ0) + B·ω + F·z/z_c, where the bristle follows the arm and slips at ±z_c:
    z ← clip(z + Δθ, -z_c, z_c), 0 in the beginning. The bristle does not depend on the
    speed and holds the limb where it is put, as long as ``K·|θ - θ0|`` is at most F.

    Attributes
    ----------
    coulomb_torque : float
        F, N·m: torque of the slipping bristle. The default is that of UPDRS 3, a
        choice of ours, not from a source.
    stiffness : float
        K, N·m/rad. A choice of ours, not from a source.
    damping : float
        B, N·m·s/rad. A choice of ours, not from a source.
    bristle_travel : float
        z_c, rad: how far the bristle bends before it slips. A choice of ours, not
        from a source.
    rest_angle : float
        θ0, rad: where the spring has no torque. A choice of ours, not from a source.
    range_end : float
        End of the range of motion, rad; that of the spastic elbow.
    speed_threshold : float
        Speed from which the arm counts as moving, rad/s; that of the spastic elbow.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range; the message names it.

    References
    ----------
    .. [1] Endo, T. et al. (2009; 2015): rigidity of the elbow as an elastic
       coefficient and a difference of bias between extension and flexion, which grows
       with the speed. Abstracts only.
    .. [2] Park, H. S. et al. (2011): spring and damper at the wrist. Abstract only.

    Examples
    --------
    >>> joint = LeadPipe.of_updrs(3).stepper(0.5)
    >>> round(joint.step(0.0, 0.5, 0.0), 4), round(joint.step(0.1, 0.6, 1.0), 4)
    (-0.7661, 1.1739)
    """

    kind: ClassVar[str] = "lead-pipe-rigidity"
    is_passive: ClassVar[bool] = True
    _kept: ClassVar[dict[str, Any]] = {"angle": math.nan, "bristle": 0.0}

    coulomb_torque: float = quantity(1.6, "N·m", "not negative")
    stiffness: float = quantity(1.4, "N·m/rad", "not negative")
    damping: float = quantity(0.2, "N·m·s/rad", "not negative")
    bristle_travel: float = quantity(math.radians(2.0), "rad", "positive")
    rest_angle: float = quantity(math.radians(60.0), "rad", "angle")

    @classmethod
    def of_updrs(cls, score: int) -> Self:
        """Return the rigidity of a UPDRS score, 0 to 4: a choice of ours."""
        torque, stiffness, damping = grade_of(_BY_UPDRS, score, "score")
        return cls(coulomb_torque=torque, stiffness=stiffness, damping=damping)

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        off = _farthest(self, start_angle, self.rest_angle)
        return self.stiffness * off + self.damping * speed + self.coulomb_torque

    def largest_slope(self, *, speed: float) -> tuple[float, float]:  # noqa: ARG002 - as all
        """Return the largest slopes, over angle and velocity: a bristle that sticks."""
        return self.stiffness + self.coulomb_torque / self.bristle_travel, self.damping

    def _law(
        self, angle: Number, velocity: Number, rest: float, *memory: Number
    ) -> Number:
        spring = self.stiffness * (angle - rest) + self.damping * velocity
        return spring + self.coulomb_torque * memory[0] / self.bristle_travel

    def _sampled(
        self, joint: ToneStepper, _time_s: float, angle: float, _velocity: float
    ) -> tuple[float, ...]:
        kept = joint.kept
        if joint.is_given_up:  # a release straightens the bristle
            kept.bristle, joint.is_given_up = 0.0, False
        if not math.isnan(kept.angle):  # the first sample finds it straight
            moved, limit = kept.bristle + angle - kept.angle, self.bristle_travel
            kept.bristle = min(max(moved, -limit), limit)
        kept.angle = angle
        return (kept.bristle,)

    def _events(self, motion: Motion) -> Iterator[tuple[str, float]]:
        # when the bristle slips and sticks
        slips = 0
        for part, bent in self._bends(motion):
            way = part.direction
            if not way:
                continue
            if slips == -way:
                yield "stick", part.start
                slips = 0
            if not slips:
                slips_at = part.angle[0] - bent + way * self.bristle_travel
                time = part.reached([way * c for c in part.beyond(slips_at)])
                if time is not None:
                    yield "slip", time
                    slips = way

    def _bends(self, motion: Motion) -> Iterator[tuple[OneWay, float]]:
        # parts that go one way, and how far the bristle is bent where they start, rad
        bent, limit = 0.0, self.bristle_travel
        for part in one_way(motion):
            yield part, bent
            moved = bent + part.angle_at(part.end) - part.angle[0]
            bent = min(max(moved, -limit), limit)

    def _memory(self, motion: Motion, times: Floats) -> list[Floats]:
        limit, parts = self.bristle_travel, list(self._bends(motion))
        starts = [part.start for part, _ in parts]
        which = np.searchsorted(starts, times, side="right") - 1
        before = np.array([bent - part.angle[0] for part, bent in parts])
        return [np.clip(before[which] + motion.angle(times), -limit, limit)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cogwheel(LeadPipe):
    """Rigidity that gives way f times a second while the arm moves.

    τ = τ_lead-pipe - m·g·F·z/z_c, where g is 1 in the last share d of every period 1/f
    since the movement began, and 0 else. A movement begins where the arm becomes as
    fast as ω_th and ends where it becomes slower or turns. A gap opens and closes
    along a raised cosine.

    Attributes
    ----------
    gap_rate : float
        f, Hz. 6 to 9 Hz is the postural tremor, cited from memory; the value is a
        choice of ours, not from a source.
    gap_depth : float
        m: share of the bristle's torque that a gap takes, at most 1. A choice of
        ours, not from a source.
    gap_share : float
        d: share of a period that is gap. A choice of ours, not from a source.
    gap_edge : float
        How long a gap takes to open, and to close, s; 0 for steps. A choice of ours,
        not from a source.
    movement_speed : float
        ω_th, rad/s. A choice of ours, not from a source.
    coulomb_torque, stiffness, damping, bristle_travel, rest_angle : float
        As of `LeadPipe`. A choice of ours, not from a source.
    range_end, speed_threshold : float
        As of the spastic elbow, rad and rad/s.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range, or the edges are longer
        than a gap; the message names it.

    Examples
    --------
    >>> joint = Cogwheel.of_updrs(3)
    >>> round(joint.gap_rate, 1), round(joint.coulomb_torque, 1)
    (6.0, 1.6)
    """

    kind: ClassVar[str] = "cogwheel-rigidity"
    _kept: ClassVar[dict[str, Any]] = {
        **LeadPipe._kept,
        "way": 0,  # of the movement, 0 at rest
        "onset": 0.0,  # s
        "ended": -math.inf,  # when the movement before ended, s
        "last": 0.0,  # how far its last gap was open
    }
    is_passive: ClassVar[bool] = False  # a gap that ends while it sticks pushes

    gap_rate: float = quantity(6.0, "Hz", "frequency")
    gap_depth: float = quantity(0.5, "", "share")
    gap_share: float = quantity(0.4, "", "share")
    gap_edge: float = quantity(0.010, "s", "not negative")
    movement_speed: float = quantity(math.radians(5.0), "rad/s", "positive")

    def _check_together(self) -> None:
        longest = 0.5 * self.gap_share / self.gap_rate
        if self.gap_edge > longest:
            raise ParameterError(
                f"gap_edge: needs at most half a gap, {longest:g} s, "
                f"got {self.gap_edge:g} s"
            )

    def _gap(self, since: Number) -> Number:
        # how far a gap is open, 0 to 1, so long after the onset of the movement, s
        period = 1.0 / self.gap_rate
        # a gap that begins now but for rounding has begun
        left = period - _functions(since).fmod(since + 1e-12, period)
        inside = self.gap_share * period - left
        is_open = _edge(inside, self.gap_edge) * _edge(left, self.gap_edge)
        return pick(inside < 0.0, 0.0, is_open)

    def _closing(self, last: float, over: Number) -> Number:
        # a gap in which the movement ended closes as any other does
        return last * (1.0 - _edge(over, self.gap_edge))

    def _law(
        self, angle: Number, velocity: Number, rest: float, *memory: Number
    ) -> Number:
        bristle, gap = memory
        torque = LeadPipe._law(self, angle, velocity, rest, bristle)
        lost = self.gap_depth * gap * self.coulomb_torque
        return torque - lost * bristle / self.bristle_travel

    def _sampled(
        self, joint: ToneStepper, time_s: float, angle: float, velocity: float
    ) -> tuple[float, ...]:
        kept = joint.kept
        if joint.is_given_up:  # a release begins anew
            kept.way, kept.last = 0, 0.0
        slow = abs(velocity) < self.movement_speed
        way = 0 if slow else (1 if velocity > 0.0 else -1)
        if way != kept.way:
            if kept.way:
                kept.last = self._gap(time_s - kept.onset)
                kept.ended = time_s
            kept.way, kept.onset = way, time_s
        gap = self._gap(time_s - kept.onset) if way else 0.0
        gap += self._closing(kept.last, time_s - kept.ended)
        return (*LeadPipe._sampled(self, joint, time_s, angle, velocity), gap)

    def _events(self, motion: Motion) -> Iterator[tuple[str, float]]:
        # when gaps begin and end, too
        yield from LeadPipe._events(self, motion)
        period = 1.0 / self.gap_rate
        for begun, until in movements(motion, self.movement_speed):
            for n in range(math.ceil((until - begun) * self.gap_rate)):
                opens = begun + (n + 1.0 - self.gap_share) * period
                closes = min(begun + (n + 1.0) * period, until)
                if opens < until:
                    yield from (("gap", opens), ("gap ends", closes))

    def _memory(self, motion: Motion, times: Floats) -> list[Floats]:
        gap = np.zeros(times.size)
        for begun, until in movements(motion, self.movement_speed):
            last = self._gap(until - begun)
            mine = (times >= begun) & (times < until + self.gap_edge)
            since, over = times[mine] - begun, times[mine] - until
            closing = self._closing(last, over)
            gap[mine] += np.where(over < 0.0, self._gap(since), closing)
        return [*LeadPipe._memory(self, motion, times), gap]


def _edge(since: Number, length: float) -> Number:
    # a raised cosine from 0 to 1 over `length`
    share = least(since / length, 1.0) if length else 1.0
    return 0.5 - 0.5 * _functions(share).cos(math.pi * share)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaspKnife(ToneModel):
    """A stretch reflex that is let go once its own torque is large enough.

    r = k·[θ - λ + μ·max(ω, 0)]+ is the reflex. At t_f, when it first reaches r_fire
    beyond θ_arm, a latch closes, and from t_f + d on the reflex is scaled by
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
    _kept: ClassVar[dict[str, Any]] = {"fired": math.nan}  # when the latch closed, s
    catch_event: ClassVar[str | None] = "fire"
    _phases: ClassVar[dict[str, int]] = {
        "fire": CATCH,
        "release": POST_CATCH,
        "arm": PRE_CATCH,
    }

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

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        off = _farthest(self, start_angle, self.rest_from(start_angle))
        return self.passive_stiffness * off + float(self._reflex(self.range_end, speed))

    def largest_slope(self, *, speed: float) -> tuple[float, float]:  # noqa: ARG002 - as all
        """Return the largest slopes, over angle and velocity: before the release."""
        reflex = self.reflex_stiffness
        return self.passive_stiffness + reflex, reflex * self.threshold_slope

    def _reflex(self, angle: Number, velocity: Number) -> Number:
        early = self.threshold_slope * greatest(velocity, 0.0)
        return self.reflex_stiffness * greatest(angle - self.threshold + early, 0.0)

    def _scale(self, since: Number) -> Number:
        # g, so long after the latch closed, s
        released = greatest(since - self.release_delay, 0.0)
        left = _functions(released).exp(-released / self.release_time)
        return self.residual_share + (1.0 - self.residual_share) * left

    def _law(
        self, angle: Number, velocity: Number, rest: float, *memory: Number
    ) -> Number:
        passive = self.passive_stiffness * (angle - rest)
        return passive + memory[0] * self._reflex(angle, velocity)

    def _sampled(
        self, joint: ToneStepper, time_s: float, angle: float, velocity: float
    ) -> tuple[float, ...]:
        # a release gives it up until the arm is back beyond θ_arm
        if angle < self.arming_angle:
            joint.phase, joint.is_given_up = PRE_CATCH, False
        if joint.is_given_up:
            return (0.0,)
        if joint.phase == PRE_CATCH:
            force = self._reflex(angle, velocity)
            if angle < self.arming_angle or force < self.firing_torque:
                return (1.0,)
            joint.kept.fired = time_s
        since = time_s - joint.kept.fired
        joint.phase = CATCH if since < self.release_delay else POST_CATCH
        return (self._scale(since),)

    def _beyond(self, part: OneWay, angle: float) -> Polynomial:
        # how far θ + μ·max(ω, 0) is beyond an angle
        lead = self.threshold_slope if part.direction > 0 else 0.0
        return part.beyond(angle, lead)

    def _latched(self, motion: Motion) -> list[tuple[float, float]]:
        # when the latch closes and opens, s; the last may never open
        fires_at = self.threshold + self.firing_torque / self.reflex_stiffness
        return latched(
            motion,
            lambda part: (
                self._beyond(part, fires_at),
                part.beyond(self.arming_angle),
            ),
            lambda _: self.arming_angle,
        )

    def _events(self, motion: Motion) -> Iterator[tuple[str, float]]:
        # when the reflex sets in, fires, gives way, ends and is armed again
        reflex = spans(motion, lambda part: self._beyond(part, self.threshold))
        for begun, until in reflex:
            yield from (("reflex", begun), ("reflex ends", until))
        for closed, opened in self._latched(motion):
            yield from (("fire", closed), ("arm", opened))
            if closed + self.release_delay < opened:
                yield "release", closed + self.release_delay

    def _memory(self, motion: Motion, times: Floats) -> list[Floats]:
        return [self._scale(_since(self._latched(motion), times))]


@dataclass(frozen=True, slots=True, kw_only=True)
class Contracture(ToneModel):
    """A spring, a damper, and a spring that stiffens exponentially at the end.

    τ = K·(θ - θ_r) + B·ω + A·exp(κ·(θ - θ_e)), which continues with the slope K_max
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
        End of the range of motion, rad: the angle that a hand is meant to reach. Our
        choice, not from a source.
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

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        rest = self.rest_angle
        ends = [abs(self._law(at, 0.0, rest)) for at in (start_angle, self.range_end)]
        return float(max(ends)) + self.damping * speed

    def largest_slope(self, *, speed: float) -> tuple[float, float]:  # noqa: ARG002 - as all
        """Return the largest slopes, over angle and velocity: those at `range_end`."""
        beyond = min(self.range_end, self.cap_angle) - self.end_angle
        steep = self.end_torque * self.end_steepness
        return self.stiffness + steep * math.exp(
            self.end_steepness * beyond
        ), self.damping

    def _law(self, angle: Number, velocity: Number, rest: float, *_: Number) -> Number:
        cap = self.cap_angle
        within = least(angle, cap) - self.end_angle
        end = self.end_torque * _functions(within).exp(self.end_steepness * within)
        beyond = self.end_stiffness * greatest(angle - cap, 0.0)
        return self.stiffness * (angle - rest) + self.damping * velocity + end + beyond

    def _events(self, motion: Motion) -> Iterator[tuple[str, float]]:
        # when it goes beyond θ_e and θ_cap
        for name, at in (("end", self.end_angle), ("cap", self.cap_angle)):
            for begun, until in spans(motion, partial(OneWay.beyond, angle=at)):
                yield from ((name, begun), (f"{name} left", until))


@dataclass(frozen=True, slots=True, kw_only=True)
class Dystonia(ToneModel):
    """A spring towards a posture and a damper, scaled by an activation.

    τ = a·(K·(θ - θ_d) + B·ω), ȧ = (a∞ - a)/T. a∞ is a0 at rest and 1 during an episode,
    which represents a movement or a touch elsewhere and comes at a fixed time after
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
    _phases: ClassVar[dict[str, int]] = {"episode": CATCH}
    _kept: ClassVar[dict[str, Any]] = {"begun": math.nan}  # the first sample, s

    stiffness: float = quantity(3.0, "N·m/rad", "not negative")
    damping: float = quantity(0.5, "N·m·s/rad", "not negative")
    posture_angle: float = quantity(math.radians(50.0), "rad", "angle")
    resting_activation: float = quantity(0.25, "", "share")
    rise_time: float = quantity(0.3, "s", "positive")
    fall_time: float = quantity(1.0, "s", "positive")
    episode_start: float = quantity(0.5, "s", "not negative")
    episode_duration: float = quantity(1.0, "s", "not negative")

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        off = _farthest(self, start_angle, self.posture_angle)
        return self.stiffness * off + self.damping * speed

    def largest_slope(self, *, speed: float) -> tuple[float, float]:  # noqa: ARG002 - as all
        """Return the largest slopes, over angle and velocity: at full activation."""
        return self.stiffness, self.damping

    def _activation(self, since: Number) -> Number:
        # a, so long after the first sample, s: both halves of the solution
        rest, begun = self.resting_activation, greatest(since - self.episode_start, 0.0)
        risen, exp = least(begun, self.episode_duration), _functions(since).exp
        highest = 1.0 - (1.0 - rest) * exp(-risen / self.rise_time)
        more = (highest - rest) * exp((risen - begun) / self.fall_time)
        return rest + pick(begun > 0.0, more, 0.0)

    def _law(
        self, angle: Number, velocity: Number, _rest: float, *memory: Number
    ) -> Number:
        full = self.stiffness * (angle - self.posture_angle) + self.damping * velocity
        return memory[0] * full

    def _sampled(
        self, joint: ToneStepper, time_s: float, _angle: float, _velocity: float
    ) -> tuple[float, ...]:
        kept = joint.kept
        if math.isnan(kept.begun):
            kept.begun = time_s
        # once released it stays at its resting activation
        since = 0.0 if joint.is_given_up else time_s - kept.begun
        activation = self._activation(since)
        joint.phase = int(activation > self.resting_activation)
        return (activation,)

    def _events(self, _motion: Motion) -> Iterator[tuple[str, float]]:
        yield "episode", self.episode_start
        yield "episode ends", self.episode_start + self.episode_duration

    def _memory(self, _motion: Motion, times: Floats) -> list[Floats]:
        return [self._activation(times)]


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
    _kept: ClassVar[dict[str, Any]] = {
        "begun": math.nan,  # when the beats were set off, s
        "farthest": 0.0,  # that the arm has been since, rad
    }
    catch_event: ClassVar[str | None] = "trigger"
    _phases: ClassVar[dict[str, int]] = {"trigger": CATCH, "stop": PRE_CATCH}

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

    def largest_torque(self, *, start_angle: float, speed: float) -> float:  # noqa: ARG002 - as all
        """Return the largest torque of a stretch and the way back, N·m."""
        return self.base_torque + self.beat_torque

    def largest_slope(self, *, speed: float) -> tuple[float, float]:  # noqa: ARG002 - as all
        """Return the largest slopes, over angle and velocity: it changes in time."""
        return 0.0, 0.0

    def _law(
        self, _angle: Number, _velocity: Number, _rest: float, *memory: Number
    ) -> Number:
        since = greatest(memory[0], 0.0)  # the first beat began, s
        functions = _functions(since)
        x = functions.fmod(since * self.beat_rate, 1.0) / (self.beat_share or math.inf)
        left = functions.exp(-since / self.fade_time) if self.fade_time else 1.0
        beat = self.beat_torque * left * functions.sin(math.pi * x) ** 2
        return self.base_torque + pick((memory[0] >= 0.0) & (x < 1.0), beat, 0.0)

    def _sampled(
        self, joint: ToneStepper, time_s: float, angle: float, velocity: float
    ) -> tuple[float, ...]:
        # a release stops the beats until the arm has been moved back
        kept, is_far = joint.kept, angle >= self.trigger_angle
        if joint.is_given_up:
            joint.is_given_up = is_far and velocity > -self.speed_threshold
        elif joint.phase == CATCH:
            kept.farthest = max(kept.farthest, angle)
            if angle < self._given_up(kept.farthest):
                joint.phase = PRE_CATCH
        elif is_far and velocity >= self.trigger_speed:
            joint.phase, kept.begun, kept.farthest = CATCH, time_s, angle
        idle = joint.phase == PRE_CATCH
        return (-math.inf if idle else time_s - kept.begun - self.delay,)

    def _given_up(self, farthest: float) -> float:
        # where the stretch is given up that has been so far, rad
        return max(self.trigger_angle, farthest - self.return_travel)

    def _trains(self, motion: Motion) -> list[tuple[float, float]]:
        # when a stretch sets beats off and when it is given up, s
        return latched(
            motion,
            lambda part: (
                part.faster(self.trigger_speed, 1),
                part.beyond(self.trigger_angle),
            ),
            self._given_up,
        )

    def _events(self, motion: Motion) -> Iterator[tuple[str, float]]:
        # when beats are set off, each beat begins, and they stop
        for begun, until in self._trains(motion):
            yield from (("trigger", begun), ("stop", until))
            first, last = begun + self.delay, min(until, motion.duration)
            for n in range(max(math.ceil((last - first) * self.beat_rate), 0)):
                yield "beat", first + n / self.beat_rate

    def _memory(self, motion: Motion, times: Floats) -> list[Floats]:
        return [_since(self._trains(motion), times) - self.delay]


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
    _kept: ClassVar[dict[str, Any]] = {
        "samples": deque(),  # younger than the delay: s, rad, rad/s
        "late": None,  # the latest of the others: rad, rad/s
    }
    catch_event: ClassVar[str | None] = "reflex"
    _phases: ClassVar[dict[str, int]] = {"reflex": CATCH, "reflex ends": PRE_CATCH}

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
        """Return the reflex of a grade of the MAS, and of a body of this mass in kg."""
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

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        off = _farthest(self, start_angle, self.rest_from(start_angle))
        passive = self.passive_stiffness * off + self.passive_damping * speed
        return passive + float(self._reflex(self.range_end, speed))

    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes, over angle and velocity, of those of a speed."""
        stiffness = self.reflex_stiffness + self.stiffening * speed
        over = max(self.range_end - self.threshold + self.threshold_slope * speed, 0.0)
        damping = stiffness * self.threshold_slope + self.stiffening * over
        return self.passive_stiffness + stiffness, self.passive_damping + damping

    def _law(
        self, angle: Number, velocity: Number, rest: float, *memory: Number
    ) -> Number:
        spring = self.passive_stiffness * (angle - rest)
        return spring + self.passive_damping * velocity + memory[0]

    def _reflex(self, angle: Number, velocity: Number) -> Number:
        # of the late angle and velocity
        over = greatest(angle - self.threshold + self.threshold_slope * velocity, 0.0)
        stiffness = self.reflex_stiffness + self.stiffening * greatest(velocity, 0.0)
        return least(stiffness * over, self.largest_reflex or math.inf)

    def _sampled(
        self, joint: ToneStepper, time_s: float, angle: float, velocity: float
    ) -> tuple[float, ...]:
        # The late sample is the latest that is as old as the delay: at a regular rate
        # that is a whole number of samples, and after a missed tick it is still right.
        # Before the first is old enough the arm is taken to have rested where it was.
        kept = joint.kept
        kept.samples.append((time_s, angle, velocity))
        kept.late = kept.late or (angle, 0.0)
        # a sample as old as the delay but for rounding is old enough
        while kept.samples and time_s - kept.samples[0][0] >= self.delay - 1e-6:
            kept.late = kept.samples.popleft()[1:]
        reflex = self._reflex(*kept.late)
        if reflex == 0.0:
            joint.is_given_up = False
        elif joint.is_given_up:  # by a release, until the arm is back below it
            reflex = 0.0
        joint.phase = CATCH if reflex > 0.0 else PRE_CATCH
        return (reflex,)

    def _events(self, motion: Motion) -> Iterator[tuple[str, float]]:
        # when the threshold is met and left, and the reflex a delay later
        angle, lead = self.threshold, self.threshold_slope
        for begun, until in spans(motion, lambda part: part.beyond(angle, lead)):
            yield from (("threshold", begun), ("reflex", begun + self.delay))
            yield from (("threshold left", until), ("reflex ends", until + self.delay))

    def _memory(self, motion: Motion, times: Floats) -> list[Floats]:
        late = np.maximum(times - self.delay, 0.0)
        # before that the arm rests where it starts
        velocity = np.where(times >= self.delay, motion.velocity(late), 0.0)
        return [self._reflex(motion.angle(late), velocity)]


JointModel = ElbowParameters | ToneModel
"""A law of the joint with its parameters, in SI units."""

_LAWS: tuple[type[JointModel], ...] = (
    ElbowParameters,
    LeadPipe,
    Cogwheel,
    ClaspKnife,
    Contracture,
    Dystonia,
    Clonus,
    ThresholdReflex,
)

MODELS: dict[str, type[JointModel]] = {law.kind: law for law in _LAWS}
"""Every law by the name of its kind; `kind = "..."` of a protocol file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tardieu:
    """What three stretches of a joint at constant speed show.

    Attributes
    ----------
    speeds : tuple of three floats
        V1, V2 and V3, rad/s.
    catch_angles : tuple of three floats or None
        Where the joint catches at V1, V2 and V3, rad; None where it does not.
    range_angle : float
        R2, rad: how far the joint goes at V1, the end of its range of motion.

    References
    ----------
    .. [1] Boyd, R. N. and Graham, H. K. (1999). Objective measurement of clinical
       findings in the use of botulinum toxin type A for the management of children
       with cerebral palsy. European Journal of Neurology, 6(S4), S23-S35.
       https://doi.org/10.1111/j.1468-1331.1999.tb00031.x
    """

    speeds: tuple[float, float, float]
    catch_angles: tuple[float | None, float | None, float | None]
    range_angle: float

    @property
    def catch_angle(self) -> float:
        """R1, rad: where the joint catches at V3, or R2 where nothing catches."""
        caught = self.catch_angles[2]
        return self.range_angle if caught is None else caught

    @property
    def difference(self) -> float:
        """R2 - R1, rad: large for what depends on the speed, 0 for a contracture."""
        return self.range_angle - self.catch_angle


def tardieu(
    model: JointModel,
    *,
    start_angle: float = math.radians(30.0),
    speeds: tuple[float, float, float] = _TARDIEU_SPEEDS,
) -> Tardieu:
    """Stretch a joint at three speeds, and say where it catches.

    The catch is where the phase "catch" begins, a root of the motion: nothing is
    stepped.

    Parameters
    ----------
    model : JointModel
        The joint, one of `MODELS`.
    start_angle : float, optional
        Where each stretch starts, rad.
    speeds : tuple of three floats, optional
        V1 (as slow as possible), V2 (a limb that falls) and V3 (as fast as possible),
        rad/s, each faster than the one before. The defaults, 10, 100 and 150 deg/s,
        are choices of ours: a forearm that falls is faster than a device may be.

    Returns
    -------
    Tardieu
        R1, R2 and the catch at each speed.

    Raises
    ------
    ParameterError
        If the speeds are not above 0 and in order, the stretch starts at or beyond
        the end of range, or the model offers no exact events.

    Examples
    --------
    >>> from math import degrees
    >>> from masrel.lab.elbow import STANDARD_MODELS
    >>> result = tardieu(STANDARD_MODELS["HM1"])
    >>> round(degrees(result.catch_angle), 6), round(degrees(result.difference), 6)
    (77.5, 68.5)
    """
    slow, falling, fast = speeds
    refuse(
        (
            not 0.0 < slow < falling < fast < math.inf,
            "speeds: need three above 0 deg/s, each faster than the one before, got "
            + ", ".join(f"{math.degrees(speed):g}" for speed in speeds),
        ),
        (
            not 0.0 <= start_angle < model.range_end,
            f"start_angle: needs 0 to less than {math.degrees(model.range_end):g} "
            f"degrees, the end of range, got {math.degrees(start_angle):g} degrees",
        ),
    )
    first, second, third = (_caught(model, start_angle, speed) for speed in speeds)
    return Tardieu(
        speeds=speeds,
        catch_angles=(first, second, third),
        range_angle=model.range_end,
    )


def _caught(model: JointModel, start: float, speed: float) -> float | None:
    stretch = ConstantSpeed(start=start, end=model.range_end, speed=speed)
    if isinstance(model, ElbowParameters):
        return events(model, stretch).catch_angle
    if not isinstance(model, ToneModel):
        raise ParameterError(
            f"model: needs one with exact events, got {type(model).__name__}"
        )
    for event in model.events(stretch):
        if event.name == model.catch_event:
            return event.angle
    return None

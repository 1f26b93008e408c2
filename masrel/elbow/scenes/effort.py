"""Peak torque, residual, work and impulse of many stretches, in closed form.

In: where the events are, and the motions as functions of time. Every law is linear in
angle, speed and acceleration, and every motion a polynomial, so that a phase's integral
is known at both of its ends.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1), (3) and (5).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.course import Courses, Flags
from masrel.elbow.scenes.table import Joints, Motions

__all__ = ["Efforts", "Path"]

_Law = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """A kind of motion as functions of time, for one column of times.

    Attributes
    ----------
    travel : callable
        Angle gone since the start, rad.
    velocity : callable
        rad/s.
    acceleration : callable
        rad/s².
    is_steady : bool
        Whether the velocity is constant.
    travel_integral : callable
        ∫ travel dt from the start, rad s.
    square_integral : callable
        ∫ velocity² dt from the start, rad²/s.
    turning : callable
        From a stiffness and a damping, the time before which stiffness · travel +
        damping · velocity rises and after which it falls, s.
    """

    travel: _Law
    velocity: _Law
    acceleration: _Law
    is_steady: bool
    travel_integral: _Law
    square_integral: _Law
    turning: Callable[[Floats, Floats], Floats]


class Efforts:
    """What many stretches ask for; each answer is computed when it is asked for.

    Parameters
    ----------
    joints : Joints
        The joints.
    motions : Motions
        The stretches, all of one kind.
    courses : Courses
        Their events.
    path : Path
        The functions of the kind.
    """

    def __init__(
        self, joints: Joints, motions: Motions, courses: Courses, path: Path
    ) -> None:
        self.joints, self.path = joints, path
        end = courses.end.high
        catch = np.where(courses.catches, courses.catch.high, end)
        catch_end = np.where(courses.leaves, courses.catch_end.high, end)
        self.times = _Times(
            catch=catch,
            peak_end=np.minimum(catch + joints.peak_duration, catch_end),
            catch_end=catch_end,
            post_end=np.where(courses.slows, courses.post_end.high, end),
            leaves=courses.leaves,
            slows=courses.slows,
        )
        rest = joints.rest_angle
        # angle above θ_rest at the start
        self.offset = np.where(np.isnan(rest), 0.0, motions.start - rest)
        self.pre_end = self._pre(catch)
        self.rise = joints.catch_torque_constant * courses.catch_speed.high
        self.caught: Flags = courses.catches
        self.end = end

    def _pre(self, t: Floats) -> Floats:
        j, path = self.joints, self.path  # (1)
        spring = j.stiffness * (self.offset + path.travel(t))
        return np.asarray(
            j.damping * path.velocity(t) + spring + j.inertia * path.acceleration(t)
        )

    @property
    def residual_torque(self) -> Floats:
        """Torque after the peak, N·m; nan without a catch."""
        level = self.pre_end + self.joints.residual_share * self.rise
        return np.where(self.caught, level, np.nan)

    def unknown(self, output: str) -> Flags:
        """Return where an output needs more than closed forms."""
        joints, times = self.joints, self.times
        is_smooth = self.caught & (joints.catch_rise > 0.0)
        if output == "residual_torque":
            return np.zeros_like(self.caught)
        if output == "work" and not self.path.is_steady:
            return is_smooth
        # a smoothed onset that the catch does not outlast
        is_cut = is_smooth & (times.catch + joints.catch_rise >= times.catch_end)
        if output == "peak_torque" and not self.path.is_steady:
            return is_cut | (joints.inertia > 0.0)
        return is_cut

    @property
    def _missing(self) -> Floats:
        # a smoothed onset lacks half of its rise on average: ∫ (1 - 3y² + 2y³) dy
        return np.where(self.caught, 0.5 * self.rise * self.joints.catch_rise, 0.0)

    @property
    def peak_torque(self) -> Floats:
        """Largest torque, N·m."""
        t, j = self.times, self.joints
        turn = self.path.turning(j.stiffness, j.damping)
        largest = self._pre(np.minimum(turn, t.catch))
        peak = np.maximum(largest, self.pre_end + self.rise)
        largest = np.where(self.caught, peak, largest)
        last = self._pre(np.clip(turn, t.post_end, self.end))
        largest = np.where(t.slows, np.maximum(largest, last), largest)
        extra = np.where(j.is_additive, j.stiffness, 0.0)
        damping = np.where(j.is_additive, j.damping, 0.0)
        turn = self.path.turning(j.post_catch_stiffness + extra, damping)
        place = np.clip(turn, t.catch_end, t.post_end)
        gone = self.path.travel(place) - self.path.travel(t.catch_end)
        base = np.where(j.is_additive, self._pre(place), self.pre_end)
        residual = j.residual_share * self.rise
        top = base + residual + j.post_catch_stiffness * gone  # (5)
        lasts = t.leaves & (t.post_end > t.catch_end)
        return np.where(lasts, np.maximum(largest, top), largest)

    @property
    def work(self) -> Floats:
        """∫ τ dθ, J."""
        t, j, path = self.times, self.joints, self.path
        peak = path.travel(t.peak_end) - path.travel(t.catch)
        residual = path.travel(t.catch_end) - path.travel(t.peak_end)
        gone = path.travel(t.post_end) - path.travel(t.catch_end)
        total = self._pre_work(np.zeros_like(t.catch), t.catch)
        total = total + (self.pre_end + self.rise) * peak
        total = total + (self.pre_end + j.residual_share * self.rise) * residual
        total = total + j.residual_share * self.rise * gone
        total = total - self._missing * path.velocity(t.catch)  # where it is constant
        total = total + 0.5 * j.post_catch_stiffness * gone * gone
        kinetic = (
            0.5
            * j.inertia
            * (path.velocity(t.post_end) ** 2 - path.velocity(t.catch_end) ** 2)
        )
        own = self.pre_end * gone + kinetic
        total = total + np.where(
            j.is_additive, self._pre_work(t.catch_end, t.post_end), own
        )
        return np.asarray(total + self._pre_work(t.post_end, self.end))

    def _pre_work(self, low: Floats, high: Floats) -> Floats:
        j, path = self.joints, self.path
        a, b = path.travel(low), path.travel(high)
        spring = j.stiffness * (b - a) * (self.offset + 0.5 * (a + b))
        square = path.square_integral(high) - path.square_integral(low)
        kinetic = 0.5 * j.inertia * (path.velocity(high) ** 2 - path.velocity(low) ** 2)
        return np.asarray(spring + j.damping * square + kinetic)

    @property
    def impulse(self) -> Floats:
        """∫ τ dt, N·m·s."""
        t, j, path = self.times, self.joints, self.path
        lasts = t.post_end - t.catch_end
        climbed = path.travel_integral(t.post_end) - path.travel_integral(t.catch_end)
        climbed = climbed - lasts * path.travel(t.catch_end)
        total = self._pre_impulse(np.zeros_like(t.catch), t.catch)
        total = total + (self.pre_end + self.rise) * (t.peak_end - t.catch)
        total = total - self._missing
        share = j.residual_share * self.rise
        total = total + (self.pre_end + share) * (t.catch_end - t.peak_end)
        total = total + share * lasts + j.post_catch_stiffness * climbed
        swing = j.inertia * (path.velocity(t.post_end) - path.velocity(t.catch_end))
        own = self.pre_end * lasts + swing
        total = total + np.where(
            j.is_additive, self._pre_impulse(t.catch_end, t.post_end), own
        )
        return np.asarray(total + self._pre_impulse(t.post_end, self.end))

    def _pre_impulse(self, low: Floats, high: Floats) -> Floats:
        j, path = self.joints, self.path
        angles = path.travel_integral(high) - path.travel_integral(low)
        spring = j.stiffness * (self.offset * (high - low) + angles)
        gone = path.travel(high) - path.travel(low)
        swing = path.velocity(high) - path.velocity(low)
        return np.asarray(spring + j.damping * gone + j.inertia * swing)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Times:
    """Times of the phases; one that is not reached begins and ends at the end."""

    catch: Floats
    peak_end: Floats
    catch_end: Floats
    post_end: Floats
    leaves: Flags
    slows: Flags

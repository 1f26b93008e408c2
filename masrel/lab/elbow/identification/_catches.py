"""The catch of a stretch: when it begins and ends, and what is read off it.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II and equations (1) to (5).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.lab.elbow.identification._changes import Changes, find_changes
from masrel.lab.elbow.identification._clusters import Rows
from masrel.lab.elbow.identification._stretches import (
    Pace,
    Part,
    Stretch,
    filtered_part,
    part_of,
    state_at_break,
)
from masrel.lab.elbow.parameters import ElbowParameters

_Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """What an arm and a sensor have beside the law, SI units; 0 is not there.

    `gravity` is m·g·l, whose torque is 0 at `gravity_angle`; `arm_inertia` acts in
    every phase; `lag` is the sensor's time constant; `drift` is N·m/s, of single trials
    in `drifts`.
    """

    gravity: float = 0.0
    gravity_angle: float = 0.0
    arm_inertia: float = 0.0
    lag: float = 0.0
    catch_rise: float = 0.0
    fits_inertia: bool = False
    drift: float = 0.0
    drifts: Mapping[str, float] = field(default_factory=dict)

    @property
    def takes_time(self) -> bool:
        """Return whether the torque that is read takes time to step."""
        return self.lag > 0.0 or self.catch_rise > 0.0

    def torque(self, part: Part, trial: str) -> _Floats:
        """Return what weight, inertia and drift add to the torque, N·m."""
        weight = self.gravity * np.sin(part.angle - self.gravity_angle)
        drift = self.drifts.get(trial, self.drift) * part.time
        return np.asarray(weight + self.arm_inertia * part.acceleration + drift)


@dataclass(frozen=True, slots=True, kw_only=True)
class PreCatchLaw:
    """b, k and m of (1)."""

    damping: float
    stiffness: float
    inertia: float

    def torque(self, part: Part) -> _Floats:
        """Return the torque of (1) without the constant k·θ_rest, N·m."""
        law = self.damping * part.velocity + self.stiffness * part.angle
        return np.asarray(law + self.inertia * part.acceleration)

    def at(self, catch: "Catch") -> float:
        """Return the torque of (1) at the start of a catch, without the constant."""
        law = self.damping * catch.speed + self.stiffness * catch.angle
        return law + self.inertia * catch.acceleration


@dataclass(frozen=True, slots=True, kw_only=True)
class Catch:
    """The catch of one stretch; SI units, its start between two samples."""

    time: float
    angle: float
    speed: float
    acceleration: float  # just before it
    mean_speed: float  # from movement onset, v̄ of (2)
    speed_gain: float  # dv̄/dθ, 1/s
    end: float | None  # None if the stretch ends within it
    travel: float  # up to its end or the stretch's
    mean_catch_speed: float  # v̄_c of (4)
    within_peak: bool  # it ends before the peak does
    residual_sd: float  # of torque about the law of the change points, N·m


# A speed that reaches the threshold in less time jumps, s.
_JUMP = 0.03

# A catch of a fit that is further from the one that was looked for is none, s.
_NEAR = 0.02

# Samples this near to a step of torque are left out: it falls between two, s.
_GUARD = 0.002

# Windows of the filter of angle and torque before a catch, s. An encoder's steps take
# long when the joint moves slowly.
SLOW_WINDOW, _FAST_WINDOW = 0.25, 0.1

# Windows of the filter of the angle after a catch, s: where its acceleration is a
# regressor, an encoder's steps must not be.
_AFTER_WINDOW, _PUSHED_WINDOW = 0.06, 0.09


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One stretch, as the fits see it; SI units.

    `pre_catch` holds samples before the catch, `after` those from it until the hand is
    slow again (None if unusable); `remark` says what is not used of it, and why.
    """

    name: str
    pace: Pace
    start: float
    duration: float
    peak_speed: float
    rest_angle: float
    pre_catch: Part
    after: Part | None = None
    catch: Catch | None = None
    remark: str = ""


def slow_trial(stretch: Stretch, name: str) -> Trial:
    """Return a slow stretch as one pre-catch phase (section II.B)."""
    unusable = stretch.in_gap | stretch.saturated
    lost = int(unusable.sum())
    whole = filtered_part(stretch, unusable, (0, stretch.time.size), SLOW_WINDOW)
    remark = f"{lost} samples missing or saturated" if lost else ""
    return _trial(stretch, name, whole, remark=remark)


def fast_trial(
    stretch: Stretch,
    name: str,
    constants: ElbowParameters,
    law: PreCatchLaw,
    window: float,
    arm: Arm | None = None,
    instant: float | None = None,
) -> Trial:
    """Return a fast stretch with its catch, or a remark that says why it has none.

    The catch is looked for; where a fit has it begin (`instant`) goes before if that is
    near.
    """
    arm = arm or Arm()
    nothing = part_of(stretch, slice(0, 0))
    onset, stop = _fast_part(stretch, constants.speed_threshold, window)
    if stretch.in_gap[:stop].any():
        why = "not used: a gap in the recording"
        return _trial(stretch, name, nothing, remark=why)
    changes = _changes(stretch, name, constants, law, arm, (onset, stop))
    catch = None
    if changes.catch is not None:
        half = 0.5 * stretch.samples.period  # between two samples
        start, end = (
            None if at is None else float(stretch.time[at]) - half
            for at in (changes.catch, changes.end)
        )
        if instant is not None and abs(instant - (start or 0.0)) < _NEAR:
            start = instant
        instants = start or 0.0, end
        catch = _catch_at(stretch, (onset, stop), instants, constants, changes)
    if catch is None:
        why = "not used: no catch that stands out of the noise"
        return _trial(stretch, name, nothing, remark=why)
    first = int(np.searchsorted(stretch.time, catch.time))
    before = filtered_part(stretch, stretch.saturated, (0, first), _FAST_WINDOW)
    if stretch.saturated[:stop].any():
        why = "torque is saturated: nothing after the catch is used"
    elif before.time.size == 0:
        why = "it catches at once: no torque before the catch to compare with"
    else:
        smooth_end = constants.post_catch == "additive" or law.inertia != 0.0
        after = _after(stretch, (first, stop), catch, constants, arm, smooth_end)
        return _trial(stretch, name, before, after=after, catch=catch)
    return _trial(stretch, name, before, catch=catch, remark=why)


def _trial(
    stretch: Stretch,
    name: str,
    pre_catch: Part,
    *,
    after: Part | None = None,
    catch: Catch | None = None,
    remark: str = "",
) -> Trial:
    return Trial(
        name=name,
        pace=stretch.pace,
        start=float(stretch.time[0]),
        duration=float(stretch.time[-1] - stretch.time[0]),
        peak_speed=stretch.peak_speed,
        rest_angle=stretch.rest_angle,
        pre_catch=pre_catch,
        after=after,
        catch=catch,
        remark=remark,
    )


def _fast_part(stretch: Stretch, limit: float, window: float) -> tuple[int, int]:
    # sample of movement onset, and the first at which the hand is slow again
    velocity = stretch.velocity
    fastest = int(np.argmax(velocity))
    slow = np.flatnonzero(velocity[fastest:] < limit)
    stop = fastest + int(slow[0]) if slow.size else velocity.size
    # the filter sees a hand stop half a window late or early
    stop = max(fastest, stop - round(0.5 * window / stretch.samples.period))
    return int(np.argmax(velocity >= limit)), stop


def _changes(
    stretch: Stretch,
    name: str,
    constants: ElbowParameters,
    law: PreCatchLaw,
    arm: Arm,
    ends: tuple[int, int],
) -> Changes:
    onset, stop = ends
    part = part_of(stretch, slice(0, stop))
    if stop == 0:
        return Changes(catch=None, end=None, residual_sd=math.nan)
    return find_changes(
        part.torque - arm.torque(part, name),
        law.torque(part),
        part.angle,
        first=onset,
        peak=round(constants.peak_duration / stretch.samples.period),
        additive=constants.post_catch == "additive",
        pushed=law.inertia * part.acceleration if law.inertia else None,
        gaps=(
            round((arm.catch_rise + 3.0 * arm.lag) / stretch.samples.period),
            round(3.0 * arm.lag / stretch.samples.period),
        ),
    )


def _catch_at(
    stretch: Stretch,
    ends: tuple[int, int],
    instants: tuple[float, float | None],
    constants: ElbowParameters,
    changes: Changes,
) -> Catch | None:
    # motion and travel of a catch; None if the joint hardly moves there
    time, period = stretch.time, stretch.samples.period
    instant, end = instants
    reach = slice(stretch.start, stretch.start + ends[1])
    angle, speed, acceleration = state_at_break(
        stretch.samples.time[reach], stretch.samples.angle[reach], instant
    )
    onset, onset_angle = _crossing(stretch, ends[0], constants.speed_threshold)
    if not (instant > onset and angle > onset_angle and speed > 0.0):
        return None
    mean_speed = (angle - onset_angle) / (instant - onset)
    last = float(time[ends[1] - 1]) if end is None else end
    if not last > instant:
        return None
    travel = float(np.interp(last, time, stretch.angle)) - angle
    peak_end = instant + constants.peak_duration
    return Catch(
        time=instant,
        angle=angle,
        speed=speed,
        acceleration=acceleration,
        mean_speed=mean_speed,
        # d/dθ of (θ - θ_on)/(t - t_on), with dt = dθ/ω
        speed_gain=(1.0 - mean_speed / speed) / (instant - onset),
        end=end,
        travel=travel,
        mean_catch_speed=travel / (last - instant),
        within_peak=end is not None and end < peak_end - 2.0 * period,
        residual_sd=changes.residual_sd,
    )


def _crossing(stretch: Stretch, place: int, limit: float) -> tuple[float, float]:
    # time and angle at which the speed reaches the limit, between two samples
    time = float(stretch.time[place])
    if stretch.acceleration[place] > limit / _JUMP:
        return _jump(stretch, time)
    if place == 0:
        return time, float(stretch.angle[0])
    low, high = stretch.velocity[place - 1], stretch.velocity[place]
    time -= stretch.samples.period * float((high - limit) / (high - low))
    return time, float(np.interp(time, stretch.time, stretch.angle))


def _jump(stretch: Stretch, near: float) -> tuple[float, float]:
    # where a motor starts at once, which a filter of speeds sees before it is: rest,
    # and a parabola from an instant on, by least squares
    samples = stretch.samples
    window = np.abs(samples.time - near) <= 3.0 * _JUMP
    time, angle = samples.time[window], samples.angle[window]
    best, squares = near, math.inf
    for instant in time[(time > near - _JUMP) & (time < near + 2.0 * _JUMP)].tolist():
        since = np.maximum(time - instant, 0.0)
        design = np.stack([np.ones_like(since), since, since**2], axis=1)
        values = np.linalg.lstsq(design, angle, rcond=None)[0]
        left = float(((angle - design @ values) ** 2).sum())
        if left < squares:
            best, squares = instant, left
    return best, stretch.rest_angle


def _after(
    stretch: Stretch,
    ends: tuple[int, int],
    catch: Catch,
    constants: ElbowParameters,
    arm: Arm,
    smooth_end: bool,
) -> Part:
    # samples from the catch on, without those next to a step of torque
    pushes = arm.arm_inertia != 0.0 or arm.fits_inertia
    window = _PUSHED_WINDOW if pushes else _AFTER_WINDOW
    part = part_of(stretch, slice(*ends), anew=window)
    if catch.end is not None and smooth_end:
        # speed and acceleration are regressors here, as they are before the catch
        first = int(np.searchsorted(stretch.time, catch.end))
        later = filtered_part(
            stretch, stretch.saturated, (first, ends[1]), _FAST_WINDOW
        )
        part = part.keep(part.time < catch.end).then(later)
    if arm.lag > 0.0:  # no step passes a sensor that lags
        return part
    steps = [catch.time + constants.peak_duration]
    if arm.catch_rise == 0.0:
        steps.append(catch.time)
    if catch.end is not None:
        steps[0] = min(steps[0], catch.end)
        if constants.post_catch == "additive":
            steps.append(catch.end)
    near = np.min([np.abs(part.time - step) for step in steps], axis=0) < _GUARD
    return part.keep(~near)


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchLevels:
    """Peak and residual above the end of pre-catch (N·m), and the climb after it.

    The residual is ``nan`` if nothing was recorded after the peak; the climb is torque
    above the residual against the angle travelled since.
    """

    peak: float
    residual: float
    climb: Rows = field(repr=False)


def catch_levels(
    trial: Trial, law: PreCatchLaw, constants: ElbowParameters, arm: Arm | None = None
) -> CatchLevels | None:
    """Return what is read off the torque of a trial; None without a usable catch."""
    arm = arm or Arm()
    catch, after, pre = trial.catch, trial.after, trial.pre_catch
    if catch is None or after is None or pre.torque.size == 0 or after.torque.size == 0:
        return None
    before = pre.torque - arm.torque(pre, trial.name)
    measured = after.torque - arm.torque(after, trial.name)
    offset = float((before - law.torque(pre)).mean())  # -k·θ_rest
    above = measured - (offset + law.at(catch))  # over τ_pre_end of (3)
    end = math.inf if catch.end is None else catch.end
    in_peak = after.time < min(catch.time + constants.peak_duration, end)
    risen = in_peak & (after.time >= catch.time + arm.catch_rise + 3.0 * arm.lag)
    later = after.time >= end
    past = np.where(later, after.angle - (catch.angle + catch.travel), 0.0)
    torque = above - np.where(later, law.inertia * after.acceleration, 0.0)
    if constants.post_catch == "additive":
        torque = np.where(later, measured - law.torque(after) - offset, above)
    climb, residual = _residual_and_climb(past[~in_peak], torque[~in_peak])
    return CatchLevels(
        peak=float(above[risen].mean()) if risen.any() else math.nan,
        residual=residual,
        climb=climb,
    )


def _residual_and_climb(past: _Floats, torque: _Floats) -> tuple[Rows, float]:
    # a level and a slope; the level alone is the residual torque
    nothing = Rows(design=np.zeros((1, 1)), target=np.zeros(1))
    if torque.size == 0:
        return nothing, math.nan
    if not past.any():
        return nothing, float(torque.mean())
    moved, left = past - past.mean(), torque - torque.mean()
    slope = float(moved @ left) / float(moved @ moved)
    rows = Rows(design=moved[:, None], target=left)
    return rows, float(torque.mean()) - slope * float(past.mean())

"""The catch of a stretch: when it begins and ends, and what is read off it.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II and equations (1) to (5).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
_Ints = NDArray[np.int64]

# Candidates of the first search, whatever the number of samples.
_COARSE = 150

# A rise or climb of less than so many standard deviations of the residuals is none.
MIN_SIGNAL = 3.0

# An end that takes less than so many residual variances off the sum of squares is none:
# of the ends of white noise the best takes 2 ln n, about 15.
MIN_GAIN = 50.0

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
class Law:
    """What is known of a joint before its catches, of the arm and of the sensor.

    SI units; 0 is not there. `damping`, `stiffness` and `inertia` are those of (1);
    `gravity` is m·g·l, whose torque is 0 at `gravity_angle`; `arm_inertia` acts in
    every phase and is a regressor if `fits_inertia`; `lag` is the sensor's time
    constant; `drift` is N·m/s, of single trials in `drifts`.
    """

    damping: float = math.nan
    stiffness: float = math.nan
    inertia: float = 0.0
    gravity: float = 0.0
    gravity_angle: float = 0.0
    arm_inertia: float = 0.0
    fits_inertia: bool = False
    lag: float = 0.0
    catch_rise: float = 0.0
    drift: float = 0.0
    drifts: Mapping[str, float] = field(default_factory=dict)

    @property
    def takes_time(self) -> bool:
        """Return whether the torque that is read takes time to step."""
        return self.lag > 0.0 or self.catch_rise > 0.0

    def pre_catch(self, part: Part) -> _Floats:
        """Return the torque of (1) without the constant k·θ_rest, N·m."""
        law = self.damping * part.velocity + self.stiffness * part.angle
        return np.asarray(law + self.inertia * part.acceleration)

    def arm(self, part: Part, trial: str) -> _Floats:
        """Return what weight, inertia and drift add to the torque, N·m."""
        weight = self.gravity * np.sin(part.angle - self.gravity_angle)
        drift = self.drifts.get(trial, self.drift) * part.time
        return np.asarray(weight + self.arm_inertia * part.acceleration + drift)


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
    pre_catch: Part = field(compare=False)
    after: Part | None = field(default=None, compare=False)
    catch: Catch | None = None
    remark: str = ""


def _trial(stretch: Stretch, name: str, pre_catch: Part, remark: str) -> Trial:
    time = stretch.samples.time
    return Trial(
        name=name,
        pace=stretch.pace,
        start=float(time[0]),
        duration=float(time[-1] - time[0]),
        peak_speed=stretch.peak_speed,
        rest_angle=stretch.rest_angle,
        pre_catch=pre_catch,
        remark=remark,
    )


def slow_trial(stretch: Stretch, name: str) -> Trial:
    """Return a slow stretch as one pre-catch phase (section II.B)."""
    lost = int((stretch.samples.in_gap | stretch.samples.saturated).sum())
    whole = filtered_part(stretch, (0, stretch.samples.time.size), SLOW_WINDOW)
    remark = f"{lost} samples missing or saturated" if lost else ""
    return _trial(stretch, name, whole, remark)


def fast_trial(
    stretch: Stretch,
    name: str,
    constants: ElbowParameters,
    law: Law,
    window: float,
    instant: float | None = None,
) -> Trial:
    """Return a fast stretch with its catch, or a remark that says why it has none.

    The catch is looked for; where a fit has it begin (`instant`) goes before if that is
    near.
    """
    samples = stretch.samples
    onset, stop = _fast_part(stretch, constants.speed_threshold, window)
    none = _trial(stretch, name, part_of(stretch, slice(0, 0)), "")
    if samples.in_gap[:stop].any():
        return replace(none, remark="not used: a gap in the recording")
    changes = _changes(stretch, name, (onset, stop), constants, law)
    catch = None
    if changes.catch is not None:
        half = 0.5 * samples.period  # between two samples
        start = float(samples.time[changes.catch]) - half
        end = None if changes.end is None else float(samples.time[changes.end]) - half
        if instant is not None and abs(instant - start) < _NEAR:
            start = instant
        catch = _catch_at(
            stretch, (onset, stop), (start, end), constants, changes.residual_sd
        )
    if catch is None:
        why = "not used: no catch that stands out of the noise"
        return replace(none, remark=why)
    first = int(np.searchsorted(samples.time, catch.time))
    before = filtered_part(stretch, (0, first), _FAST_WINDOW)
    trial = replace(none, pre_catch=before, catch=catch)
    if samples.saturated[:stop].any():
        why = "torque is saturated: nothing after the catch is used"
        return replace(trial, remark=why)
    if before.time.size == 0:
        why = "it catches at once: no torque before the catch to compare with"
        return replace(trial, remark=why)
    after = _after(stretch, (first, stop), catch, constants, law)
    return replace(trial, after=after)


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
    ends: tuple[int, int],
    constants: ElbowParameters,
    law: Law,
) -> "Changes":
    onset, stop = ends
    part = part_of(stretch, slice(0, stop))
    times = constants.peak_duration, law.catch_rise + 3.0 * law.lag, 3.0 * law.lag
    peak, gap, last_gap = (round(time / stretch.samples.period) for time in times)
    return find_changes(
        part.torque - law.arm(part, name),
        law.pre_catch(part),
        part.angle,
        first=onset,
        lengths=(peak, gap, last_gap),
        additive=constants.post_catch == "additive",
        pushed=law.inertia * part.acceleration,
    )


def _catch_at(
    stretch: Stretch,
    part: tuple[int, int],
    instants: tuple[float, float | None],
    constants: ElbowParameters,
    residual_sd: float,
) -> Catch | None:
    # motion and travel of a catch; None if the joint hardly moves there
    samples, (instant, end) = stretch.samples, instants
    fast = samples.cut(slice(part[1]))
    angle, speed, acceleration = state_at_break(fast.time, fast.angle, instant)
    onset, onset_angle = _onset(stretch, part[0], constants.speed_threshold)
    last = float(fast.time[-1]) if end is None else end
    if not (instant > onset and angle > onset_angle and speed > 0.0 and last > instant):
        return None
    mean_speed = (angle - onset_angle) / (instant - onset)
    travel = float(np.interp(last, samples.time, stretch.angle)) - angle
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
        within_peak=end is not None and end < peak_end - 2.0 * samples.period,
        residual_sd=residual_sd,
    )


def _onset(stretch: Stretch, place: int, limit: float) -> tuple[float, float]:
    # time and angle at which the speed reaches the limit, between two samples
    samples, velocity = stretch.samples, stretch.velocity
    time = float(samples.time[place])
    if stretch.acceleration[place] > limit / _JUMP:
        return _jump(stretch.recording.time, stretch.recording.angle, time), (
            stretch.rest_angle
        )
    if place == 0:
        return time, float(stretch.angle[0])
    low, high = velocity[place - 1], velocity[place]
    time -= samples.period * float((high - limit) / (high - low))
    return time, float(np.interp(time, samples.time, stretch.angle))


def _jump(time: _Floats, angle: _Floats, near: float) -> float:
    # where a motor starts at once, which a filter of speeds sees before it is: rest,
    # and a parabola from an instant on, by least squares
    window = np.abs(time - near) <= 3.0 * _JUMP
    time, angle = time[window], angle[window]
    best, squares = near, math.inf
    for instant in time[(time > near - _JUMP) & (time < near + 2.0 * _JUMP)].tolist():
        since = np.maximum(time - instant, 0.0)
        design = np.stack([np.ones_like(since), since, since**2], axis=1)
        values = np.linalg.lstsq(design, angle, rcond=None)[0]
        left = float(((angle - design @ values) ** 2).sum())
        if left < squares:
            best, squares = instant, left
    return best


def _after(
    stretch: Stretch,
    part: tuple[int, int],
    catch: Catch,
    constants: ElbowParameters,
    law: Law,
) -> Part:
    # samples from the catch on, without those next to a step of torque
    pushes = law.arm_inertia != 0.0 or law.fits_inertia
    window = _PUSHED_WINDOW if pushes else _AFTER_WINDOW
    after = part_of(stretch, slice(*part), anew=window)
    additive = constants.post_catch == "additive"
    if catch.end is not None and (additive or law.inertia != 0.0):
        # speed and acceleration are regressors here, as they are before the catch
        first = int(np.searchsorted(stretch.samples.time, catch.end))
        later = filtered_part(stretch, (first, part[1]), _FAST_WINDOW)
        after = after.keep(after.time < catch.end).then(later)
    if law.lag > 0.0:  # no step passes a sensor that lags
        return after
    end = math.inf if catch.end is None else catch.end
    steps = [min(catch.time + constants.peak_duration, end)]
    steps += [catch.time] if law.catch_rise == 0.0 else []
    steps += [end] if additive else []
    near = np.min([np.abs(after.time - step) for step in steps], axis=0) < _GUARD
    return after.keep(~near)


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
    trial: Trial, law: Law, constants: ElbowParameters
) -> CatchLevels | None:
    """Return what is read off the torque of a trial; None without a usable catch."""
    catch, after, pre = trial.catch, trial.after, trial.pre_catch
    if catch is None or after is None or pre.torque.size == 0 or after.torque.size == 0:
        return None
    before = pre.torque - law.arm(pre, trial.name)
    measured = after.torque - law.arm(after, trial.name)
    offset = float((before - law.pre_catch(pre)).mean())  # -k·θ_rest
    pre_end = law.damping * catch.speed + law.stiffness * catch.angle
    pre_end += law.inertia * catch.acceleration
    above = measured - (offset + pre_end)  # over τ_pre_end of (3)
    end = math.inf if catch.end is None else catch.end
    in_peak = after.time < min(catch.time + constants.peak_duration, end)
    risen = in_peak & (after.time >= catch.time + law.catch_rise + 3.0 * law.lag)
    later = after.time >= end
    past = np.where(later, after.angle - (catch.angle + catch.travel), 0.0)
    torque = above - np.where(later, law.inertia * after.acceleration, 0.0)
    if constants.post_catch == "additive":
        torque = np.where(later, measured - law.pre_catch(after) - offset, above)
    past, torque = past[~in_peak], torque[~in_peak]
    residual, slope = float(torque.mean()) if torque.size else math.nan, 0.0
    climb = Rows(np.zeros((1, 1)), np.zeros(1))
    if past.any():  # a level and a slope; the level alone is the residual torque
        moved, left = past - past.mean(), torque - torque.mean()
        slope = float(moved @ left) / float(moved @ moved)
        residual -= slope * float(past.mean())
        climb = Rows(moved[:, None], left)
    return CatchLevels(
        peak=float(above[risen].mean()) if risen.any() else math.nan,
        residual=residual,
        climb=climb,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Changes:
    """Where the torque of one stretch changes, as places of its samples."""

    catch: int | None = None
    end: int | None = None
    residual_sd: float = math.nan


class _Running(NamedTuple):
    # sums of values and of their squares before each place: any stretch of them in O(1)
    one: _Floats
    two: _Floats

    @classmethod
    def of(cls, values: _Floats) -> "_Running":
        return cls(*np.cumsum([np.append(0.0, values), np.append(0.0, values**2)], 1))

    def about_mean(self, low: _Ints, high: _Ints) -> _Floats:
        # Σ(x - mean)² over the samples from low to before high; 0 of none
        one, two = self.one[high] - self.one[low], self.two[high] - self.two[low]
        return np.asarray(two - one**2 / np.maximum(high - low, 1))


class _Sums(NamedTuple):
    torque: _Running
    rest: _Running  # torque - pre-catch law
    angle: _Running
    later: _Running  # torque - what the law adds after the catch
    later_angle: _Floats  # of their products
    offset: _Floats  # what the law adds at each place
    at: _Floats  # the angle there


def find_changes(
    torque: _Floats,
    pre_catch: _Floats,
    angle: _Floats,
    *,
    first: int,
    lengths: tuple[int, int, int],
    additive: bool,
    pushed: _Floats | float = 0.0,
) -> Changes:
    """Return the catch of a stretch, by least squares over all pairs of instants.

    Every level is free: the pre-catch law up to a constant, one level during the peak,
    one after it, and a climb in proportion to the angle travelled after the end of the
    catch. No catch is before sample `first`. `lengths` are the samples of the peak, and
    those after its start and its end that are left out, where torque takes time.
    `additive` says that post-catch adds to the pre-catch law instead of going on from
    the residual torque; `pushed` is m·θ̈ of (5), which post-catch has and the catch has
    not.

    A catch whose rise, or an end whose climb, is below `MIN_SIGNAL` standard deviations
    of the residuals is none; nor is an end that takes less than `MIN_GAIN` residual
    variances off the sum of squares. If post-catch is additive, that gain alone decides
    of an end.
    """
    n = torque.size
    if n - 2 <= first + 1:
        return Changes()
    angle = angle - angle.mean()
    torque, pre_catch = torque - torque.mean(), pre_catch - pre_catch.mean()
    rest = torque - pre_catch
    later = rest if additive else torque - pushed
    sums = _Sums(
        torque=_Running.of(torque),
        rest=_Running.of(rest),
        angle=_Running.of(angle),
        later=_Running.of(later),
        later_angle=np.append(0.0, np.cumsum(later * angle)),
        offset=pre_catch if additive else np.zeros(n),
        at=np.append(angle, angle[-1]),
    )
    # First both coarsely, then the catch to the sample, then the end to the sample.
    step = max(1, n // _COARSE)
    starts, ends = np.arange(first + 1, n - 2, step), np.arange(first + 2, n - 1, step)
    peak, *gaps = lengths
    near = peak, *(max(step, gap) for gap in gaps)
    for finer in (False, True, True):
        squares = _squares(sums, starts, np.append(ends, n), near)
        place = np.unravel_index(int(np.argmin(squares)), squares.shape)
        catch, end = int(starts[place[0]]), int(np.append(ends, n)[place[1]])
        reach, near = 2 if finer else 3 * step, lengths
        starts = np.arange(max(catch - reach, first + 1), min(catch + reach, n - 3) + 1)
        ends = np.arange(first + 2, n - 1) if finer else ends
    least = float(squares[place])
    if not math.isfinite(least) or catch >= end:
        return Changes()
    sd = math.sqrt(max(least, 0.0) / max(n - 6, 1))
    step = min(catch + peak, end)
    rise = torque[catch:step].mean() - rest[:catch].mean() - pre_catch[catch]
    if rise < MIN_SIGNAL * sd:
        return Changes(residual_sd=sd)
    if end < n:
        _, along, length = _hinge(sums, np.array(step), np.array(end), 0.0)
        climb = (angle[-1] - angle[end]) * along / length if length > 0.0 else 0.0
        endless = _squares(sums, starts, np.array([n]), lengths)[:, 0]
        seen = additive or climb >= MIN_SIGNAL * sd
        if seen and float(endless.min()) - least >= MIN_GAIN * sd**2:
            return Changes(catch=catch, end=end, residual_sd=sd)
        catch = int(starts[int(np.argmin(endless))])
    return Changes(catch=catch, residual_sd=sd)


def _squares(
    sums: _Sums, starts: _Ints, ends: _Ints, lengths: tuple[int, ...]
) -> _Floats:
    # residual sum of squares of every pair, shape (n_starts, n_ends); without `gap`
    # samples after a step, which then may be anywhere between two candidates, and
    # without the two around the end of the peak, whose length is no whole number
    peak, gap, last_gap = lengths
    i, e = starts[:, None], ends[None, :]
    step = np.minimum(i + peak, e)  # down, from the peak
    low = np.minimum(i + gap, step)
    total = sums.rest.about_mean(np.zeros_like(i), i)
    total = total + sums.torque.about_mean(low, np.maximum(step - 1, low))
    after = np.minimum(step + max(last_gap, 1), sums.offset.size)
    end = np.maximum(e, after)
    whole, along, length = _hinge(sums, after, end, sums.offset[i])
    usable = (length > 0.0) & (along > 0.0)
    total += whole - np.where(usable, along**2 / np.where(usable, length, 1.0), 0.0)
    # an end just before that of the peak is the same as one just after it
    separate = (e > i + gap) & ((e < i + peak - 3) | (e > i + peak + 1))
    return np.where(separate, total, np.inf)


def _hinge(
    sums: _Sums, low: _Ints, end: _Ints, offset: _Floats | float
) -> tuple[_Floats, _Floats, _Floats]:
    # Of torque from `low` on, about its mean: its squares, its products with the angle
    # travelled since `end`, and the squares of that.
    n = sums.offset.size
    count, m, at = np.maximum(n - low, 1), n - end, sums.at[end]
    before, after, angle = sums.torque, sums.later, sums.angle
    later = after.one[n] - after.one[end]
    squares = after.two[n] - after.two[end] + offset * (2.0 * later + offset * m)
    squares = squares + before.two[end] - before.two[low]
    later = later + offset * m
    total = before.one[end] - before.one[low] + later
    moved = angle.one[n] - angle.one[end]
    h = moved - m * at  # Σ max(θ - θ_e, 0)
    h2 = angle.two[n] - angle.two[end] - 2.0 * at * moved + m * at**2
    cross = sums.later_angle[n] - sums.later_angle[end] + offset * moved - at * later
    return squares - total**2 / count, cross - total * h / count, h2 - h**2 / count

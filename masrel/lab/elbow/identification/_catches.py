"""Stretches of a recording, and the catch of each: when it begins and ends.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II and equations (1) to (5).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import detrend, savgol_filter

from masrel.errors import RecordingError
from masrel.lab.elbow.identification._clusters import Rows
from masrel.lab.elbow.identification._reading import (
    MIN_TRAVEL,
    Movement,
    Samples,
    even_samples,
)
from masrel.lab.elbow.motions import Floats
from masrel.lab.elbow.parameters import ElbowParameters

_Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

Pace = Literal["slow", "fast"]

_WINDOW = 0.06  # of the filter of speeds, s: 20.5 Hz at 1 kHz
_ORDER = 3  # of the polynomials that are fitted in the window of the filter
_MIN_LENGTH = 7  # of that window, samples

# Reach of the fit of the speed at a catch, to either side, s.
_REACH = 0.1

# A joint that extends slower rests: an encoder's steps make less than this, rad/s.
_MOVING = math.radians(2.0)

# A shorter rest, without going back, does not end a stretch, s.
_MIN_REST = 0.1

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


def window_length(window: float, period: float) -> int:
    """Return the samples of a filter's window: odd, enough for its polynomial."""
    return max(2 * round(0.5 * window / period) + 1, _MIN_LENGTH)


def differentiate(
    angle: Floats, period: float, window: float
) -> tuple[Floats, Floats, Floats]:
    """Return smoothed angle, velocity, acceleration, without delay.

    They are those of the cubic fitted to each window (Savitzky and Golay 1964), and of
    the first and last window at the ends; fewer samples than a window are one window.

    >>> t = np.arange(200) / 1000.0
    >>> angle, velocity, acceleration = differentiate(t**2, 0.001, 0.06)
    >>> bool(np.allclose(velocity, 2 * t)), bool(np.allclose(acceleration, 2.0))
    (True, True)
    """
    length = min(window_length(window, period), angle.size - 1 + angle.size % 2)
    order = min(_ORDER, length - 1)
    smooth, velocity, acceleration = (
        savgol_filter(angle, length, order, deriv=deriv, delta=period)
        if deriv <= order
        else np.zeros_like(angle)
        for deriv in range(3)
    )
    return smooth, velocity, acceleration


def filter_alike(
    angle: Floats, torque: Floats, period: float, window: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return angle, velocity, acceleration and torque after one filter.

    They are for the inner samples: those with a whole window, except the first and last
    of them. A weighted mean over a symmetric window (Hann's) commutes with d/dt:
    whatever the hand does, a linear law holds for the means as for the values, so that
    the window can be as long as an encoder's steps at a slow speed need. Noise in a
    regressor would pull b towards 0.

    >>> t = np.arange(1000) / 1000.0
    >>> angle = np.sin(9.0 * t)
    >>> law = 2.0 * 9.0 * np.cos(9.0 * t) + 3.0 * angle
    >>> x, v, _, torque = filter_alike(angle, law, 0.001, 0.25)
    >>> bool(np.allclose(torque, 2.0 * v + 3.0 * x, atol=1e-3))
    True
    """
    weights = np.hanning(window_length(window, period) + 2)[1:-1]
    weights /= weights.sum()
    means = np.convolve(angle, weights, mode="valid")
    resistance = np.convolve(torque, weights, mode="valid")
    velocity = (means[2:] - means[:-2]) / (2.0 * period)
    acceleration = (means[2:] - 2.0 * means[1:-1] + means[:-2]) / period**2
    return means[1:-1], velocity, acceleration, resistance[1:-1]


def state_at_break(
    time: Floats, angle: Floats, at: float
) -> tuple[float, float, float]:
    """Return angle, velocity and acceleration when a hand meets resistance.

    At a catch torque steps: angle and velocity are continuous, acceleration is not, and
    a filter that knows nothing of it would put part of the later slowing before it. Two
    cubics that share angle and velocity at the instant are fitted to the 0.1 s before
    and after; the acceleration is the one just before.

    >>> t = np.arange(0.0, 0.4, 0.001)
    >>> angle = t - 2.0 * np.maximum(t - 0.2, 0.0) ** 2
    >>> [round(x, 9) + 0.0 for x in state_at_break(t, angle, 0.2)]
    [0.2, 1.0, 0.0]
    """
    near = (time >= at - _REACH) & (time <= at + _REACH)
    since = (time[near] - at) / _REACH
    early, late = np.minimum(since, 0.0), np.maximum(since, 0.0)
    columns = [np.ones_like(since), since, early**2, late**2, early**3, late**3]
    values = np.linalg.lstsq(np.stack(columns, axis=1), angle[near], rcond=None)[0]
    return (
        float(values[0]),
        float(values[1]) / _REACH,
        2.0 * float(values[2]) / _REACH**2,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """One extension of the joint in a recording; SI units."""

    name: str  # of the recording, with a number if it has several
    recording: Samples = field(compare=False, repr=False)
    samples: Samples = field(compare=False, repr=False)  # of the extension alone
    angle: Floats = field(compare=False, repr=False)  # smoothed, like the next two
    velocity: Floats = field(compare=False, repr=False)
    acceleration: Floats = field(compare=False, repr=False)
    pace: Pace
    peak_speed: float
    rest_angle: float  # the smallest of the 0.5 s before


def find_stretches(
    movement: Movement, slow_below: float
) -> tuple[list[Stretch], float]:
    """Return where the joint is extended by 15 degrees or more, and the noise at rest.

    A stretch whose speed stays below `slow_below` is slow. The noise is the standard
    deviation of the torque about a line in each rest of 0.1 s or more, N·m. Refuses a
    recorded velocity that is not the derivative of the angle.
    """
    samples = even_samples(movement)
    angle, velocity, acceleration = differentiate(
        samples.angle, samples.period, _WINDOW
    )
    if movement.velocity is not None:
        recorded = np.interp(samples.time, movement.time, movement.velocity)
        ratio = float(recorded @ velocity) / float(velocity @ velocity)
        if not 0.8 <= ratio <= 1.25:
            raise RecordingError(
                f"{movement.name}: the velocity is {ratio:.3g} times the derivative of "
                "the angle; is its unit right?"
            )
    runs = [
        (start, stop)
        for start, stop in _runs(samples, angle, velocity)
        if angle[stop - 1] - angle[start] >= MIN_TRAVEL
    ]
    stretches = []
    for number, (start, stop) in enumerate(runs, start=1):
        part = slice(start, stop)
        rest = slice(max(0, start - round(0.5 / samples.period)), start + 1)
        before = samples.angle[rest]
        peak_speed = float(velocity[part].max())
        stretches.append(
            Stretch(
                name=f"{movement.name} #{number}" if len(runs) > 1 else movement.name,
                recording=samples,
                samples=samples.cut(part),
                angle=angle[part],
                velocity=velocity[part],
                acceleration=acceleration[part],
                pace="slow" if peak_speed < slow_below else "fast",
                peak_speed=peak_speed,
                rest_angle=float(np.median(before[before <= before.min() + 1e-9])),
            )
        )
    return stretches, _rest_noise(samples, velocity)


def _spans(mask: Bools) -> list[tuple[int, int]]:
    # first sample of each run that is marked, and the first after it
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _runs(samples: Samples, angle: Floats, velocity: Floats) -> list[tuple[int, int]]:
    # a short rest, without going back, belongs to the extension around it
    runs: list[tuple[int, int]] = []
    for start, stop in _spans(velocity > _MOVING):
        first = start
        if runs and (start - runs[-1][1]) * samples.period < _MIN_REST:
            if angle[start] >= angle[runs[-1][1] - 1] - _MOVING * _MIN_REST:
                first, _ = runs.pop()
        runs.append((first, stop))
    return runs


def _rest_noise(samples: Samples, velocity: Floats) -> float:
    still = (np.abs(velocity) < 0.5 * _MOVING) & ~samples.in_gap & ~samples.saturated
    squares, df = 0.0, 0
    for start, stop in _spans(still):
        if (stop - start) * samples.period >= _MIN_REST:
            left = detrend(samples.torque[start:stop])
            squares, df = squares + float(left @ left), df + left.size - 2
    return math.sqrt(squares / df) if df > 0 else math.nan


class Part(NamedTuple):
    """Samples of a trial that are used, each column of shape (n_samples,), SI units.

    Angle and its derivatives are smoothed within the part, before a catch the torque as
    well; `measured` is the torque as recorded.
    """

    time: Floats
    angle: Floats
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    torque: Floats
    measured: Floats

    def keep(self, which: Bools | _Ints) -> "Part":
        """Return some of the samples."""
        return Part(*(column[which] for column in self))

    def ahead(self, by: float) -> "Part":
        """Return the part with an angle of so much later, s, to second order."""
        return self._replace(
            angle=self.angle + by * (self.velocity + 0.5 * by * self.acceleration),
            velocity=self.velocity + by * (self.acceleration + 0.5 * by * self.jerk),
            acceleration=self.acceleration + by * self.jerk,
        )

    def then(self, later: "Part") -> "Part":
        """Return both parts as one."""
        return Part(*map(np.concatenate, zip(self, later, strict=True)))


def filtered_part(samples: Samples, window: float) -> Part:
    """Return the samples that have a whole window without a gap or saturation.

    Angle and torque go through one filter, as a linear law allows.
    """
    margin = window_length(window, samples.period) // 2 + 1
    if samples.time.size <= 2 * margin:
        return Part(*[np.zeros(0)] * len(Part._fields))
    angle, velocity, acceleration, torque = filter_alike(
        samples.angle, samples.torque, samples.period, window
    )
    unusable = samples.in_gap | samples.saturated
    touched = np.convolve(unusable, np.ones(2 * margin + 1), mode="valid") > 0.5
    whole = Part(
        samples.time[margin:-margin],
        angle,
        velocity,
        acceleration,
        _slope(acceleration, samples.period),
        torque,
        samples.torque[margin:-margin],
    )
    return whole.keep(~touched)


def part_of(stretch: Stretch, which: slice, *, anew: float | None = None) -> Part:
    """Return samples of a stretch with torque as measured.

    With `anew`, a window in seconds, the angle is smoothed within the part alone, so
    the motion beyond does not affect it.
    """
    samples = stretch.samples.cut(which)
    angle, velocity, acceleration = (
        x[which] for x in (stretch.angle, stretch.velocity, stretch.acceleration)
    )
    if anew is not None:
        angle, velocity, acceleration = differentiate(
            samples.angle, samples.period, anew
        )
    jerk, torque = _slope(acceleration, samples.period), samples.torque
    return Part(samples.time, angle, velocity, acceleration, jerk, torque, torque)


def _slope(values: Floats, period: float) -> Floats:
    return np.gradient(values, period) if values.size > 1 else np.zeros_like(values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """What is known of a joint before its catches, of the arm and of the sensor.

    SI units; 0 is not there. `fitted` names what is fitted of the arm; `damping`,
    `stiffness` and `inertia` are those of (1); `gravity` is m·g·l, whose torque is 0 at
    `gravity_angle`; `arm_inertia` acts in every phase; `offset` is a trial's constant
    torque above -k·θ_rest, and `drift` what that gains, N·m/s, of single trials in
    `drifts`; `lag` is the sensor's time constant.
    """

    constants: ElbowParameters
    fitted: tuple[str, ...]
    damping: float = math.nan
    stiffness: float = math.nan
    inertia: float = 0.0
    gravity: float = 0.0
    gravity_angle: float = 0.0
    arm_inertia: float = 0.0
    lag: float = 0.0
    catch_rise: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    drifts: Mapping[str, float] = field(default_factory=dict)

    @property
    def takes_time(self) -> bool:
        """Return whether the torque that is read takes time to step."""
        return self.lag > 0.0 or self.catch_rise > 0.0

    def pre_catch(self, part: Part) -> Floats:
        """Return the torque of (1) without the constant k·θ_rest, N·m."""
        law = self.damping * part.velocity + self.stiffness * part.angle
        return np.asarray(law + self.inertia * part.acceleration)

    def arm(self, part: Part, trial: str) -> Floats:
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
    """One stretch, as the fits see it.

    `pre_catch` holds samples before the catch, `after` those from it until the hand is
    slow again (None if unusable); `remark` says what is not used of it, and why.
    """

    stretch: Stretch
    pre_catch: Part = field(compare=False)
    after: Part | None = field(default=None, compare=False)
    catch: Catch | None = None
    remark: str = ""

    def ahead(self, by: float) -> "Trial":
        """Return the trial with angles of so much later, s, and the same torque."""
        catch, after = self.catch, self.after
        if catch is not None:
            travel = by * (catch.speed + 0.5 * by * catch.acceleration)
            catch = replace(
                catch,
                angle=catch.angle + travel,
                speed=catch.speed + by * catch.acceleration,
                mean_speed=catch.mean_speed + catch.speed_gain * travel,
            )
        return replace(
            self,
            pre_catch=self.pre_catch.ahead(by),
            after=None if after is None else after.ahead(by),
            catch=catch,
        )


def slow_trial(stretch: Stretch) -> Trial:
    """Return a slow stretch as one pre-catch phase (section II.B)."""
    lost = int((stretch.samples.in_gap | stretch.samples.saturated).sum())
    whole = filtered_part(stretch.samples, SLOW_WINDOW)
    remark = f"{lost} samples missing or saturated" if lost else ""
    return Trial(stretch=stretch, pre_catch=whole, remark=remark)


def fast_trial(stretch: Stretch, law: Law, instant: float | None = None) -> Trial:
    """Return a fast stretch with its catch, or a remark that says why it has none.

    The catch is searched for; its beginning by a fit (`instant`) overrides the search
    if it is near.
    """
    samples, velocity = stretch.samples, stretch.velocity
    onset = int(np.argmax(velocity >= law.constants.speed_threshold))
    fastest = int(np.argmax(velocity))
    slow = np.flatnonzero(velocity[fastest:] < law.constants.speed_threshold)
    stop = fastest + int(slow[0]) if slow.size else velocity.size
    # the filter sees a hand stop half a window late or early
    stop = max(fastest, stop - round(0.5 * _WINDOW / samples.period))
    none = Trial(stretch=stretch, pre_catch=part_of(stretch, slice(0, 0)))
    if samples.in_gap[:stop].any():
        return replace(none, remark="not used: a gap in the recording")
    catch = _catch(stretch, (onset, stop), law, instant)
    if catch is None:
        return replace(none, remark="not used: no catch stands out from the noise")
    first = int(np.searchsorted(samples.time, catch.time))
    before = filtered_part(samples.cut(slice(0, first)), _FAST_WINDOW)
    remark, after = "", None
    if samples.saturated[:stop].any():
        remark = "torque is saturated: nothing after the catch is used"
    elif before.time.size == 0:
        remark = "it catches at once, so there is no torque before it to compare with"
    else:
        after = _after(stretch, (first, stop), catch, law)
    return replace(none, pre_catch=before, after=after, catch=catch, remark=remark)


def _catch(
    stretch: Stretch, ends: tuple[int, int], law: Law, instant: float | None
) -> Catch | None:
    # between the samples of movement onset and of the hand's being slow again; None if
    # the torque does not say so, or the joint hardly moves there
    samples, constants, (first, stop) = stretch.samples, law.constants, ends
    part = part_of(stretch, slice(0, stop))
    times = constants.peak_duration, law.catch_rise + 3.0 * law.lag, 3.0 * law.lag
    peak, gap, last_gap = (round(time / samples.period) for time in times)
    at, until, residual_sd = find_changes(
        part.torque - law.arm(part, stretch.name),
        law.pre_catch(part),
        part.angle,
        first=first,
        lengths=(peak, gap, last_gap),
        additive=constants.post_catch == "additive",
        pushed=law.inertia * part.acceleration,
    )
    if at is None:
        return None
    half = 0.5 * samples.period  # between two samples
    time = float(samples.time[at]) - half
    end = None if until is None else float(samples.time[until]) - half
    if instant is not None and abs(instant - time) < _NEAR:
        time = instant
    angle, speed, acceleration = state_at_break(part.time, samples.angle[:stop], time)
    onset, onset_angle = _onset(stretch, first, constants.speed_threshold)
    last = float(part.time[-1]) if end is None else end
    if not (time > onset and angle > onset_angle and speed > 0.0 and last > time):
        return None
    mean_speed = (angle - onset_angle) / (time - onset)
    travel = float(np.interp(last, samples.time, stretch.angle)) - angle
    peak_end = time + constants.peak_duration
    return Catch(
        time=time,
        angle=angle,
        speed=speed,
        acceleration=acceleration,
        mean_speed=mean_speed,
        # d/dθ of (θ - θ_on)/(t - t_on), with dt = dθ/ω
        speed_gain=(1.0 - mean_speed / speed) / (time - onset),
        end=end,
        travel=travel,
        mean_catch_speed=travel / (last - time),
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


def _jump(time: Floats, angle: Floats, near: float) -> float:
    # where a motor starts at once, which a filter of speeds sees before it is: rest,
    # and a parabola from an instant on, by least squares
    window = np.abs(time - near) <= 3.0 * _JUMP
    time, angle = time[window], angle[window]

    def squares(instant: float) -> float:
        since = np.maximum(time - instant, 0.0)
        design = np.stack([np.ones_like(since), since, since**2], axis=1)
        values = np.linalg.lstsq(design, angle, rcond=None)[0]
        return float(((angle - design @ values) ** 2).sum())

    tried = time[(time > near - _JUMP) & (time < near + 2.0 * _JUMP)].tolist()
    return float(min(tried, key=squares, default=near))


def _after(stretch: Stretch, part: tuple[int, int], catch: Catch, law: Law) -> Part:
    # samples from the catch on, without those next to a step of torque
    pushes = law.arm_inertia != 0.0 or "arm_inertia" in law.fitted
    window = _PUSHED_WINDOW if pushes else _AFTER_WINDOW
    after = part_of(stretch, slice(*part), anew=window)
    additive = law.constants.post_catch == "additive"
    if catch.end is not None and (additive or law.inertia != 0.0):
        # speed and acceleration are regressors here, as they are before the catch
        first = int(np.searchsorted(stretch.samples.time, catch.end))
        rest = stretch.samples.cut(slice(first, part[1]))
        later = filtered_part(rest, _FAST_WINDOW)
        after = after.keep(after.time < catch.end).then(later)
    if law.lag > 0.0:  # no step passes a sensor that lags
        return after
    end = math.inf if catch.end is None else catch.end
    steps = [min(catch.time + law.constants.peak_duration, end)]
    steps += [catch.time] if law.catch_rise == 0.0 else []
    steps += [end] if additive else []
    near = np.min([np.abs(after.time - step) for step in steps], axis=0) < _GUARD
    return after.keep(~near)


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchLevels:
    """Peak and residual of a catch above the end of pre-catch, N·m, and the climb.

    The residual is ``nan`` if nothing was recorded after the peak; the climb is torque
    above the residual against the angle travelled since.
    """

    catch: Catch
    peak: float
    residual: float
    climb: Rows = field(repr=False)


def catch_levels(trial: Trial, law: Law) -> CatchLevels | None:
    """Return what is read off the torque of a trial; None without a usable catch."""
    catch, after, pre = trial.catch, trial.after, trial.pre_catch
    if catch is None or after is None or pre.torque.size == 0 or after.torque.size == 0:
        return None
    before = pre.torque - law.arm(pre, trial.stretch.name)
    measured = after.torque - law.arm(after, trial.stretch.name)
    offset = float((before - law.pre_catch(pre)).mean())  # -k·θ_rest
    pushed = law.inertia * catch.acceleration
    pre_end = law.damping * catch.speed + law.stiffness * catch.angle + pushed
    above = measured - (offset + pre_end)  # over τ_pre_end of (3)
    end = math.inf if catch.end is None else catch.end
    in_peak = after.time < min(catch.time + law.constants.peak_duration, end)
    risen = in_peak & (after.time >= catch.time + law.catch_rise + 3.0 * law.lag)
    later = after.time >= end
    past = np.where(later, after.angle - (catch.angle + catch.travel), 0.0)
    torque = above - np.where(later, law.inertia * after.acceleration, 0.0)
    if law.constants.post_catch == "additive":
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
        catch=catch,
        peak=float(above[risen].mean()) if risen.any() else math.nan,
        residual=residual,
        climb=climb,
    )


def find_changes(
    torque: Floats,
    pre_catch: Floats,
    angle: Floats,
    *,
    first: int,
    lengths: tuple[int, int, int],
    additive: bool,
    pushed: Floats | float = 0.0,
) -> tuple[int | None, int | None, float]:
    """Return the samples where a catch begins and ends, and the residuals' deviation.

    By least squares over all pairs of instants, where every level is free: the
    pre-catch law up to a constant, one level during the peak, one after it, and a climb
    in proportion to the angle travelled after the end of the catch. No catch is before
    sample `first`. `lengths` are the samples of the peak, and those after its start and
    its end that are left out, where torque takes time. `additive` says that post-catch
    adds to the pre-catch law instead of going on from the residual torque; `pushed` is
    m·θ̈ of (5), which post-catch has and the catch has not.

    A catch whose rise, or an end whose climb, is below `MIN_SIGNAL` standard deviations
    of the residuals does not count, nor does an end that reduces the sum of squares by
    less than `MIN_GAIN` residual variances. If post-catch is additive, that gain alone
    decides on an end.
    """
    n = torque.size
    if n - 2 <= first + 1:
        return None, None, math.nan
    angle = angle - angle.mean()
    torque, pre_catch = torque - torque.mean(), pre_catch - pre_catch.mean()
    rest = torque - pre_catch
    later = rest if additive else torque - pushed
    sums = _Sums.of(torque, rest, angle, later, pre_catch if additive else 0.0 * rest)
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
        return None, None, math.nan
    sd = math.sqrt(max(least, 0.0) / max(n - 6, 1))
    step = min(catch + peak, end)
    rise = torque[catch:step].mean() - rest[:catch].mean() - pre_catch[catch]
    if rise < MIN_SIGNAL * sd:
        return None, None, sd
    if end < n:
        _, along, length = _hinge(sums, np.array(step), np.array(end), 0.0)
        climb = (angle[-1] - angle[end]) * along / length if length > 0.0 else 0.0
        endless = _squares(sums, starts, np.array([n]), lengths)[:, 0]
        seen = additive or climb >= MIN_SIGNAL * sd
        if seen and float(endless.min()) - least >= MIN_GAIN * sd**2:
            return catch, end, sd
        catch = int(starts[int(np.argmin(endless))])
    return catch, None, sd


_ONE, _TORQUE, _REST, _ANGLE, _LATER = range(5)


class _Sums(NamedTuple):
    # sums of the products of two of: 1, torque, torque - pre-catch law, angle, and
    # torque - what the law adds after the catch; those of any stretch take no loop
    before: Floats  # each place, (5, 5, n + 1)
    at: Floats  # the angle at each place
    offset: Floats  # what the law adds there

    @classmethod
    def of(cls, *columns: Floats) -> "_Sums":
        *varying, offset = columns
        rows = np.stack([np.ones_like(offset), *varying])
        products = np.cumsum(rows[:, None] * rows, axis=2)
        at = np.append(rows[_ANGLE], rows[_ANGLE, -1])
        return cls(np.pad(products, [(0, 0), (0, 0), (1, 0)]), at, offset)

    def between(self, i: int, j: int, low: _Ints, high: _Ints | int = -1) -> Floats:
        before = self.before[i, j]
        return np.asarray(before[high] - before[low])

    def about_mean(self, i: int, low: _Ints, high: _Ints) -> Floats:
        # Σ(x - mean)² over the samples from low to before high; 0 of none
        total = self.between(_ONE, i, low, high)
        mean = total / np.maximum(high - low, 1)
        return np.asarray(self.between(i, i, low, high) - total * mean)


def _squares(
    sums: _Sums, starts: _Ints, ends: _Ints, lengths: tuple[int, ...]
) -> Floats:
    # residual sum of squares of every pair, shape (n_starts, n_ends); without `gap`
    # samples after a step, which then may be anywhere between two candidates, and
    # without the two around the end of the peak, whose length is no whole number
    peak, gap, last_gap = lengths
    i, e = starts[:, None], ends[None, :]
    step = np.minimum(i + peak, e)  # down, from the peak
    low = np.minimum(i + gap, step)
    total = sums.about_mean(_REST, np.zeros_like(i), i)
    total = total + sums.about_mean(_TORQUE, low, np.maximum(step - 1, low))
    after = np.minimum(step + max(last_gap, 1), sums.offset.size)
    whole, along, length = _hinge(sums, after, np.maximum(e, after), sums.offset[i])
    usable = (length > 0.0) & (along > 0.0)
    total += whole - np.where(usable, along**2 / np.where(usable, length, 1.0), 0.0)
    # an end just before that of the peak is the same as one just after it
    separate = (e > i + gap) & ((e < i + peak - 3) | (e > i + peak + 1))
    return np.where(separate, total, np.inf)


def _hinge(
    sums: _Sums, low: _Ints, end: _Ints, offset: Floats | float
) -> tuple[Floats, Floats, Floats]:
    # Of torque from `low` on, about its mean: its squares, its products with the angle
    # travelled since `end`, and the squares of that.
    n = sums.offset.size
    m, at, count = n - end, sums.at[end], np.maximum(n - low, 1)
    later, moved = sums.between(_ONE, _LATER, end), sums.between(_ONE, _ANGLE, end)
    squares = sums.between(_LATER, _LATER, end) + offset * (2.0 * later + offset * m)
    squares = squares + sums.between(_TORQUE, _TORQUE, low, end)
    later = later + offset * m
    total = sums.between(_ONE, _TORQUE, low, end) + later
    h = moved - m * at  # Σ max(θ - θ_e, 0)
    h2 = sums.between(_ANGLE, _ANGLE, end) - 2.0 * at * moved + m * at**2
    cross = sums.between(_ANGLE, _LATER, end) + offset * moved - at * later
    return squares - total**2 / count, cross - total * h / count, h2 - h**2 / count

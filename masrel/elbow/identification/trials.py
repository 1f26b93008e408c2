"""What a stretch says of the joint, once its catch is found."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.changes import find_changes
from masrel.elbow.identification.kinematics import (
    differentiate,
    filter_alike,
    state_at_break,
    window_length,
)
from masrel.elbow.identification.stretches import Pace, Stretch
from masrel.elbow.parameters import ElbowParameters

__all__ = ["Catch", "Part", "Trial", "fast_trial", "slow_trial"]

Floats = NDArray[np.float64]

GUARD = 0.002
"""Samples this near to a step of torque are left out: it falls between two, s."""

AFTER_WINDOW = 0.06
"""Window of the filter of the angle after a catch, s."""

SLOW_WINDOW, FAST_WINDOW = 0.25, 0.1
"""Windows of the filter of angle and torque before a catch, s. An encoder's steps take
long when the joint moves slowly."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Samples of a trial that are used, within one phase or several.

    Attributes
    ----------
    time, angle, velocity, acceleration, torque : ndarray, shape (n_samples,)
        s, rad, rad/s, rad/s², N·m; smoothed within the part, before a catch the
        torque as well.
    measured : ndarray, shape (n_samples,)
        Torque as recorded, N·m.
    """

    time: Floats = field(compare=False, repr=False)
    angle: Floats = field(compare=False, repr=False)
    velocity: Floats = field(compare=False, repr=False)
    acceleration: Floats = field(compare=False, repr=False)
    torque: Floats = field(compare=False, repr=False)
    measured: Floats = field(compare=False, repr=False)

    def keep(self, which: NDArray[np.bool_]) -> "Part":
        """Leave out the samples that are not marked.

        Parameters
        ----------
        which : ndarray of bool, shape (n_samples,)
            Samples to keep.

        Returns
        -------
        Part
            The others are gone.
        """
        return Part(
            time=self.time[which],
            angle=self.angle[which],
            velocity=self.velocity[which],
            acceleration=self.acceleration[which],
            torque=self.torque[which],
            measured=self.measured[which],
        )

    def then(self, later: "Part") -> "Part":
        """Join two parts.

        Parameters
        ----------
        later : Part
            What follows.

        Returns
        -------
        Part
            Both.
        """
        return Part(
            time=np.concatenate([self.time, later.time]),
            angle=np.concatenate([self.angle, later.angle]),
            velocity=np.concatenate([self.velocity, later.velocity]),
            acceleration=np.concatenate([self.acceleration, later.acceleration]),
            torque=np.concatenate([self.torque, later.torque]),
            measured=np.concatenate([self.measured, later.measured]),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Catch:
    """The catch of one stretch.

    Attributes
    ----------
    time : float
        Its start, midway between two samples, s.
    angle, speed, acceleration : float
        There, rad, rad/s and (just before) rad/s².
    mean_speed : float
        Mean speed from movement onset, v̄ of (2), rad/s.
    speed_gain : float
        How fast that mean grew with the angle there, dv̄/dθ, 1/s.
    end : float or None
        Time of its end, s; None if the stretch ends within it.
    travel : float
        Angle travelled during it, rad: up to its end or the stretch's.
    mean_catch_speed : float
        Mean speed during it, v̄_c of (4), rad/s.
    within_peak : bool
        Whether it ends before the peak does.
    """

    time: float
    angle: float
    speed: float
    acceleration: float
    mean_speed: float
    speed_gain: float
    end: float | None
    travel: float
    mean_catch_speed: float
    within_peak: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One stretch, as the fits see it.

    Attributes
    ----------
    name : str
        The recording, and which stretch of it.
    pace : {"slow", "fast"}
        Whether it can catch.
    start, duration : float
        Time of its start and how long it takes, s.
    peak_speed : float
        Largest speed, rad/s.
    pre_catch : Part
        Samples before the catch.
    after : Part or None
        Samples from the catch until the hand is slow again; None if unusable.
    catch : Catch or None
        The catch, or None.
    remark : str
        What is not used of it, and why; empty if all is.
    """

    name: str
    pace: Pace
    start: float
    duration: float
    peak_speed: float
    pre_catch: Part
    after: Part | None = None
    catch: Catch | None = None
    remark: str = ""


def slow_trial(stretch: Stretch, name: str) -> Trial:
    """Take a slow stretch as one pre-catch phase (section II.B).

    Parameters
    ----------
    stretch : Stretch
        A slow stretch.
    name : str
        What to call it.

    Returns
    -------
    Trial
        Without samples in gaps and saturated ones.
    """
    unusable = stretch.missing | stretch.saturated
    lost = int(unusable.sum())
    return Trial(
        name=name,
        pace="slow",
        start=float(stretch.time[0]),
        duration=float(stretch.time[-1] - stretch.time[0]),
        peak_speed=stretch.peak_speed,
        pre_catch=_filtered(stretch, unusable, (0, stretch.time.size), SLOW_WINDOW),
        remark=f"{lost} samples missing or saturated" if lost else "",
    )


def _filtered(
    stretch: Stretch,
    unusable: NDArray[np.bool_],
    ends: tuple[int, int],
    window: float,
) -> Part:
    # samples between the ends; one is used if its window holds nothing unusable
    period = stretch.samples.period
    margin = window_length(window, period) // 2 + 1
    start, stop = ends
    if stop - start <= 2 * margin:
        return _part(stretch, slice(0, 0))
    angle, torque = stretch.raw_angle[start:stop], stretch.torque[start:stop]
    made = filter_alike(angle, torque, period, window)
    inner = slice(start + margin, stop - margin)
    reach = np.ones(2 * margin + 1)
    touched = np.convolve(unusable[start:stop], reach, mode="valid") > 0.5
    whole = Part(
        time=stretch.time[inner],
        angle=made[0],
        velocity=made[1],
        acceleration=made[2],
        torque=made[3],
        measured=stretch.torque[inner],
    )
    return whole.keep(~touched)


def fast_trial(
    stretch: Stretch,
    name: str,
    constants: ElbowParameters,
    law: tuple[float, float, float],
    window: float,
) -> Trial:
    """Find the catch of a fast stretch.

    Parameters
    ----------
    stretch : Stretch
        A fast stretch.
    name : str
        What to call it.
    constants : ElbowParameters
        ν_th, ΔT_peak and the reading of (5).
    law : tuple of three float
        b, k and m of the slow stretches, SI units.
    window : float
        Length of the filter's window, s.

    Returns
    -------
    Trial
        With its catch, or a remark that says why it has none that can be used.
    """
    onset, stop = _fast_part(stretch, constants.speed_threshold, window)
    if stretch.missing[:stop].any():
        return _unused(stretch, name, "a gap in the recording")
    motion = (stretch.velocity, stretch.angle, stretch.acceleration)
    pre = sum((x * y for x, y in zip(law, motion, strict=True)), 0.0 * motion[0])
    found = find_changes(
        stretch.torque[:stop],
        pre[:stop],
        stretch.angle[:stop],
        first=onset,
        peak=round(constants.peak_duration / stretch.samples.period),
        additive=constants.post_catch == "additive",
        pushed=law[2] * stretch.acceleration[:stop] if law[2] else None,
    )
    if found.catch is None:
        return _unused(stretch, name, "no catch that stands out of the noise")
    places = _Places(onset=onset, catch=found.catch, end=found.end, stop=stop)
    catch = _catch_at(stretch, places, constants)
    before = _filtered(stretch, stretch.saturated, (0, places.catch), FAST_WINDOW)
    why = ""
    if stretch.saturated[:stop].any():
        why = "torque is saturated: nothing after the catch is used"
    elif before.time.size == 0:
        why = "it catches at once: no torque before the catch to compare with"
    smooth_end = constants.post_catch == "additive" or law[2] != 0.0
    return Trial(
        name=name,
        pace="fast",
        start=float(stretch.time[0]),
        duration=float(stretch.time[-1] - stretch.time[0]),
        peak_speed=stretch.peak_speed,
        pre_catch=before,
        after=None if why else _after(stretch, places, catch, constants, smooth_end),
        catch=catch,
        remark=why,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Places:
    # samples of a stretch: movement onset, first of the catch, first after it, and
    # first that is slow again
    onset: int
    catch: int
    end: int | None
    stop: int


def _fast_part(stretch: Stretch, limit: float, window: float) -> tuple[int, int]:
    # movement onset, and where the hand is slow again
    velocity = stretch.velocity
    fastest = int(np.argmax(velocity))
    slow = np.flatnonzero(velocity[fastest:] < limit)
    stop = fastest + int(slow[0]) if slow.size else velocity.size
    # the filter sees a hand stop half a window late or early
    stop = max(fastest, stop - round(0.5 * window / stretch.samples.period))
    return int(np.argmax(velocity >= limit)), stop


def _catch_at(stretch: Stretch, places: _Places, constants: ElbowParameters) -> Catch:
    time, period = stretch.time, stretch.samples.period
    instant = float(time[places.catch]) - 0.5 * period  # between two samples
    reach = slice(stretch.start, stretch.start + places.stop)
    angle, speed, acceleration = state_at_break(
        stretch.samples.time[reach], stretch.samples.angle[reach], instant
    )
    onset, onset_angle = _crossing(stretch, places.onset, constants.speed_threshold)
    mean_speed = (angle - onset_angle) / (instant - onset)
    end = None if places.end is None else float(time[places.end]) - 0.5 * period
    last = float(time[places.stop - 1]) if end is None else end
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
    )


def _after(
    stretch: Stretch,
    places: _Places,
    catch: Catch,
    constants: ElbowParameters,
    smooth_end: bool,
) -> Part:
    # samples from the catch on, without those next to a step of torque
    part = _part(stretch, slice(places.catch, places.stop), smoothed_anew=True)
    if catch.end is not None and places.end is not None and smooth_end:
        # speed and acceleration are regressors here, as they are before the catch
        ends = (places.end, places.stop)
        later = _filtered(stretch, stretch.saturated, ends, FAST_WINDOW)
        part = part.keep(part.time < catch.end).then(later)
    steps = [catch.time, catch.time + constants.peak_duration]
    if catch.end is not None:
        steps[1] = min(steps[1], catch.end)
        if constants.post_catch == "additive":
            steps.append(catch.end)
    near = np.min([np.abs(part.time - step) for step in steps], axis=0) < GUARD
    return part.keep(~near)


def _crossing(stretch: Stretch, place: int, limit: float) -> tuple[float, float]:
    # time and angle at which the speed reaches the limit, between two samples
    if place == 0:
        return float(stretch.time[0]), float(stretch.angle[0])
    low, high = stretch.velocity[place - 1], stretch.velocity[place]
    time = float(stretch.time[place]) - stretch.samples.period * float(
        (high - limit) / (high - low)
    )
    return time, float(np.interp(time, stretch.time, stretch.angle))


def _unused(stretch: Stretch, name: str, why: str) -> Trial:
    nothing = np.zeros(stretch.time.size, dtype=np.bool_)
    return Trial(
        name=name,
        pace="fast",
        start=float(stretch.time[0]),
        duration=float(stretch.time[-1] - stretch.time[0]),
        peak_speed=stretch.peak_speed,
        pre_catch=_part(stretch, slice(0, stretch.time.size)).keep(nothing),
        remark=f"not used: {why}",
    )


def _part(stretch: Stretch, which: slice, *, smoothed_anew: bool = False) -> Part:
    # smoothed anew, the motion within the part knows nothing of what is beyond it
    motion = stretch.angle, stretch.velocity, stretch.acceleration
    if smoothed_anew:
        angle, velocity, acceleration = differentiate(
            stretch.raw_angle[which], stretch.samples.period, AFTER_WINDOW
        )
    else:
        angle, velocity, acceleration = (values[which] for values in motion)
    return Part(
        time=stretch.time[which],
        angle=angle,
        velocity=velocity,
        acceleration=acceleration,
        torque=stretch.torque[which],
        measured=stretch.torque[which],
    )

"""What a stretch says of the joint, once its catch is found."""

from dataclasses import dataclass

import numpy as np

from masrel.elbow.identification.catch import Catch, Places, catch_at, fast_part
from masrel.elbow.identification.changes import Changes, find_changes
from masrel.elbow.identification.law import PreCatchLaw
from masrel.elbow.identification.part import Part, filtered_part, part_of
from masrel.elbow.identification.stretches import Pace, Stretch
from masrel.elbow.parameters import ElbowParameters

__all__ = ["Trial", "fast_trial", "slow_trial"]

GUARD = 0.002
"""Samples this near to a step of torque are left out: it falls between two, s."""

SLOW_WINDOW, FAST_WINDOW = 0.25, 0.1
"""Windows of the filter of angle and torque before a catch, s. An encoder's steps take
long when the joint moves slowly."""


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
        pre_catch=filtered_part(stretch, unusable, (0, stretch.time.size), SLOW_WINDOW),
        remark=f"{lost} samples missing or saturated" if lost else "",
    )


def fast_trial(
    stretch: Stretch,
    name: str,
    constants: ElbowParameters,
    law: PreCatchLaw,
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
    law : PreCatchLaw
        b, k and m of the slow stretches.
    window : float
        Length of the filter's window, s.

    Returns
    -------
    Trial
        With its catch, or a remark that says why it has none that can be used.
    """
    onset, stop = fast_part(stretch, constants.speed_threshold, window)
    if stretch.missing[:stop].any():
        return _unused(stretch, name, "a gap in the recording")
    found = _changes(stretch, constants, law, (onset, stop))
    if found.catch is None:
        return _unused(stretch, name, "no catch that stands out of the noise")
    places = Places(onset=onset, catch=found.catch, end=found.end, stop=stop)
    catch = catch_at(stretch, places, constants, found.residual_sd)
    before = filtered_part(stretch, stretch.saturated, (0, places.catch), FAST_WINDOW)
    why = ""
    if stretch.saturated[:stop].any():
        why = "torque is saturated: nothing after the catch is used"
    elif before.time.size == 0:
        why = "it catches at once: no torque before the catch to compare with"
    smooth_end = constants.post_catch == "additive" or law.inertia != 0.0
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


def _changes(
    stretch: Stretch,
    constants: ElbowParameters,
    law: PreCatchLaw,
    ends: tuple[int, int],
) -> Changes:
    onset, stop = ends
    part = part_of(stretch, slice(0, stop))
    return find_changes(
        part.torque,
        law.torque(part),
        part.angle,
        first=onset,
        peak=round(constants.peak_duration / stretch.samples.period),
        additive=constants.post_catch == "additive",
        pushed=law.inertia * part.acceleration if law.inertia else None,
    )


def _after(
    stretch: Stretch,
    places: Places,
    catch: Catch,
    constants: ElbowParameters,
    smooth_end: bool,
) -> Part:
    # samples from the catch on, without those next to a step of torque
    part = part_of(stretch, slice(places.catch, places.stop), smoothed_anew=True)
    if catch.end is not None and places.end is not None and smooth_end:
        # speed and acceleration are regressors here, as they are before the catch
        ends = (places.end, places.stop)
        later = filtered_part(stretch, stretch.saturated, ends, FAST_WINDOW)
        part = part.keep(part.time < catch.end).then(later)
    steps = [catch.time, catch.time + constants.peak_duration]
    if catch.end is not None:
        steps[1] = min(steps[1], catch.end)
        if constants.post_catch == "additive":
            steps.append(catch.end)
    near = np.min([np.abs(part.time - step) for step in steps], axis=0) < GUARD
    return part.keep(~near)


def _unused(stretch: Stretch, name: str, why: str) -> Trial:
    return Trial(
        name=name,
        pace="fast",
        start=float(stretch.time[0]),
        duration=float(stretch.time[-1] - stretch.time[0]),
        peak_speed=stretch.peak_speed,
        pre_catch=part_of(stretch, slice(0, 0)),
        remark=f"not used: {why}",
    )

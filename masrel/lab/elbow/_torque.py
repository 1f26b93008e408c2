"""Torque of a motion at times or angles, and what it asks of whoever moves the arm.

Everything comes from the events and from polynomials, piece by piece: no trace.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1), (3) and (5).
"""

import functools
import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from masrel.errors import ParameterError
from masrel.lab.elbow import _law
from masrel.lab.elbow._events import CATCH, Timeline, timeline
from masrel.lab.elbow._law import TorqueLaw
from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow._polynomials import (
    Number,
    Polynomial,
    bernstein,
    derivative,
    first_above,
    integral,
    product,
    shifted,
    split_at_roots,
    value,
)
from masrel.lab.elbow.parameters import ElbowParameters

__all__ = [
    "impulse",
    "peak_torque",
    "residual_torque",
    "times_at",
    "torque",
    "torque_at",
    "work",
]

_MANY = 16  # pieces, above which columns of them are faster

_SAME_ANGLE = 1e-15  # rad: the end of a motion, but for rounding


def torque(parameters: ElbowParameters, motion: Motion, times: ArrayLike) -> Floats:
    """Return the torque of a motion at given times.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.
    times : array_like, shape (n_times,)
        Times within the motion, s.

    Returns
    -------
    ndarray, shape (n_times,)
        Torque that resists extension, N·m. At the instant of an event the later
        phase holds.

    Raises
    ------
    ParameterError
        If a time is outside the motion, or the motion starts at or beyond the end
        of range.

    Examples
    --------
    HM3 at 92 deg/s before the catch, by (1): 1.26 ω + 3.15 (θ - 30 deg):

    >>> from math import radians
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> round(float(torque(STANDARD_MODELS["HM3"], stretch, [0.5])[0]), 4)
    4.5522
    """
    at = np.atleast_1d(np.asarray(times, dtype=np.float64))
    line = timeline(parameters, motion)
    end = line.end.time
    if (outside := at[~((at >= 0.0) & (at <= end))]).size:
        raise ParameterError(
            f"times: need 0 to {end:g} s, the end of the stretch, got {outside[0]:g} s"
        )
    values = np.empty(at.shape)
    laid = segments(parameters, line)
    which = np.searchsorted([segment.start for segment in laid], at, side="right") - 1
    for i, segment in enumerate(laid):
        mine = which == i
        if mine.any():
            values[mine] = segment_torque(segment, motion, at[mine])
    return values


def torque_at(parameters: ElbowParameters, motion: Motion, angles: ArrayLike) -> Floats:
    """Return the torque of a motion where it first reaches given angles.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.
    angles : array_like, shape (n_angles,)
        Angles, rad.

    Returns
    -------
    ndarray, shape (n_angles,)
        Torque that resists extension, N·m.

    Raises
    ------
    ParameterError
        If an angle is not reached, or the motion starts at or beyond the end of
        range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> torque_at(STANDARD_MODELS["HM3"], stretch, [radians(146)]).round(3)
    array([10.984])
    """
    goals = np.asarray(angles, dtype=np.float64)
    times = times_at(motion, goals)
    if (goals > parameters.range_end).any():
        raise ParameterError(
            f"angles: need {math.degrees(parameters.range_end):g} degrees, the end of "
            "range, or less"
        )
    end = timeline(parameters, motion).end.time
    return torque(parameters, motion, np.minimum(times, end))


def times_at(motion: Motion, angles: ArrayLike) -> Floats:
    """Return when a motion first reaches given angles.

    Parameters
    ----------
    motion : Motion
        The motion, SI units.
    angles : array_like, shape (n_angles,)
        Angles, rad.

    Returns
    -------
    ndarray, shape (n_angles,)
        Times, s.

    Raises
    ------
    ParameterError
        If an angle is not reached.

    Examples
    --------
    >>> from masrel.lab.elbow import MinimumJerk
    >>> times_at(MinimumJerk(start=0.5, end=2.5, mean_speed=1.0), [0.5, 1.5, 2.5])
    array([0., 1., 2.])
    """
    goals = np.atleast_1d(np.asarray(angles, dtype=np.float64)).tolist()
    return np.array([_first_time(motion, goal) for goal in goals])


def _first_time(motion: Motion, goal: float) -> float:
    # where goal - θ has not the sign any more that it has at the start
    sign = 1.0 if goal > motion.start else -1.0
    for start, length, angle, _, _ in motion.pieces() if math.isfinite(goal) else ():
        if goal == motion.start:
            return 0.0
        left = (goal - motion.origin) - angle[0]
        place = first_above([-sign * left, *[sign * c for c in angle[1:]]], 0.0, length)
        if place is not None:
            return start + place
        if abs(value(angle, length) - angle[0] - left) < _SAME_ANGLE:
            return min(start + length, motion.duration)
    raise ParameterError(
        f"angles: need ones that the motion reaches, got {math.degrees(goal):g} degrees"
    )


def peak_torque(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the largest torque of a motion, without a trace.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        The largest torque, N·m: at an event, at an end, or where a phase's torque
        turns.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> round(peak_torque(STANDARD_MODELS["HM3"], stretch), 3)
    10.984
    """
    laid = segments(parameters, timeline(parameters, motion))
    return max(map(section_peak, sections(laid, motion)))


def residual_torque(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the torque after the peak of the first catch, (3), second line.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        The torque, N·m, also where the catch ends before its peak does; ``nan``
        without a catch.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> round(residual_torque(STANDARD_MODELS["HM3"], stretch), 3)
    7.624
    """
    return loads(parameters, motion, timeline(parameters, motion), "residual_torque")


def work(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the work done against the joint, ∫ τ dθ.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        The work, J; less than 0 where the joint gave back more than it took.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    A slow stretch of 1 rad works against the damper and the spring alone,
    1.26 x 0.2 x 1 + 3.15 / 2 x 1² J:

    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=0.5, end=1.5, speed=0.2)
    >>> round(work(STANDARD_MODELS["HM3"], stretch), 12)
    1.827
    """
    return loads(parameters, motion, timeline(parameters, motion), "work")


def impulse(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the angular impulse of the joint's torque, ∫ τ dt.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        The impulse, N·m·s.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    A slow stretch of 1 rad in 5 s, 1.26 x 1 + 3.15 / 2 x 5 N·m·s:

    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=0.5, end=1.5, speed=0.2)
    >>> round(impulse(STANDARD_MODELS["HM3"], stretch), 12)
    9.135
    """
    return loads(parameters, motion, timeline(parameters, motion), "impulse")


class TorqueSegment(NamedTuple):
    """A time in which one law of torque holds."""

    # start, end: s
    start: Number
    end: Number
    law: TorqueLaw  # angles count from the motion's origin


def segments(p: ElbowParameters, line: Timeline) -> list[TorqueSegment]:
    """Return the laws of a motion in order, without those that hold for no time."""
    laid = []
    for (phase, start, angle, stretch), ended in pairwise([*line.changes, line.end]):
        end = ended.time
        if stretch is None:
            laid.append(TorqueSegment(start, end, line.law))
        elif phase == CATCH:
            peak, residual = _law.catch(p, stretch.pre_end, stretch.rise)
            risen = min(start + p.catch_rise, end)
            fallen = min(start + p.peak_duration, end)
            onset = TorqueLaw(stretch.pre_end, onset=(stretch.rise, p.catch_rise))
            laid += [
                TorqueSegment(start, risen, onset),
                TorqueSegment(risen, fallen, peak),
                TorqueSegment(fallen, end, residual),
            ]
        else:
            level, rest = residual.level, line.law.origin
            law = _law.post_catch(p, level, stretch.pre_end, angle, rest)
            laid.append(TorqueSegment(start, end, law))
    return [segment for segment in laid if segment.end > segment.start]


def segment_torque(segment: TorqueSegment, motion: Motion, at: Floats) -> Floats:
    """Return the torque of one law at times, also where the next begins, N·m."""
    law = segment.law
    values = law.commanded(motion.angle(at, motion.origin), motion.velocity(at))
    if law.inertia:
        values = values + law.inertia * motion.acceleration(at)
    if law.onset is not None:
        rise, time = law.onset
        share = np.clip((at - segment.start) / time, 0.0, 1.0)
        values = values + rise * _law.onset_share(share)
    return np.asarray(values)


class Section(NamedTuple):
    """What a law and a piece of the motion, or a column of pieces, have in common."""

    length: Number  # s
    angle: Polynomial  # rad, over s since the section began
    torque: Polynomial  # N·m


def sections(laid: list[TorqueSegment], motion: Motion) -> Iterator[Section]:
    """Cut a motion where its law or its polynomial changes."""
    if len(pieces := motion.pieces()) > _MANY:
        yield from _column_sections(laid, motion)
        return
    for segment in laid:
        for start, length, angle, _, _ in pieces:
            low = max(segment.start - start, 0.0)
            high = min(segment.end - start, length)
            if low < high:
                part = shifted(angle, low) if low else angle
                since = start + low - segment.start
                yield Section(high - low, part, segment.law.along(part, since))


def _column_sections(laid: list[TorqueSegment], motion: Motion) -> Iterator[Section]:
    # the same for many pieces: a segment's sections are columns
    start, angle = motion.rows()
    stop = np.append(start[1:], motion.duration)
    for segment in laid:
        first = np.searchsorted(stop, segment.start, side="right")
        rows = slice(int(first), int(np.searchsorted(start, segment.end)))
        low = np.maximum(segment.start - start[rows], 0.0)
        high = np.minimum(segment.end, stop[rows]) - start[rows]
        part = shifted(list(angle[:, rows]), low)
        since = start[rows] + low - segment.start
        yield Section(high - low, part, segment.law.along(part, since))


def loads(p: ElbowParameters, motion: Motion, line: Timeline, name: str) -> float:
    """Return one of the loads, by the name of its function."""
    if name == "residual_torque":
        first = line.first
        if first is None or first.catch is None:
            return math.nan
        return float(_law.catch(p, first.pre_end, first.rise)[1].level)
    parts = sections(segments(p, line), motion)
    if name == "peak_torque":
        return max(map(section_peak, parts))
    of_section = section_work if name == "work" else section_impulse
    return math.fsum(float(np.sum(of_section(part))) for part in parts)


def section_peak(section: Section) -> float:
    """Return the largest torque, N·m: at an end, or where it turns."""
    length, _, torque = section
    if isinstance(length, np.ndarray):
        return _column_peak(length, torque)
    if not math.isfinite(sum(map(abs, torque))):
        return math.inf  # more than a float can hold
    peak = float(max(torque[0], value(torque, length)))
    if len(torque) < 3:
        return peak
    turns = split_at_roots(derivative(torque), length)[1:-1]
    return float(max([peak, *[value(torque, x) for x in turns]]))


def _column_peak(length: Floats, torque: Polynomial) -> float:
    # the largest of all, where it turns only in rows that may be the largest
    best = float(np.max(np.maximum(torque[0], value(torque, length))))
    bounds = functools.reduce(np.maximum, bernstein(torque, length), 0.0 * length)
    for i in np.flatnonzero(~(bounds <= best)).tolist():
        one = [float(c[i] if np.ndim(c) else c) for c in torque]
        best = max(best, section_peak(Section(float(length[i]), [0.0], one)))
    return best


def section_work(section: Section) -> Number:
    """Return ∫ τ θ̇ dt, J."""
    power = product(section.torque, derivative(section.angle))
    return value(integral(power), section.length)


def section_impulse(section: Section) -> Number:
    """Return ∫ τ dt, N·m·s."""
    return value(integral(section.torque), section.length)

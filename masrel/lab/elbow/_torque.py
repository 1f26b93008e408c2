"""Torque of a motion at times or angles, what it asks of whoever moves the arm, traces.

All but a trace comes from the events and from polynomials, piece by piece.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1), (3) and (5).
"""

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.errors import ParameterError
from masrel.lab.elbow._events import Events, Timeline, events, phase_marks
from masrel.lab.elbow._polynomials import (
    Number,
    Polynomial,
    derivative,
    first_above,
    greatest,
    integral,
    known,
    largest,
    least,
    pick,
    product,
    shifted,
    some,
    value,
)
from masrel.lab.elbow.motions import Floats, Motion
from masrel.lab.elbow.parameters import (
    ElbowParameters,
    TorqueLaw,
    catch_laws,
    onset_share,
    post_catch_law,
)
from masrel.lab.elbow.tone import JointModel

__all__ = [
    "Outline",
    "Trace",
    "impulse",
    "outline",
    "peak_torque",
    "residual_torque",
    "times_at",
    "torque",
    "torque_at",
    "trace",
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
    line = Timeline(parameters, motion)
    end = line.end
    if (outside := at[~((at >= 0.0) & (at <= end))]).size:
        raise ParameterError(
            f"times: need 0 to {end:g} s, the end of the stretch, got {outside[0]:g} s"
        )
    values = np.empty(at.shape)
    laid = segments(line)
    which = np.searchsorted([segment.start for segment in laid], at, side="right") - 1
    moved = _moved(motion, at)
    for i, segment in enumerate(laid):
        mine = which == i
        if mine.any():
            values[mine] = _segment_torque(segment, moved[:, mine])
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
    end = Timeline(parameters, motion).end
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
        if place == place:
            return float(start + place)
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
    return float(load(Timeline(parameters, motion), motion, "peak_torque"))


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
    return float(load(Timeline(parameters, motion), motion, "residual_torque"))


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
    return float(load(Timeline(parameters, motion), motion, "work"))


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
    return float(load(Timeline(parameters, motion), motion, "impulse"))


class TorqueSegment(NamedTuple):
    """A time in which one law of torque holds; of no length in some rows of columns."""

    # start, end: s
    start: Number
    end: Number
    law: TorqueLaw  # angles count from the motion's origin


def segments(line: Timeline) -> list[TorqueSegment]:
    """Return the laws of a motion in order, without those that hold for no time."""
    p, begun, laid = line.p, 0.0, []
    for stretch in line.stretches:
        if not some(stretch.catch == stretch.catch):
            continue
        # what does not come has no length at the end
        catch, peak_end, left, over = (
            known(time, line.end)
            for time in (
                stretch.catch,
                stretch.peak_end,
                stretch.catch_end,
                stretch.over,
            )
        )
        pre_end, rise, angle = (
            known(number, 0.0)
            for number in (stretch.pre_end, stretch.rise, stretch.left_angle)
        )
        peak, residual = catch_laws(p, pre_end, rise)
        post = post_catch_law(p, residual.level, pre_end, angle, line.law.origin)
        risen = least(catch + p.catch_rise, left)
        fallen = greatest(peak_end, risen)
        onset = rise, pick(p.catch_rise > 0.0, p.catch_rise, 1.0)
        laid += [
            TorqueSegment(begun, catch, line.law),
            TorqueSegment(catch, risen, TorqueLaw(pre_end, onset=onset)),
            TorqueSegment(risen, fallen, peak),
            TorqueSegment(fallen, left, residual),
            TorqueSegment(left, over, post),
        ]
        begun = over
    laid.append(TorqueSegment(begun, line.end, line.law))
    return [segment for segment in laid if some(segment.end > segment.start)]


def _moved(motion: Motion, at: Floats) -> Floats:
    # (4, n): times, s, and how the arm is moved then: angle from the motion's origin,
    # rad, velocity and acceleration
    angle = motion.angle(at, motion.origin)
    return np.stack([at, angle, motion.velocity(at), motion.acceleration(at)])


def _segment_torque(segment: TorqueSegment, moved: Floats) -> Floats:
    # the torque of one law at such times, also where the next begins, N·m
    law, (at, angle, velocity, acceleration) = segment.law, moved
    values = law.commanded(angle, velocity)
    if law.inertia:
        values = values + law.inertia * acceleration
    if law.onset is not None:
        rise, time = law.onset
        share = np.clip((at - segment.start) / time, 0.0, 1.0)
        values = values + rise * onset_share(share)
    return np.asarray(values)


def sections(
    line: Timeline, motion: Motion, laid: list[TorqueSegment]
) -> Iterator[tuple[Number, Polynomial, Polynomial]]:
    """Cut laws where the motion's polynomial changes, the last first.

    Yields what a law and a piece, or a column of either, have in common: how long, s, 0
    or less where nothing, and angle, rad, and torque, N·m, over s since it began.
    """
    pieces: list[Any] = [piece[:3] for piece in line.pieces]
    for begun, ended, law in reversed(laid):
        if len(line.pieces) > _MANY:
            pieces = _column_of_pieces(motion, begun, ended)
        for start, length, angle in pieces:
            low, high = greatest(begun - start, 0.0), least(ended - start, length)
            if some(high > low):
                part = shifted(angle, low)
                yield high - low, part, law.along(part, start + low - begun)


def _column_of_pieces(
    motion: Motion, begun: float, ended: float
) -> list[tuple[Floats, Floats, Polynomial]]:
    # those of a long motion that are between two times, a row each
    start, angle = motion.rows()
    stop = np.append(start[1:], motion.duration)
    first = np.searchsorted(stop, begun, side="right")
    rows = slice(int(first), int(np.searchsorted(start, ended)))
    return [(start[rows], (stop - start)[rows], list(angle[:, rows]))]


def load(line: Timeline, motion: Motion, name: str) -> Number:
    """Return one of the loads, by the name of its function; of columns, of each row."""
    if name == "residual_torque":
        first = line.first
        return catch_laws(line.p, first.pre_end, first.rise)[1].level
    laid = segments(line)
    if name == "peak_torque":
        return _peak(line, motion, laid)
    amounts: list[Number] = []
    for length, angle, along in sections(line, motion, laid):
        rate = along if name == "impulse" else product(along, derivative(angle))
        amounts.append(value(integral(rate), greatest(length, 0.0)))
    if isinstance(line.end, np.ndarray):
        return sum(amounts)
    return math.fsum(map(np.sum, amounts))  # of one scene, also over its pieces


def _peak(line: Timeline, motion: Motion, laid: list[TorqueSegment]) -> Number:
    # levels first: what is more is then looked for only where it may be
    best: Number = -math.inf
    for begun, ended, law in laid:
        if law.is_flat:
            best = greatest(best, pick(ended > begun, law.level, -math.inf))
    moving = [segment for segment in laid if not segment.law.is_flat]
    for length, _, along in sections(line, motion, moving):
        best = largest(along, length, best)
        if isinstance(best, np.ndarray) and not isinstance(line.end, np.ndarray):
            best = best.max()  # of one scene, over its pieces
    return best


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """What a figure draws of a motion."""

    time: Floats = field(compare=False, repr=False)
    angle: Floats = field(compare=False, repr=False)
    torque: Floats = field(compare=False, repr=False)
    phase: NDArray[np.int8] = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trace(Line):
    """Columns of a motion at a fixed rate; arrays are read-only.

    Attributes
    ----------
    time : ndarray, shape (n_samples,)
        s.
    angle : ndarray, shape (n_samples,)
        rad.
    velocity : ndarray, shape (n_samples,)
        rad/s.
    torque : ndarray, shape (n_samples,)
        Torque that resists extension, N·m; without the inertial term.
    phase : ndarray of int8, shape (n_samples,)
        Position in `masrel.lab.recording.PHASES`.
    rate_hz : float
        Samples a second.
    """

    velocity: Floats = field(compare=False, repr=False)
    rate_hz: float


def trace(parameters: JointModel, motion: Motion, *, rate_hz: float = 1000.0) -> Trace:
    """Give the sampled law every sample of a motion.

    Parameters
    ----------
    parameters : JointModel
        The joint.
    motion : Motion
        The motion, SI units; for a spastic elbow it is cut at the end of range.
    rate_hz : float, optional
        Samples a second.

    Returns
    -------
    Trace
        What the driver's controller commands for this motion, sample for sample.

    Raises
    ------
    ParameterError
        If `rate_hz` is not more than 0, or the motion starts at or beyond the end
        of range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> made = trace(STANDARD_MODELS["HM3"], stretch)
    >>> made.time.size, int(made.phase.max())
    (1261, 2)
    """
    if not 0.0 < rate_hz < math.inf:
        raise ParameterError(f"rate_hz: needs more than 0, got {rate_hz}")
    end = motion.duration
    if isinstance(parameters, ElbowParameters):
        end = Timeline(parameters, motion).end
    time = np.arange(math.floor(end * rate_hz) + 1) / rate_hz
    angle, velocity = motion.angle(time), motion.velocity(time)
    torque, phase = _stepped(parameters, motion.start, time, angle, velocity)
    columns = (time, angle, velocity, torque, phase)
    for column in columns:
        column.setflags(write=False)
    return Trace(
        time=time,
        angle=angle,
        velocity=velocity,
        torque=torque,
        phase=phase,
        rate_hz=rate_hz,
    )


def _stepped(
    model: JointModel, start: float, time: Floats, angle: Floats, velocity: Floats
) -> tuple[Floats, NDArray[np.int8]]:
    # (n,) each: torque, N·m, and phase of the sampled law at these samples
    joint = model.stepper(start)
    torque, phase = np.empty(time.size), np.empty(time.size, dtype=np.int8)
    samples = zip(time.tolist(), angle.tolist(), velocity.tolist(), strict=True)
    for i, sample in enumerate(samples):
        torque[i] = joint.step(*sample)
        phase[i] = joint.phase
    return torque, phase


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline(Line):
    """Points of a line; where the torque jumps, two have the same time.

    Attributes
    ----------
    time : ndarray, shape (n_points,)
        s.
    angle : ndarray, shape (n_points,)
        rad.
    torque : ndarray, shape (n_points,)
        Torque that resists extension, N·m.
    phase : ndarray of int8, shape (n_points,)
        Position in `masrel.lab.recording.PHASES`.
    events : Events
        The events of the motion.
    """

    events: Events


def outline(
    parameters: ElbowParameters, motion: Motion, *, n_points: int = 800
) -> Outline:
    """Lay points along the torque of a motion, as many as a figure has pixels.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units; it is cut at the end of range.
    n_points : int, optional
        Points, to which two are added for every law that holds in it.

    Returns
    -------
    Outline
        The points, in order of time. However long the motion, they are no more.

    Raises
    ------
    ParameterError
        If `n_points` is less than 2, or the motion starts at or beyond the end of
        range.

    Examples
    --------
    Three phases and the two levels of the catch, of 11.6 s:

    >>> from math import radians
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> made = outline(STANDARD_MODELS["HM3"], stretch, n_points=100)
    >>> 100 <= made.time.size <= 108
    True
    """
    if n_points < 2:
        raise ParameterError(f"n_points: needs 2 or more, got {n_points}")
    line = Timeline(parameters, motion)
    marks = phase_marks(line)
    begun = [time for _, time, _ in marks]
    times, torques, codes = [], [], []
    for segment in segments(line):
        low, high = segment.start, segment.end
        n = max(2, math.ceil(n_points * (high - low) / line.end) + 1)
        at = np.linspace(low, high, n)
        times.append(at)
        torques.append(_segment_torque(segment, _moved(motion, at)))
        code = marks[bisect_right(begun, low) - 1][0]
        codes.append(np.full(n, code, dtype=np.int8))
    time = np.concatenate(times)
    return Outline(
        time=time,
        angle=motion.angle(time),
        torque=np.concatenate(torques),
        phase=np.concatenate(codes),
        events=events(parameters, motion),
    )


def line(
    joint: JointModel, motion: Motion, *, n_points: int = 800, rate_hz: float = 1000.0
) -> Line:
    """Return the exact law: `n_points` for an elbow, otherwise at a rate."""
    if isinstance(joint, ElbowParameters):
        return outline(joint, motion, n_points=n_points)
    time = np.arange(math.floor(motion.duration * rate_hz) + 1) / rate_hz
    phase = np.zeros(time.size, dtype=np.int8)
    for event in joint.events(motion) if joint._phases else ():
        if event.name in joint._phases:
            phase[time >= event.time] = joint._phases[event.name]
    return Line(
        time=time,
        angle=motion.angle(time),
        torque=joint.torque(motion, time),
        phase=phase,
    )

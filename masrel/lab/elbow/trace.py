"""A motion as columns: what the controller would command, or a line to draw."""

import math
from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.errors import ParameterError
from masrel.lab.elbow._events import Events, Timeline, events, phase_marks
from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow._torque import segment_torque, segments
from masrel.lab.elbow.joint_model import JointModel
from masrel.lab.elbow.parameters import ElbowParameters

__all__ = ["Outline", "Trace", "outline", "trace"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trace:
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

    time: NDArray[np.float64] = field(compare=False, repr=False)
    angle: NDArray[np.float64] = field(compare=False, repr=False)
    velocity: NDArray[np.float64] = field(compare=False, repr=False)
    torque: NDArray[np.float64] = field(compare=False, repr=False)
    phase: NDArray[np.int8] = field(compare=False, repr=False)
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
class Outline:
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

    time: Floats = field(compare=False, repr=False)
    angle: Floats = field(compare=False, repr=False)
    torque: Floats = field(compare=False, repr=False)
    phase: NDArray[np.int8] = field(compare=False, repr=False)
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
        torques.append(segment_torque(segment, motion, at))
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

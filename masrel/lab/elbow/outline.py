"""A motion as a line to draw: few points, every jump as a jump."""

import math
from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.errors import ParameterError
from masrel.lab.elbow._events import Events, events, timeline
from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow._torque import segment_torque, segments
from masrel.lab.elbow.parameters import ElbowParameters

__all__ = ["Outline", "outline"]


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
    line = timeline(parameters, motion)
    times, torques, codes = [], [], []
    starts = [change.time for change in line.changes]
    for segment in segments(parameters, line):
        low, high = segment.start, segment.end
        n = max(2, math.ceil(n_points * (high - low) / line.end.time) + 1)
        at = np.linspace(low, high, n)
        times.append(at)
        torques.append(segment_torque(segment, motion, at))
        code = line.changes[bisect_right(starts, low) - 1].phase
        codes.append(np.full(n, code, dtype=np.int8))
    time = np.concatenate(times)
    return Outline(
        time=time,
        angle=motion.angle(time),
        torque=np.concatenate(torques),
        phase=np.concatenate(codes),
        events=events(parameters, motion),
    )

"""Strokes: the movements in one direction of a device that is backdriven."""

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.kinematics import filter_alike, window_length
from masrel.elbow.identification.samples import Samples

__all__ = ["Moved", "Stroke", "find_strokes"]

Floats = NDArray[np.float64]

MOVING = math.radians(5.0)
"""Slower, the direction of motion is not certain and the device may stick, rad/s."""

WINDOW = 0.1
"""Window of the filter of angle and torque, s."""

SHORTEST = 0.1
"""A stroke lasts at least this long, s."""


Moved = tuple[Floats, Floats, Floats, Floats]
"""Time, velocity, acceleration and torque of a stroke, SI units."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stroke:
    """A movement in one direction, as the fit sees it.

    Attributes
    ----------
    recording : str
        Where it is from.
    time, velocity, acceleration, torque, fitted : ndarray, shape (n_samples,)
        s, rad/s, rad/s², N·m (smoothed by one filter), and the law, N·m.
    """

    recording: str
    time: Floats = field(compare=False, repr=False)
    velocity: Floats = field(compare=False, repr=False)
    acceleration: Floats = field(compare=False, repr=False)
    torque: Floats = field(compare=False, repr=False)
    fitted: Floats = field(compare=False, repr=False)


def find_strokes(samples: Samples) -> list[Moved]:
    """Find the movements in one direction.

    Parameters
    ----------
    samples : Samples
        A recording.

    Returns
    -------
    list of Moved
        Filtered; those that last long enough and hold no gap.
    """
    margin = window_length(WINDOW, samples.period) // 2 + 1
    _, velocity, acceleration, torque = filter_alike(
        samples.angle, samples.torque, samples.period, WINDOW
    )
    time = samples.time[margin:-margin]
    unusable = np.convolve(
        samples.missing | samples.saturated, np.ones(2 * margin + 1), mode="valid"
    )
    # sgn of (7) is one number within the window of the filter, or it is not used
    direction = np.where(np.abs(velocity) > MOVING, np.sign(velocity), 0.0)
    direction[unusable > 0.5] = 0.0
    edges = np.flatnonzero(np.diff(direction, prepend=0.0, append=0.0))
    found = []
    for start, stop in pairwise(edges):
        inner = slice(start + margin, stop - margin)
        long = (stop - start - 2 * margin) * samples.period >= SHORTEST
        if direction[start] != 0.0 and long:
            found.append(
                (time[inner], velocity[inner], acceleration[inner], torque[inner])
            )
    return found

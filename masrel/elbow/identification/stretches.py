"""The stretches of a recording: where the joint is extended, slowly or fast."""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.kinematics import differentiate
from masrel.elbow.identification.movement import LEAST_TRAVEL
from masrel.elbow.identification.samples import Samples

__all__ = ["Pace", "Stretch", "find_stretches"]

Floats = NDArray[np.float64]

Pace = Literal["slow", "fast"]

MOVING = math.radians(2.0)
"""A joint that extends slower rests: an encoder's steps make less than this, rad/s."""

SHORTEST_REST = 0.1
"""A rest shorter than this, without going back, does not end a stretch, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """One extension of the joint.

    Attributes
    ----------
    samples : Samples
        The recording it is in.
    start, stop : int
        Its samples are those from `start` to before `stop`.
    angle, velocity, acceleration : ndarray, shape (stop - start,)
        Smoothed, SI units.
    pace : {"slow", "fast"}
        Whether its speed stays below what can catch.
    """

    samples: Samples
    start: int
    stop: int
    angle: Floats = field(compare=False, repr=False)
    velocity: Floats = field(compare=False, repr=False)
    acceleration: Floats = field(compare=False, repr=False)
    pace: Pace

    @property
    def time(self) -> Floats:
        """Times of its samples, s."""
        return self.samples.time[self.start : self.stop]

    @property
    def raw_angle(self) -> Floats:
        """Angles as the encoder reads them, rad."""
        return self.samples.angle[self.start : self.stop]

    @property
    def torque(self) -> Floats:
        """Torque, N·m."""
        return self.samples.torque[self.start : self.stop]

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Samples within a gap."""
        return self.samples.missing[self.start : self.stop]

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Samples whose torque is cut off."""
        return self.samples.saturated[self.start : self.stop]

    @property
    def peak_speed(self) -> float:
        """Largest speed, rad/s."""
        return float(self.velocity.max())


def find_stretches(
    samples: Samples, *, window: float, slow_below: float
) -> list[Stretch]:
    """Find where the joint is extended by 15 degrees or more.

    Parameters
    ----------
    samples : Samples
        The recording.
    window : float
        Length of the window of the filter that gives the speed, s.
    slow_below : float
        A stretch whose speed stays below is slow, rad/s.

    Returns
    -------
    list of Stretch
        In order of time.
    """
    angle, velocity, acceleration = differentiate(samples.angle, samples.period, window)
    found = []
    for start, stop in _runs(samples, angle, velocity):
        if angle[stop - 1] - angle[start] < LEAST_TRAVEL:
            continue
        part = slice(start, stop)
        pace: Pace = "slow" if velocity[part].max() < slow_below else "fast"
        found.append(
            Stretch(
                samples=samples,
                start=start,
                stop=stop,
                angle=angle[part],
                velocity=velocity[part],
                acceleration=acceleration[part],
                pace=pace,
            )
        )
    return found


def _runs(samples: Samples, angle: Floats, velocity: Floats) -> list[tuple[int, int]]:
    moving = np.concatenate([[False], velocity > MOVING, [False]])
    edges = np.flatnonzero(np.diff(moving.astype(np.int8)))
    runs: list[tuple[int, int]] = []
    shortest = SHORTEST_REST / samples.period
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if runs and start - runs[-1][1] < shortest:
            if angle[start] >= angle[runs[-1][1] - 1] - MOVING * SHORTEST_REST:
                runs[-1] = (runs[-1][0], stop)
                continue
        runs.append((start, stop))
    return runs

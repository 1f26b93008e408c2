"""The angles that were read, from what a recording keeps of them.

A recording keeps angles in degrees, and from radians to degrees and back a float may
end one last bit aside. The speed that was estimated from the angles is recorded too and
tells such neighbours apart, so that the readings come back to the last bit.
"""

import copy
import math
from typing import TypeAlias

import numpy as np

from masrel.hess.velocity import VelocityEstimate

__all__ = ["recorded_angles"]

_MOST_PATHS = 64

_Path: TypeAlias = "tuple[float, _Path] | None"  # an angle, and those before it


def recorded_angles(
    times_s: list[float], angles_deg: list[float], velocities_deg_s: list[float]
) -> tuple[list[float], bool]:
    """Return the angles that were read, from what was recorded of them."""
    # Takes times_s (n_readings,), angles_deg (n_readings,), velocities_deg_s
    # One last bit of an angle is many of a speed over 1 ms, so few paths live long.
    paths: list[tuple[_Path, VelocityEstimate]] = [(None, VelocityEstimate())]
    for time_s, angle, velocity in zip(
        times_s, angles_deg, velocities_deg_s, strict=True
    ):
        ways = _radians_of(angle)
        grown: list[tuple[_Path, VelocityEstimate]] = []
        for path, estimate in paths:
            for way in ways:
                tried = copy.copy(estimate)
                if _degrees(tried.update(time_s, way)) == velocity:
                    grown.append(((way, path), tried))
        if not grown:
            return [math.radians(angle) for angle in angles_deg], False
        paths = grown[:_MOST_PATHS]
    return _walked(paths[0][0]), True


def _walked(path: _Path) -> list[float]:
    angles = []
    while path is not None:
        angle, path = path
        angles.append(angle)
    return angles[::-1]


def _radians_of(angle_deg: float) -> list[float]:
    # Every float whose degrees are these, the nearest first: a degree is 57 of a
    # radian, so that up to two neighbours may share them.
    near = math.radians(angle_deg)
    below, above = math.nextafter(near, -math.inf), math.nextafter(near, math.inf)
    return [way for way in (near, below, above) if _degrees(way) == angle_deg]


def _degrees(angle: float) -> float:
    return float(np.degrees(angle))  # as the recording was made

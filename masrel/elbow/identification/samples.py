"""A recording on even times, with what must not be used marked."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.movement import Movement

__all__ = ["LONGEST_GAP", "Samples", "even_samples"]

Floats = NDArray[np.float64]

LONGEST_GAP = 0.02
"""Gaps up to this are bridged by straight lines, longer ones are left out, s."""

EVEN = 1e-3
"""Steps that differ from the median by less than this share of it are even."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """A movement at even times.

    Attributes
    ----------
    name : str
        Where it is from.
    period : float
        Time between samples, s.
    time, angle, torque : ndarray, shape (n_samples,)
        s, rad, N·m.
    missing : ndarray of bool, shape (n_samples,)
        Samples within a gap of the recording.
    saturated : ndarray of bool, shape (n_samples,)
        Samples whose torque is cut off.
    """

    name: str
    period: float
    time: Floats = field(compare=False, repr=False)
    angle: Floats = field(compare=False, repr=False)
    torque: Floats = field(compare=False, repr=False)
    missing: NDArray[np.bool_] = field(compare=False, repr=False)
    saturated: NDArray[np.bool_] = field(compare=False, repr=False)


def even_samples(movement: Movement) -> Samples:
    """Put a movement on even times.

    Parameters
    ----------
    movement : Movement
        The recording.

    Returns
    -------
    Samples
        The recording itself if its times are even to a thousandth of a period; else
        its values by linear interpolation at the median period.
    """
    time = movement.time
    steps = np.diff(time)
    period = float(np.median(steps))
    if np.abs(steps - period).max() <= EVEN * period:
        return Samples(
            name=movement.name,
            period=period,
            time=time,
            angle=movement.angle,
            torque=movement.torque,
            missing=np.zeros(time.size, dtype=np.bool_),
            saturated=movement.saturated,
        )
    even = time[0] + period * np.arange(int((time[-1] - time[0]) / period + 1e-9) + 1)
    before = np.clip(np.searchsorted(time, even, side="right") - 1, 0, time.size - 2)
    cut = movement.saturated
    inside = (even > time[before]) & (even < time[before + 1])
    return Samples(
        name=movement.name,
        period=period,
        time=even,
        angle=np.interp(even, time, movement.angle),
        torque=np.interp(even, time, movement.torque),
        missing=inside & (steps[before] > max(LONGEST_GAP, 5.0 * period)),
        saturated=cut[before] | (cut[before + 1] & inside),
    )

"""How far into a catch an end of it would be told from noise."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.changes import LEAST_GAIN, LEAST_SIGNAL
from masrel.elbow.identification.trials import Trial
from masrel.elbow.parameters import ElbowParameters

__all__ = ["Horizon", "horizon"]

Floats = NDArray[np.float64]

CANDIDATES = 200
"""Ends that are tried, whatever the number of samples."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Horizon:
    """The travel up to which the end of one catch would have been seen.

    Attributes
    ----------
    travel : float
        An end here would be found as often as not, rad.
    softness : float
        Standard deviation of where noise lets the search find one last, rad.
    """

    travel: float
    softness: float


def horizon(
    trial: Trial, stiffness: float, constants: ElbowParameters
) -> Horizon | None:
    """Find how late the catch of a trial could end and be seen to.

    Parameters
    ----------
    trial : Trial
        A trial whose catch does not end.
    stiffness : float
        k_post, N·m/rad: what an end makes the torque climb with, and nothing else
        (m is 0, and post-catch goes on from the residual torque).
    constants : ElbowParameters
        ΔT_peak.

    Returns
    -------
    Horizon or None
        None without a catch, or if no end of it could be seen at all.

    Notes
    -----
    An end is found if its climb takes `LEAST_GAIN` residual variances off the sum of
    squares and adds up to `LEAST_SIGNAL` standard deviations. The root of that gain
    is a t whose error has a standard deviation of 1, which over the slope of t
    against the angle of the end is the softness.
    """
    if trial.catch is None or trial.after is None or not stiffness > 0.0:
        return None
    catch = trial.catch
    angle = trial.after.angle[trial.after.time >= catch.time + constants.peak_duration]
    if angle.size == 0:
        return None
    ends = np.unique(np.linspace(0, angle.size - 1, CANDIDATES).astype(np.int64))
    climb = np.maximum(angle - angle[ends, None], 0.0)  # (n_ends, n_samples)
    about = climb - climb.mean(axis=1, keepdims=True)
    scatter = np.sqrt((about**2).sum(axis=1))
    seen = stiffness * scatter / catch.residual_sd
    rises = climb[:, -1] > 0.0  # but for the last sample
    needed = np.full(ends.size, math.sqrt(LEAST_GAIN))
    least = LEAST_SIGNAL * scatter[rises] / climb[rises, -1]
    needed[rises] = np.maximum(needed[rises], least)
    return _last(angle[ends] - catch.angle, seen - needed)


def _last(travel: Floats, spare: Floats) -> Horizon | None:
    # where what is to spare runs out for good: an end at the last sample adds nothing
    enough = np.flatnonzero(spare[:-1] >= 0.0)
    if enough.size == 0:
        return None
    last = int(enough[-1])
    fall = float(spare[last] - spare[last + 1])
    slope = float(travel[last + 1] - travel[last]) / fall
    return Horizon(
        travel=float(travel[last]) + slope * float(spare[last]), softness=slope
    )

"""Whether the torque drifts in each trial in a way of its own.

Drifts whose signs differ cancel in a mean over trials. So each slow trial is given one,
and what they explain is held against what is left (F), in means over 0.25 s, which are
as good as independent where a sensor's noise is correlated over less.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from masrel.lab.elbow.identification._stretches import Part

_Floats = NDArray[np.float64]

_BLOCK = 0.25  # s
_MIN_BLOCKS = 4  # of a trial
_RANK_TOLERANCE = 1e-8  # relative to columns of length 1
_ROUNDING = 1e-20  # of a sum of squares


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftTest:
    """F of drifts that differ, degrees of freedom of its denominator, and p."""

    ratio: float
    df: int
    p_value: float


def own_drifts(slow: Sequence[Part], gravity_angle: float) -> DriftTest | None:
    """Test whether slow trials drift each in a way of its own; None if too few tell.

    Those are drifts beyond what trials have in common: one drift, b, k, weight,
    inertia, a stiffness and a damping that bend.
    """
    trials = [_block_means(part, gravity_angle) for part in slow]
    trials = [means for means in trials if len(means) >= _MIN_BLOCKS]
    if len(trials) < 2:
        return None
    which = np.repeat(np.arange(len(trials)), [len(means) for means in trials])
    offsets = np.eye(len(trials))[which]  # (n_blocks, n_trials)
    table = np.concatenate(trials)
    time, torque = table[:, :1], table[:, -1]
    in_common = np.column_stack([offsets, table[:, :-1]])
    before, n_before = _left(in_common, torque)
    left, n_columns = _left(np.column_stack([in_common, offsets * time]), torque)
    n_more, df = n_columns - n_before, which.size - n_columns
    if n_more < 1 or df < 1:
        return None
    left = max(left, _ROUNDING * float(torque @ torque))  # of torque without noise
    ratio = max((before - left) / n_more / (left / df), 0.0)
    return DriftTest(ratio=ratio, df=df, p_value=float(fdtrc(n_more, df, ratio)))


def _block_means(part: Part, gravity_angle: float) -> _Floats:
    # columns of time, of what the law and an arm have, and of torque
    if part.time.size == 0:
        return np.zeros((0, 8))
    columns = (
        part.time - part.time.mean(),
        part.velocity,
        part.angle,
        part.acceleration,
        np.sin(part.angle - gravity_angle),
        part.angle**2,
        part.velocity**2,
        part.measured,
    )
    n_blocks = max(int((part.time[-1] - part.time[0]) / _BLOCK), 1)
    blocks = np.array_split(np.column_stack(columns), n_blocks)
    return np.array([block.mean(axis=0) for block in blocks])


def _left(design: _Floats, target: _Floats) -> tuple[float, int]:
    # sum of squares of what least squares leave, and the rank of the design
    size = np.linalg.norm(design, axis=0)
    scaled = design / np.where(size > 0.0, size, 1.0)
    values, _, rank, _ = np.linalg.lstsq(scaled, target, rcond=_RANK_TOLERANCE)
    return float(((target - scaled @ values) ** 2).sum()), int(rank)

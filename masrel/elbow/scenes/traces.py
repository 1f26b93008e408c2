"""Torque traces of many scenes in one array: what the driver would command for each.

Rows are made block by block, in buffers that stay in the processor's cache; a phase is
evaluated only in the columns where some row of the block is in it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from masrel.elbow.course import end_time
from masrel.elbow.motion import Floats, Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.scenes.batch import check_starts, motions_of, paired
from masrel.elbow.scenes.course import Motions
from masrel.elbow.scenes.fill import BLOCK, Fill
from masrel.elbow.scenes.rows import LAWS
from masrel.elbow.scenes.samples import phase_samples
from masrel.elbow.scenes.table import Joints, joints_of
from masrel.elbow.trace import trace
from masrel.errors import ParameterError

__all__ = ["torque_traces"]


def torque_traces(
    parameters: ElbowParameters | Sequence[ElbowParameters],
    motions: Motion | Sequence[Motion],
    *,
    rate_hz: float = 1000.0,
) -> Floats:
    """Sample the torque of many scenes as the controller would command it.

    Parameters
    ----------
    parameters : ElbowParameters or sequence of ElbowParameters
        The joints, one a scene; or one for all.
    motions : Motion or sequence of Motion
        The motions, one a scene; or one for all.
    rate_hz : float, optional
        Samples a second.

    Returns
    -------
    ndarray, shape (n_scenes, n_samples)
        Row by row the bits of ``trace(...).torque``, N·m; ``nan`` from the end of a
        motion on that is shorter than others.

    Raises
    ------
    ParameterError
        If `rate_hz` is not more than 0, the numbers of joints and motions do not fit,
        or a motion starts at or beyond the end of range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed, trace
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> made = torque_traces(list(STANDARD_MODELS.values()), stretch)
    >>> made.shape
    (4, 1261)
    >>> bool((made[2] == trace(STANDARD_MODELS["HM3"], stretch).torque).all())
    True
    """
    if not 0.0 < rate_hz < math.inf:
        raise ParameterError(f"rate_hz: needs more than 0, got {rate_hz}")
    joints, moves = paired(parameters, motions)
    groups = [
        _Group.of(kind, np.array(rows), joints, moves, rate_hz)
        for kind, rows in _kinds(joints, moves).items()
    ]
    out = np.empty((len(moves), max(int(group.n_samples.max()) for group in groups)))
    for group in groups:
        for i in group.rows[group.fill(out)].tolist():
            torque = trace(joints[i], moves[i], rate_hz=rate_hz).torque
            out[i, : torque.size] = torque
            out[i, torque.size :] = np.nan
    return out


def _kinds(
    joints: Sequence[ElbowParameters], moves: Sequence[Motion]
) -> dict[type[Motion], list[int]]:
    found: dict[type[Motion], list[int]] = {}
    for i, (joint, motion) in enumerate(zip(joints, moves, strict=True)):
        is_plain = joint.post_catch == "continuous" and joint.catch_rise == 0.0
        found.setdefault(type(motion) if is_plain else Motion, []).append(i)
    return found


@dataclass(frozen=True, slots=True)
class _Group:
    """Scenes whose motions are of one kind."""

    kind: type[Motion]
    rows: np.ndarray
    n_samples: np.ndarray
    rate_hz: float
    joints: Joints | None = None  # None: each is stepped through alone
    motions: Motions | None = None

    @classmethod
    def of(
        cls,
        kind: type[Motion],
        rows: np.ndarray,
        joints: Sequence[ElbowParameters],
        moves: Sequence[Motion],
        rate_hz: float,
    ) -> "_Group":
        own = [joints[i] for i in rows.tolist()]
        stretches = [moves[i] for i in rows.tolist()]
        check_starts(own, stretches, rows)
        columns, motions = None, None
        alone = np.ones(rows.size, dtype=np.bool_)
        ends = np.empty(rows.size)
        if kind in LAWS:
            columns, motions = joints_of(own), motions_of(kind, stretches)
            ends, alone = LAWS[kind].ends(columns, motions)
        for i in np.flatnonzero(alone).tolist():
            ends[i] = end_time(own[i], stretches[i])
        n_samples = np.floor(ends * rate_hz).astype(np.intp) + 1
        return cls(kind, rows, n_samples, rate_hz, columns, motions)

    def fill(self, out: Floats) -> np.ndarray:
        """Write the rows, and return which of them are left."""
        if self.joints is None or self.motions is None:
            return np.ones(self.rows.size, dtype=np.bool_)
        law = LAWS[self.kind](self.motions)
        found = phase_samples(
            self.joints, law.kinematics(), self.n_samples, self.rate_hz
        )
        time = np.arange(out.shape[1]) / self.rate_hz
        columns = (self.joints, self.motions, law, found)
        fill = Fill(*columns, self.n_samples, time, [out[i] for i in self.rows])
        rows = np.flatnonzero(~found.is_doubtful)
        rows = rows[np.argsort(found.catch[rows], kind="stable")]
        for first in range(0, rows.size, BLOCK):
            fill.block(rows[first : first + BLOCK])
        return found.is_doubtful

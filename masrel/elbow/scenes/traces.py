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
from masrel.elbow.motions import ConstantSpeed, MinimumJerk
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.scenes.batch import check_starts, motions_of, paired
from masrel.elbow.scenes.constant import constant_ends
from masrel.elbow.scenes.course import Motions
from masrel.elbow.scenes.quintic import quintic_ends
from masrel.elbow.scenes.samples import Kinematics, PhaseSamples, phase_samples
from masrel.elbow.scenes.table import Joints, joints_of
from masrel.elbow.trace import trace
from masrel.errors import ParameterError

__all__ = ["torque_traces"]

_BLOCK = 24  # rows: with 1500 samples a buffer of them is 290 kB


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
class _Work:
    """Buffers of one block, contiguous: what is worked on lies together."""

    angle: Floats
    share: Floats
    spare: Floats


class _Constant:
    """Angles and speeds of `ConstantSpeed`, operation by operation."""

    ends = staticmethod(constant_ends)

    def __init__(self, motions: Motions) -> None:
        self.start, self.speed = motions.start, motions.speed

    def kinematics(self) -> Kinematics:
        return Kinematics(
            angle=lambda t: self.start + self.speed * t,
            velocity=lambda t: self.speed + 0.0 * t,
            fastest=np.full(self.speed.shape, 1e9),  # s: not before the end
            top_speed=self.speed,
            is_rising=True,  # sums and products of floats keep their order
        )

    def angle(self, rows: np.ndarray, time: Floats, work: _Work) -> Floats:
        out = work.angle
        np.multiply(self.speed[rows, np.newaxis], time, out=out)
        out += self.start[rows, np.newaxis]
        return out

    def damped(self, rows: np.ndarray, damping: Floats, _: _Work) -> Floats:
        return damping * self.speed[rows, np.newaxis]


class _Quintic:
    """Angles and speeds of `MinimumJerk`, operation by operation."""

    ends = staticmethod(quintic_ends)

    def __init__(self, motions: Motions) -> None:
        self.start, self.speed = motions.start, motions.speed
        self.way = motions.end - motions.start
        self.duration = self.way / self.speed

    def kinematics(self) -> Kinematics:
        def angle(t: Floats) -> Floats:
            s = t / self.duration
            share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
            return np.asarray(self.start + self.way * share)

        def velocity(t: Floats) -> Floats:
            s = t / self.duration
            rest = s * (1.0 - s)
            return np.asarray(30.0 * self.speed * rest * rest)

        return Kinematics(
            angle=angle,
            velocity=velocity,
            fastest=0.5 * self.duration,
            top_speed=1.875 * self.speed,
            is_rising=False,
        )

    def angle(self, rows: np.ndarray, time: Floats, work: _Work) -> Floats:
        s, out, cube = work.share, work.angle, work.spare
        np.divide(time, self.duration[rows, np.newaxis], out=s)
        np.multiply(6.0, s, out=out)
        out -= 15.0
        out *= s
        out += 10.0
        np.multiply(s, s, out=cube)
        cube *= s
        out *= cube
        out *= self.way[rows, np.newaxis]
        out += self.start[rows, np.newaxis]
        return out

    def damped(self, rows: np.ndarray, damping: Floats, work: _Work) -> Floats:
        # of the shares that `angle` left
        s, rest = work.share, work.spare
        np.subtract(1.0, s, out=rest)
        rest *= s
        np.multiply((30.0 * self.speed[rows])[:, np.newaxis], rest, out=s)
        s *= rest
        s *= damping
        return s


_LAWS: dict[type[Motion], "type[_Constant] | type[_Quintic]"] = {
    ConstantSpeed: _Constant,
    MinimumJerk: _Quintic,
}


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
        if kind in _LAWS:
            columns, motions = joints_of(own), motions_of(kind, stretches)
            ends, alone = _LAWS[kind].ends(columns, motions)
        for i in np.flatnonzero(alone).tolist():
            ends[i] = end_time(own[i], stretches[i])
        n_samples = np.floor(ends * rate_hz).astype(np.intp) + 1
        return cls(kind, rows, n_samples, rate_hz, columns, motions)

    def fill(self, out: Floats) -> np.ndarray:
        """Write the rows, and return which of them are left."""
        if self.joints is None or self.motions is None:
            return np.ones(self.rows.size, dtype=np.bool_)
        law = _LAWS[self.kind](self.motions)
        found = phase_samples(
            self.joints, law.kinematics(), self.n_samples, self.rate_hz
        )
        time = np.arange(out.shape[1]) / self.rate_hz
        columns = (self.joints, self.motions, law, found)
        fill = _Fill(*columns, self.n_samples, time, [out[i] for i in self.rows])
        rows = np.flatnonzero(~found.is_doubtful)
        rows = rows[np.argsort(found.catch[rows], kind="stable")]
        for first in range(0, rows.size, _BLOCK):
            fill.block(rows[first : first + _BLOCK])
        return found.is_doubtful


class _Fill:
    """Writes the rows of one kind of motion."""

    def __init__(
        self,
        joints: Joints,
        motions: Motions,
        law: _Constant | _Quintic,
        found: PhaseSamples,
        n_samples: np.ndarray,
        time: Floats,
        out: list[Floats],
    ) -> None:
        self.joints, self.law, self.found = joints, law, found
        self.n, self.time, self.out = n_samples, time, out
        rest = np.where(np.isnan(joints.rest_angle), motions.start, joints.rest_angle)
        self.rest = rest
        caught = found.catch_angle - rest
        self.pre_end = joints.damping * found.catch_speed + joints.stiffness * caught
        rise = joints.catch_torque_constant * found.catch_speed
        self.peak = self.pre_end + rise
        self.residual = self.pre_end + joints.residual_share * rise
        self._buffers = [np.empty((_BLOCK, time.size)) for _ in range(5)]

    def block(self, rows: np.ndarray) -> None:
        """Write some rows; their buffers are of the columns that a phase needs."""
        found, n = self.found, int(self.n[rows].max())
        catch, again = found.catch[rows], found.post_end[rows]
        post, first, last = found.post[rows], int(found.post[rows].min()), again.min()
        before = self._pre_catch(rows, 0, int(catch.max()), 0)
        after = self._post_catch(rows, first, int(again.max())) if first < n else before
        later = self._pre_catch(rows, int(last), n, 1) if last < n else before
        own = (rows, catch, found.fallen[rows], post, again, self.n[rows])
        levels = (self.peak[rows], self.residual[rows])
        columns = (column.tolist() for column in (*own, *levels))
        for k, (i, c, f, p, e, end, peak, residual) in enumerate(
            zip(*columns, strict=True)
        ):
            target = self.out[i]
            target[:c] = before[k, :c]
            if c < end:
                target[c:f] = peak  # (3), first line
                target[f:p] = residual  # (3), second line
                if p < end:
                    target[p:e] = after[k, p - first : e - first]
                if e < end:
                    target[e:end] = later[k, e - last : end - last]
            if end < target.size:
                target[end:] = np.nan

    def _work(self, which: int, low: int, high: int, n_rows: int) -> _Work:
        size = n_rows * (high - low)
        return _Work(
            *(
                self._buffers[k].ravel()[:size].reshape(n_rows, high - low)
                for k in (which, 3, 4)
            )
        )

    def _pre_catch(self, rows: np.ndarray, low: int, high: int, which: int) -> Floats:
        work, joints = self._work(which, low, high, rows.size), self.joints
        torque = self.law.angle(rows, self.time[low:high], work)
        damped = self.law.damped(rows, joints.damping[rows, np.newaxis], work)
        torque -= self.rest[rows, np.newaxis]
        torque *= joints.stiffness[rows, np.newaxis]
        torque += damped  # (1)
        return torque

    def _post_catch(self, rows: np.ndarray, low: int, high: int) -> Floats:
        work = self._work(2, low, high, rows.size)
        torque = self.law.angle(rows, self.time[low:high], work)
        torque -= self.found.post_angle[rows, np.newaxis]
        torque *= self.joints.post_catch_stiffness[rows, np.newaxis]
        torque += self.residual[rows, np.newaxis]  # (5)
        return torque

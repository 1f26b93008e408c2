"""Rows of traces, made block by block in buffers that stay in the cache."""

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.rows import ConstantRows, QuinticRows, Work
from masrel.elbow.scenes.samples import PhaseSamples
from masrel.elbow.scenes.table import Joints, Motions

__all__ = ["BLOCK", "Fill"]

BLOCK = 24
"""Rows at a time: with 1500 samples a buffer of them is 290 kB."""


class Fill:
    """Writes the rows of one kind of motion."""

    def __init__(
        self,
        joints: Joints,
        motions: Motions,
        law: ConstantRows | QuinticRows,
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
        self._buffers = [np.empty((BLOCK, time.size)) for _ in range(5)]

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

    def _work(self, which: int, low: int, high: int, n_rows: int) -> Work:
        size = n_rows * (high - low)
        return Work(
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

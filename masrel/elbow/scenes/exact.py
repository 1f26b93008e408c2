"""Torque of many scenes from their exact events: one polynomial in time a phase.

The torque of a block of rows is a product of two matrices: coefficients, a row a scene,
and powers of time, which all rows have in common.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1), (3) and (5).
"""

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.motion import Floats, Motion
from masrel.elbow.motions import ConstantSpeed, MinimumJerk
from masrel.elbow.scenes.course import Courses, Flags
from masrel.elbow.scenes.effort import Efforts
from masrel.elbow.scenes.table import Motions

__all__ = ["ExactRows"]

Indices = NDArray[np.intp]
_Lines = list[tuple[int, int, int, int, int, float, float]]

_SHARES: dict[type[Motion], tuple[float, ...]] = {
    ConstantSpeed: (0.0, 1.0),
    MinimumJerk: (0.0, 0.0, 0.0, 10.0, -15.0, 6.0),
}
# share of the way, in powers of the share of the duration

_ROWS, _COLUMNS = 48, 768
# What is multiplied at a time: it stays in the cache, and no matrix library finds it
# worth a second thread.


class ExactRows:
    """Writes the rows of one kind of motion.

    Parameters
    ----------
    kind : type
        `ConstantSpeed` or `MinimumJerk`.
    motions : Motions
        The stretches.
    courses : Courses
        Their events.
    efforts : Efforts
        Their torques at the events.
    n_samples : ndarray of int, shape (n_scenes,)
        Samples of each.
    rate_hz : float
        Samples a second.
    """

    def __init__(
        self,
        kind: type[Motion],
        motions: Motions,
        courses: Courses,
        efforts: Efforts,
        n_samples: Indices,
        rate_hz: float,
    ) -> None:
        joints, c = efforts.joints, courses
        time = np.arange(int(n_samples.max())) / rate_hz

        def first(event: Floats, known: Flags) -> Indices:
            # at the instant of an event the later phase holds
            found = np.searchsorted(time, np.where(known, event, np.inf))
            return np.minimum(found, n_samples)

        self._n = n_samples
        self._catch = first(c.catch.high, c.catches)
        self._post = first(c.catch_end.high, c.leaves)
        fallen = first((c.catch + joints.peak_duration).high, c.catches)
        self._fallen = np.minimum(fallen, self._post)
        self._post_end = first(c.post_end.high, c.slows)
        self._peak = efforts.pre_end + efforts.rise
        self._residual = efforts.pre_end + joints.residual_share * efforts.rise
        longest = float(time[-1]) if time.size > 1 else 1.0
        self._before, self._after = _coefficients(kind, motions, efforts, longest)
        self._powers = _powers(time / longest, self._before.shape[1])
        self._buffer = np.empty((_ROWS, time.size))

    def fill(self, out: Floats, places: Indices, rows: Indices) -> None:
        """Write some scenes.

        Parameters
        ----------
        out : ndarray, shape (any, n_columns)
            Traces; ``nan`` where they have ended.
        places : ndarray of int, shape (n_scenes,)
            The row of each scene in it.
        rows : ndarray of int
            Which scenes.
        """
        if not rows.size:
            return
        ends, post, again = self._n[rows], self._post[rows], self._post_end[rows]
        cuts = (self._catch[rows], self._fallen[rows], post, again, ends)
        levels = (self._peak[rows], self._residual[rows])
        lines = list(zip(*(each.tolist() for each in (*cuts, *levels)), strict=True))
        blocks = np.arange(0, rows.size, _ROWS)
        columns = (
            np.maximum.reduceat(self._catch[rows], blocks).tolist(),
            np.minimum.reduceat(again, blocks).tolist(),
            np.maximum.reduceat(ends, blocks).tolist(),
            np.minimum.reduceat(post, blocks).tolist(),
            np.maximum.reduceat(again, blocks).tolist(),
        )
        at = places[rows]
        for first, *reach in zip(blocks.tolist(), *columns, strict=True):
            some = slice(first, first + _ROWS)
            own, to = rows[some], at[some]
            if to[-1] - to[0] == own.size - 1:  # they are neighbours
                block = out[to[0] : to[-1] + 1]
                self._block(own, block, lines[some], reach)
            else:
                block = np.empty((own.size, out.shape[1]))
                self._block(own, block, lines[some], reach)
                out[to] = block

    def _block(
        self, rows: Indices, out: Floats, lines: _Lines, reach: list[int]
    ) -> None:
        # (1) but for columns in which no row is pre-catch, and over it what is not
        last_catch, first_again, end, first_post, last_post = reach
        before = self._before[rows]
        self._multiply(before, 0, last_catch, out)
        self._multiply(before, max(last_catch, first_again), end, out)
        if first_post < last_post:
            self._multiply(self._after[rows], first_post, last_post, self._buffer)
        for row, later, line in zip(out, self._buffer, lines, strict=False):
            c, f, p, e, end, peak, residual = line
            if c < end:
                row[c:f] = peak  # (3), first line
                row[f:p] = residual  # (3), second line
                if p < e:
                    row[p:e] = later[p:e]  # (5)
            if end < row.size:
                row[end:] = np.nan

    def _multiply(self, coefficients: Floats, low: int, high: int, out: Floats) -> None:
        n_rows = len(coefficients)
        for first in range(low, high, _COLUMNS):
            last = min(first + _COLUMNS, high)
            powers = self._powers[:, first:last]
            np.matmul(coefficients, powers, out=out[:n_rows, first:last])


def _coefficients(
    kind: type[Motion], motions: Motions, efforts: Efforts, longest: float
) -> tuple[Floats, Floats]:
    # (n_scenes, n_powers) of (1) and (5), in powers of time over the longest time
    joints, caught = efforts.joints, efforts.caught[:, np.newaxis]
    way = motions.end - motions.start
    shares = np.array(_SHARES[kind])
    order = np.arange(shares.size)
    # a row that ends before `longest / 1e12` has but the sample at 0
    scale = np.minimum(longest / (way / motions.speed), 1e12)
    travel = way[:, np.newaxis] * shares * _powers(scale, shares.size).T
    velocity, acceleration = np.zeros_like(travel), np.zeros_like(travel)
    velocity[:, :-1] = (travel * order)[:, 1:] / longest
    acceleration[:, :-1] = (velocity * order)[:, 1:] / longest
    inertial = joints.inertia[:, np.newaxis] * acceleration
    pre = joints.stiffness[:, np.newaxis] * travel
    pre += joints.damping[:, np.newaxis] * velocity + inertial
    pre[:, 0] += joints.stiffness * efforts.offset  # (1)
    additive = joints.is_additive[:, np.newaxis]
    climb = joints.post_catch_stiffness
    post = np.where(additive, pre, inertial) + climb[:, np.newaxis] * travel
    residual = joints.residual_share * efforts.rise
    level = np.where(joints.is_additive, 0.0, efforts.pre_end) + residual
    gone = efforts.path.travel(efforts.times.catch_end)
    post[:, 0] += level - climb * gone  # (5)
    return pre, np.where(caught, post, 0.0)


def _powers(share: Floats, n_powers: int) -> Floats:
    out = np.ones((n_powers, share.size))
    for k in range(1, n_powers):
        np.multiply(out[k - 1], share, out=out[k])
    return out

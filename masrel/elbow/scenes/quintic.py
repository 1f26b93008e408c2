"""Many minimum-jerk stretches: events by Newton's rule, all at once, in 32 digits.

A place x is a share of the duration. The share of the way is P(x) = 10x³ - 15x⁴ + 6x⁵,
and the mean speed since x_on the overall one times Q(x) = (P(x) - P(x_on))/(x - x_on).

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2), (4) and (6).
"""

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.bernstein import sign_changes
from masrel.elbow.scenes.course import Courses, Flags, Motions
from masrel.elbow.scenes.table import Joints
from masrel.elbow.scenes.twofold import Twofold, difference, product

__all__ = ["quintic_courses", "quintic_ends", "shares_of_way"]

_NEAR = 1e-12
# rad, or shares: what is as near as that is left to 50 digits

_SETTLED = 1e-22
# The last correction of a share; the next would be its square or so.


def quintic_courses(joints: Joints, motions: Motions) -> Courses:
    """Find the events of minimum-jerk stretches.

    Parameters
    ----------
    joints : Joints
        The joints.
    motions : Motions
        The stretches.

    Returns
    -------
    Courses
        Their events.
    """
    with np.errstate(all="ignore"):  # what is not reached may be anything
        return _Quintics(joints, motions).courses()


def quintic_ends(joints: Joints, motions: Motions) -> tuple[Floats, Flags]:
    """Find when minimum-jerk stretches end, and nothing else.

    Parameters
    ----------
    joints : Joints
        The joints, of which the end of range is used.
    motions : Motions
        The stretches.

    Returns
    -------
    end : ndarray, shape (n_scenes,)
        s.
    is_doubtful : ndarray of bool, shape (n_scenes,)
        Ask `masrel.elbow.course` instead.
    """
    duration = difference(motions.end, motions.start) / motions.speed
    cut = joints.range_end < motions.end
    if not cut.any():
        return duration.high, cut
    with np.errstate(all="ignore"):
        share = difference(joints.range_end, motions.start)
        share = share / difference(motions.end, motions.start)
        place, settled = shares_of_way(share)
    end = (place * duration).where(cut, duration)
    return end.high, cut & ~settled


class _Quintics:
    """The stretches, and of which of them there is doubt."""

    def __init__(self, joints: Joints, motions: Motions) -> None:
        self.joints, self.motions = joints, motions
        self.way = difference(motions.end, motions.start)
        self.doubtful: Flags = joints.has_jump.copy()

    def courses(self) -> Courses:
        joints, speed = self.joints, self.motions.speed
        end, cut = _like(speed, 1.0), joints.range_end < self.motions.end
        if cut.any():
            end = self._reaches(joints.range_end).where(cut, end)
        onset, moves = self._onset()
        moves &= self._before(onset, end)
        slow = 1.0 - onset
        stop = slow.where(self._before(slow, end), end)
        catch, catches = self._catch(onset, stop, moves)
        travelled = _way_share(catch) * self.way
        released = travelled + joints.catch_travel  # (4)
        leaves = catches & self._before(released, _way_share(end) * self.way)
        left = self._solved(released / self.way, leaves)
        duration = self.way / speed
        post_end = slow.where(slow.high > left.high, left)
        rest = catch * (1.0 - catch)
        return Courses(
            is_doubtful=self.doubtful,
            moves=moves,
            catches=catches,
            leaves=leaves,
            slows=leaves & (slow.high < end.high),
            onset=onset * duration,
            catch=catch * duration,
            catch_end=left * duration,
            post_end=post_end * duration,
            end=end * duration,
            catch_angle=travelled + self.motions.start,
            catch_speed=30.0 * rest * rest * speed,
            mean_speed=_mean_share(catch, onset) * speed,
        )

    def _before(self, one: Twofold, other: Twofold) -> Flags:
        apart = (other - one).high
        self.doubtful |= np.abs(apart) < _NEAR
        return np.asarray(apart > 0.0)

    def _onset(self) -> tuple[Twofold, Flags]:
        # x (1 - x) = √(ν_th / 30 v): the smaller root, without cancellation
        c = (
            Twofold(self.joints.speed_threshold) / (30.0 * Twofold(self._speed))
        ).sqrt()
        left = 1.0 - 4.0 * c
        self.doubtful |= np.abs(left.high) < _NEAR
        return 2.0 * c / (1.0 + left.sqrt()), np.asarray(left.high > 0.0)

    @property
    def _speed(self) -> Floats:
        return self.motions.speed

    def _reaches(self, angle: Floats) -> Twofold:
        # place where an angle is reached; 0 or 1 for one before or beyond the stretch
        share = difference(angle, self.motions.start) / self.way
        inside = (share.high > 0.0) & (share.high < 1.0)
        outside = Twofold(np.where(share.high > 0.0, 1.0, 0.0))
        return self._solved(share, inside).where(inside, outside)

    def _solved(self, share: Twofold, asked: Flags) -> Twofold:
        found, settled = shares_of_way(share)
        self.doubtful |= asked & ~settled
        return found

    def _catch(
        self, onset: Twofold, stop: Twofold, moves: Flags
    ) -> tuple[Twofold, Flags]:
        # θ > θ_catch where θ > θ_L, and θ > L - α v̄ or θ > L - α ν_L: (2) with (6)
        joints = self.joints
        lowest = self._reaches(joints.smallest_catch_angle)
        latest = self._latest()
        low = lowest.where(lowest.high > onset.high, onset)
        self.doubtful |= np.abs((lowest - onset).high) < _NEAR
        possible = moves & self._before(low, stop)
        in_time = self._before(latest, stop)
        at_once = ~self._before(low, latest)
        line = _line(joints, self.motions, onset)
        height = _horner(line, low.high)
        at_once |= height > 0.0
        self.doubtful |= possible & (np.abs(height) < _NEAR)
        high = np.where(in_time, latest.high, stop.high)
        rows = np.flatnonzero(possible & ~at_once)
        passes, found = self._passes(line[:, rows], low, high, onset, rows)
        later = latest.where(in_time, low)
        catch = low.where(at_once, later)
        catches = possible & (at_once | in_time)
        catch.high[passes], catch.low[passes] = found.high, found.low
        catches[passes] = True
        return catch, catches

    def _latest(self) -> Twofold:
        # place of L - α ν_L in 32 digits
        joints = self.joints
        held = product(joints.catch_slope, joints.slowest_mean_speed)
        angle = difference(joints.catch_angle_constant, self.motions.start) - held
        share = angle / self.way
        inside = (share.high > 0.0) & (share.high < 1.0)
        outside = Twofold(np.where(share.high > 0.0, 2.0, -1.0))
        return self._solved(share, inside).where(inside, outside)

    def _passes(
        self, line: Floats, low: Twofold, high: Floats, onset: Twofold, rows: np.ndarray
    ) -> tuple[np.ndarray, Twofold]:
        # rows in which θ passes L - α v̄ between the places, and where
        left, right = low.high[rows], high[rows]
        changes, unclear = sign_changes(line, left, right, least=_NEAR)
        self.doubtful[rows[unclear | (changes > 1)]] = True
        own = np.flatnonzero((changes == 1) & ~unclear)
        passes = rows[own]
        found = _root(line[:, own], left[own], right[own])
        start = _taken(onset, passes)
        way, speed = _taken(self.way, passes), self._speed[passes]
        slope = self.joints.catch_slope[passes]
        base = difference(
            self.motions.start[passes], self.joints.catch_angle_constant[passes]
        )
        tangent = _slope(line[:, own])
        place, step = Twofold(found), np.zeros(found.shape)
        for _ in range(2):
            mean = _mean_share(place, start) * product(slope, speed)
            step = (base + way * _way_share(place) + mean).high
            step = step / _horner(tangent, place.high)
            place = place - step
        self.doubtful[passes[~(np.abs(step) < _SETTLED)]] = True
        return passes, place


def shares_of_way(share: Twofold) -> tuple[Twofold, Flags]:
    """Find the share of the duration in which a share of the way is gone.

    Parameters
    ----------
    share : Twofold
        Shares of the way.

    Returns
    -------
    place : Twofold
        Shares of the duration, where `share` lies between 0 and 1.
    settled : ndarray of bool
        Whether each is right to 32 digits.
    """
    with np.errstate(all="ignore"):
        near = np.minimum(share.high, 1.0 - share.high)
        x = np.cbrt(0.1 * near)
        for _ in range(2):
            x = np.cbrt(near / (10.0 + x * (6.0 * x - 15.0)))
        for _ in range(4):
            rest = x * (1.0 - x)
            x = x - (x * x * x * (10.0 + x * (6.0 * x - 15.0)) - near) / (
                30.0 * rest * rest
            )
        place = Twofold(np.where(share.high > 0.5, 1.0 - x, x))
        step = np.zeros(x.shape)
        for _ in range(2):
            rest = place.high * (1.0 - place.high)
            step = (_way_share(place) - share).high / (30.0 * rest * rest)
            place = place - step
    return place, np.asarray(np.abs(step) < _SETTLED * np.abs(place.high))


def _like(column: Floats, value: float) -> Twofold:
    return Twofold(np.full(column.shape, value))


def _taken(numbers: Twofold, rows: np.ndarray) -> Twofold:
    return Twofold(numbers.high[rows], numbers.low[rows])


def _way_share(x: Twofold) -> Twofold:
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))  # P


def _mean_share(x: Twofold, onset: Twofold) -> Twofold:
    # Q, by dividing P by x - x_on
    q3 = 6.0 * onset - 15.0
    q2 = onset * q3 + 10.0
    q1 = onset * q2
    return onset * q1 + x * (q1 + x * (q2 + x * (q3 + 6.0 * x)))


def _line(joints: Joints, motions: Motions, onset: Twofold) -> Floats:
    # (6, n_scenes): coefficients of θ - (L - α v̄), in floats
    x, way = onset.high, motions.end - motions.start
    moved = joints.catch_slope * motions.speed
    q3 = 6.0 * x - 15.0
    q2 = x * q3 + 10.0
    q1 = x * q2
    return np.stack(
        [
            (motions.start - joints.catch_angle_constant) + moved * (x * q1),
            moved * q1,
            moved * q2,
            10.0 * way + moved * q3,
            -15.0 * way + moved * 6.0,
            6.0 * way,
        ]
    )


def _horner(coefficients: Floats, x: Floats) -> Floats:
    total = coefficients[-1] * np.ones_like(x)
    for row in coefficients[-2::-1]:
        total = total * x + row
    return np.asarray(total)


def _slope(coefficients: Floats) -> Floats:
    powers = np.arange(1, len(coefficients))
    return np.asarray(coefficients[1:] * powers[:, np.newaxis])


def _root(line: Floats, low: Floats, high: Floats) -> Floats:
    # Newton's rule, or halving where it leaves the bracket; from below 0 to above
    tangent = _slope(line)
    x = 0.5 * (low + high)
    for _ in range(12):
        height = _horner(line, x)
        low, high = np.where(height > 0.0, low, x), np.where(height > 0.0, x, high)
        x = x - height / _horner(tangent, x)
        x = np.where((x >= low) & (x <= high), x, 0.5 * (low + high))
    return x

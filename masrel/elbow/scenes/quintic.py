"""Many minimum-jerk stretches: events by Newton's rule, all at once.

Places are shares of the duration.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2), (4) and (6).
"""

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.bernstein import sign_changes
from masrel.elbow.scenes.course import Courses, Flags
from masrel.elbow.scenes.digits import DIGITS_32, Digits
from masrel.elbow.scenes.effort import Path
from masrel.elbow.scenes.line import catch_lines, horner, slopes, zeros_of
from masrel.elbow.scenes.table import Joints, Motions
from masrel.elbow.scenes.twofold import Twofold
from masrel.elbow.scenes.way import mean_share, places_of, way_share

__all__ = ["quintic_courses", "quintic_ends", "quintic_path"]


def quintic_courses(
    joints: Joints, motions: Motions, digits: Digits = DIGITS_32
) -> Courses:
    """Find the events of minimum-jerk stretches.

    Parameters
    ----------
    joints : Joints
        The joints.
    motions : Motions
        The stretches.
    digits : Digits, optional
        What to compute with.

    Returns
    -------
    Courses
        Their events.
    """
    with np.errstate(all="ignore"):  # what is not reached may be anything
        return _Quintics(joints, motions, digits).courses()


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
    way = Twofold.difference(motions.end, motions.start)
    duration = way / motions.speed
    cut = joints.range_end < motions.end
    if not cut.any():
        return duration.high, cut
    with np.errstate(all="ignore"):
        share = Twofold.difference(joints.range_end, motions.start) / way
        place, settled = places_of(share, DIGITS_32)
    end = (place * duration).where(cut, duration)
    return end.high, cut & ~settled


class _Quintics:
    """The stretches, and of which of them there is doubt."""

    def __init__(self, joints: Joints, motions: Motions, digits: Digits) -> None:
        self.joints, self.motions, self.digits = joints, motions, digits
        self.number = digits.number
        self.way = self.number.difference(motions.end, motions.start)
        self.doubtful: Flags = joints.has_jump.copy()

    def courses(self) -> Courses:
        joints, speed = self.joints, self.motions.speed
        end = self.number(np.ones(speed.shape))
        cut = joints.range_end < self.motions.end
        if cut.any():
            end = self._reaches(joints.range_end).where(cut, end)
        onset, moves = self._onset()
        moves &= self._before(onset, end)
        slow = 1.0 - onset
        stop = slow.where(self._before(slow, end), end)
        catch, catches = self._catch(onset, stop, moves)
        travelled = way_share(catch) * self.way
        released = travelled + joints.catch_travel  # (4)
        leaves = catches & self._before(released, way_share(end) * self.way)
        # a late one matters less: no torque jumps by a speed there
        left = self._solved(released / self.way, leaves, 0.1)
        # to the last bit with any digits: stretches often end at a sample
        duration = Twofold.difference(self.motions.end, self.motions.start) / speed
        duration = self.number(duration.high, duration.low)
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
            mean_speed=mean_share(catch, onset) * speed,
        )

    def _before(self, one: Twofold, other: Twofold) -> Flags:
        apart = (other - one).high
        self.doubtful |= np.abs(apart) < self.digits.near
        return np.asarray(apart > 0.0)

    def _onset(self) -> tuple[Twofold, Flags]:
        # x (1 - x) = √(ν_th / 30 v): the smaller root, without cancellation
        number = self.number
        overall = 30.0 * number(self.motions.speed)
        c = (number(self.joints.speed_threshold) / overall).sqrt()
        left = 1.0 - 4.0 * c
        self.doubtful |= np.abs(left.high) < self.digits.near
        return 2.0 * c / (1.0 + left.sqrt()), np.asarray(left.high > 0.0)

    def _reaches(self, angle: Floats) -> Twofold:
        # place where an angle is reached; 0 or 1 for one before or beyond the stretch
        share = self.number.difference(angle, self.motions.start) / self.way
        inside = (share.high > 0.0) & (share.high < 1.0)
        outside = self.number(np.where(share.high > 0.0, 1.0, 0.0))
        return self._solved(share, inside).where(inside, outside)

    def _solved(self, share: Twofold, asked: Flags, slowness: float = 1.0) -> Twofold:
        found, settled = places_of(share, self.digits, slowness)
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
        self.doubtful |= np.abs((lowest - onset).high) < self.digits.near
        possible = moves & self._before(low, stop)
        in_time = self._before(latest, stop)
        at_once = ~self._before(low, latest)
        line = catch_lines(joints, self.motions, onset.high)
        height = horner(line, low.high)
        at_once |= height > 0.0
        self.doubtful |= possible & (np.abs(height) < self.digits.near)
        high = np.where(in_time, latest.high, stop.high)
        rows = np.flatnonzero(possible & ~at_once)
        passes, found = self._passes(line[:, rows], low, high, onset, rows)
        later = latest.where(in_time, low)
        catch = low.where(at_once, later)
        catches = possible & (at_once | in_time)
        catch.put(passes, found)
        catches[passes] = True
        return catch, catches

    def _latest(self) -> Twofold:
        # place of L - α ν_L
        joints, number = self.joints, self.number
        held = number.product(joints.catch_slope, joints.slowest_mean_speed)
        share = number.difference(joints.catch_angle_constant, self.motions.start)
        share = (share - held) / self.way
        inside = (share.high > 0.0) & (share.high < 1.0)
        outside = self.number(np.where(share.high > 0.0, 2.0, -1.0))
        return self._solved(share, inside).where(inside, outside)

    def _passes(
        self, line: Floats, low: Twofold, high: Floats, onset: Twofold, rows: np.ndarray
    ) -> tuple[np.ndarray, Twofold]:
        # rows in which θ passes L - α v̄ between the places, and where
        left, right = low.high[rows], high[rows]
        changes, unclear = sign_changes(line, left, right, least=self.digits.near)
        self.doubtful[rows[unclear | (changes > 1)]] = True
        own = np.flatnonzero((changes == 1) & ~unclear)
        passes = rows[own]
        line = line[:, own]
        place = self.number(zeros_of(line, left[own], right[own]))
        tangent = slopes(line)
        for _ in range(self.digits.n_corrections):
            steep = horner(tangent, place.high)
            step = self._height(place, onset, passes).high / steep
            place = place - step
        self.doubtful[passes[~(np.abs(step) < self.digits.settled)]] = True
        size = horner(np.abs(line), np.abs(place.high))
        is_defined = steep > self.digits.least_steepness * size
        self.doubtful[passes[~is_defined]] = True
        return passes, place

    def _height(self, place: Twofold, onset: Twofold, rows: np.ndarray) -> Twofold:
        # θ - (L - α v̄)
        number, slope = self.number, self.joints.catch_slope[rows]
        mean = mean_share(place, onset.take(rows))
        base = number.difference(
            self.motions.start[rows], self.joints.catch_angle_constant[rows]
        )
        gone = self.way.take(rows) * way_share(place)
        return base + gone + mean * number.product(slope, self.motions.speed[rows])


def quintic_path(motions: Motions) -> Path:
    """Return the functions of minimum-jerk stretches.

    Parameters
    ----------
    motions : Motions
        The stretches.

    Returns
    -------
    Path
        Their functions.
    """
    # in shares x of the duration the way is P(x) = 10x³ - 15x⁴ + 6x⁵
    way, speed = motions.end - motions.start, motions.speed
    total = way / speed
    return Path(
        travel=lambda t: way * _way(t / total),
        velocity=lambda t: speed * _pace(t / total),
        acceleration=lambda t: speed / total * _gain(t / total),
        is_steady=False,
        travel_integral=lambda t: total * way * _way_integral(t / total),
        square_integral=lambda t: way * speed * _square_integral(t / total),
        turning=lambda k, b: total * _turn(k, 2.0 * b / total),
    )


def _way(x: Floats) -> Floats:
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))  # P


def _pace(x: Floats) -> Floats:
    rest = x * (1.0 - x)
    return 30.0 * rest * rest  # P'


def _gain(x: Floats) -> Floats:
    return 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)  # P''


def _way_integral(x: Floats) -> Floats:
    power = x * x * x * x
    return power * (2.5 + x * (x - 3.0))


def _square_integral(x: Floats) -> Floats:
    # 900 ∫ x⁴ (1 - x)⁴
    power = x * x * x * x * x
    inner = 900 / 5 + x * (-600.0 + x * (5400 / 7 + x * (-450.0 + x * 100.0)))
    return np.asarray(power * inner)


def _turn(k: Floats, c: Floats) -> Floats:
    # k x (1 - x) + c (1 - 2x) = 0, without cancellation
    root = np.sqrt(k * k + 4.0 * c * c)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.where(
            k > 2.0 * c,
            (k - 2.0 * c + root) / (2.0 * k),
            2.0 * c / (2.0 * c - k + root),
        )
    return np.where(root > 0.0, x, 0.5)

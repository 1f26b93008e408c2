"""Which samples of many stretches are the first of a phase, by halving between samples.

The comparisons are those of `SampledJoint`, in the same floats. While the mean speed
grows, angle and catch angle move towards each other, so that a comparison once true
stays true, and halving finds its first sample; any stretch of which that is not certain
is left to `sampled_columns`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.course import Flags
from masrel.elbow.scenes.table import Joints

__all__ = ["Kinematics", "PhaseSamples", "phase_samples"]

Indices = NDArray[np.intp]

_NEAR = 1e-9
# rad, rad/s: comparisons as near as that may go either way from sample to sample


@dataclass(frozen=True, slots=True, kw_only=True)
class Kinematics:
    """One kind of motion, in the floats that its own methods give.

    Attributes
    ----------
    angle, velocity : callable
        Of times, one a scene; rad and rad/s.
    fastest : ndarray
        When each stretch is fastest, s.
    top_speed : ndarray
        rad/s.
    is_rising : bool
        Whether no sampled angle is less than the one before, rounding and all.
    """

    angle: Callable[[Floats], Floats]
    velocity: Callable[[Floats], Floats]
    fastest: Floats
    top_speed: Floats
    is_rising: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseSamples:
    """First samples of the phases of many stretches, each of shape (n_scenes,).

    One that is not reached begins at the number of samples.

    Attributes
    ----------
    is_doubtful : ndarray of bool
        Step through these.
    catch, fallen, post, post_end : ndarray of int
        The catch, the end of ΔT_peak, post-catch, and pre-catch again.
    catch_angle, catch_speed, post_angle : ndarray
        At these samples, rad and rad/s.
    """

    is_doubtful: Flags
    catch: Indices
    fallen: Indices
    post: Indices
    post_end: Indices
    catch_angle: Floats
    catch_speed: Floats
    post_angle: Floats


def phase_samples(
    joints: Joints, motion: Kinematics, n_samples: Indices, rate_hz: float
) -> PhaseSamples:
    """Find the first samples of the phases.

    Parameters
    ----------
    joints : Joints
        The joints.
    motion : Kinematics
        The stretches.
    n_samples : ndarray of int, shape (n_scenes,)
        Samples of each.
    rate_hz : float
        Samples a second.

    Returns
    -------
    PhaseSamples
        The samples.
    """
    search = _Search(joints, motion, n_samples, rate_hz)
    with np.errstate(all="ignore"):  # before the onset there is no mean speed
        return search.phases()


class _Search:
    def __init__(
        self, joints: Joints, motion: Kinematics, n_samples: Indices, rate_hz: float
    ) -> None:
        self.joints, self.motion = joints, motion
        self.n, self.rate = n_samples, rate_hz
        self.threshold = joints.speed_threshold
        near = np.abs(motion.top_speed - self.threshold) < _NEAR
        step = self.threshold / rate_hz  # rad a sample, at least
        self.doubtful: Flags = near | (step < _NEAR) | joints.has_jump

    def time(self, i: Indices) -> Floats:
        return np.asarray(i / self.rate)

    def angle(self, i: Indices) -> Floats:
        return self.motion.angle(self.time(i))

    def speed(self, i: Indices) -> Floats:
        return self.motion.velocity(self.time(i))

    def phases(self) -> PhaseSamples:
        zero = np.zeros_like(self.n)
        fastest = np.minimum(
            (self.motion.fastest * self.rate).astype(np.intp), self.n - 1
        )
        onset = _first(lambda i: self.speed(i) >= self.threshold, zero, fastest + 1)
        moves = onset <= fastest
        slow = _first(lambda i: self.speed(i) < self.threshold, fastest + 1, self.n)
        catch = self._catch(onset, fastest, slow, moves)
        caught = catch < self.n
        at = np.minimum(catch, self.n - 1)
        angle, speed = self.angle(at), self.speed(at)
        self.doubtful |= caught & (speed <= self.threshold)
        post = self._post(at, angle, caught)
        since = self.time(at)
        fallen = _first(
            lambda i: self.time(i) - since >= self.joints.peak_duration, at, self.n
        )
        post_end = np.where(slow < self.n, np.maximum(post + 1, slow), self.n)
        return PhaseSamples(
            is_doubtful=self.doubtful,
            catch=catch,
            fallen=np.where(caught, fallen, self.n),
            post=post,
            post_end=np.minimum(np.where(post < self.n, post_end, self.n), self.n),
            catch_angle=angle,
            catch_speed=speed,
            post_angle=self.angle(np.minimum(post, self.n - 1)),
        )

    def _catch(
        self, onset: Indices, fastest: Indices, slow: Indices, moves: Flags
    ) -> Indices:
        begin, start = self.time(onset), self.angle(onset)

        def mean(i: Indices) -> Floats:
            return np.asarray((self.angle(i) - start) / (self.time(i) - begin))

        def beyond(i: Indices) -> Flags:
            return np.asarray(self.angle(i) > _catch_angles(self.joints, mean(i)))

        first = onset + 1
        # from the fastest sample on, the mean grows until the speed has fallen to it
        peak = np.maximum(fastest, first)
        turn = _first(lambda i: self.speed(i) < mean(i), peak, slow)
        turn = np.where(self.motion.top_speed > mean(turn - 1), turn, slow)
        found = _first(beyond, first, np.minimum(turn, slow))
        none = found >= np.minimum(turn, slow)
        last = np.maximum(slow - 1, 0)
        least = _catch_angles(self.joints, mean(np.maximum(turn - 1, first)))
        late = (turn < slow) & (self.angle(last) > least - _NEAR)
        able = moves & (self.motion.top_speed > self.threshold) & (first < slow)
        self.doubtful |= able & none & late
        return np.where(able & ~none, found, self.n)

    def _post(self, at: Indices, angle: Floats, caught: Flags) -> Indices:
        def over(i: Indices) -> Floats:
            return (self.angle(i) - angle) - self.joints.catch_travel

        found = _first(lambda i: over(i) > 0.0, at, self.n)
        for neighbour in () if self.motion.is_rising else (found, found - 1):
            inside = np.clip(neighbour, 0, self.n - 1)
            self.doubtful |= caught & (np.abs(over(inside)) < 1e-14)
        return np.where(caught, found, self.n)


def _first(holds: Callable[[Indices], Flags], low: Indices, high: Indices) -> Indices:
    # first sample from low on where it holds, or high; once true it stays so
    low, high = low - 1, np.maximum(high, low)
    while (open_ := high - low > 1).any():
        middle = (low + high) // 2
        true = holds(np.maximum(middle, 0))
        high = np.where(open_ & true, middle, high)
        low = np.where(open_ & ~true, middle, low)
    return high


def _catch_angles(joints: Joints, mean_speed: Floats) -> Floats:
    # ElbowParameters.catch_angle, operation by operation
    span = joints.catch_angle_constant - joints.smallest_catch_angle
    fast = mean_speed > span / joints.catch_slope
    slowed = np.maximum(mean_speed, joints.slowest_mean_speed)
    angles = joints.catch_angle_constant - joints.catch_slope * slowed
    return np.where(fast, joints.smallest_catch_angle, angles)

"""The sampled law over whole columns: bit for bit what stepping gives.

A column is cut into runs of samples that are all faster than ν_th, all slower, or all
flexing faster than ν_th. Within a run each event is the first sample of a comparison,
and each phase one evaluation of its law.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.motion import Floats
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.sampled import CATCH, POST_CATCH, PRE_CATCH

__all__ = ["sampled_columns"]

_BLOCK = 2048
# Samples compared at once while an event is sought: a late event costs no more than
# all samples before it, an early one no more than a block.


def sampled_columns(
    parameters: ElbowParameters,
    start_angle: float,
    time: Floats,
    angle: Floats,
    velocity: Floats,
) -> tuple[Floats, NDArray[np.int8]]:
    """Decide the torque of every sample of a movement.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    start_angle : float
        As of `SampledJoint`, rad.
    time : ndarray, shape (n_samples,)
        Times of the samples, s, each after the one before.
    angle : ndarray, shape (n_samples,)
        Angles, rad.
    velocity : ndarray, shape (n_samples,)
        Angular velocities, rad/s.

    Returns
    -------
    torque : ndarray, shape (n_samples,)
        What `SampledJoint.step` returns from sample to sample, N·m.
    phase : ndarray of int8, shape (n_samples,)
        Its phase after each.

    Examples
    --------
    >>> import numpy as np
    >>> from masrel.elbow import STANDARD_MODELS
    >>> time = np.array([0.0, 0.1])
    >>> angle, velocity = 0.5 + 0.2 * time, np.array([0.2, 0.2])
    >>> torque, phase = sampled_columns(
    ...     STANDARD_MODELS["HM1"], 0.5, time, angle, velocity
    ... )
    >>> torque.round(3).tolist(), phase.tolist()
    ([0.252, 0.315], [0, 0])
    """
    p, threshold = parameters, parameters.speed_threshold
    rest = start_angle if p.rest_angle is None else p.rest_angle
    # (1) without m·θ̈, in the order of operations of SampledJoint
    torque = p.damping * velocity + p.stiffness * (angle - rest)
    phase = np.zeros(time.size, dtype=np.int8)
    columns = _Columns(parameters, time, angle, velocity, torque, phase)
    speed = (velocity >= threshold).astype(np.int8) - (velocity <= -threshold)
    starts = np.flatnonzero(np.diff(speed, prepend=np.int8(2)))
    ends = np.append(starts, time.size)[1:].tolist()
    for start, end in zip(starts.tolist(), ends, strict=True):
        columns.run(int(speed[start]), start, end)
    return torque, phase


@dataclass(slots=True)
class _Columns:
    """The state machine of `SampledJoint`, led from run to run."""

    parameters: ElbowParameters
    time: Floats
    angle: Floats
    velocity: Floats
    torque: Floats  # that of pre-catch everywhere at first
    phase: NDArray[np.int8]
    now: int = PRE_CATCH
    is_armed: bool = True
    catch: int = 0  # sample of the last catch
    post: int = 0  # and of the post-catch after it
    # τ_pre_end and H·v_c of (3), of the last catch
    pre_end: float = 0.0
    rise: float = 0.0

    def run(self, speed: int, start: int, end: int) -> None:
        """Go through samples that are all fast (1), slow (0) or flexing (-1)."""
        if speed < 0:
            self.now, self.is_armed = PRE_CATCH, True
        elif self.now == CATCH:
            self._on_in_catch(start, end, is_slow=speed == 0)
        elif speed == 0:
            self.now = PRE_CATCH
        elif self.now == POST_CATCH:
            self._post_catch(start, end)
        elif self.is_armed:
            self._from_onset(start, end)

    def _from_onset(self, onset: int, end: int) -> None:
        p, time, angle = self.parameters, self.time, self.angle
        for low in range(onset + 1, end, _BLOCK):
            block = slice(low, min(low + _BLOCK, end))
            mean = (angle[block] - angle[onset]) / (time[block] - time[onset])
            # ElbowParameters.catch_angle, operation by operation
            slowed = np.maximum(mean, p.slowest_mean_speed)
            line = p.catch_angle_constant - p.catch_slope * slowed
            fast = mean > p.fastest_mean_speed
            caught = angle[block] > np.where(fast, p.smallest_catch_angle, line)
            caught &= self.velocity[block] > p.speed_threshold
            if caught.any():
                catch = low + int(caught.argmax())
                self.now, self.is_armed, self.catch = CATCH, False, catch
                self.pre_end = float(self.torque[catch])
                self.rise = p.catch_torque_constant * float(self.velocity[catch])
                self._on_in_catch(catch, end, is_slow=False)
                return

    def _on_in_catch(self, start: int, end: int, *, is_slow: bool) -> None:
        p, post = self.parameters, end
        for low in range(start, end, _BLOCK):
            block = slice(low, min(low + _BLOCK, end))
            # the sample of the catch itself has travelled nothing yet
            beyond = self.angle[block] - self.angle[self.catch] > p.catch_travel  # (4)
            if beyond.any():
                post = low + int(beyond.argmax())
                break
        own = slice(start, post)
        since = self.time[own] - self.time[self.catch]
        peak = self.pre_end + self.rise
        residual = self.pre_end + p.residual_share * self.rise
        levels = np.where(since < p.peak_duration, peak, residual)  # (3)
        smooth = since < p.catch_rise
        if smooth.any():
            y = since[smooth] / p.catch_rise
            levels[smooth] = self.pre_end + self.rise * (y * y * (3.0 - 2.0 * y))
        self.torque[own] = levels
        self.phase[own] = CATCH
        if post < end:
            # below ν_th post-catch lasts for the sample that began it
            last = post + 1 if is_slow else end
            self.post = post
            self._post_catch(post, last)
            self.now = POST_CATCH if last == end else PRE_CATCH

    def _post_catch(self, start: int, end: int) -> None:
        p, own = self.parameters, slice(start, end)
        residual = p.residual_share * self.rise
        climb = p.post_catch_stiffness * (self.angle[own] - self.angle[self.post])
        if p.post_catch == "additive":  # (5) as Table III's footnote reads it
            self.torque[own] = self.torque[own] + residual + climb
        else:
            self.torque[own] = self.pre_end + residual + climb  # (5), continuous
        self.phase[own] = POST_CATCH

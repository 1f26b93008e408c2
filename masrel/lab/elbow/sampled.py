"""The sampled joint: what a controller decides at every sample of a motion.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, Fig. 7; its equations are in `_law`.
"""

import math
from typing import TYPE_CHECKING

from masrel.lab.elbow import _law
from masrel.lab.elbow._law import TorqueLaw

if TYPE_CHECKING:
    from masrel.lab.elbow.parameters import ElbowParameters

__all__ = ["SampledJoint"]

PRE_CATCH, CATCH, POST_CATCH = 0, 1, 2  # positions in masrel.lab.recording.PHASES


class SampledJoint:
    """The joint model as a state machine that sees one sample at a time.

    A stretch is a movement in extension. It begins when the speed first reaches
    ν_th, and catches at most once: after a catch the joint is armed again only when
    the arm has been moved back, that is flexed faster than ν_th. Flexing ends a
    catch or post-catch too.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint. The inertial term of (1) and (5) is not computed here: the
        mannequin's arm has the inertia.
    start_angle : float
        Where the stretch starts, rad; θ_rest of (1) unless the parameters set it.

    Attributes
    ----------
    phase : int
        Position in `masrel.lab.recording.PHASES`.
    catch_time, catch_angle : float
        Sample at which the last catch began, s and rad; ``nan`` before the first.
    mean_speed : float
        Mean speed of the pre-catch phase so far, or up to the catch, rad/s.

    Examples
    --------
    >>> from masrel.lab.elbow.parameters import STANDARD_MODELS
    >>> joint = SampledJoint(STANDARD_MODELS["HM1"], start_angle=0.5)
    >>> joint.step(0.0, 0.5, 0.0)
    0.0
    """

    __slots__ = (
        "_armed",
        "_law",
        "_moving",
        "_onset_angle",
        "_onset_time",
        "_parameters",
        "_peak",
        "_pre_catch",
        "_pre_end",
        "_residual",
        "_rise",
        "catch_angle",
        "catch_time",
        "mean_speed",
        "phase",
    )

    def __init__(self, parameters: "ElbowParameters", *, start_angle: float) -> None:
        rest = parameters.rest_angle
        self._parameters = parameters
        self._pre_catch = _law.pre_catch(
            parameters, start_angle if rest is None else rest
        )
        self._law: TorqueLaw = self._pre_catch  # the one that holds
        self.phase = PRE_CATCH
        self.catch_time = math.nan
        self.catch_angle = math.nan
        self.mean_speed = 0.0
        self._armed = True
        self._moving = False
        self._onset_time = 0.0
        self._onset_angle = start_angle
        self._pre_end = 0.0  # τ_pre_end of (3)
        self._rise = 0.0  # H·v_c of (3)
        self._peak = self._residual = 0.0  # torques of (3), first and second line

    def release(self) -> None:
        """Return to pre-catch at once, as when the grip is lost (section III.B.3)."""
        self._to_pre_catch()
        self._armed = False

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample.

        Parameters
        ----------
        time_s : float
            Time of the sample, s; later than that of the one before.
        angle : float
            Angle, rad.
        velocity : float
            Angular velocity, rad/s.

        Returns
        -------
        float
            Torque that resists extension, N·m.
        """
        threshold = self._parameters.speed_threshold
        if velocity <= -threshold:  # flexed again: the stretch is over
            self._to_pre_catch()
            self._armed = True
        elif self.phase == PRE_CATCH:
            self._watch_for_catch(time_s, angle, velocity)
        elif self.phase == CATCH:
            # (4): t - t_c > D / v̄_c, the angle travelled exceeds D
            if angle - self.catch_angle > self._parameters.catch_travel:
                self._to_post_catch(angle)
        elif velocity < threshold:  # post-catch ends, Fig. 7
            self._to_pre_catch()
        if self.phase == CATCH:
            return self._catch_torque(time_s - self.catch_time)
        torque: float = self._law.commanded(angle, velocity)
        return torque

    def _watch_for_catch(self, time_s: float, angle: float, velocity: float) -> None:
        parameters = self._parameters
        if velocity < parameters.speed_threshold:
            self._moving = False
            return
        if not self._moving:  # movement onset
            self._moving = True
            self._onset_time = time_s
            self._onset_angle = angle
            return
        mean_speed = (angle - self._onset_angle) / (time_s - self._onset_time)
        self.mean_speed = mean_speed
        if not self._armed or velocity <= parameters.speed_threshold:
            return
        if angle > parameters.catch_angle(mean_speed):  # Fig. 7 with (2) and (6)
            self.phase = CATCH
            self._armed = False
            self.catch_time = time_s
            self.catch_angle = angle
            self._pre_end = self._pre_catch.commanded(angle, velocity)
            self._rise = parameters.catch_torque_constant * velocity
            peak, residual = _law.catch(parameters, self._pre_end, self._rise)
            self._peak, self._residual = peak.level, residual.level

    def _catch_torque(self, since: float) -> float:
        parameters = self._parameters
        if since < parameters.catch_rise:
            share = _law.onset_share(since / parameters.catch_rise)
            return float(self._pre_end + self._rise * share)
        return self._peak if since < parameters.peak_duration else self._residual

    def _to_post_catch(self, angle: float) -> None:
        self.phase = POST_CATCH
        rest = self._pre_catch.origin
        self._law = _law.post_catch(
            self._parameters, self._residual, self._pre_end, angle, rest
        )

    def _to_pre_catch(self) -> None:
        self.phase = PRE_CATCH
        self._law = self._pre_catch
        self._moving = False

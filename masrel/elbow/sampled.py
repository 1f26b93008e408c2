"""The sampled law: what a controller decides at every sample of a motion.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, Fig. 7 and equations (1)-(6).
"""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.elbow.parameters import ElbowParameters

__all__ = ["SampledJoint"]

PRE_CATCH, CATCH, POST_CATCH = 0, 1, 2  # positions in masrel.recording.PHASES


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
        Position in `masrel.recording.PHASES`.
    catch_time, catch_angle : float
        Sample at which the last catch began, s and rad; ``nan`` before the first.
    mean_speed : float
        Mean speed of the pre-catch phase so far, or up to the catch, rad/s.

    Examples
    --------
    >>> from masrel.elbow.parameters import STANDARD_MODELS
    >>> joint = SampledJoint(STANDARD_MODELS["HM1"], start_angle=0.5)
    >>> joint.step(0.0, 0.5, 0.0)
    0.0
    """

    __slots__ = (
        "_additive",
        "_armed",
        "_catch_speed",
        "_moving",
        "_onset_angle",
        "_onset_time",
        "_parameters",
        "_post_angle",
        "_pre_end",
        "_rest",
        "catch_angle",
        "catch_time",
        "mean_speed",
        "phase",
    )

    def __init__(self, parameters: "ElbowParameters", *, start_angle: float) -> None:
        rest = parameters.rest_angle
        self._parameters = parameters
        self._rest = start_angle if rest is None else rest
        self._additive = parameters.post_catch == "additive"
        self.phase = PRE_CATCH
        self.catch_time = math.nan
        self.catch_angle = math.nan
        self.mean_speed = 0.0
        self._armed = True
        self._moving = False
        self._onset_time = 0.0
        self._onset_angle = start_angle
        self._catch_speed = 0.0  # v_c of (3)
        self._pre_end = 0.0  # τ_pre_end of (3)
        self._post_angle = 0.0  # θ_post of (5)

    def release(self) -> None:
        """Return to pre-catch at once, as when the grip is lost (section III.B.3)."""
        self.phase = PRE_CATCH
        self._moving = False
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
            self.phase = PRE_CATCH
            self._armed = True
            self._moving = False
        elif self.phase == PRE_CATCH:
            self._watch_for_catch(time_s, angle, velocity)
        elif self.phase == CATCH:
            # (4): t - t_c > D / v̄_c, the angle travelled exceeds D
            if angle - self.catch_angle > self._parameters.catch_travel:
                self.phase = POST_CATCH
                self._post_angle = angle
        elif velocity < threshold:  # post-catch ends, Fig. 7
            self.phase = PRE_CATCH
            self._moving = False
        return self._torque(time_s, angle, velocity)

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
            self._catch_speed = velocity
            self._pre_end = self._pre_catch_torque(angle, velocity)

    def _pre_catch_torque(self, angle: float, velocity: float) -> float:
        parameters = self._parameters  # (1) without m·θ̈
        return parameters.damping * velocity + parameters.stiffness * (
            angle - self._rest
        )

    def _torque(self, time_s: float, angle: float, velocity: float) -> float:
        if self.phase == PRE_CATCH:
            return self._pre_catch_torque(angle, velocity)
        parameters = self._parameters
        rise = parameters.catch_torque_constant * self._catch_speed  # H·v_c
        if self.phase == CATCH:
            since = time_s - self.catch_time
            if since < parameters.catch_rise:  # a smoothed onset
                share = since / parameters.catch_rise
                return self._pre_end + rise * (share * share * (3.0 - 2.0 * share))
            if since < parameters.peak_duration:
                return self._pre_end + rise  # (3), first line
            return self._pre_end + parameters.residual_share * rise  # (3), second line
        residual = parameters.residual_share * rise
        climb = parameters.post_catch_stiffness * (angle - self._post_angle)
        if self._additive:  # (5) as Table III's footnote reads it
            return self._pre_catch_torque(angle, velocity) + residual + climb
        return self._pre_end + residual + climb  # (5), continuous

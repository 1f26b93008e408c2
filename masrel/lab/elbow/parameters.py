"""The parameters of a spastic elbow, and the four models of Table III.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1)-(6) and Table III.
"""

import math
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar, Literal

from masrel.errors import ParameterError
from masrel.lab.elbow import _law
from masrel.lab.elbow._law import SampledJoint
from masrel.lab.elbow.joint_model import Law, known, quantity

__all__ = ["STANDARD_MODELS", "ElbowParameters", "PostCatch", "ResidualReading"]

PostCatch = Literal["continuous", "additive"]
"""Reading of equation (5): "continuous" starts from the residual torque."""

ResidualReading = Literal["residual", "decrease"]
"""What Q is a share of the rise for: the residual (section II), or the decrease."""


_published = partial(quantity, is_choice=False)

READINGS = {
    "post_catch": ("continuous", "additive"),
    "residual_reading": ("residual", "decrease"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ElbowParameters(Law):
    """Parameters of the joint model, in SI units (angles in rad).

    Angle 0 is full flexion and grows with extension.

    Attributes
    ----------
    catch_angle_constant : float
        L of (2), rad.
    catch_torque_constant : float
        H of (3), N·m·s/rad.
    residual_ratio : float
        Q of (3): residual torque over peak torque, both above pre-catch. In section
        III.C's words, the decrease after the peak over the rise: `residual_reading`.
    catch_travel : float
        D of (4), rad: the angle travelled during the catch.
    inertia : float
        m of (1), kg·m². Not commanded by the device.
    damping : float
        b of (1), N·m·s/rad.
    stiffness : float
        k of (1), N·m/rad.
    catch_slope : float
        α of (2), s.
    peak_duration : float
        ΔT_peak of (3), s.
    post_catch_stiffness : float
        k_post of (5), N·m/rad.
    speed_threshold : float
        ν_th of Fig. 7, rad/s.
    slowest_mean_speed : float
        ν_L of (6), rad/s: below it the catch angle grows no more.
    smallest_catch_angle : float
        θ_L of (6), rad.
    range_end : float
        End of the range of motion, rad.
    rest_angle : float or None
        θ_rest of (1), rad; None means the angle where the stretch starts.
    post_catch : {"continuous", "additive"}
        Reading of (5).
    residual_reading : {"residual", "decrease"}
        Reading of Q: with "decrease" the residual is 1 - Q of the peak.
    catch_rise : float
        How long the torque takes to its peak, s; 0 is the step of (3). An amplifier
        may be spared the step so: torque then rises along 3x² - 2x³.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range; the message names it.
    """

    kind: ClassVar[str] = "spastic-elbow"

    # is_passive is False: an arm led back slowly in its catch is pushed by the residual
    # torque

    catch_angle_constant: float = field(metadata=known("rad", "angle above 0"))
    catch_torque_constant: float = field(metadata=known("N·m·s/rad", "not negative"))
    residual_ratio: float = field(metadata=known("", "share below 1"))
    catch_travel: float = field(metadata=known("rad", "angle above 0"))
    inertia: float = _published(0.0, "kg·m²", "not negative")
    damping: float = _published(1.26, "N·m·s/rad", "not negative")
    stiffness: float = _published(3.15, "N·m/rad", "not negative")
    catch_slope: float = _published(0.35, "s", "positive")
    peak_duration: float = _published(0.1, "s", "positive")
    post_catch_stiffness: float = _published(5.8, "N·m/rad", "not negative")
    speed_threshold: float = _published(math.radians(20.0), "rad/s", "positive")
    slowest_mean_speed: float = _published(math.radians(60.0), "rad/s", "not negative")
    smallest_catch_angle: float = _published(math.radians(60.0), "rad", "not negative")
    range_end: float = _published(math.radians(146.0), "rad", "angle above 0")
    rest_angle: float | None = _published(None, "rad", "finite")
    post_catch: PostCatch = "continuous"
    residual_reading: ResidualReading = "residual"
    catch_rise: float = _published(0.0, "s", "finite")

    def _check_together(self) -> None:
        for name, (one, other) in READINGS.items():
            if (value := getattr(self, name)) not in (one, other):
                raise ParameterError(
                    f'{name}: needs "{one}" or "{other}", got {value!r}'
                )
        if not 0.0 <= self.catch_rise <= self.peak_duration:
            raise ParameterError(
                f"catch_rise: needs 0 to peak_duration, {self.peak_duration:g} s, "
                f"got {self.catch_rise:g} s"
            )

    @property
    def fastest_mean_speed(self) -> float:
        """Mean speed above which the catch angle is the smallest, ν_H of (6), rad/s."""
        span = self.catch_angle_constant - self.smallest_catch_angle
        return span / self.catch_slope

    @property
    def residual_share(self) -> float:
        """Residual torque over peak torque, both above pre-catch."""
        return float(_law.catch(self, 0.0, 1.0)[1].level)

    def catch_angle(self, mean_speed: float) -> float:
        """Return the catch angle for a mean pre-catch speed.

        Parameters
        ----------
        mean_speed : float
            Mean speed of the pre-catch phase so far, rad/s.

        Returns
        -------
        float
            Catch angle, rad, by (2) with the clamps of (6).
        """
        if mean_speed > self.fastest_mean_speed:
            return self.smallest_catch_angle  # third line of (6)
        slowed = max(mean_speed, self.slowest_mean_speed)  # first line of (6)
        return self.catch_angle_constant - self.catch_slope * slowed  # (2)

    def stepper(self, start_angle: float) -> SampledJoint:
        """Return the joint as a state machine that has not seen a sample yet."""
        return SampledJoint(self, start_angle=start_angle)

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m.

        Inertia, which is not commanded, is left out.

        Examples
        --------
        >>> from math import radians
        >>> from masrel.lab.elbow import STANDARD_MODELS
        >>> joint = STANDARD_MODELS["HM3"]
        >>> bound = joint.largest_torque(start_angle=radians(30), speed=radians(92))
        >>> round(bound, 3)
        12.897
        """
        rest, end = self.rest_from(start_angle), self.range_end
        first = min(self.catch_angle(0.0), self.smallest_catch_angle)  # (6)
        earliest = min(max(first, start_angle), end)
        held = end if self.post_catch == "additive" else earliest
        climb = max(end - earliest - self.catch_travel, 0.0)
        rise = self.catch_torque_constant * speed  # H·v_c of (3)
        spring = self.stiffness * (end - rest)
        return self.damping * speed + max(
            abs(spring),
            self.stiffness * abs(start_angle - rest),
            # an arm led slowly past the catch angle catches where it is first fast
            spring + rise,
            # (5), whose torque is convex in the angle of the catch
            self.stiffness * (held - rest)
            + self.residual_share * rise
            + self.post_catch_stiffness * climb,
        )

    def largest_slope(self, *, speed: float) -> tuple[float, float]:  # noqa: ARG002 - as all
        """Return the largest slopes, over angle and velocity, where nothing jumps."""
        goes_on = self.post_catch == "additive"
        after = self.post_catch_stiffness + goes_on * self.stiffness
        return max(self.stiffness, after), self.damping


def _table_iii(
    length: float, torque: float, ratio: float, travel: float
) -> ElbowParameters:
    return ElbowParameters(
        catch_angle_constant=math.radians(length),
        catch_torque_constant=torque,
        residual_ratio=ratio,
        catch_travel=math.radians(travel),
    )


STANDARD_MODELS: dict[str, ElbowParameters] = {
    "HM1": _table_iii(130.0, 1.4, 0.15, 60.0),  # MAS 1
    "HM2": _table_iii(120.0, 2.0, 0.30, 50.0),  # MAS 1+
    "HM3": _table_iii(115.0, 2.8, 0.60, 30.0),  # MAS 2
    "HM4": _table_iii(110.0, 3.8, 0.80, 10.0),  # MAS 3
}
"""Table III: L, H, Q and D; every other constant is the default above."""

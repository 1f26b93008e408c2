"""The paper's law: its parameters, equations (1)-(6), and what a controller decides.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1)-(6) and Table III.

The sampled joint applies the law at every sample, the events and loads of a motion to
the polynomials of its pieces, `evaluate` to columns of scenes. `p` is
`ElbowParameters`, or columns under the same names.
"""

import math
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, Literal, NamedTuple

from masrel.errors import ParameterError
from masrel.lab.elbow._polynomials import (
    NOTHING,
    Number,
    Polynomial,
    derivative,
    product,
    some,
)
from masrel.lab.elbow.joint_model import Law, known, quantity

__all__ = [
    "STANDARD_MODELS",
    "ElbowParameters",
    "PostCatch",
    "ResidualReading",
    "SampledJoint",
]

PRE_CATCH, CATCH, POST_CATCH = range(3)  # positions in masrel.lab.recording.PHASES

Parameters = Any  # ElbowParameters, or columns under the same names


class TorqueLaw(NamedTuple):
    """Torque as long as one law holds: level + k (θ - origin) + b θ̇ + m θ̈.

    Of a smoothed onset also rise (3y² - 2y³), y the share of its time that has passed.
    """

    level: Number  # N·m
    stiffness: Number = 0.0  # N·m/rad
    origin: Number = 0.0  # rad
    damping: Number = 0.0  # N·m·s/rad
    inertia: Number = 0.0  # kg·m²
    onset: tuple[Number, Number] | None = None  # rise, N·m, and its time, s

    def commanded(self, angle: Number, velocity: Number) -> Number:
        """Return the torque without m·θ̈: the mannequin's arm has the inertia."""
        level, stiffness, origin, damping, _, _ = (
            self  # twice as fast as by their names
        )
        return level + stiffness * (angle - origin) + damping * velocity

    @property
    def is_flat(self) -> bool:
        """Whether it is its level, whatever the arm does."""
        terms = (self.stiffness, self.damping, self.inertia)
        is_level = all(isinstance(term, float) and term == 0.0 for term in terms)
        return is_level and self.onset is None

    def along(self, angle: Polynomial, since: Number) -> Polynomial:
        """Return the torque along an angle that begins so long after the law, s."""
        if self.onset is not None:
            rise, time = self.onset
            y = [since / time, 1.0 / time]
            square, last = product(y, y), [3.0 - 2.0 * y[0], -2.0 * y[1]]
            first, *later = product(square, last)  # `onset_share`
            return [self.level + rise * first, *[rise * c for c in later]]
        if self.is_flat:
            return [self.level]
        k, b, m = self.stiffness, self.damping, self.inertia
        speed = [*derivative(angle), 0.0]
        torque = [k * x + b * v for x, v in zip(angle, speed, strict=False)]
        torque[0] = self.commanded(angle[0], speed[0])
        if some(m != 0.0):
            for i, acceleration in enumerate(derivative(speed)):
                torque[i] = torque[i] + m * acceleration
        return torque


def pre_catch_law(p: Parameters, rest: Number) -> TorqueLaw:
    """(1): m·θ̈ + b·θ̇ + k·(θ - θ_rest)."""
    return TorqueLaw(0.0, p.stiffness, rest, p.damping, p.inertia)


def catch_line(
    p: Parameters,
    constant: Number,
    angle: Polynomial,
    way: Polynomial,
    since: Polynomial,
) -> Polynomial:
    """(2) as a polynomial: θ - (L - α·v̄), v̄ = way/since, times the time since onset."""
    # constant: L, counted as the angles are; since: one coefficient or two
    beyond = [angle[0] - constant, *angle[1:]]
    if len(since) == 2:
        longer, before = [*beyond, 0.0], [0.0, *beyond]
        beyond = [
            since[0] * a + since[1] * b for a, b in zip(longer, before, strict=True)
        ]
    for i, w in enumerate(way):
        beyond[i] = beyond[i] + p.catch_slope * w
    return beyond


def slow_line(p: Parameters, way: Polynomial, since: Polynomial) -> Polynomial:
    """ν_H - v̄, v̄ = way/since, times the time since onset: (6) where ν_L exceeds ν_H."""
    # a mean speed that differs from ν_H by rounding alone is ν_H
    longer = [*since, *[0.0] * len(way)]
    return [
        (1.0 + NOTHING) * p.fastest_mean_speed * s - w
        for s, w in zip(longer, way, strict=False)
    ]


def catch_bounds(p: Parameters, origin: Number) -> tuple[Number, Number]:
    """(6), last line and first: θ_L, and L - α·ν_L, the largest; rad from an origin."""
    largest = (p.catch_angle_constant - origin) - p.catch_slope * p.slowest_mean_speed
    return p.smallest_catch_angle - origin, largest


def catch_laws(
    p: Parameters, pre_end: Number, rise: Number
) -> tuple[TorqueLaw, TorqueLaw]:
    """(3), first and second line; pre_end is τ_pre_end and rise H·v_c."""
    # What stays is Q as section II reads it, or 1 - Q, as section III.C does
    decrease = 1.0 * (p.residual_reading == "decrease")
    share = decrease * (1.0 - p.residual_ratio) + (1.0 - decrease) * p.residual_ratio
    return TorqueLaw(pre_end + rise), TorqueLaw(pre_end + share * rise)


def onset_share(y: Number) -> Number:
    """Share of the rise at share y of `catch_rise`, a smoothed onset: 3y² - 2y³."""
    return y * y * (3.0 - 2.0 * y)


def post_catch_law(
    p: Parameters, residual: Number, pre_end: Number, start: Number, rest: Number
) -> TorqueLaw:
    """(5): from the residual torque of (3) on; start is θ_post."""
    additive = 1.0 * (p.post_catch == "additive")
    # as Table III's footnote reads it, the spring and damper of (1) go on
    spring = p.stiffness * (start - rest)
    return TorqueLaw(
        level=residual + additive * (spring - pre_end),
        stiffness=p.post_catch_stiffness + additive * p.stiffness,
        origin=start,
        damping=additive * p.damping,
        inertia=p.inertia,
    )


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
        self._parameters = parameters
        self._pre_catch = pre_catch_law(parameters, parameters.rest_from(start_angle))
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
                self.phase, rest = POST_CATCH, self._pre_catch.origin
                self._law = post_catch_law(
                    self._parameters, self._residual, self._pre_end, angle, rest
                )
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
            peak, residual = catch_laws(parameters, self._pre_end, self._rise)
            self._peak, self._residual = peak.level, residual.level

    def _catch_torque(self, since: float) -> float:
        parameters = self._parameters
        if since < parameters.catch_rise:
            share = onset_share(since / parameters.catch_rise)
            return float(self._pre_end + self._rise * share)
        return self._peak if since < parameters.peak_duration else self._residual

    def _to_pre_catch(self) -> None:
        self.phase = PRE_CATCH
        self._law = self._pre_catch
        self._moving = False


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
        return float(catch_laws(self, 0.0, 1.0)[1].level)

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

"""The law of the joint: equations (1)-(6), for a sample, a polynomial or a column.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330.

The sampled joint applies it at every sample, the events and loads of a motion to the
polynomials of its pieces, `evaluate` to columns of scenes. `p` is `ElbowParameters`, or
columns under the same names.
"""

from typing import Any, NamedTuple

from masrel.lab.elbow._polynomials import (
    NOTHING,
    Number,
    Polynomial,
    derivative,
    product,
    some,
)

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


def pre_catch(p: Parameters, rest: Number) -> TorqueLaw:
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


def catch(p: Parameters, pre_end: Number, rise: Number) -> tuple[TorqueLaw, TorqueLaw]:
    """(3), first and second line; pre_end is τ_pre_end and rise H·v_c."""
    # What stays is Q as section II reads it, or 1 - Q, as section III.C does
    decrease = 1.0 * (p.residual_reading == "decrease")
    share = decrease * (1.0 - p.residual_ratio) + (1.0 - decrease) * p.residual_ratio
    return TorqueLaw(pre_end + rise), TorqueLaw(pre_end + share * rise)


def onset_share(y: Number) -> Number:
    """Share of the rise at share y of `catch_rise`, a smoothed onset: 3y² - 2y³."""
    return y * y * (3.0 - 2.0 * y)


def post_catch(
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

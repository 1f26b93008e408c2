"""Prescribed movements: the quintic by hand, derivatives, times, refusals."""

import math
from math import degrees, nan, radians

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from masrel.errors import MasrelError, ParameterError
from masrel.lab.elbow import ConstantSpeed, MinimumJerk, Motion, times_at
from tests.lab.elbow.stretches import constant, minimum_jerk, motions

# From 0.5 to 2.5 rad at a mean of 1 rad/s: 2 rad in 2 s.
QUINTIC = MinimumJerk(start=0.5, end=2.5, mean_speed=1.0)


@pytest.mark.parametrize(
    ("time", "angle", "velocity", "acceleration"),
    [
        # p(s) = 10 s³ - 15 s⁴ + 6 s⁵, p' = 30 s² (1-s)², p'' = 60 s (1-s)(1-2s) with
        # s = t/2: θ = 0.5 + 2 p, ω = 2/2 p' = p', α = 2/4 p'' = p''/2.
        (0.0, 0.5, 0.0, 0.0),
        # s = 1/4: p = 10/64 - 15/256 + 6/1024 = (160 - 60 + 6)/1024 = 106/1024;
        # p' = 30 · 1/16 · 9/16 = 270/256; p'' = 60 · 1/4 · 3/4 · 1/2 = 5.625.
        (0.5, 0.5 + 212 / 1024, 270 / 256, 2.8125),
        # s = 1/2: p = 1/2, half the way; p' = 30/16 = 1.875; p'' = 0.
        (1.0, 1.5, 1.875, 0.0),
        (1.5, 2.5 - 212 / 1024, 270 / 256, -2.8125),  # mirrored
        (2.0, 2.5, 0.0, 0.0),
    ],
)
def test_minimum_jerk_has_the_values_of_the_quintic(
    time: float, angle: float, velocity: float, acceleration: float
) -> None:
    # These are dyadic fractions: no operation rounds.
    assert float(QUINTIC.angle(time)) == angle
    assert float(QUINTIC.velocity(time)) == velocity
    assert float(QUINTIC.acceleration(time)) == acceleration


def test_minimum_jerk_is_stationary_for_the_integral_of_squared_jerk() -> None:
    # Its sixth derivative is 0 (Euler-Lagrange): the sixth difference of 7 points of a
    # quintic vanishes, up to 2⁶ roundings of 2.5.
    angle = QUINTIC.angle(np.linspace(0.0, 2.0, 7))
    assert abs(float(np.diff(angle, 6)[0])) < 64 * 2.5 * np.finfo(float).eps


def test_constant_speed_by_hand() -> None:
    stretch = ConstantSpeed(start=0.5, end=2.5, speed=4.0)
    assert stretch.duration == 0.5
    assert stretch.angle(np.array([0.0, 0.25, 0.5])).tolist() == [0.5, 1.5, 2.5]
    assert stretch.velocity(np.array([0.0, 0.5])).tolist() == [4.0, 4.0]
    assert stretch.acceleration(np.array([0.0, 0.5])).tolist() == [0.0, 0.0]
    assert times_at(stretch, [1.5]).tolist() == [0.25]


@given(motion=motions())
def test_mean_speed_is_travel_over_duration(motion: Motion) -> None:
    asked = motion.speed if isinstance(motion, ConstantSpeed) else motion.mean_speed
    first, last = motion.angle(np.array([0.0, motion.duration]))
    assert first == motion.start
    # end - start and the sum in angle() each round once: a few ulp of at most π
    assert last == pytest.approx(motion.end, abs=2e-15)
    assert (last - first) / motion.duration == pytest.approx(asked, rel=1e-14)


@given(motion=motions(), share=st.floats(0.01, 0.99))
def test_velocity_is_the_derivative_of_the_angle(motion: Motion, share: float) -> None:
    # Complex step: the imaginary part of θ(t + ih)/h is θ' without cancellation; its
    # truncation, h² θ'''/6 with h = 1e-20 s, is far below rounding.
    time = share * motion.duration
    step = 1e-20
    slope = np.imag(motion.angle(time + 1j * step)) / step  # type: ignore[arg-type]
    assert float(motion.velocity(time)) == pytest.approx(float(slope), rel=1e-12)


@given(motion=motions(), share=st.floats(0.01, 0.99))
def test_acceleration_is_the_derivative_of_the_velocity(
    motion: Motion, share: float
) -> None:
    # Near the middle the acceleration passes through 0, so the error is measured
    # against its scale, mean speed over duration.
    assume(isinstance(motion, MinimumJerk))
    time = share * motion.duration
    step = 1e-20
    slope = np.imag(motion.velocity(time + 1j * step)) / step  # type: ignore[arg-type]
    scale = 6.0 * (motion.end - motion.start) / motion.duration**2
    assert abs(float(motion.acceleration(time) - slope)) < 1e-13 * scale


@given(motion=motions(), shares=st.lists(st.floats(0.0, 1.0), min_size=1))
def test_many_times_at_once_give_the_same_bits_as_one_by_one(
    motion: Motion, shares: list[float]
) -> None:
    times = [share * motion.duration for share in shares]
    for law in (motion.angle, motion.velocity, motion.acceleration):
        assert law(np.array(times)).tolist() == [float(law(time)) for time in times]


@given(motion=motions(), share=st.floats(0.001, 0.999))
def test_times_at_undoes_angle(motion: Motion, share: float) -> None:
    angle = motion.start + share * (motion.end - motion.start)
    found = float(times_at(motion, [angle])[0])
    assert 0.0 <= found <= motion.duration
    assert float(motion.angle(found)) == pytest.approx(angle, abs=4e-15)


@pytest.mark.parametrize("kind", [constant, minimum_jerk])
@pytest.mark.parametrize(
    ("start", "end"),
    [(50.0, 50.0), (60.0, 50.0), (-1.0, 50.0), (10.0, 181.0), (nan, 50.0), (10.0, nan)],
)
def test_angles_out_of_order_or_range_are_refused(kind, start, end) -> None:
    said = (
        r"start, end: need 0 <= start < end <= 180 degrees, "
        rf"got {start:g} and {end:g} degrees"
    )
    with pytest.raises(ParameterError, match=said):
        kind(90.0, start_deg=start, end_deg=end)


@pytest.mark.parametrize(
    ("kind", "name"), [(constant, "speed"), (minimum_jerk, "mean_speed")]
)
@pytest.mark.parametrize("speed", [0.0, -90.0, nan, math.inf])
def test_speeds_that_do_not_move_are_refused(kind, name: str, speed: float) -> None:
    said = rf"^{name}: needs more than 0 and finite, got {speed:g} deg/s"
    with pytest.raises(ParameterError, match=said):
        kind(speed)


def test_refusals_are_errors_of_the_package_and_values() -> None:
    with pytest.raises(MasrelError) as caught:
        constant(0.0)
    assert isinstance(caught.value, ValueError)


def test_motions_are_frozen() -> None:
    stretch = constant(90.0)
    with pytest.raises(AttributeError):
        stretch.speed = 1.0  # type: ignore[misc]
    assert degrees(stretch.speed) == pytest.approx(90.0)
    assert radians(30.0) == stretch.start


@pytest.mark.parametrize("goal", [2.6, 0.4, float("nan"), float("inf")])
def test_an_angle_that_is_not_reached_has_no_time(goal: float) -> None:
    stretch = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
    with pytest.raises(ParameterError, match="angles: need ones that the motion reach"):
        times_at(stretch, [goal])

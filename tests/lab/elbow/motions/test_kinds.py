"""Kinds of motion: by hand, against SciPy, and pieces against samples."""

from math import inf, nan, pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.interpolate import PchipInterpolator

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    ConstantSpeed,
    Hold,
    Joined,
    MinimumJerk,
    Motion,
    Part,
    Recorded,
    Reversed,
    Trapezoid,
    interrupted,
)
from tests.lab.elbow.scenes import KINDS, random_scene

LINE = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
REACH = MinimumJerk(start=0.5, end=2.5, mean_speed=1.0)
# ramps of 0.5 s and 0.25 rad, 1.5 rad at 1 rad/s between them
RAMPS = Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=2.0)


def any_motion(seed: int, kind: str) -> Motion:
    return random_scene(np.random.default_rng(seed), kind, wide=False)[1]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_samples_are_those_of_the_pieces(kind: str, seed: int) -> None:
    motion = any_motion(seed, kind)
    time = 0.0
    for piece in motion.pieces():
        angle = Polynomial(piece.angle)
        for share in np.arange(1, 8) / 8:
            x = share * piece.length
            at = piece.start + x
            speed, acceleration = angle.deriv()(x), angle.deriv(2)(x)
            assert piece.slowest - 1e-12 <= speed <= piece.fastest + 1e-12
            expected = motion.origin + angle(x)
            assert float(motion.angle(at)) == pytest.approx(expected, abs=1e-12)
            assert float(motion.velocity(at)) == pytest.approx(speed, abs=1e-11)
            # accelerations of uneven samples are differences of near slopes
            scale = max(abs(acceleration), 1.0)
            found = float(motion.acceleration(at))
            assert found == pytest.approx(acceleration, abs=1e-8 * scale)
        time += piece.length
    assert time == pytest.approx(motion.duration, rel=1e-14)
    assert float(motion.angle(0.0)) == pytest.approx(motion.start, abs=1e-15)
    assert float(motion.angle(motion.duration)) == pytest.approx(motion.end, abs=1e-14)


@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 30), share=st.floats(0.0, 1.0), origin=st.floats(0.0, 2.0))
def test_an_origin_is_taken_off_the_angle(
    kind: str, seed: int, share: float, origin: float
) -> None:
    motion = any_motion(seed, kind)
    time = share * motion.duration
    apart = float(motion.angle(time, origin)) - (float(motion.angle(time)) - origin)
    assert abs(apart) < 2e-15
    start = float(motion.angle(0.0, motion.start))
    assert abs(start) < 1e-16


@pytest.mark.parametrize("kind", KINDS)
def test_many_times_at_once_give_the_same_bits_as_one_by_one(kind: str) -> None:
    motion = any_motion(3, kind)
    times = np.linspace(0.0, motion.duration, 37)
    for law in (motion.angle, motion.velocity, motion.acceleration):
        assert law(times).tolist() == [float(law(time)) for time in times.tolist()]


# Trapezoid


@pytest.mark.parametrize(
    ("time", "angle", "velocity", "acceleration"),
    [
        (0.0, 0.5, 0.0, 2.0),
        (0.25, 0.5625, 0.5, 2.0),  # ½ · 2 · ¼²
        (0.5, 0.75, 1.0, 0.0),
        (1.0, 1.25, 1.0, 0.0),
        (2.25, 2.4375, 0.5, -2.0),
        (2.5, 2.5, 0.0, -2.0),
    ],
)
def test_a_trapezoid_by_hand(
    time: float, angle: float, velocity: float, acceleration: float
) -> None:
    assert float(RAMPS.angle(time)) == angle
    assert float(RAMPS.velocity(time)) == velocity
    assert float(RAMPS.acceleration(time)) == acceleration


def test_a_trapezoid_may_be_a_triangle_and_no_less() -> None:
    # 1 rad/s on 2 rad needs 1²/2 = 0.5 rad/s² at least: then there is no level
    triangle = Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=0.5)
    assert len(list(triangle.pieces())) == 2
    assert float(triangle.angle(2.0)) == 1.5
    said = r"^acceleration_rate: needs 28\.6479 deg/s² or more to reach 57\.2958 deg/s"
    with pytest.raises(ParameterError, match=said):
        Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=0.49)


@pytest.mark.parametrize("rate", [0.0, -1.0, nan, inf])
def test_ramps_must_rise(rate: float) -> None:
    with pytest.raises(ParameterError, match=r"^acceleration_rate: needs more than 0"):
        Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=rate)


# Recorded


@given(
    rises=st.lists(st.floats(-0.3, 0.3), min_size=2, max_size=12),
    widths=st.lists(st.floats(0.01, 1.0), min_size=12, max_size=12),
)
def test_cubics_between_samples_are_those_of_scipy(
    rises: list[float], widths: list[float]
) -> None:
    angle = np.clip(1.5 + np.cumsum([0.0, *rises]), 0.0, pi)
    time = np.cumsum([0.0, *widths[: len(rises)]])
    motion = Recorded(time=time, angle=angle)
    peer = PchipInterpolator(time, angle)
    at = np.linspace(0.0, time[-1], 101)
    steepest = float(np.abs(np.diff(angle) / np.diff(time)).max()) + 1.0
    assert motion.angle(at) == pytest.approx(peer(at), abs=1e-13)
    assert motion.velocity(at) == pytest.approx(peer(at, 1), abs=1e-10 * steepest)


def test_a_recorded_line_is_a_line() -> None:
    motion = Recorded(
        time=[3.0, 3.5, 5.0], angle=[0.5, 1.0, 2.5], interpolation="linear"
    )
    times = np.linspace(0.0, 2.0, 41)
    assert motion.angle(times) == pytest.approx(LINE.angle(times), abs=1e-15)
    assert set(motion.velocity(times).tolist()) == {1.0}
    assert set(motion.acceleration(times).tolist()) == {0.0}


def test_two_samples_are_enough() -> None:
    for interpolation in ("pchip", "linear"):
        motion = Recorded(
            time=[0.0, 2.0], angle=[0.5, 2.5], interpolation=interpolation
        )
        assert float(motion.angle(0.5)) == 1.0
        assert (motion.start, motion.end) == (0.5, 2.5)


@pytest.mark.parametrize(
    ("time", "angle", "said"),
    [
        ([0.0], [0.5], "two or more samples and as many times as angles"),
        ([0.0, 1.0], [0.5], r"got shapes \(2,\) and \(1,\)"),
        ([0.0, 1.0, 1.0], [0.5, 0.6, 0.7], "time: needs to grow.*got 1 in sample 3"),
        ([0.0, 2.0, 1.0], [0.5, 0.6, 0.7], "time: needs to grow.*got 1 in sample 3"),
        ([0.0, nan], [0.5, 0.6], "time: needs finite numbers, got nan in sample 2"),
        ([0.0, 1.0], [0.5, inf], "angle: needs finite numbers, got inf in sample 2"),
        ([0.0, 1.0], [-0.1, 0.5], "angle: needs 0 to 180 degrees, got -5.7.* sample 1"),
        ([0.0, 1.0], [0.5, 57.0], "angle: needs 0 to 180 degrees, got 3265.* sample 2"),
    ],
)
def test_wrong_samples_are_refused_with_their_place(time, angle, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        Recorded(time=time, angle=angle)


def test_an_unknown_interpolation_is_refused() -> None:
    said = "interpolation: needs one of pchip, linear, got 'cubic'"
    with pytest.raises(ParameterError, match=said):
        Recorded(time=[0.0, 1.0], angle=[0.5, 0.6], interpolation="cubic")  # type: ignore[arg-type]


# Composed


def test_backwards_by_hand() -> None:
    back = Reversed(motion=REACH)
    assert (back.start, back.end, back.duration) == (2.5, 0.5, 2.0)
    # the quintic of test_motion.py, at 0.5 s before its end
    assert float(back.angle(0.5)) == 2.5 - 212 / 1024
    assert float(back.velocity(0.5)) == -270 / 256
    assert float(back.acceleration(0.5)) == -2.8125


def test_a_part_is_the_whole_between_two_times() -> None:
    part = Part(motion=RAMPS, begin=0.25, finish=2.25)
    assert (part.start, part.end, part.duration) == (0.5625, 2.4375, 2.0)
    assert float(part.velocity(0.0)) == 0.5
    assert [piece.length for piece in part.pieces()] == [0.25, 1.5, 0.25]


def test_an_interruption_by_hand() -> None:
    motion = interrupted(LINE, at=0.5, pause=3.0)
    assert motion.duration == 5.0
    times = np.array([0.25, 0.5, 2.0, 3.5, 4.0, 5.0])
    assert motion.angle(times).tolist() == [0.75, 1.0, 1.0, 1.0, 1.5, 2.5]
    # where the speed jumps the later one holds
    assert motion.velocity(times).tolist() == [1.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert motion.acceleration(times).tolist() == [0.0] * 6


def test_a_long_rest_costs_no_more_digits_than_its_time_has() -> None:
    # 1e5 s have an ulp of 1.5e-11 s, and the reach is as much too early or too late
    motion = Joined(
        [Hold(start=0.5, duration=0.1), Hold(start=0.5, duration=1e5), REACH]
    )
    begin = 100000.1
    left = begin - 1e5 - 0.1  # what the float of the time is more than 1e5 + 0.1
    at = float(motion.angle(begin + 1.0))
    assert at == pytest.approx(float(REACH.angle(1.0 + left)), abs=3e-11)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Joined([]), "motions: needs one or more, got none"),
        (
            lambda: Joined([LINE, LINE]),
            r"motions\[1\]: needs to start at 143.239 degrees, .* got 28.6479 degrees",
        ),
        (
            lambda: Hold(start=4.0, duration=1.0),
            "start: needs 0 to 180 degrees, got 229",
        ),
        (
            lambda: Hold(start=nan, duration=1.0),
            "start: needs 0 to 180 degrees, got nan",
        ),
        (lambda: Hold(start=1.0, duration=0.0), "duration: needs more than 0 s"),
        (lambda: Hold(start=1.0, duration=inf), "duration: needs more than 0 s"),
        (lambda: Part(motion=LINE, begin=1.0, finish=1.0), "got 1 and 1 s"),
        (lambda: Part(motion=LINE, begin=0.0, finish=3.0), "<= 2 s, the duration"),
        (lambda: Part(motion=LINE, begin=-1.0, finish=1.0), "got -1 and 1 s"),
        (lambda: interrupted(LINE, at=2.0, pause=1.0), "got 2 and 2 s"),
    ],
)
def test_movements_that_cannot_be_are_refused(make, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        make()


def test_degrees_are_radians_inside() -> None:
    assert float(Hold(start=radians(90.0), duration=1.0).angle(0.5)) == pi / 2

"""Motions: by hand, pieces against samples, refusals."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    MinimumJerk,
    Motion,
    Part,
    Recorded,
    Reversed,
    Trapezoid,
    times_at,
)
from tests.lab.elbow.scenes import KINDS, random_scene

# From 0.5 to 2.5 rad at a mean of 1 rad/s: 2 rad in 2 s.
REACH = MinimumJerk(start=0.5, end=2.5, mean_speed=1.0)
# ramps of 0.5 s and 0.25 rad, 1.5 rad at 1 rad/s between them
RAMPS = Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=2.0)


# Dyadic fractions, of which no operation rounds.
@pytest.mark.parametrize(
    ("motion", "time", "angle", "velocity", "acceleration"),
    [
        # p(s) = 10 s³ - 15 s⁴ + 6 s⁵, p' = 30 s² (1-s)², p'' = 60 s (1-s)(1-2s) with
        # s = t/2: θ = 0.5 + 2 p, ω = 2/2 p' = p', α = 2/4 p'' = p''/2.
        (REACH, 0.0, 0.5, 0.0, 0.0),
        # s = 1/4: p = 10/64 - 15/256 + 6/1024 = (160 - 60 + 6)/1024 = 106/1024;
        # p' = 30 · 1/16 · 9/16 = 270/256; p'' = 60 · 1/4 · 3/4 · 1/2 = 5.625.
        (REACH, 0.5, 0.5 + 212 / 1024, 270 / 256, 2.8125),
        # s = 1/2: p = 1/2, half the way; p' = 30/16 = 1.875; p'' = 0.
        (REACH, 1.0, 1.5, 1.875, 0.0),
        (REACH, 1.5, 2.5 - 212 / 1024, 270 / 256, -2.8125),  # mirrored
        (REACH, 2.0, 2.5, 0.0, 0.0),
        (Reversed(motion=REACH), 0.5, 2.5 - 212 / 1024, -270 / 256, -2.8125),
        (RAMPS, 0.0, 0.5, 0.0, 2.0),
        (RAMPS, 0.25, 0.5625, 0.5, 2.0),  # ½ · 2 · ¼²
        (RAMPS, 0.5, 0.75, 1.0, 0.0),
        (RAMPS, 1.0, 1.25, 1.0, 0.0),
        (RAMPS, 2.25, 2.4375, 0.5, -2.0),
        (RAMPS, 2.5, 2.5, 0.0, -2.0),
        (Part(motion=RAMPS, begin=0.25, finish=2.25), 0.0, 0.5625, 0.5, 2.0),
        (Part(motion=RAMPS, begin=0.25, finish=2.25), 2.0, 2.4375, 0.5, -2.0),
    ],
)
def test_motions_by_hand(
    motion: Motion, time: float, angle: float, velocity: float, acceleration: float
) -> None:
    assert float(motion.angle(time)) == angle
    assert float(motion.velocity(time)) == velocity
    assert float(motion.acceleration(time)) == acceleration


@pytest.mark.parametrize("kind", KINDS[:3])
@pytest.mark.parametrize("seed", range(20))
def test_times_at_undoes_angle(kind: str, seed: int) -> None:
    motion = any_motion(seed, kind)
    angles = np.linspace(motion.start, motion.end, 20)[1:-1]
    found = times_at(motion, angles)
    assert 0.0 <= found.min() <= found.max() <= motion.duration
    assert motion.angle(found) == pytest.approx(angles, abs=4e-15)


def test_a_recording_is_at_its_samples_and_does_not_pass_them() -> None:
    time, angle = np.array([0.0, 0.5, 2.0, 2.25]), np.array([0.5, 1.0, 1.0, 0.75])
    for interpolation in ("pchip", "linear"):
        motion = Recorded(time=time, angle=angle, interpolation=interpolation)
        assert motion.angle(time) == pytest.approx(angle, abs=1e-15)
        assert motion.angle(np.linspace(0.0, 2.25, 99)).max() <= 1.0 + 1e-15
    assert float(motion.angle(0.25)) == 0.75


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


def test_a_trapezoid_may_be_a_triangle_and_no_less() -> None:
    # 1 rad/s on 2 rad needs 1²/2 = 0.5 rad/s² at least: then there is no level
    triangle = Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=0.5)
    assert len(list(triangle.pieces())) == 2
    assert float(triangle.angle(2.0)) == 1.5
    said = r"^acceleration_rate: needs 28\.6479 deg/s² or more to reach 57\.2958 deg/s"
    with pytest.raises(ParameterError, match=said):
        Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=0.49)


# Recorded


# Composed

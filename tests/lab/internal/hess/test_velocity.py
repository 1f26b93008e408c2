import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.lab.hess._signals import VelocityEstimate


def test_a_step_of_speed_is_followed_as_a_first_order_system() -> None:
    # A ramp of angle is a step of speed; sampled every h, the exact first-order
    # response after n samples is v (1 - exp(-c n h)).
    estimate = VelocityEstimate()
    estimate.update(0.0, 0.0)
    for n in range(1, 40):
        velocity = estimate.update(n * 1e-3, 1.5 * n * 1e-3)
        assert velocity == pytest.approx(1.5 * (1 - math.exp(-180e-3 * n)), rel=1e-9)


def test_one_encoder_step_moves_the_estimate_by_less_than_the_dead_zone() -> None:
    # 0.005 deg in 1 ms is 5 deg/s; 5 (1 - exp(-0.18)) = 0.8236 deg/s < 1 deg/s,
    # where friction compensation begins.
    estimate = VelocityEstimate()
    estimate.update(0.0, 30.0)
    assert estimate.update(0.001, 30.005) == pytest.approx(0.82365, abs=1e-4)


def test_the_first_reading_gives_no_speed_and_no_time_gives_no_change() -> None:
    estimate = VelocityEstimate()
    assert estimate.update(5.0, 2.0) == 0.0
    moving = estimate.update(5.001, 2.001)
    assert estimate.update(5.001, 3.0) == moving


@given(st.lists(st.integers(1, 5), min_size=30, max_size=60))
def test_missed_ticks_do_not_bias_a_constant_speed(intervals_ms: list[int]) -> None:
    estimate = VelocityEstimate()
    estimate.update(0.0, 0.0)
    elapsed_ms = 0
    for interval in intervals_ms:
        elapsed_ms += interval
        velocity = estimate.update(elapsed_ms * 1e-3, 2.0 * elapsed_ms * 1e-3)
    exact = 2.0 * (1.0 - math.exp(-180.0 * elapsed_ms * 1e-3))
    assert velocity == pytest.approx(exact, rel=1e-6)

"""The filters: what they keep, what they pass, and where a hand's speed breaks."""

import math

import numpy as np
import pytest

from masrel.lab.elbow.identification._stretches import (
    differentiate,
    filter_alike,
    state_at_break,
    window_length,
)

PERIOD = 1e-3
TIME = np.arange(600) * PERIOD


def test_a_cubic_is_kept_with_its_derivatives_up_to_the_ends() -> None:
    cubic = np.polynomial.Polynomial([0.3, 1.0, -2.0, 4.0])
    angle, velocity, acceleration = differentiate(cubic(TIME), PERIOD, 0.06)
    np.testing.assert_allclose(angle, cubic(TIME), atol=1e-12)
    np.testing.assert_allclose(velocity, cubic.deriv()(TIME), atol=1e-9)
    np.testing.assert_allclose(acceleration, cubic.deriv(2)(TIME), atol=1e-6)


def test_speed_at_20_5_hz_comes_out_at_half_its_power() -> None:
    turn = 2.0 * math.pi * 20.5  # as the page on identification has it
    _, velocity, _ = differentiate(np.sin(turn * TIME), PERIOD, 0.06)
    inner = slice(100, 500)
    ratio = velocity[inner] @ np.cos(turn * TIME[inner])
    ratio /= turn * (np.cos(turn * TIME[inner]) @ np.cos(turn * TIME[inner]))
    assert ratio == pytest.approx(math.sqrt(0.5), rel=5e-3)


def test_a_linear_law_survives_filtering_angle_and_torque_alike() -> None:
    # whatever the motion: here one far beyond the filter's bandwidth
    rng = np.random.default_rng(3)
    angle = np.cumsum(np.cumsum(rng.standard_normal(900))) * 1e-5
    law = np.zeros_like(angle)
    law[1:-1] = 1.3 * (angle[2:] - angle[:-2]) / (2 * PERIOD) + 3.0 * angle[1:-1]
    x, v, a, torque = filter_alike(angle[1:-1], law[1:-1], PERIOD, 0.1)
    np.testing.assert_allclose(torque, 1.3 * v + 3.0 * x, atol=1e-10)
    assert a.shape == x.shape


def test_a_break_in_acceleration_does_not_reach_the_speed_before_it() -> None:
    # speed 2 rad/s that falls by 40 rad/s² from 0.3 s on
    late = np.maximum(TIME - 0.3, 0.0)
    angle = 2.0 * TIME - 20.0 * late**2
    _, speed, acceleration = state_at_break(TIME, angle, 0.3)
    assert speed == pytest.approx(2.0, abs=1e-9)
    assert acceleration == pytest.approx(0.0, abs=1e-6)
    smooth = differentiate(angle, PERIOD, 0.06)[1][300]
    assert smooth < 1.95  # what a filter that knows nothing of the break would say


@pytest.mark.parametrize(("window", "length"), [(0.001, 7), (0.006, 7), (0.06, 61)])
def test_a_window_has_samples_enough_for_its_cubic(window: float, length: int) -> None:
    assert window_length(window, PERIOD) == length

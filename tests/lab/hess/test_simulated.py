"""The simulated device: an arm that sticks, slides, stops, and a hand that moves it."""

import time
from math import radians

import pytest

from masrel.errors import ParameterError
from masrel.lab.hess import (
    RealClock,
    SimulatedClock,
    SimulatedHand,
    open_device,
)

STEP = radians(0.005)  # of the encoder


def angles_of(torque_nm: float, slip_time: float | None = None) -> list[float]:
    """What the encoder reads each ms for 3 s, rad; the last second is under torque."""
    clock = SimulatedClock()
    hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5, slip_time=slip_time)
    angles = []
    with open_device("simulated", clock=clock, hand=hand) as device:
        for tick in range(3000):
            clock.sleep_until_ns(tick * 1_000_000)
            angles.append(device.read().angle)
            assert device.read().angle == angles[-1]  # the same twice
            if tick == 2000:
                device.command(torque_nm)
    return angles


def test_the_end_stops_hold_the_arm_and_the_encoder_reads_multiples_of_its_step() -> (
    None
):
    pushed = angles_of(-20.0)
    assert radians(145.0) < max(pushed[:2000]) <= max(pushed) <= radians(146.2)
    flexed = angles_of(20.0, slip_time=0.0)
    assert min(flexed) >= radians(-1.5)
    assert flexed[-1] == pytest.approx(0.0, abs=radians(0.1))
    for angle in pushed + flexed:
        assert angle / STEP == pytest.approx(round(angle / STEP), abs=1e-6)


# Clocks


def test_the_real_clock_is_never_early_and_sleeps_but_for_the_end_of_a_wait() -> None:
    clock = RealClock()
    for wait_ns in (0, 200_000, 3_000_000):
        deadline = clock.now_ns() + wait_ns
        clock.sleep_until_ns(deadline)
        assert clock.now_ns() >= deadline
    before, began = time.monotonic(), time.thread_time()
    clock.sleep_until_ns(clock.now_ns() - 10_000_000_000)  # has passed
    assert time.monotonic() - before < 1.0
    clock.sleep_until_ns(clock.now_ns() + 200_000_000)
    assert time.thread_time() - began < 0.05


def test_the_simulated_clock_stands_still_until_told_to_sleep_and_never_goes_back() -> (
    None
):
    clock = SimulatedClock(start_ns=7)
    assert [clock.now_ns(), clock.now_ns()] == [7, 7]
    for deadline_ns in (1_000, 10):
        clock.sleep_until_ns(deadline_ns)
        assert clock.now_ns() == 1_000
    with pytest.raises(ParameterError, match="start_ns: needs 0 or more, got -1"):
        SimulatedClock(start_ns=-1)

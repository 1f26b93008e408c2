"""The simulated device: an arm that sticks, slides, stops, and a hand that moves it."""

import time
from math import pi, radians

import pytest

from masrel.errors import ParameterError
from masrel.lab.hess import (
    HandTraits,
    HumanHand,
    RealClock,
    SimulatedClock,
    SimulatedHand,
    open_device,
)

STEP = radians(0.005)  # of the encoder


class Bench:
    """An open device and its clock; nobody holds the arm unless told otherwise."""

    def __init__(self, slip_time: float | None = 0.0) -> None:
        self.clock = SimulatedClock()
        hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5, slip_time=slip_time)
        self.device = open_device("simulated", clock=self.clock, hand=hand)
        self.device.read()

    def run(self, until_s: float) -> list[float]:
        angles = []
        while self.clock.now_ns() < round(until_s * 1e9):
            self.clock.sleep_until_ns(self.clock.now_ns() + 1_000_000)
            angles.append(self.device.read().angle)
        return angles


@pytest.fixture
def bench(request: pytest.FixtureRequest):
    made = Bench(*getattr(request, "param", ()))
    yield made
    made.device.close()


held = pytest.mark.parametrize("bench", [(None,)], indirect=True)


@held
def test_the_end_stop_holds_the_arm_within_a_fifth_of_a_degree(bench: Bench) -> None:
    assert max(bench.run(2.0)) <= radians(146.2)
    bench.device.command(-20.0)
    assert max(bench.run(3.0)) <= radians(146.2)


def test_the_stop_at_full_flexion_holds_too(bench: Bench) -> None:
    bench.device.command(20.0)
    assert min(bench.run(2.0)) >= radians(-1.5)
    assert bench.run(3.0)[-1] == pytest.approx(0.0, abs=radians(0.1))


@held
def test_the_encoder_reads_multiples_of_its_step_and_the_same_twice(bench) -> None:
    for angle in bench.run(1.0):
        assert angle / STEP == pytest.approx(round(angle / STEP), abs=1e-6)
    assert bench.device.read() == bench.device.read()
    once = Bench(None)  # a gap in the readings does not change where the arm is
    with once.device:
        once.clock.sleep_until_ns(1_000_000_000)
        assert once.device.read().angle == angle


@pytest.mark.parametrize("range_end", [0.9, 3.2])
def test_an_arm_that_cannot_be_is_refused(range_end: float) -> None:
    hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5)
    assert not 1.0 < range_end <= pi
    with pytest.raises(ParameterError, match="range_end"):
        open_device("simulated", clock=SimulatedClock(), hand=hand, range_end=range_end)


def test_a_sensor_reads_what_a_heavy_hand_gives_the_arm() -> None:
    # What moves the arm's own 0.0597 kg·m² is the hand less motor and friction
    clock = SimulatedClock()
    traits = HandTraits(stiffness=60.0, damping=3.0, inertia=0.1)
    hand = HumanHand(traits, start=1.0, end=2.5, mean_speed=1.5)
    given, last = 0.0, 1.0
    with open_device("simulated", clock=clock, hand=hand) as device:
        for tick in range(400):
            angle = device.read().angle
            if tick:
                viscous, coulomb = 0.168 * (angle - last), 0.189e-3 * (angle > last)
                given -= viscous + coulomb + device.motor_torque * 1e-3
            given += device.hand_torque * 1e-3
            speed, last = (angle - last) / 1e-3, angle
            device.command(3.0 if tick > 200 else 0.0)
            clock.sleep_until_ns(clock.now_ns() + 1_000_000)
    # a step of the encoder is 0.0052 N·m·s of 0.0597 kg·m²
    assert given == pytest.approx(0.0597 * speed, abs=0.009)


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

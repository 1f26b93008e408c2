"""The simulated torque sensor reads what mechanics says it must."""

import math

import numpy as np
import pytest

from masrel.lab.hess import Friction, SimulatedClock, SimulatedHand, TorqueSensor
from masrel.lab.hess._simulated import PlantParameters, SimulatedDevice

FRICTIONLESS = Friction(inertia=0.01, viscous=0.0, coulomb=0.0)
INSTANT = {"torque_step": 0.0, "lag_time": 0.0, "delay": 0.0}
EXACT = TorqueSensor(noise=0.0, lag_time=0.0, step=0.0)


def bench(
    sensor: TorqueSensor, *, slip_time: float | None = 0.0, **parameters: object
) -> tuple[SimulatedClock, SimulatedDevice]:
    # Without a hand unless told otherwise: it slips at once
    clock = SimulatedClock()
    hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5, slip_time=slip_time)
    plant = PlantParameters(**parameters)
    device = SimulatedDevice(clock=clock, hand=hand, sensor=sensor, parameters=plant)
    device.open()
    device.read()
    return clock, device


def sensed(
    clock: SimulatedClock, device: SimulatedDevice, until_s: float
) -> list[float]:
    torques = []
    while clock.now_ns() < round(until_s * 1e9):
        clock.sleep_until_ns(clock.now_ns() + 1_000_000)
        torques += device.read().channels
    return torques


def test_on_a_free_arm_it_reads_what_moves_the_arm() -> None:
    # -0.06 N·m on 0.01 + 0.05 kg·m² give 1 rad/s², for which the arm takes 0.05 N·m
    clock, device = bench(EXACT, friction=FRICTIONLESS, **INSTANT)
    with device:
        device.command(-0.06)
        assert sensed(clock, device, 0.5)[-1] == pytest.approx(-0.05, abs=1e-12)


def test_in_even_motion_it_reads_motor_and_friction() -> None:
    # 0.168 N·m·s/rad at 1.5 rad/s and 0.189 N·m, against a motor that gives 2 N·m
    clock, device = bench(EXACT, slip_time=None, **INSTANT)
    with device:
        device.command(2.0)
        torque = sensed(clock, device, 0.6)[-1]
        # The tail of the hand's ramp: 3 % of a speed that settles within 0.1 s
        assert torque == pytest.approx(2.0 + 0.168 * 1.5 + 0.189, abs=0.01)


def test_at_rest_against_the_stop_it_reads_what_the_motor_presses_with() -> None:
    clock, device = bench(EXACT, **INSTANT)
    with device:
        device.command(-5.0)
        torque = sensed(clock, device, 3.0)[-1]
        assert torque == pytest.approx(-5.0, abs=0.189)  # friction may carry so much


def test_it_integrates_to_the_momentum_of_the_motor() -> None:
    # What the sensor reads less motor and friction has moved the motor's 0.0097 kg·m²
    clock, device = bench(EXACT, slip_time=None, friction=FRICTIONLESS, **INSTANT)
    with device:
        device.command(0.5)
        torques = sensed(clock, device, 0.4)
        speed = device._plant.velocity
    assert sum(torques) * 1e-3 - 0.5 * 0.4 == pytest.approx(0.01 * speed, rel=0.02)


@pytest.mark.parametrize("lag_time", [0.0008, 0.02])
def test_its_low_pass_answers_a_step_with_an_exponential(lag_time: float) -> None:
    sensor = TorqueSensor(noise=0.0, lag_time=lag_time, step=0.0)
    clock, device = bench(sensor, friction=FRICTIONLESS, **INSTANT)
    with device:
        device.command(-0.06)
        torques = np.array(sensed(clock, device, 0.1))
    # The step is a ramp of one step of the integration, 0.5 ms
    ramp = 0.0005 / lag_time
    times = np.arange(1, 101) * 1e-3
    late = (np.exp(ramp) - 1.0) / ramp * np.exp(-times / lag_time)
    assert torques == pytest.approx(-0.05 * (1.0 - late), abs=1e-9)


def test_its_noise_and_its_steps_are_those_stated() -> None:
    clock, device = bench(TorqueSensor(seed=3))
    with device:
        torques = np.array(sensed(clock, device, 4.0))
    steps = torques / 0.01
    assert np.abs(steps - np.round(steps)).max() < 1e-9
    # 4000 readings: the standard deviation is known to 1.1 %; four of these, and the
    # 0.0029 N·m of the steps
    expected = math.hypot(0.02, 0.01 / math.sqrt(12.0))
    assert torques.std() == pytest.approx(expected, rel=0.045)
    assert abs(torques.mean()) < 4.0 * 0.02 / math.sqrt(4000.0)

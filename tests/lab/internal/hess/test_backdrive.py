"""The backdrivability test of Fig. 8: the torque a hand feels on the bare device."""

import math
from math import radians

import pytest

from masrel.lab.hess import Friction, FrictionCompensation, SimulatedClock
from masrel.lab.hess._signals import VelocityEstimate
from masrel.lab.hess._simulated import PlantParameters, SimulatedDevice

TRAVEL = radians(100.0)
DURATION = 1.7  # one way, s; the source prints no speed: within those of Table V


class BackAndForth:
    """A hand that goes forth and back by minimum jerk, peak speed 110 deg/s."""

    stiffness = 600.0
    damping = 40.0
    slip_time = math.inf
    inertia = 0.0
    yields = False
    start = radians(35.0)

    def intended(self, time_s: float) -> tuple[float, float]:
        trip, within = divmod(time_s, DURATION)
        s = within / DURATION
        shape = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        rate = 30.0 * s**2 * (1.0 - s) ** 2 / DURATION
        if trip % 2:
            return self.start + TRAVEL * (1.0 - shape), -TRAVEL * rate
        return self.start + TRAVEL * shape, TRAVEL * rate


def felt(share: float) -> list[float]:
    # The hand's torque at every tick of two trips, N·m. As in (7), the moving mass
    # is the motor's: the forearm hangs behind the sensor.
    clock = SimulatedClock()
    bare = PlantParameters(arm_inertia=0.0)
    device = SimulatedDevice(clock=clock, hand=BackAndForth(), parameters=bare)
    compensation = FrictionCompensation(Friction(), share=share)
    estimate = VelocityEstimate()
    torques = []
    with device:
        device.open()
        for tick in range(round(2e3 * DURATION)):
            clock.sleep_until_ns(tick * 1_000_000)
            velocity = estimate.update(tick * 1e-3, device.read().angle)
            device.command(-compensation.torque(velocity))
            torques.append(device.hand_torque)
    return torques


def test_without_compensation_the_hand_feels_what_equation_7_says() -> None:
    # Peak speed 1.875 × 100 / 1.7 = 110.3 deg/s = 1.925 rad/s, without acceleration:
    # 0.168 × 1.925 + 0.189 = 0.512 N·m, and the inertia adds a little before.
    expected = 0.168 * 1.875 * TRAVEL / DURATION + 0.189
    assert max(felt(0.0)) == pytest.approx(expected, rel=0.05)


def test_compensation_brings_it_from_above_a_half_to_a_fifth() -> None:
    # The source: from above 0.5 to below 0.2 N·m. A compensation by speed cannot help
    # an arm that sticks: at the reversal β = 0.189 N·m is left, and 0.009 N·m for
    # inertia and the 5.6 ms by which the estimated speed comes late.
    without, compensated = felt(0.0), felt(0.9)
    assert max(abs(torque) for torque in without) > 0.5
    largest = max(range(len(compensated)), key=lambda tick: abs(compensated[tick]))
    assert abs(compensated[largest]) == pytest.approx(0.198, abs=0.002)
    assert largest * 1e-3 == pytest.approx(DURATION, abs=0.1)  # where it turns back


def test_in_motion_a_tenth_of_the_friction_is_left() -> None:
    # In the middle of a trip: 0.1 × 0.512 = 0.051 N·m, the filter lags 5.6 ms.
    assert felt(0.9)[round(500 * DURATION)] == pytest.approx(0.051, abs=0.005)

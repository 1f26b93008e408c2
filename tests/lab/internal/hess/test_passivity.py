"""Whether the rendered joint can feed energy into a hand: the numbers of the page.

Colgate and Schenkel (1997), J. Robot. Syst. 14(1), 37-47: a device with damping B that
renders H at period T is passive with any hand when, for all ω up to the Nyquist rate,
B > T / (2 (1 - cos ωT)) Re((1 - exp(-jωT)) H(exp(jωT))).
"""

import math
from math import radians
from pathlib import Path

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    Friction,
    SimulatedClock,
    SimulatedHand,
    run_presentation,
)
from masrel.lab.hess._signals import VelocityEstimate, passive_damping
from masrel.lab.hess._simulated import SimulatedDevice

PAGE = (Path(__file__).parents[4] / "docs" / "driver.md").read_text(encoding="utf-8")
PERIOD = 0.001
B = Friction().viscous
MODEL = STANDARD_MODELS["HM1"]


def needed(
    damping: float,
    stiffness: float,
    *,
    cutoff: float | None = 180.0,
    delay: float = 0.0,
    lag: float = 0.0,
) -> float:
    """The damping a device must have to render these passively, N·m·s/rad."""
    omega = np.linspace(1.0, np.pi / PERIOD, 100_000)
    back = np.exp(-1j * omega * PERIOD)
    speed = (1.0 - back) / PERIOD
    if cutoff is not None:
        gain = -math.expm1(-cutoff * PERIOD)
        speed = speed * gain / (1.0 - (1.0 - gain) * back)
    motor = np.exp(-1j * omega * delay) / (1.0 + 1j * omega * lag)
    rendered = (stiffness + damping * speed) * motor
    bound = np.real((1.0 - back) * rendered) * PERIOD / (2.0 * (1.0 - back.real))
    return float(bound.max())


def says(*words: str) -> None:
    for word in words:
        assert word in PAGE


def test_with_the_raw_difference_the_pre_catch_damping_would_not_be_passive() -> None:
    # By hand, at the Nyquist rate: K T / 2 + b = 0.0016 + 1.26.
    raw = needed(MODEL.damping, MODEL.stiffness, cutoff=None)
    assert raw == pytest.approx(3.15 * 0.0005 + 1.26, rel=1e-6)
    assert raw > 7.0 * B
    says("1.262 N·m·s/rad")


def test_with_the_filtered_speed_it_is() -> None:
    # By hand, at the Nyquist rate: b g / (2 - g) + K T / 2 with g = 1 - exp(-0.18).
    gain = -math.expm1(-0.18)
    filtered = needed(MODEL.damping, MODEL.stiffness)
    expected = 1.26 * gain / (2.0 - gain) + 3.15 * 0.0005
    assert filtered == pytest.approx(expected, rel=1e-6)
    assert filtered < B
    assert needed(MODEL.damping, MODEL.stiffness, cutoff=260.0) < B
    assert needed(MODEL.damping, MODEL.stiffness, cutoff=270.0) > B
    says("0.115 N·m·s/rad", "260 rad/s")


@pytest.mark.parametrize(
    ("stiffness", "damping"), [(3.15, 1.26), (100.0, 0.3), (0.0, 0.8), (47.2, 0.2)]
)
@pytest.mark.parametrize("rate_hz", [1000, 2000])
def test_what_the_loop_checks_is_the_largest_over_all_frequencies(
    stiffness: float, damping: float, rate_hz: int
) -> None:
    if rate_hz == 1000:
        expected = needed(damping, stiffness)
        assert passive_damping(stiffness, damping, 1000) == pytest.approx(
            expected, rel=1e-6
        )
    half = passive_damping(stiffness, damping, 2 * rate_hz)
    assert half < passive_damping(stiffness, damping, rate_hz)


def test_a_delay_of_the_motor_takes_that_away() -> None:
    late = needed(MODEL.damping, MODEL.stiffness, delay=0.0005, lag=0.0005)
    assert late == pytest.approx(0.222, abs=0.0005)
    assert late > B
    says("0.222 N·m·s/rad")
    assert (
        needed(MODEL.damping, MODEL.stiffness, cutoff=120.0, delay=5e-4, lag=5e-4) < B
    )


def test_compensated_friction_is_taken_from_what_the_device_has() -> None:
    # The commanded part is b - 0.9 B; what the device keeps of its own is all of B.
    compensated = needed(MODEL.damping - 0.9 * B, MODEL.stiffness)
    assert compensated == pytest.approx(0.101, abs=0.0005)
    says("0.101 N·m·s/rad")


@pytest.mark.parametrize("model", sorted(STANDARD_MODELS))
@pytest.mark.parametrize("command_nm", [3.0, -3.0])
def test_an_arm_that_nobody_holds_comes_to_rest(model: str, command_nm: float) -> None:
    # Pushed for 50 ms and let go, with the default compensation: no limit cycle, no
    # creep. The last second is one angle, and the torque less than β.
    clock = SimulatedClock()
    start = radians(80.0)
    nobody = SimulatedHand(
        start=start, end=radians(146.0), mean_speed=1.0, slip_time=0.0
    )
    controller = Controller(STANDARD_MODELS[model], start_angle=start)
    estimate = VelocityEstimate()
    angles = []
    with SimulatedDevice(clock=clock, hand=nobody) as device:
        for tick in range(6000):
            clock.sleep_until_ns(tick * 1_000_000)
            angle = device.read().angle
            velocity = estimate.update(tick * 1e-3, angle)
            torque = controller.step(tick * 1e-3, angle, velocity)
            device.command(torque + (command_nm if tick < 50 else 0.0))
            angles.append(angle)
    assert max(angles) - min(angles) > radians(1.0)  # it was moved
    assert len(set(angles[-1000:])) == 1
    assert abs(torque) <= Friction().coulomb


@pytest.mark.parametrize("speed_deg_s", [40.0, 90.0, 131.0])
def test_an_arm_that_slips_under_the_guards_torque_stays_below_the_limit(
    speed_deg_s: float,
) -> None:
    # 10 N·m on 0.06 kg·m² for the 10 ms until it is noticed and half of the 50 ms of
    # the ramp make 336 deg/s; what they brake first, and friction, take some off that.
    class Active:
        kind, is_passive, phase = "test", False, 0
        range_end, speed_threshold = radians(146.0), radians(20.0)

        def stepper(self, _start_angle: float) -> "Active":
            return self

        def step(self, time_s: float, _angle: float, _velocity: float) -> float:
            return min(1.0 + 30.0 * time_s, limits.active_torque)

        def release(self) -> None:
            pass

    limits = DeviceLimits()
    clock = SimulatedClock()
    hand = SimulatedHand(
        start=radians(30.0),
        end=radians(146.0),
        mean_speed=radians(speed_deg_s),
        slip_time=0.5,
    )
    device = SimulatedDevice(clock=clock, hand=hand)
    device.open()
    presented = run_presentation(
        device,
        Controller(Active(), start_angle=radians(30.0)),
        clock=clock,
        limits=limits,
    )
    assert presented.fault is not None
    assert presented.fault.kind == "slip"
    assert presented.fault.time_s < 0.515
    assert presented.fault.torque_nm > 9.5
    assert radians(150.0) < -device._plant.velocity < limits.speed

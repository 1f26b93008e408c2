import math
from math import radians

import pytest

from masrel.errors import DeviceError, ParameterError
from masrel.lab.hess import (
    Friction,
    HandTraits,
    HumanHand,
    SimulatedClock,
    SimulatedHand,
)
from masrel.lab.hess._simulated import PlantParameters, SimulatedDevice

# An amplifier that gives any torque at once
INSTANT = {"torque_step": 0.0, "lag_time": 0.0, "delay": 0.0}
FRICTIONLESS = Friction(inertia=0.01, viscous=0.0, coulomb=0.0)


def bench(
    *,
    slip_time: float | None = 0.0,
    **parameters: object,
) -> tuple[SimulatedClock, SimulatedDevice]:
    # Without a hand unless told otherwise: it slips at once.
    clock = SimulatedClock()
    hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5, slip_time=slip_time)
    device = SimulatedDevice(
        clock=clock, hand=hand, parameters=PlantParameters(**parameters)
    )
    device.open()
    device.read()
    return clock, device


def run(clock: SimulatedClock, device: SimulatedDevice, until_s: float) -> list[float]:
    angles = []
    while clock.now_ns() < round(until_s * 1e9):
        clock.sleep_until_ns(clock.now_ns() + 1_000_000)
        angles.append(device.read().angle)
    return angles


@pytest.mark.parametrize("torque", [0.188, -0.188])
def test_below_the_coulomb_friction_the_arm_sticks(torque: float) -> None:
    clock, device = bench()
    with device:
        start = device.read().angle
        device.command(torque)
        assert set(run(clock, device, 1.0)) == {start}


@pytest.mark.parametrize("torque", [0.25, -0.25])
def test_above_it_the_arm_goes_against_the_sign_of_the_command(torque: float) -> None:
    clock, device = bench()
    with device:
        start = device.read().angle
        device.command(torque)  # positive resists extension
        assert (run(clock, device, 0.5)[-1] - start) * torque < 0.0


def test_without_friction_a_constant_torque_gives_a_parabola() -> None:
    # θ = ½ (τ / I) t²: 0.06 N·m on 0.06 kg·m² give 1 rad/s², 0.5 rad after 1 s.
    clock, device = bench(friction=FRICTIONLESS, **INSTANT)
    with device:
        device.command(-0.06)
        assert run(clock, device, 1.0)[-1] == pytest.approx(1.5, abs=5e-4)


def test_with_viscous_friction_the_speed_settles_at_torque_over_damping() -> None:
    # θ(t) = v (t - T (1 - e^(-t/T))), v = τ/B = 1 rad/s, T = I/B = 0.1 s.
    friction = Friction(inertia=0.01, viscous=0.2, coulomb=0.0)
    clock, device = bench(friction=friction, arm_inertia=0.01, **INSTANT)
    with device:
        device.command(-0.2)
        expected = 1.0 + (0.8 - 0.1 * (1.0 - math.exp(-8.0)))
        assert run(clock, device, 0.8)[-1] == pytest.approx(expected, abs=5e-4)


def test_coulomb_friction_alone_stops_the_arm_where_work_has_eaten_its_energy() -> None:
    # Let go at v = 1.5 rad/s, I = 0.06: ½ I v² = 0.0675 J, over 0.189 N·m: 0.3571 rad,
    # after I v / β = 0.476 s; then it stays.
    friction = Friction(inertia=0.01, viscous=0.0, coulomb=0.189)
    clock, device = bench(slip_time=0.3, friction=friction)
    with device:
        angles = run(clock, device, 1.2)
    assert angles[-1] - angles[299] == pytest.approx(0.3571, abs=0.006)
    assert angles[770] < angles[790] or angles[770] == angles[-1]
    assert len(set(angles[800:])) == 1


def test_the_end_stop_holds_the_arm_within_a_fifth_of_a_degree() -> None:
    clock, device = bench(slip_time=None)
    with device:
        assert max(run(clock, device, 2.0)) <= radians(146.2)
        device.command(-20.0)
        assert max(run(clock, device, 3.0)) <= radians(146.2)


def test_the_stop_at_full_flexion_holds_too() -> None:
    clock, device = bench()
    with device:
        device.command(20.0)
        assert min(run(clock, device, 2.0)) >= radians(-1.5)
        assert run(clock, device, 3.0)[-1] == pytest.approx(0.0, abs=radians(0.1))


def test_the_encoder_reads_multiples_of_its_step() -> None:
    clock, device = bench(slip_time=None)
    step = radians(0.005)
    with device:
        for angle in run(clock, device, 1.0):
            assert angle / step == pytest.approx(round(angle / step), abs=1e-6)


def test_reading_twice_at_one_time_reads_the_same() -> None:
    clock, device = bench(slip_time=None)
    with device:
        run(clock, device, 0.5)
        assert device.read() == device.read()


def test_a_gap_in_the_readings_does_not_change_where_the_arm_is() -> None:
    often_clock, often = bench(slip_time=None)
    once_clock, once = bench(slip_time=None)
    with often, once:
        angle = run(often_clock, often, 0.7)[-1]
        once_clock.sleep_until_ns(700_000_000)
        assert once.read().angle == angle


def test_the_hand_moves_the_arm_as_it_intends_against_ten_newton_metres() -> None:
    clock, device = bench(slip_time=None)
    with device:
        device.command(10.0)
        angles = run(clock, device, 0.8)
    speed = (angles[799] - angles[399]) / 0.4
    assert speed == pytest.approx(1.5, rel=0.01)


def test_a_torque_that_is_not_finite_is_refused() -> None:
    _, device = bench()
    with device, pytest.raises(DeviceError, match="finite torque, got nan"):
        device.command(math.nan)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"range_end": 0.9}, "range_end"),
        ({"range_end": 3.2}, "range_end"),
    ],
)
def test_an_impossible_plant_is_refused(change: dict[str, float], words: str) -> None:
    hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5)
    with pytest.raises(ParameterError, match=words):
        SimulatedDevice(
            clock=SimulatedClock(), hand=hand, parameters=PlantParameters(**change)
        )


def test_the_hand_presses_as_hard_as_the_arm_resists() -> None:
    # Between the stops, at rest: 10 N·m, which is 1436 quanta, 9.9988 N·m;
    # friction carries up to 0.189 of it.
    clock, device = bench(slip_time=None)
    with device:
        device.command(10.0)
        run(clock, device, 3.0)
        assert device.hand_torque == pytest.approx(9.9988, abs=0.1891)


def test_a_hand_that_has_let_go_or_not_begun_gives_no_torque() -> None:
    clock, device = bench(slip_time=0.3997)
    with device:
        run(clock, device, 0.3)
        assert device.hand_torque != 0.0
        run(clock, device, 0.4)
        assert device.hand_torque == 0.0
    hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5)
    assert SimulatedDevice(clock=SimulatedClock(), hand=hand).hand_torque == 0.0


def test_a_sensor_reads_what_a_heavy_hand_gives_the_arm() -> None:
    # What moves the arm's own 0.0597 kg·m² is the hand less motor and friction
    clock = SimulatedClock()
    traits = HandTraits(stiffness=60.0, damping=3.0, inertia=0.1)
    hand = HumanHand(traits, start=1.0, end=2.5, mean_speed=1.5)
    device = SimulatedDevice(clock=clock, hand=hand, resolution=1e-9)
    given, last = 0.0, 1.0
    with device:
        for tick in range(400):
            angle = device.read().angle
            if tick:
                viscous, coulomb = 0.168 * (angle - last), 0.189e-3 * (angle > last)
                given -= viscous + coulomb + device.motor_torque * 1e-3
            given += device.hand_torque * 1e-3
            speed, last = (angle - last) / 1e-3, angle
            device.command(3.0 if tick > 200 else 0.0)
            clock.sleep_until_ns(clock.now_ns() + 1_000_000)
    assert given == pytest.approx(0.0597 * speed, abs=0.004)

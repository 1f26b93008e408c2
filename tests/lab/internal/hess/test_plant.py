"""The simulated arm against scipy's solver, against itself, and by hand."""

import math
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    Friction,
    Hand,
    SimulatedClock,
    SimulatedHand,
    YieldingHand,
    run_presentation,
)
from masrel.lab.hess._simulated import (
    Plant,
    PlantParameters,
    SimulatedDevice,
    propagator,
)
from tests.benchmarks.driver_integrators import by_solve_ivp, chosen, commands
from tests.lab.hess.rig import END, START

STEP_NS = 500_000
QUANTUM = 18.8 / 2700.0


def loose(**parameters: object) -> Plant:
    # An arm that no hand holds
    hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5, slip_time=0.0)
    return Plant(hand, PlantParameters(**parameters))


# Against other solutions


def test_the_hand_feels_what_scipys_solver_says_within_a_torque_quantum() -> None:
    # A whole presentation of HM3: it sticks, breaks away, catches, meets the end stop.
    # RK45 at rtol 1e-5 is within 3e-4 N·m of DOP853 at 1e-12 (the benchmark's figure).
    torques = commands()
    right = by_solve_ivp(torques, "RK45", 1e-5)
    assert np.abs(chosen(torques, STEP_NS) - right).max() < QUANTUM


def presented(hand: Hand, step_ns: int) -> dict[str, np.ndarray]:
    clock = SimulatedClock()
    parameters = PlantParameters(step_ns=step_ns)
    device = SimulatedDevice(
        clock=clock, hand=hand, parameters=parameters, resolution=1e-9
    )
    with device:
        device.open()
        controller = Controller(STANDARD_MODELS["HM4"], start_angle=START)
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=DeviceLimits(),
            max_duration_s=3.0,
        ).recording.columns


@pytest.mark.parametrize("slip_time", [None, 0.70031])
def test_halving_the_step_changes_nothing_visible(slip_time: float | None) -> None:
    # Visible would be a step of the encoder, 0.005 deg, or a quantum of the torque.
    options = {"start": START, "end": END, "mean_speed": radians(80.0)}
    hands = [SimulatedHand(**options, slip_time=slip_time) for _ in range(2)]
    whole, half = presented(hands[0], STEP_NS), presented(hands[1], STEP_NS // 2)
    assert whole["time_s"].size == half["time_s"].size
    assert np.abs(whole["angle_deg"] - half["angle_deg"]).max() < 0.0025
    torque = whole["command_torque_nm"] - half["command_torque_nm"]
    assert np.abs(torque).max() < QUANTUM / 2.0


positive = st.floats(0.01, 10.0)


@given(positive, st.floats(0.0, 50.0), st.floats(0.0, 2e4), st.floats(1e-4, 1e-2))
def test_a_step_is_the_matrix_exponential(inertia, damping, stiffness, step) -> None:
    # scipy's expm of the same 5 by 5 system, which is Padé's and not Taylor's
    lag_time = 5e-4
    system = np.array(
        [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [-stiffness / inertia, -damping / inertia, -1 / inertia, 1 / inertia, 0.0],
            [0.0, 0.0, -1.0 / lag_time, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 0.0, 0.0],
        ]
    )
    made = propagator(inertia, damping, stiffness, lag_time, step)
    right = expm(system * step)
    largest = max(1.0, np.abs(right).max())
    assert np.abs(np.array(made[:5]) - right[0]).max() < 1e-11 * largest
    assert np.abs(np.array(made[5:10]) - right[1]).max() < 1e-11 * largest
    assert made[10] == pytest.approx(math.exp(-step / lag_time), rel=1e-12)


# The motor


def test_the_motor_follows_after_its_delay_and_lag() -> None:
    # 1 N·m is 143.6 quanta: 144 of them. Delay 0.5 ms, then 1 - exp(-t / 0.5 ms).
    plant = loose(step_ns=100_000)
    plant.command(1.0, 0)
    found = []
    for tick in range(1, 16):
        plant.advance(tick * 100_000)
        found.append(plant.motor_torque)
    assert found[:5] == [0.0] * 5
    for tick in range(6, 16):
        expected = 144 * QUANTUM * -math.expm1(-(tick - 5) * 0.2)
        assert found[tick - 1] == pytest.approx(expected, rel=1e-9)


def test_a_command_that_comes_during_the_delay_replaces_nothing() -> None:
    plant = loose(step_ns=100_000, lag_time=0.0, torque_step=0.0)
    plant.command(1.0, 0)
    plant.command(2.0, 300_000)
    seen = []
    for tick in range(1, 12):
        plant.advance(tick * 100_000)
        seen.append(plant.motor_torque)
    assert seen == [0.0] * 5 + [1.0] * 3 + [2.0] * 3


def test_the_torque_is_a_whole_number_of_quanta() -> None:
    plant = loose(lag_time=0.0, delay=0.0)
    for number, torque in enumerate((0.0034, 0.0036, -0.0036, 12.3)):
        plant.command(torque, number * STEP_NS)
        plant.advance((number + 1) * STEP_NS)
        quanta = plant.motor_torque / QUANTUM
        assert quanta == pytest.approx(round(torque / QUANTUM), abs=1e-9)


# Friction


def test_it_sticks_until_the_torque_exceeds_the_coulomb_friction() -> None:
    # The torque grows by 1 N·m/s: it breaks away at 0.189 s, and not before.
    friction = Friction(inertia=0.01, viscous=0.0, coulomb=0.189)
    plant = loose(friction=friction, lag_time=0.0, delay=0.0, torque_step=0.0)
    for tick in range(300):
        plant.command(-tick * 1e-3, tick * 1_000_000)
        plant.advance((tick + 1) * 1_000_000)
        moved = plant.angle != 1.0
        assert moved is (tick > 189)


def test_a_sliding_arm_stops_when_its_energy_is_eaten_and_stays() -> None:
    # It breaks away within a 1024th of a step, 0.5 µs, of the command: 1e-5 of 0.1 s.
    # 0.5 I v² = β s: pushed with 1 N·m for 0.1 s. I = 0.06: v = (1 - 0.189) 0.1 / 0.06,
    # 1.3517 rad/s; it slides on by 0.06 v² / (2 · 0.189) = 0.29002 rad.
    friction = Friction(inertia=0.01, viscous=0.0, coulomb=0.189)
    plant = loose(friction=friction, lag_time=0.0, delay=0.0, torque_step=0.0)
    plant.command(-1.0, 0)
    plant.advance(100_000_000)
    assert plant.velocity == pytest.approx((1.0 - 0.189) * 0.1 / 0.06, rel=1e-5)
    left = plant.angle
    plant.command(0.0, 100_000_000)
    plant.advance(1_000_000_000)
    speed = (1.0 - 0.189) * 0.1 / 0.06
    assert plant.angle - left == pytest.approx(0.06 * speed**2 / (2 * 0.189), rel=2e-5)
    assert plant.velocity == 0.0


def test_without_friction_a_spring_swings_at_its_own_frequency() -> None:
    # A hand that holds 0.1 rad away without damping: cos(sqrt(K / I) t).
    class Spring(SimulatedHand):
        def intended(self, time_s: float) -> tuple[float, float]:  # noqa: ARG002
            return 1.1, 0.0

    hand = Spring(start=1.0, end=2.5, mean_speed=1.5, stiffness=6.0, damping=1e-300)
    friction = Friction(inertia=0.01, viscous=0.0, coulomb=0.0)
    plant = Plant(hand, PlantParameters(friction=friction))
    for tick in range(1, 2000):
        plant.advance(tick * 1_000_000)
        swing = 0.1 * math.cos(math.sqrt(6.0 / 0.06) * tick * 1e-3)
        assert plant.angle == pytest.approx(1.1 - swing, abs=5e-6)


# Hands


def test_a_yielding_hand_slows_after_a_catch() -> None:
    options = {"start": START, "end": END, "mean_speed": radians(80.0)}
    stiff = presented(SimulatedHand(**options), STEP_NS)
    soft = presented(YieldingHand(**options), STEP_NS)

    def speed(columns: dict[str, np.ndarray], after_s: float) -> float:
        caught = int(np.flatnonzero(columns["phase"] == 1)[0])
        at = caught + round(after_s * 1000)
        return float(columns["velocity_deg_s"][at])

    assert speed(stiff, 0.09) == pytest.approx(80.0, abs=3.0)
    assert speed(soft, 0.0) < 80.0  # the pre-catch torque slows it, too
    assert speed(soft, 0.09) < 0.85 * speed(soft, 0.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [({"yielding": -1.0}, "yielding"), ({"reaction_time": 0.0}, "reaction_time")],
)
def test_an_impossible_yielding_hand_is_refused(change, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        YieldingHand(start=START, end=END, mean_speed=1.5, **change)


def test_a_hand_that_yields_nothing_is_the_usual_one() -> None:
    options = {"start": START, "end": END, "mean_speed": radians(80.0)}
    usual = presented(SimulatedHand(**options), STEP_NS)
    same = presented(YieldingHand(**options, yielding=0.0), STEP_NS)
    np.testing.assert_allclose(usual["angle_deg"], same["angle_deg"], atol=1e-6)

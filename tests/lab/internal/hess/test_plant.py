"""The simulated arm against scipy's solver, against itself, and by hand; passivity.

Colgate and Schenkel (1997), J. Robot. Syst. 14(1), 37-47: a device with damping B that
renders H at period T is passive with any hand when, for all ω up to the Nyquist rate,
B > T / (2 (1 - cos ωT)) Re((1 - exp(-jωT)) H(exp(jωT))).
"""

import math
from math import radians
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Friction,
    FrictionCompensation,
    SimulatedClock,
    SimulatedHand,
    TorqueSensor,
)
from masrel.lab.hess._signals import VelocityEstimate, passive_damping
from masrel.lab.hess._simulated import (
    Plant,
    PlantParameters,
    SimulatedDevice,
    propagator,
)
from tests.benchmarks.driver_integrators import by_solve_ivp, chosen, commands
from tests.lab.hess.rig import MODELS, controls, stretching

PAGE = (Path(__file__).parents[4] / "docs/explanation/driver.md").read_text("utf-8")
STEP_NS = 500_000
QUANTUM = 18.8 / 2700.0
INSTANT = {"torque_step": 0.0, "lag_time": 0.0, "delay": 0.0}
FRICTIONLESS = Friction(inertia=0.01, viscous=0.0, coulomb=0.0)
STICKY = Friction(inertia=0.01, viscous=0.0, coulomb=0.189)
EXACT = TorqueSensor(noise=0.0, lag_time=0.0, step=0.0)


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


positive = st.floats(0.01, 10.0)


@given(positive, st.floats(0.0, 50.0), st.floats(0.0, 2e4), st.floats(1e-4, 1e-2))
def test_a_step_is_the_matrix_exponential(inertia, damping, stiffness, step) -> None:
    # scipy's expm of the same 5 by 5 system, which is Padé's and not Taylor's
    lag_time = 5e-4
    system = np.zeros((5, 5))
    system[0, 1] = system[3, 4] = 1.0
    system[1, :4] = np.array([-stiffness, -damping, -1.0, 1.0]) / inertia
    system[2, 2] = -1.0 / lag_time
    made = propagator(inertia, damping, stiffness, lag_time, step)
    right = expm(system * step)
    largest = max(1.0, np.abs(right).max())
    assert np.abs(np.array(made[:10]) - right[:2].ravel()).max() < 1e-11 * largest
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
    lags = -np.expm1(-0.2 * np.arange(1, 11))
    assert found[5:] == pytest.approx(144 * QUANTUM * lags, rel=1e-9)


def test_a_command_that_comes_during_the_delay_replaces_nothing() -> None:
    plant = loose(step_ns=100_000, lag_time=0.0, torque_step=0.0)
    plant.command(1.0, 0)
    plant.command(2.0, 300_000)
    seen = []
    for tick in range(1, 12):
        plant.advance(tick * 100_000)
        seen.append(plant.motor_torque)
    assert seen == [0.0] * 5 + [1.0] * 3 + [2.0] * 3


# Friction


def test_it_sticks_until_the_torque_exceeds_the_coulomb_friction() -> None:
    # The torque grows by 1 N·m/s: it breaks away at 0.189 s, and not before.
    plant = loose(friction=STICKY, **INSTANT)
    for tick in range(300):
        plant.command(-tick * 1e-3, tick * 1_000_000)
        plant.advance((tick + 1) * 1_000_000)
        assert (plant.angle != 1.0) is (tick > 189)


def test_a_sliding_arm_stops_when_its_energy_is_eaten_and_stays() -> None:
    # It breaks away within a 1024th of a step, 0.5 µs, of the command: 1e-5 of 0.1 s.
    # 0.5 I v² = β s: pushed with 1 N·m for 0.1 s. I = 0.06: v = (1 - 0.189) 0.1 / 0.06,
    # 1.3517 rad/s; it slides on by 0.06 v² / (2 · 0.189) = 0.29002 rad.
    plant = loose(friction=STICKY, **INSTANT)
    plant.command(-1.0, 0)
    plant.advance(100_000_000)
    speed = (1.0 - 0.189) * 0.1 / 0.06
    assert plant.velocity == pytest.approx(speed, rel=1e-5)
    left = plant.angle
    plant.command(0.0, 100_000_000)
    plant.advance(1_000_000_000)
    assert plant.angle - left == pytest.approx(0.06 * speed**2 / (2 * 0.189), rel=2e-5)
    assert plant.velocity == 0.0


# The torque sensor reads what mechanics says it must


def sensed(
    until_s: float,
    torque_nm: float,
    sensor: TorqueSensor = EXACT,
    slip_time: float | None = 0.0,
    **parameters: object,
) -> tuple[np.ndarray, SimulatedDevice]:
    # What it reads every millisecond under a torque; the hand slips at once
    clock = SimulatedClock()
    hand = SimulatedHand(start=1.0, end=2.5, mean_speed=1.5, slip_time=slip_time)
    plant = PlantParameters(**{**INSTANT, **parameters})
    device = SimulatedDevice(clock=clock, hand=hand, sensor=sensor, parameters=plant)
    torques = []
    with device:
        device.read()
        device.command(torque_nm)
        for tick in range(1, round(until_s * 1e3) + 1):
            clock.sleep_until_ns(tick * 1_000_000)
            torques += device.read().channels
    return np.array(torques), device


@pytest.mark.parametrize(
    ("until_s", "torque_nm", "options", "expected", "within"),
    [
        # -0.06 N·m on 0.01 + 0.05 kg·m² give 1 rad/s²: the arm takes 0.05 N·m
        (0.5, -0.06, {"friction": FRICTIONLESS}, -0.05, 1e-12),
        # Even motion: 0.168 N·m·s/rad at 1.5 rad/s and 0.189 N·m, against 2 N·m; the
        # tail of the hand's ramp: 3 % of a speed that settles within 0.1 s
        (0.6, 2.0, {"slip_time": None}, 2.0 + 0.168 * 1.5 + 0.189, 0.01),
        # At rest against the stop; friction may carry so much
        (3.0, -5.0, {}, -5.0, 0.189),
    ],
)
def test_the_sensor_reads_what_moves_the_arm(
    until_s: float, torque_nm: float, options: dict, expected: float, within: float
) -> None:
    torques, _ = sensed(until_s, torque_nm, **options)
    assert torques[-1] == pytest.approx(expected, abs=within)


@pytest.mark.parametrize("lag_time", [0.0008, 0.02])
def test_its_low_pass_answers_a_step_with_an_exponential(lag_time: float) -> None:
    sensor = TorqueSensor(noise=0.0, lag_time=lag_time, step=0.0)
    torques, _ = sensed(0.1, -0.06, sensor, friction=FRICTIONLESS)
    # The step is a ramp of one step of the integration, 0.5 ms
    ramp = 0.0005 / lag_time
    times = np.arange(1, 101) * 1e-3
    late = (np.exp(ramp) - 1.0) / ramp * np.exp(-times / lag_time)
    assert torques == pytest.approx(-0.05 * (1.0 - late), abs=1e-9)


def test_its_noise_and_its_steps_are_those_stated() -> None:
    torques, _ = sensed(4.0, 0.0, TorqueSensor(seed=3))
    steps = torques / 0.01
    assert np.abs(steps - np.round(steps)).max() < 1e-9
    # 4000 readings: the standard deviation is known to 1.1 %; four of these, and the
    # 0.0029 N·m of the steps
    expected = math.hypot(0.02, 0.01 / math.sqrt(12.0))
    assert torques.std() == pytest.approx(expected, rel=0.045)
    assert abs(torques.mean()) < 4.0 * 0.02 / math.sqrt(4000.0)


# The backdrivability test of Fig. 8: the torque a hand feels on the bare device

TRAVEL = radians(100.0)
DURATION = 1.7  # one way, s; the source prints no speed: within those of Table V


class BackAndForth(SimulatedHand):
    """A hand that goes forth and back by minimum jerk, peak speed 110 deg/s."""

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
    hand = BackAndForth(start=radians(35.0), end=radians(135.0), mean_speed=1.0)
    bare = PlantParameters(arm_inertia=0.0)
    device = SimulatedDevice(clock=clock, hand=hand, parameters=bare)
    compensation = FrictionCompensation(Friction(), share=share)
    estimate = VelocityEstimate()
    torques = []
    with device:
        for tick in range(round(2e3 * DURATION)):
            clock.sleep_until_ns(tick * 1_000_000)
            velocity = estimate.update(tick * 1e-3, device.read().angle)
            device.command(-compensation.torque(velocity))
            torques.append(device._plant.hand_torque)
    return torques


def test_compensation_brings_what_equation_7_says_from_above_a_half_to_a_fifth() -> (
    None
):
    # Peak speed 1.875 × 100 / 1.7 = 110.3 deg/s = 1.925 rad/s, without acceleration:
    # 0.168 × 1.925 + 0.189 = 0.512 N·m, and the inertia adds a little before.
    # The source: from above 0.5 to below 0.2 N·m. A compensation by speed cannot help
    # an arm that sticks: at the reversal β = 0.189 N·m is left, and 0.009 N·m for
    # inertia and the 5.6 ms by which the estimated speed comes late.
    without, compensated = felt(0.0), felt(0.9)
    peak = 0.168 * 1.875 * TRAVEL / DURATION + 0.189
    assert max(without) == pytest.approx(peak, rel=0.05)
    assert max(map(abs, without)) == pytest.approx(0.52, abs=0.005)  # as on the page
    largest = max(range(len(compensated)), key=lambda tick: abs(compensated[tick]))
    assert abs(compensated[largest]) == pytest.approx(0.198, abs=0.002)
    assert largest * 1e-3 == pytest.approx(DURATION, abs=0.1)  # where it turns back
    # In the middle of a trip: 0.1 × 0.512 = 0.051 N·m, the filter lags 5.6 ms.
    assert compensated[round(500 * DURATION)] == pytest.approx(0.051, abs=0.005)


# Whether the rendered joint can feed energy into a hand: the numbers of the page

PERIOD = 0.001
B = Friction().viscous


def needed(
    damping: float = 1.26,
    stiffness: float = 3.15,
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


def test_the_damping_that_the_page_says_is_needed() -> None:
    model = STANDARD_MODELS["HM1"]
    assert (model.damping, model.stiffness) == (1.26, 3.15)
    # By hand, at the Nyquist rate: with the raw difference K T / 2 + b, with the
    # filtered speed b g / (2 - g) + K T / 2 with g = 1 - exp(-0.18).
    assert needed(cutoff=None) == pytest.approx(3.15 * 0.0005 + 1.26, rel=1e-6)
    assert needed(cutoff=None) > 7.0 * B
    gain = -math.expm1(-0.18)
    assert needed() == pytest.approx(1.26 * gain / (2 - gain) + 3.15 * 0.0005, rel=1e-6)
    assert needed() < B
    assert needed(cutoff=260.0) < B < needed(cutoff=270.0)
    late = {"delay": 0.0005, "lag": 0.0005}  # a delay of the motor takes that away
    assert needed(**late) == pytest.approx(0.222, abs=0.0005)
    assert needed(cutoff=120.0, **late) < B < needed(**late)
    # The commanded part is b - 0.9 B; what the device keeps of its own is all of B.
    assert needed(1.26 - 0.9 * B) == pytest.approx(0.101, abs=0.0005)
    for words in ("1.262", "0.115", "0.222", "0.101"):
        assert f"{words} N·m·s/rad" in PAGE
    assert "260 rad/s" in PAGE


@pytest.mark.parametrize(
    ("stiffness", "damping"), [(3.15, 1.26), (100.0, 0.3), (0.0, 0.8), (47.2, 0.2)]
)
def test_what_the_loop_checks_is_the_largest_over_all_frequencies(
    stiffness: float, damping: float
) -> None:
    checked = [passive_damping(stiffness, damping, hz) for hz in (1000, 2000, 4000)]
    assert checked[0] == pytest.approx(needed(damping, stiffness), rel=1e-6)
    assert checked[0] > checked[1] > checked[2]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("command_nm", [3.0, -3.0])
def test_an_arm_that_nobody_holds_comes_to_rest(model: str, command_nm: float) -> None:
    # Pushed for 50 ms and let go, with the default compensation: no limit cycle, no
    # creep. The last second is one angle, and the torque less than β.
    clock = SimulatedClock()
    nobody = stretching(start=radians(80.0), slip_time=0.0)
    controller = controls(model, start_angle=nobody.start)
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

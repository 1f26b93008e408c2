"""Steady runs of a free arm, and what is refused."""

import math
from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import DeviceError, DeviceTimeoutError, ParameterError
from masrel.hess import SimulatedClock, SimulatedHand, open_device
from masrel.hess.puck.friction import SteadyRun, fit_friction, steady_runs
from masrel.hess.simulated import SimulatedDevice
from tests.hess.puck.rig import END, fault, loose, opened, puck_options

speeds = st.lists(st.floats(0.1, 3.0), min_size=2, max_size=6, unique=True)


def runs_of(
    viscous: float, coulomb: float, offset: float, speeds: list[float]
) -> list[SteadyRun]:
    return [
        SteadyRun(speed=v, torque=viscous * v + math.copysign(coulomb, v) + offset)
        for speed in speeds
        for v in (speed, -speed)
    ]


@given(
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(-0.5, 0.5),
    speeds.filter(lambda values: max(values) - min(values) > 0.1),
)
def test_a_fit_without_noise_gives_the_truth(
    viscous: float, coulomb: float, offset: float, speeds: list[float]
) -> None:
    found = fit_friction(runs_of(viscous, coulomb, offset, speeds))
    assert found.viscous == pytest.approx(viscous, abs=1e-10)
    assert found.coulomb == pytest.approx(coulomb, abs=1e-10)
    assert found.offset == pytest.approx(offset, abs=1e-10)
    assert found.viscous_error < 1e-9


def test_errors_are_those_of_least_squares() -> None:
    # Over 400 draws B ± 1.96 errors (11 degrees of freedom: t = 2.2) holds the truth
    # in 95 % of them; below 91 % or above 98 % has a chance of 1e-3 or less.
    rng = np.random.default_rng(5)
    clean = runs_of(0.168, 0.189, 0.0, [0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4])
    inside = 0
    for _ in range(400):
        noisy = [replace(r, torque=r.torque + rng.normal(0.0, 0.01)) for r in clean]
        found = fit_friction(noisy)
        inside += abs(found.viscous - 0.168) <= 2.201 * found.viscous_error
    assert 364 <= inside <= 392


@pytest.mark.parametrize(
    "runs",
    [
        [],
        runs_of(0.1, 0.1, 0.0, [1.0]),
        [SteadyRun(speed=v, torque=v) for v in (1.0, 2.0, 3.0, 4.0)],
        runs_of(0.1, 0.1, 0.0, [1.0]) * 2,
    ],
)
def test_runs_that_cannot_tell_are_refused(runs: list[SteadyRun]) -> None:
    with pytest.raises(ParameterError, match="at two speeds and in both directions"):
        fit_friction(runs)


@pytest.mark.parametrize("start_deg", [35.0, 120.0])
def test_a_free_arm_says_its_friction_from_wherever_it_starts(start_deg: float) -> None:
    clock = SimulatedClock()
    two = (radians(40.0), radians(80.0))
    with opened(clock, loose(start_deg)) as device:
        found = fit_friction(steady_runs(device, clock, speeds=two))
    assert device.emulator.registers.mode == 0
    assert found.viscous == pytest.approx(0.168, rel=0.03)
    assert found.coulomb == pytest.approx(0.189, rel=0.03)


def test_it_runs_on_the_simulated_device_too() -> None:
    clock = SimulatedClock()
    with open_device("simulated", clock=clock, hand=loose(60.0)) as device:
        found = fit_friction(steady_runs(device, clock))
    assert found.viscous == pytest.approx(0.168, rel=0.015)
    assert found.coulomb == pytest.approx(0.189, rel=0.015)


def holding(start_deg: float = 60.0) -> SimulatedHand:
    # Rests for a minute before it does anything
    start = radians(start_deg)
    return SimulatedHand(start=start, end=END, mean_speed=1.0, delay=60.0)


def test_an_arm_that_is_held_is_not_turned() -> None:
    clock = SimulatedClock()
    with (
        opened(clock, holding()) as device,
        pytest.raises(DeviceError, match=r"needs a free arm, 0.5 N·m do not move it"),
    ):
        steady_runs(device, clock)


def test_an_arm_near_its_end_is_not_turned() -> None:
    clock = SimulatedClock()
    with (
        opened(clock, loose(130.0)) as device,
        pytest.raises(DeviceError, match="between 30 and 125 deg to begin with"),
    ):
        steady_runs(device, clock)


class Reversed(SimulatedDevice):
    """Its motor turns the other way."""

    def _send(self, torque_nm: float) -> None:
        super()._send(-torque_nm)


def test_a_motor_that_turns_the_other_way_is_noticed_at_once() -> None:
    # Under speed control it would run away.
    clock = SimulatedClock()
    with Reversed(clock=clock, hand=loose(60.0)) as device:
        with pytest.raises(
            DeviceError, match="counts of the puck have different signs"
        ):
            steady_runs(device, clock)
        assert abs(device.read().angle - radians(60.0)) < radians(2.0)


def test_a_mirrored_puck_is_the_same_to_everybody() -> None:
    # Counts and torques change their signs together: only a person who looks at the
    # arm can tell. docs/hardware.md says how.
    clock, hand = SimulatedClock(), loose(60.0)
    options = puck_options(hand, direction=-1)
    two = (radians(40.0), radians(80.0))
    with open_device("puck", clock=clock, hand=hand, options=options) as device:
        found = fit_friction(steady_runs(device, clock, speeds=two))
    assert found.viscous == pytest.approx(0.168, rel=0.03)


class CountingWatchdog:
    def __init__(self) -> None:
        self.n_beats, self.n_rests = 0, 0

    def beat(self) -> None:
        self.n_beats += 1

    def rest(self) -> None:
        self.n_rests += 1


def test_the_watchdog_hears_every_tick() -> None:
    clock, watchdog = SimulatedClock(), CountingWatchdog()
    with open_device("simulated", clock=clock, hand=loose(60.0)) as device:
        steady_runs(device, clock, speeds=(radians(80.0),), watchdog=watchdog)
    assert watchdog.n_beats == clock.now_ns() // 1_000_000 + 1
    assert watchdog.n_rests == 1


@pytest.mark.parametrize(("lost_s", "ends"), [(0.0015, False), (0.01, True)])
def test_two_lost_readings_in_a_row_are_let_pass(lost_s: float, ends: bool) -> None:
    clock = SimulatedClock()
    faults = (fault("dropped-replies", 0.6, end_s=0.6 + lost_s),)
    two = (radians(60.0), radians(80.0))
    with opened(clock, loose(60.0), emulator={"faults": faults}) as device:
        if ends:
            with pytest.raises(DeviceTimeoutError, match="no position within 1 ms"):
                steady_runs(device, clock, speeds=two)
        else:
            assert len(steady_runs(device, clock, speeds=two)) == 4

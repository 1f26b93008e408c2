"""A free arm turned by its motor, what ends that, and the friction fitted to it."""

import math
from dataclasses import replace
from math import radians
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import (
    DeviceError,
    DeviceTimeoutError,
    EmergencyStopError,
    LimitExceededError,
    ParameterError,
)
from masrel.lab.hess import (
    Device,
    EmergencyStop,
    Reading,
    SimulatedClock,
    SimulatedHand,
    open_device,
)
from masrel.lab.hess.puck import SteadyRun, fit_friction, steady_runs
from tests.lab.hess.puck.rig import END, fault, loose, opened, puck_options
from tests.lab.hess.rig import ScriptedDevice


@pytest.mark.parametrize("start_deg", [35.0, 120.0])
def test_a_free_arm_says_its_friction_from_wherever_it_starts(start_deg: float) -> None:
    clock = SimulatedClock()
    two = (radians(40.0), radians(80.0))
    with opened(clock, loose(start_deg)) as device:
        estimate = fit_friction(steady_runs(device, clock, speeds=two))
    assert device.emulator.mode == 0
    assert estimate.viscous == pytest.approx(0.168, rel=0.03)
    assert estimate.coulomb == pytest.approx(0.189, rel=0.03)


def test_it_runs_on_the_simulated_device_too() -> None:
    clock = SimulatedClock()
    with open_device("simulated", clock=clock, hand=loose(60.0)) as device:
        estimate = fit_friction(steady_runs(device, clock))
    assert estimate.viscous == pytest.approx(0.168, rel=0.015)
    assert estimate.coulomb == pytest.approx(0.189, rel=0.015)


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


class Faulty(Device):
    """The simulated device with an arm at 60 deg; a subclass says what is wrong."""

    name: ClassVar[str] = "faulty"
    simulated: ClassVar[bool] = True

    def __init__(self, clock: SimulatedClock) -> None:
        self.inner = open_device("simulated", clock=clock, hand=loose(60.0))

    def _start(self) -> None: ...

    def _read(self) -> Reading:
        return self.inner.read()

    def _send(self, torque_nm: float) -> None:
        self.inner.command(torque_nm)

    def _stop(self) -> None:
        self.inner.close()


def test_a_first_reading_that_is_lost_is_waited_for() -> None:
    class Losing(Faulty):
        n_lost = 0

        def _read(self) -> Reading:
            if self.n_lost < 2:
                self.n_lost += 1
                raise DeviceTimeoutError("no answer")
            return super()._read()

    clock = SimulatedClock()
    with Losing(clock) as device:
        assert len(steady_runs(device, clock, speeds=(radians(80.0),))) == 2


class Reversed(Faulty):
    """Its motor turns the other way."""

    def _send(self, torque_nm: float) -> None:
        super()._send(-torque_nm)


def test_a_motor_that_turns_the_other_way_is_noticed_at_once() -> None:
    # Under speed control it would run away.
    clock = SimulatedClock()
    with Reversed(clock) as device:
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
        estimate = fit_friction(steady_runs(device, clock, speeds=two))
    assert estimate.viscous == pytest.approx(0.168, rel=0.03)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("frozen-encoder", "frozen: needs an angle that changes within 10 ms"),
        ("jumping-encoder", "jump: needs an angle within 0.3 deg"),
        ("idled", "needs MODE 2, somebody else has set it to 0"),
    ],
)
def test_a_fault_while_the_arm_turns_by_itself_ends_it(kind, words: str) -> None:
    clock = SimulatedClock()
    options = {"faults": (fault(kind, 0.9),)}
    with opened(clock, loose(60.0), emulator=options) as device:
        with pytest.raises(DeviceError, match=words):
            steady_runs(device, clock, speeds=(radians(60.0), radians(80.0)))
        motor, now_ns = device.emulator.motor, clock.now_ns()
        assert radians(35.0) < motor.angle(now_ns) < radians(120.0)
        assert abs(motor.plant.velocity) < radians(150.0)
    assert device.emulator.mode == 0


def test_an_arm_that_is_caught_while_it_turns_is_let_go_soon() -> None:
    # At 20 deg/s until 0.5 s, then it comes to rest against something soft: 0.2 s
    # later at the latest the torque has been too much for an arm at rest for 0.2 s.
    def angle(time_s: float) -> float:
        after = max(0.0, time_s - 0.5)
        moved = min(time_s, 0.5) + 0.02 * -math.expm1(-after / 0.02)
        step = radians(0.005)
        return math.floor(radians(75.0 + 20.0 * moved) / step) * step

    clock = SimulatedClock()
    with (
        ScriptedDevice(clock, angle) as device,
        pytest.raises(DeviceError, match="standing torque: needs at most 1 N·m"),
    ):
        steady_runs(device, clock, speeds=(radians(20.0), radians(80.0)))
    assert max(abs(torque) for _, torque in device.commands) <= 2.0
    assert clock.now_ns() < 1_100_000_000


def test_an_emergency_stop_ends_it() -> None:
    class Pressing(SimulatedClock):
        def sleep_until_ns(self, deadline_ns: int) -> None:
            super().sleep_until_ns(deadline_ns)
            if deadline_ns >= 500_000_000:
                stop.press("test")

    stop, clock = EmergencyStop(), Pressing()
    with (
        open_device("simulated", clock=clock, hand=loose(60.0)) as device,
        pytest.raises(EmergencyStopError, match="emergency stop: test"),
    ):
        steady_runs(device, clock, stop=stop)
    assert clock.now_ns() <= 502_000_000


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


SILENT = r"needs a new reading after at most 2 ticks .*no position within 1 ms"


@pytest.mark.parametrize(("lost_s", "ends"), [(0.0015, False), (0.01, True)])
def test_two_lost_readings_in_a_row_are_let_pass(lost_s: float, ends: bool) -> None:
    clock = SimulatedClock()
    faults = (fault("dropped-replies", 0.6, end_s=0.6 + lost_s),)
    two = (radians(60.0), radians(80.0))
    with opened(clock, loose(60.0), emulator={"faults": faults}) as device:
        if ends:
            with pytest.raises(LimitExceededError, match=SILENT) as caught:
                steady_runs(device, clock, speeds=two)
            assert caught.value.kind == "missed-replies"  # as in a presentation
        else:
            assert len(steady_runs(device, clock, speeds=two)) == 4


def test_every_fourth_lost_reading_ends_it_as_it_ends_a_presentation() -> None:
    clock = SimulatedClock()
    faults = (fault("dropped-replies", 0.6, every=4),)
    with (
        opened(clock, loose(60.0), emulator={"faults": faults}) as device,
        pytest.raises(LimitExceededError, match="at most 10 of 100 ticks"),
    ):
        steady_runs(device, clock, speeds=(radians(60.0), radians(80.0)))


def test_a_reading_that_comes_again_is_none() -> None:
    class Repeating(Faulty):
        n_read = 0

        def _read(self) -> Reading:
            self.n_read += 1
            if self.n_read <= 500:
                self.last = super()._read()
            return self.last

    clock = SimulatedClock()
    with (
        Repeating(clock) as device,
        pytest.raises(
            LimitExceededError, match=r"3 in a row \(one of 0.499000 s again"
        ),
    ):
        steady_runs(device, clock, speeds=(radians(60.0), radians(80.0)))


# The fit

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
    estimate = fit_friction(runs_of(viscous, coulomb, offset, speeds))
    assert estimate.viscous == pytest.approx(viscous, abs=1e-10)
    assert estimate.coulomb == pytest.approx(coulomb, abs=1e-10)
    assert estimate.offset == pytest.approx(offset, abs=1e-10)
    assert estimate.viscous_error < 1e-9


def test_errors_are_those_of_least_squares() -> None:
    # Over 400 draws B ± 1.96 errors (11 degrees of freedom: t = 2.2) holds the truth
    # in 95 % of them; below 91 % or above 98 % has a chance of 1e-3 or less.
    rng = np.random.default_rng(5)
    clean = runs_of(0.168, 0.189, 0.0, [0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4])
    inside = 0
    for _ in range(400):
        noisy = [replace(r, torque=r.torque + rng.normal(0.0, 0.01)) for r in clean]
        estimate = fit_friction(noisy)
        inside += abs(estimate.viscous - 0.168) <= 2.201 * estimate.viscous_error
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

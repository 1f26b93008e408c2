"""What every device does, whichever backend it is: one suite for all names."""

import gc
import importlib.util
import math
import pkgutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from math import radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import DeviceError
from masrel.lab import hess
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    BackendOptions,
    Controller,
    Device,
    DeviceLimits,
    Hand,
    PresentationStatus,
    Presented,
    Reading,
    ReplayOptions,
    SimulatedClock,
    SimulatedHand,
    SimulatedOptions,
    StretchRules,
    TorqueSensor,
    device_names,
    open_device,
    run_presentation,
)
from masrel.lab.hess.device import _BACKENDS
from masrel.lab.recording import MEASURED_TORQUE, Channel, Recording, stretches
from tests.lab.hess.rig import ScriptedDevice

START, END = radians(30.0), radians(146.0)

Opener = Callable[[SimulatedClock, Hand], Device]


def _scripted(clock: SimulatedClock, _hand: Hand) -> Device:
    device = ScriptedDevice(clock)
    device.open()
    return device


# A torque sensor, muscles and a trigger
CHANNELS = (MEASURED_TORQUE, Channel(name="emg_biceps", unit="mv"), Channel(name="key"))


def _scripted_with_channels(clock: SimulatedClock, _hand: Hand) -> Device:
    device = ScriptedDevice(clock)
    device.channels = CHANNELS
    device.values = lambda time_s: (2.0, 0.1 * time_s, 0.0)
    device.open()
    return device


SENSING = SimulatedOptions(torque_sensor=TorqueSensor())


def _stretching(n_stretches: int = 1) -> SimulatedHand:
    speed = radians(90.0)
    again = (speed,) * (n_stretches - 1)
    return SimulatedHand(
        start=START, end=END, mean_speed=speed, again=again, returns=True
    )


@cache
def _recording(
    options: BackendOptions | None = None, n_stretches: int = 1
) -> Recording:
    clock, hand = SimulatedClock(), _stretching(n_stretches)
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand, options=options) as device:
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=DeviceLimits(),
            stretches=StretchRules(n=n_stretches),
        ).recording


def _options(name: str) -> BackendOptions | None:
    # What a backend needs beside the clock and the hand of the tests
    return ReplayOptions(recording=_recording()) if name == "replay" else None


def _with_channels(name: str) -> BackendOptions:
    if name == "replay":
        return ReplayOptions(recording=_recording(SENSING))
    return SENSING


def _registered(name: str, *, with_channels: bool = False) -> Opener:
    options = _with_channels if with_channels else _options
    return lambda clock, hand: open_device(
        name, clock=clock, hand=hand, options=options(name)
    )


# Every registered name is held to the suite, without a line here; the device that the
# other tests script is held to it too.
OPENERS: dict[str, Opener] = {
    **{name: _registered(name) for name in device_names()},
    "scripted": _scripted,
}
registered = pytest.mark.parametrize("backend", device_names(), indirect=True)
# Those that measure anything beside the angle, told to do so
WITH_CHANNELS: dict[str, Opener] = {
    "simulated": _registered("simulated", with_channels=True),
    "replay": _registered("replay", with_channels=True),
    "scripted": _scripted_with_channels,
}
# A recording does not move.
WITH_ARM = [name for name in device_names() if name != "replay"]
with_arm = pytest.mark.parametrize("backend", WITH_ARM, indirect=True)


@pytest.fixture
def clock() -> SimulatedClock:
    return SimulatedClock()


@pytest.fixture(params=sorted(OPENERS))
def backend(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def opened(backend: str, clock: SimulatedClock):
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(90.0))
    device = OPENERS[backend](clock, hand)
    yield device
    device.close()


def tick(clock: SimulatedClock, n: int = 1) -> None:
    clock.sleep_until_ns(clock.now_ns() + n * 1_000_000)


@pytest.mark.parametrize("name", ["wam", *device_names()])
def test_a_name_without_a_device_or_without_what_it_needs_is_refused(name: str) -> None:
    with pytest.raises(
        DeviceError, match=r": needs (a hand|options|one of .*simulated)"
    ):
        open_device(name, clock=SimulatedClock())


def test_options_of_another_backend_are_refused(backend: str) -> None:
    class Foreign(BackendOptions):
        pass

    if backend in device_names():
        with pytest.raises(
            DeviceError, match=f"{backend}: needs options .* got Foreign"
        ):
            open_device(
                backend, clock=SimulatedClock(), hand=_stretching(), options=Foreign()
            )


def test_a_backend_is_imported_when_it_is_chosen() -> None:
    code = "import sys, masrel.lab.hess; print('masrel.lab.hess.puck' in sys.modules)"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_every_registered_name_is_held_to_this_suite() -> None:
    assert set(OPENERS) == {*device_names(), "scripted"}
    assert set(WITH_ARM) == {*device_names()} - {"replay"}


def test_every_backend_that_is_written_is_registered() -> None:
    # A backend is a module with a function `build` of a setup.
    written = {
        module.name
        for module in pkgutil.walk_packages(hess.__path__, "masrel.lab.hess.")
        if "\ndef build(setup: DeviceSetup)" in _source(module.name)
    }
    assert written == set(_BACKENDS.values())


def _source(module: str) -> str:
    found = importlib.util.find_spec(module)
    assert found is not None
    assert found.origin is not None
    return Path(found.origin).read_text(encoding="utf-8")


# Who it is


def test_it_says_its_name_and_whether_hardware_moves(
    opened: Device, backend: str
) -> None:
    assert opened.name == backend
    assert isinstance(opened.simulated, bool)


# Opening and closing


def test_it_is_open_when_it_has_been_opened(opened: Device) -> None:
    assert opened.is_open


def test_opening_it_again_does_nothing(opened: Device, clock: SimulatedClock) -> None:
    tick(clock)
    before = opened.read()
    opened.open()
    assert opened.is_open
    again = opened.read()
    assert again.angle == before.angle  # where it was
    assert again.time_ns >= before.time_ns


def test_closing_it_twice_does_nothing_more(opened: Device) -> None:
    opened.close()
    opened.close()
    assert not opened.is_open


def test_what_was_closed_is_not_opened_again(opened: Device, backend: str) -> None:
    opened.close()
    with pytest.raises(DeviceError, match=f"{backend}: needs a new device"):
        opened.open()
    assert not opened.is_open


def test_a_with_block_gives_the_device_and_closes_it(opened: Device) -> None:
    with opened as device:
        assert device is opened
        assert device.is_open
    assert not opened.is_open


@pytest.mark.parametrize("interruption", [ValueError, KeyboardInterrupt])
def test_a_with_block_closes_it_after_an_exception_that_goes_on(
    opened: Device, interruption: type[BaseException]
) -> None:
    with pytest.raises(interruption), opened:
        raise interruption
    assert not opened.is_open


@pytest.mark.parametrize("wish", ["read", "command"])
def test_a_closed_device_is_neither_read_nor_commanded(
    opened: Device, backend: str, wish: str
) -> None:
    opened.close()
    words = f"{backend}: needs an open device to {wish}, this one is closed"
    with pytest.raises(DeviceError, match=words):
        opened.read() if wish == "read" else opened.command(0.0)


def forgotten(backend: str) -> Device:
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(90.0))
    return OPENERS[backend](SimulatedClock(), hand)


def test_a_forgotten_device_warns(backend: str) -> None:
    with pytest.warns(ResourceWarning, match=f"{backend}: a device was never closed"):
        forgotten(backend)  # the last reference goes with the statement


def test_a_device_that_was_closed_is_forgotten_in_silence(backend: str) -> None:
    device = forgotten(backend)
    device.close()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        del device
        gc.collect()
    assert not [warning for warning in caught if warning.category is ResourceWarning]


@pytest.mark.parametrize("filtering", ["always", "ignore", "error"])
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_forgotten_device_is_left_with_zero_torque(filtering: str) -> None:
    commands: list[tuple[int, float]] = []

    def leave() -> None:
        device = ScriptedDevice(SimulatedClock())
        device.open()
        device.commands = commands
        device.command(3.0)

    with warnings.catch_warnings(record=True):
        warnings.simplefilter(filtering, ResourceWarning)
        leave()
        gc.collect()
    assert commands == [(0, 3.0), (0, 0.0)]


def test_closing_sends_zero_torque_before_it_lets_go() -> None:
    acts = []

    class Watched(ScriptedDevice):
        def _send(self, torque_nm: float) -> None:
            acts.append(torque_nm)

        def _stop(self) -> None:
            acts.append("stop")

    with Watched(SimulatedClock()) as device:
        device.command(2.0)
    assert acts == [2.0, 0.0, "stop"]


def test_a_device_that_takes_no_zero_torque_is_let_go_all_the_same() -> None:
    acts = []

    class Deaf(ScriptedDevice):
        def _send(self, torque_nm: float) -> None:
            raise DeviceError(f"deaf: does not take {torque_nm} N·m")

        def _stop(self) -> None:
            acts.append("stop")

    device = Deaf(SimulatedClock())
    device.open()
    with pytest.raises(DeviceError, match=r"does not take 0\.0"):
        device.close()
    assert acts == ["stop"]


def test_an_opening_that_fails_leaves_nothing_to_close() -> None:
    class Absent(ScriptedDevice):
        def _start(self) -> None:
            raise DeviceError("absent: nobody answers")

        def _stop(self) -> None:
            raise AssertionError("there is nothing to let go of")

    device = Absent(SimulatedClock())
    with pytest.raises(DeviceError, match="nobody answers"):
        device.open()
    assert not device.is_open
    device.close()
    assert device.commands == []


def use(device: Device) -> None:
    device.open()
    device.read()
    device.command(0.0)
    device.check()
    device.close()


@pytest.mark.parametrize("error", [OSError(5, "broken"), ValueError("broken")])
@pytest.mark.parametrize(
    ("hook", "act"),
    [
        ("_start", "opening"),
        ("_read", "reading"),
        ("_send", "sending a torque"),
        ("_check", "asking for its state"),
        ("_stop", "letting go"),
    ],
)
def test_an_exception_of_a_backend_is_a_fault_of_the_device(
    hook: str, act: str, error: Exception
) -> None:
    def fail(*_arguments: object) -> None:
        raise error

    device = ScriptedDevice(SimulatedClock())
    setattr(device, hook, fail)
    with pytest.raises(DeviceError) as caught:
        use(device)
    assert str(caught.value) == f"scripted: {act}: {type(error).__name__}: {error}"
    assert caught.value.kind == "device"
    assert caught.value.__cause__ is error
    vars(device).pop(hook)
    device.close()


# Reading


def test_a_reading_is_a_time_on_the_clock_and_an_angle_in_the_range(
    opened: Device, clock: SimulatedClock
) -> None:
    tick(clock, 7)
    asked_ns = clock.now_ns()
    reading = opened.read()
    assert isinstance(reading, Reading)
    assert type(reading.time_ns) is int
    assert type(reading.angle) is float  # a numpy scalar would slow the loop down
    assert asked_ns <= reading.time_ns <= clock.now_ns()
    assert 0.0 <= reading.angle <= math.pi


def test_a_later_reading_has_a_later_time(
    opened: Device, clock: SimulatedClock
) -> None:
    times = []
    for _ in range(5):
        tick(clock)
        times.append(opened.read().time_ns)
    assert times == sorted(set(times))


# Channels


@pytest.fixture(params=[*OPENERS, *(f"{name} with channels" for name in WITH_CHANNELS)])
def measuring(request: pytest.FixtureRequest, clock: SimulatedClock):
    name, _, channels = request.param.partition(" ")
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(90.0))
    device = (WITH_CHANNELS if channels else OPENERS)[name](clock, hand)
    assert bool(device.channels) == bool(channels)
    yield device
    device.close()


def test_every_reading_has_a_number_for_each_channel(
    measuring: Device, clock: SimulatedClock
) -> None:
    columns = [channel.column for channel in measuring.channels]
    assert len(set(columns)) == len(columns)
    for _ in range(5):
        tick(clock)
        values = measuring.read().channels
        assert len(values) == len(columns)
        assert all(type(value) is float for value in values)


def test_what_it_measures_is_in_the_recording(
    measuring: Device, clock: SimulatedClock
) -> None:
    recording = run_presentation(
        measuring,
        Controller(STANDARD_MODELS["HM3"], start_angle=START),
        clock=clock,
        limits=DeviceLimits(),
        max_duration_s=0.2,
    ).recording
    assert recording.channels == measuring.channels
    for channel in recording.channels:
        assert np.isfinite(recording.columns[channel.column]).all()
        assert recording.facts[f"n_missing_{channel.column}"] == 0


# Its state, and who else can idle it


def test_an_open_device_that_is_well_has_nothing_to_say(
    opened: Device, clock: SimulatedClock
) -> None:
    tick(clock)
    opened.read()
    opened.check()
    assert opened.is_open


def test_a_closed_device_has_no_state(opened: Device, backend: str) -> None:
    opened.close()
    words = f"{backend}: needs an open device to check, this one is closed"
    with pytest.raises(DeviceError, match=words):
        opened.check()


def test_who_else_can_idle_it_is_a_module_that_can(opened: Device) -> None:
    idle = opened.idle_command()
    if idle is not None:
        assert callable(importlib.import_module(idle.module).prepare)
        assert all(isinstance(argument, str) for argument in idle.arguments)


# Commanding


@pytest.mark.parametrize("torque", [math.nan, math.inf, -math.inf])
def test_a_torque_that_is_not_finite_is_refused_and_the_device_stays_open(
    opened: Device, backend: str, torque: float
) -> None:
    with pytest.raises(DeviceError, match=f"{backend}: needs a finite torque, got"):
        opened.command(torque)
    assert opened.is_open
    opened.command(0.0)


@with_arm
def test_a_positive_torque_resists_extension(
    backend: str, clock: SimulatedClock
) -> None:
    free = SimulatedHand(
        start=radians(90.0), end=END, mean_speed=radians(90.0), slip_time=0.0
    )
    with open_device(backend, clock=clock, hand=free) as device:
        before = device.read().angle
        device.command(1.0)
        tick(clock, 200)
        assert device.read().angle < before - radians(1.0)


@with_arm
def test_a_torque_is_held_until_the_next_one(
    backend: str, clock: SimulatedClock
) -> None:
    free = SimulatedHand(
        start=radians(90.0), end=END, mean_speed=radians(90.0), slip_time=0.0
    )
    with open_device(backend, clock=clock, hand=free) as device:
        device.read()
        device.command(1.0)
        angles = []
        for _ in range(4):
            tick(clock, 50)
            angles.append(device.read().angle)
        steps = [after - before for before, after in pairwise(angles)]
        # It gains speed all the time.
        assert all(later < earlier < 0.0 for earlier, later in pairwise(steps))


# In the loop


@registered
def test_a_presentation_runs_on_it(
    opened: Device, backend: str, clock: SimulatedClock
) -> None:
    presented = run_presentation(
        opened,
        Controller(STANDARD_MODELS["HM3"], start_angle=START),
        clock=clock,
        limits=DeviceLimits(torque=20.0, speed=radians(400.0), missed_ticks=20),
    )
    assert presented.fault is None
    assert presented.recording.facts["device"] == backend
    assert presented.recording.facts["simulated"] is opened.simulated
    assert presented.recording.facts["ended"] == "arrived"
    assert opened.is_open


# Many stretches, and their soft ends


def open_for_many(backend: str, clock: SimulatedClock) -> Device:
    """A device whose arm, or whose recording, is stretched twice."""
    hand = _stretching(2)
    if backend == "scripted":
        device = ScriptedDevice(clock, lambda time_s: hand.intended(time_s)[0])
        device.open()
        return device
    options = None
    if backend == "replay":
        options = ReplayOptions(recording=_recording(n_stretches=2))
    return open_device(backend, clock=clock, hand=hand, options=options)


class Saying(SimulatedClock):
    """A clock on which the rater says done at a time."""

    def __init__(self, status: PresentationStatus) -> None:
        super().__init__()
        self.done_ns, self.status = math.inf, status

    def sleep_until_ns(self, deadline_ns: int) -> None:
        super().sleep_until_ns(deadline_ns)
        if deadline_ns >= self.done_ns:
            self.status.done()


def presented_many(backend: str, done_s: float = math.inf) -> Presented:
    status = PresentationStatus()
    clock = Saying(status)
    with open_for_many(backend, clock) as device:
        clock.done_ns = clock.now_ns() + done_s * 1e9
        presented = run_presentation(
            device,
            Controller(STANDARD_MODELS["HM4"], start_angle=START),
            clock=clock,
            limits=DeviceLimits(),
            stretches=StretchRules(n=2),
            status=status,
        )
        assert device.is_open
    assert status.n_stretches == len(stretches(presented.recording))
    return presented


def assert_softly(presented: Presented) -> None:
    """A catch, a post-catch and a presentation end within 100 ms, by no more a tick."""
    columns = presented.recording.columns
    torque, phase = columns["command_torque_nm"], columns["phase"]
    ends = np.flatnonzero((phase[:-1] > 0.0) & (phase[1:] == 0.0))
    for stands in [*ends, presented.recording.n_presented - 1]:
        falls = -np.diff(np.abs(torque[stands : stands + 101]))
        most = math.pi / 2.0 * abs(torque[stands]) / 100.0 + 1e-9
        assert falls.max() <= most
    assert torque[-1] == 0.0


def test_an_arm_may_be_stretched_many_times(backend: str) -> None:
    presented = presented_many(backend)
    assert presented.fault is None
    assert presented.recording.facts["ended"] == "stretches"
    made = stretches(presented.recording)
    assert [one.number for one in made] == [1, 2]
    for one in made:
        assert one.phases == ("pre-catch", "catch", "post-catch", "pre-catch")
        assert one.mean_speed_deg_s == pytest.approx(89.2, abs=1.0)
        assert one.catch_angle_deg == pytest.approx(made[0].catch_angle_deg, abs=0.3)
    assert_softly(presented)


@pytest.mark.parametrize("done_s", [0.65, 3.0])
def test_a_rater_may_be_done_at_any_time(backend: str, done_s: float) -> None:
    presented = presented_many(backend, done_s)
    assert presented.fault is None
    assert presented.recording.facts["ended"] == "done"
    assert presented.recording.n_presented == pytest.approx(1000 * done_s, abs=2)
    assert_softly(presented)

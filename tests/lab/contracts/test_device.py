"""What every device does, whichever backend it is: one suite for all names."""

import gc
import importlib.util
import math
import pkgutil
import warnings
from functools import cache, partial
from itertools import pairwise
from math import radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import DeviceError
from masrel.lab import hess
from masrel.lab.hess import (
    BackendOptions,
    Clock,
    Device,
    DeviceSetup,
    PresentationStatus,
    Presented,
    Reading,
    ReplayOptions,
    SimulatedClock,
    SimulatedOptions,
    StretchRules,
    TorqueSensor,
    build_device,
    device_names,
    open_device,
    run_presentation,
)
from masrel.lab.hess.testing import (
    CONTRACT,
    DeviceUnderTest,
    assert_device_contract,
)
from masrel.lab.recording import MEASURED_TORQUE, Channel, Recording, stretches
from tests.lab.hess.rig import (
    LIMITS,
    START,
    ActingClock,
    ScriptedDevice,
    controls,
    present,
    stretching,
)

# A torque sensor, muscles and a trigger
CHANNELS = (MEASURED_TORQUE, Channel(name="emg_biceps", unit="mv"), Channel(name="key"))
SENSING = SimulatedOptions(torque_sensor=TorqueSensor())
SPEED = radians(90.0)


@cache
def _recording(options: BackendOptions | None, n_stretches: int) -> Recording:
    hand = stretching(90.0, again=(SPEED,) * (n_stretches - 1), returns=True)
    rules = StretchRules(n=n_stretches)
    return present(hand=hand, backend=options, stretches=rules).recording


def device_of(
    backend: str,
    clock: SimulatedClock,
    n_stretches: int = 1,
    *,
    measures: bool = False,
    angle=lambda _time_s: START,
) -> Device:
    """An open device: every registered name without a line here, and the scripted one.

    It is told to measure something beside the angle where it can.
    """
    device = made(backend, setup_of(backend, clock, n_stretches, measures), angle)
    if backend == "scripted" and measures:
        device.channels = CHANNELS
        device.values = lambda time_s: (2.0, 0.1 * time_s, 0.0)
    device.open()
    return device


def made(backend: str, setup: DeviceSetup, angle=lambda _time_s: START) -> Device:
    if backend == "scripted":
        return ScriptedDevice(setup.clock, angle)
    return build_device(backend, setup)


def setup_of(
    backend: str, clock: Clock, n_stretches: int = 1, measures: bool = False
) -> DeviceSetup:
    options = SENSING if measures else None
    if backend == "replay":  # a recording does not move
        options = ReplayOptions(recording=_recording(options, n_stretches))
    again = (SPEED,) * (n_stretches - 1)
    hand = stretching(90.0, again=again, returns=n_stretches > 1)
    return DeviceSetup(clock=clock, hand=hand, options=options)


NAMES = [*device_names(), "scripted"]
MEASURING = ("simulated", "replay", "scripted")
registered = pytest.mark.parametrize("backend", device_names(), indirect=True)
WITH_ARM = [name for name in device_names() if name != "replay"]
with_arm = pytest.mark.parametrize("backend", WITH_ARM, indirect=True)


@pytest.fixture
def clock() -> SimulatedClock:
    return SimulatedClock()


@pytest.fixture(params=NAMES)
def backend(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def opened(backend: str, clock: SimulatedClock):
    device = device_of(backend, clock)
    yield device
    device.close()


def tick(clock: SimulatedClock, n: int = 1) -> None:
    clock.sleep_until_ns(clock.now_ns() + n * 1_000_000)


def test_every_backend_that_is_written_is_registered() -> None:
    # A backend is a module with a function `build` of a setup.
    written = {
        module.name
        for module in pkgutil.walk_packages(hess.__path__, "masrel.lab.hess.")
        if "\ndef build(setup: DeviceSetup)" in _source(module.name)
    }
    assert len(written) == len(device_names())


def _source(module: str) -> str:
    found = importlib.util.find_spec(module)
    assert found is not None
    assert found.origin is not None
    return Path(found.origin).read_text(encoding="utf-8")


@pytest.mark.parametrize("rule", CONTRACT)
def test_every_device_holds_the_contract(backend: str, rule: str) -> None:
    CONTRACT[rule](
        DeviceUnderTest(
            build=partial(made, backend),
            setup=lambda: setup_of(backend, SimulatedClock()),
            controller=controls,
        )
    )


@pytest.mark.parametrize("backend", MEASURING)
def test_so_does_one_that_measures_something(backend: str) -> None:
    def setup() -> DeviceSetup:
        return setup_of(backend, SimulatedClock(), measures=True)

    build = partial(made, backend)
    assert_device_contract(
        DeviceUnderTest(build=build, setup=setup, controller=controls)
    )


class Wrong(ScriptedDevice):
    """A device that breaks one rule, and may stay open."""

    def __del__(self) -> None:
        """Nothing is warned of."""

    def __init__(self, rule: str, setup: DeviceSetup) -> None:
        super().__init__(setup.clock)
        self.rule, self.simulated = rule, rule != "idle from elsewhere"
        self.holds_torque_when_silent = True
        if rule == "a presentation":
            self.angle = lambda time_s: START + 99.0 * time_s

    def check(self) -> None:
        if self.rule == "errors are the device's" and self.is_open:
            self._check()
        super().check()

    def close(self) -> None:
        if self.rule == "zero before idle" and self.is_open:
            self._stop()
        if self.rule != "ticks without a reading" or not self.n_reads:
            super().close()

    def command(self, torque_nm: float) -> None:
        if self.rule == "finite torque only":
            self._send(torque_nm)
        super().command(torque_nm)

    def open(self) -> None:
        if self.rule == "order of states":
            self._state = "new"
        super().open()

    def _read(self) -> Reading:
        reading = super()._read()
        if self.rule == "readings":
            return reading._replace(time_ns=self.start_ns)
        return reading


@pytest.mark.parametrize("rule", CONTRACT)
def test_a_rule_that_is_broken_is_named(rule: str) -> None:
    of = DeviceUnderTest(
        build=partial(Wrong, rule),
        setup=lambda: DeviceSetup(clock=SimulatedClock()),
        controller=controls,
    )
    with pytest.raises(DeviceError, match=f"^{rule}: scripted: "):
        assert_device_contract(of)


# Opening and closing


def test_opening_it_again_does_nothing(
    opened: Device, clock: SimulatedClock, backend: str
) -> None:
    assert opened.name == backend
    assert isinstance(opened.simulated, bool)
    tick(clock)
    before = opened.read()
    opened.open()
    assert opened.is_open
    again = opened.read()
    assert again.angle == before.angle  # where it was
    assert again.time_ns >= before.time_ns


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


def test_a_forgotten_device_warns_and_one_that_was_closed_does_not(
    backend: str,
) -> None:
    with pytest.warns(ResourceWarning, match=f"{backend}: a device was never closed"):
        device_of(backend, SimulatedClock())  # the last reference goes with this
    device = device_of(backend, SimulatedClock())
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


@pytest.mark.parametrize("is_deaf", [False, True])
def test_closing_sends_zero_torque_before_it_lets_go_all_the_same(
    is_deaf: bool,
) -> None:
    acts = []

    class Watched(ScriptedDevice):
        def _send(self, torque_nm: float) -> None:
            acts.append(torque_nm)
            if is_deaf:
                raise DeviceError(f"deaf: does not take {torque_nm} N·m")

        def _stop(self) -> None:
            acts.append("stop")

    device = Watched(SimulatedClock())
    device.open()
    if is_deaf:
        with pytest.raises(DeviceError, match=r"does not take 0\.0"):
            device.close()
    else:
        device.close()
    assert acts == [0.0, "stop"]


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


def test_hardware_says_what_it_does_with_its_torque_in_silence() -> None:
    device = ScriptedDevice(SimulatedClock(), simulated=False)
    with pytest.raises(DeviceError, match="scripted: needs holds_torque_when_silent"):
        device.open()
    device.holds_torque_when_silent = False
    device.open()
    options = {"clock": device.clock, "limits": LIMITS, "max_duration_s": 0.02}
    recording = run_presentation(device, controls(), **options).recording
    assert recording.facts["holds_torque_when_silent"] is False
    device.close()


# Reading


# Channels


@pytest.fixture(params=[*NAMES, *(f"{name} with channels" for name in MEASURING)])
def measuring(request: pytest.FixtureRequest, clock: SimulatedClock):
    name, _, channels = request.param.partition(" ")
    device = device_of(name, clock, measures=bool(channels))
    assert bool(device.channels) == bool(channels)
    yield device
    device.close()


def test_what_it_measures_is_in_the_recording(
    measuring: Device, clock: SimulatedClock
) -> None:
    options = {"clock": clock, "limits": LIMITS, "max_duration_s": 0.2}
    recording = run_presentation(measuring, controls(), **options).recording
    assert recording.channels == measuring.channels
    for channel in recording.channels:
        assert np.isfinite(recording.columns[channel.column]).all()
        assert recording.facts[f"n_missing_{channel.column}"] == 0


# Its state, and who else can idle it


# Commanding


@with_arm
def test_a_positive_torque_resists_extension_and_is_held_until_the_next_one(
    backend: str, clock: SimulatedClock
) -> None:
    free = stretching(90.0, start=radians(90.0), slip_time=0.0)
    with open_device(backend, clock=clock, hand=free) as device:
        angles = [device.read().angle]
        device.command(1.0)
        for _ in range(4):
            for _ in range(50 if backend == "moteus" else 1):  # it lets go by itself
                tick(clock, 1 if backend == "moteus" else 50)
                angle = device.read().angle
                device.command(1.0)
            angles.append(angle)
        assert angles[-1] < angles[0] - radians(1.0)
        steps = [after - before for before, after in pairwise(angles)]
        # It gains speed all the time.
        assert all(later < earlier < 0.0 for earlier, later in pairwise(steps))


# In the loop


@registered
def test_a_presentation_runs_on_it(
    opened: Device, backend: str, clock: SimulatedClock
) -> None:
    presented = run_presentation(opened, controls(), clock=clock, limits=LIMITS)
    assert presented.fault is None
    assert presented.recording.facts["device"] == backend
    assert presented.recording.facts["simulated"] is opened.simulated
    assert presented.recording.facts["ended"] == "arrived"
    assert opened.is_open


# Many stretches, and their soft ends


def presented_many(backend: str, done_s: float | None = None) -> Presented:
    status = PresentationStatus()
    hand = stretching(90.0, again=(SPEED,), returns=True)
    clock = ActingClock({})
    angle = lambda time_s: hand.intended(time_s)[0]  # noqa: E731
    with device_of(backend, clock, 2, angle=angle) as device:
        if done_s is not None:
            clock.acts[clock.now_ns() * 1e-9 + done_s] = lambda _: status.done()
        presented = run_presentation(
            device,
            controls("HM4"),
            clock=clock,
            limits=LIMITS,
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


def test_a_rater_may_be_done_in_a_catch(backend: str) -> None:
    presented = presented_many(backend, 0.65)
    assert presented.fault is None
    assert presented.recording.facts["ended"] == "done"
    assert presented.recording.n_presented == pytest.approx(650, abs=2)
    assert_softly(presented)


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

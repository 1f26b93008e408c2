"""At least 25 faults, each put into a session, and what came of it.

``python -m tests.lab.hess.injected`` prints the table of docs/driver.md.
"""

import contextlib
import errno
import math
import os
import pathlib
import signal
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import radians
from unittest import mock

import numpy as np

from masrel.errors import OverrunWarning
from masrel.lab.hess import (
    Controller,
    Device,
    SimulatedClock,
    SimulatedHand,
    StretchRules,
    open_device,
)
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.recording import read_recording
from masrel.lab.run import SimulatedGrades, model_controller, read_log, run_session
from masrel.lab.run import _present as presenting
from masrel.lab.run._presenter import CLOCKS
from masrel.lab.schedule import write_schedules

from . import faults as f

PROTOCOL = """
[study]
id = "one"
title = "One model"
[scale]
name = "MAS"
grades = ["0", "1", "1+", "2", "3", "4"]
[[models]]
id = "HM3"
intended_grade = "2"
catch_angle_constant_deg = 115.0
catch_torque_nms_rad = 2.8
residual_ratio = 0.60
catch_travel_deg = 30.0
[[raters]]
id = "R1"
[[sessions]]
id = "test"
raters = ["R1"]
[schedule]
seed = 11
[simulated_raters]
mean_speed_deg_s = {speed}
speed_sd_deg_s = 0.0
"""

# HM3 at 92 deg/s: pre-catch until 0.63 s, catch until 0.96 s, then post-catch
PRE, CATCH, POST = 0.4, 0.68, 1.1

N_STRETCHES = 3  # where there are many


def later_s(stretch: int, speed_deg_s: float = 92.0) -> float:
    """Return how long after the first the simulated hand begins a stretch, s."""
    # 118.5 deg there and, at 60 deg/s, back: half the ramps, and a rest after each
    there_and_back = 118.5 / speed_deg_s + 0.06 + 118.5 / 60.0 + 0.1 + 2.0 * 0.3
    return round((stretch - 1) * there_and_back, 3)


Wrap = Callable[[Device], Device]


@dataclass(frozen=True, kw_only=True)
class Injection:
    """One fault: where it is put, and what is expected of it."""

    name: str
    at_s: float
    expected: str | None  # kind of fault; None where it is let pass
    wrap: Wrap | None = None
    clock: Callable[[], SimulatedClock] | None = None
    controller: Callable[[Protocol, str], Controller] | None = None
    slip: bool = False
    full_disk: bool = False
    speed: float = 92.0


@dataclass(kw_only=True)
class Outcome:
    """What came of one injection."""

    name: str
    kind: str | None = None
    detected_ms: float = math.nan
    held_nm: float = math.nan  # when it was noticed
    peak_nm: float = math.nan  # after that
    zero_ms: float = math.nan  # from notice to zero torque
    intact: bool = False
    resumes: bool = False
    events: list[str] = field(default_factory=list)


def reading(fault: f.ReadFault) -> Wrap:
    return lambda inner: f.FaultyDevice(inner, read_fault=fault)


def sending(fault: f.SendFault) -> Wrap:
    return lambda inner: f.FaultyDevice(inner, send_fault=fault)


class InjectedClock(SimulatedClock):
    """A simulated clock to which things happen some s after `begin`, each once."""

    def __init__(self, acts: dict[float, Callable[["InjectedClock"], object]]) -> None:
        super().__init__()
        self.begin_ns, self.acts = math.inf, acts

    def begin(self) -> None:
        """The device is open: from here on the presentation is timed."""
        self.begin_ns = self.now_ns()

    def miss(self, gap_s: float) -> None:
        super().sleep_until_ns(self.now_ns() + round(gap_s * 1e9))

    def sleep_until_ns(self, deadline_ns: int) -> None:
        super().sleep_until_ns(deadline_ns)
        since_ns = deadline_ns - self.begin_ns
        for at_s in [at for at in self.acts if since_ns >= round(at * 1e9)]:
            self.acts.pop(at_s)(self)


def signalling(at_s: float) -> InjectedClock:
    """Somebody presses Ctrl-C at a time."""
    return InjectedClock({at_s: lambda _: signal.raise_signal(signal.SIGINT)})


def late(gaps: dict[float, float]) -> InjectedClock:
    """A machine that is away for some s at chosen times."""
    return InjectedClock(
        {at_s: lambda clock, gap=gap: clock.miss(gap) for at_s, gap in gaps.items()}
    )


class Wrong:
    """A joint model that goes wrong at a time; else like the one it stands for."""

    def __init__(self, joint, at_s: float, act: Callable[[float], float]) -> None:
        self.joint, self.at_s, self.act = joint, at_s, act

    def __getattr__(self, name: str):
        return getattr(self.joint, name)

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        torque = self.joint.step(time_s, angle, velocity)
        return torque if time_s < self.at_s - 1e-9 else self.act(torque)


def model(at_s: float, act: Callable[[float], float]):
    def made(protocol: Protocol, name: str) -> Controller:
        controller = model_controller(protocol, name)
        controller._joint = Wrong(controller._joint, at_s, act)
        return controller

    return made


def _fail(_torque: float) -> float:
    raise ZeroDivisionError("float division by zero")


def injections(stretch: int = 1) -> list[Injection]:
    """Return the faults, put into a stretch."""
    pre, catch, post = (at_s + later_s(stretch) for at_s in (PRE, CATCH, POST))
    slow = 4.0 + later_s(stretch, 15.0)

    def device(name: str, at_s: float, expected: str | None, wrap: Wrap, **options):
        return Injection(name=name, at_s=at_s, expected=expected, wrap=wrap, **options)

    def check(error) -> Wrap:
        return lambda inner: f.FaultyDevice(
            inner, send_fault=f.ignored(catch), check_fault=f.says(catch, error)
        )

    lost = "missed-replies"
    return [
        device("one reply dropped", catch, None, reading(f.dropped(catch, 1))),
        device("two replies dropped", catch, None, reading(f.dropped(catch, 2))),
        device("three replies dropped", catch, lost, reading(f.dropped(catch, 3))),
        device(
            "every fourth reply dropped",
            catch,
            lost,
            reading(f.dropped(catch, every=4)),
        ),
        device(
            "every tenth reply dropped",
            catch,
            None,
            reading(f.dropped(catch, every=10)),
        ),
        device("replies cease in pre-catch", pre, lost, reading(f.dropped(pre))),
        device("replies cease in the catch", catch, lost, reading(f.dropped(catch))),
        device("replies cease in post-catch", post, lost, reading(f.dropped(post))),
        device("one reply late by 2 ms", catch, None, reading(f.late(catch, 2e-3, 1))),
        device("replies late by 3 ms", catch, lost, reading(f.late(catch, 3e-3))),
        device("replies late by 8 ms", catch, lost, reading(f.late(catch, 8e-3))),
        device("a reply twice", catch, None, reading(f.repeated(catch, 1))),
        device("the same reply for ever", catch, lost, reading(f.repeated(catch))),
        device("replies from the future", catch, "stale", reading(f.early(catch, 1.0))),
        device("encoder frozen in pre-catch", pre, "frozen", reading(f.frozen(pre))),
        device(
            "encoder frozen in the catch", catch, "frozen", reading(f.frozen(catch))
        ),
        device("encoder frozen in post-catch", post, "frozen", reading(f.frozen(post))),
        device(
            "encoder frozen at 15 deg/s",
            slow,
            "standing-torque",
            reading(f.frozen(slow)),
            speed=15.0,
        ),
        device(
            "encoder jumps by 1 deg", catch, "jump", reading(f.shifted(catch, f.JUMP))
        ),
        device(
            "encoder off by -1 deg once",
            catch,
            "jump",
            reading(f.shifted(catch, -f.JUMP, 1)),
        ),
        device(
            "encoder wraps at 22 bits", pre, "range", reading(f.shifted(pre, f.WRAP))
        ),
        device(
            "encoder drifts by 400 deg/s",
            pre,
            "jump",
            reading(f.drifting(pre, radians(400.0))),
        ),
        device("no number", catch, "range", reading(f.shifted(catch, math.nan))),
        device(
            "bus off while reading",
            catch,
            "device",
            reading(f.says(catch, f.BUS_OFF)),
        ),
        device(
            "OSError of the backend while reading",
            catch,
            "device",
            reading(f.says(catch, OSError(5, "Input/output error"))),
        ),
        device(
            "ValueError of the backend while reading",
            catch,
            "device",
            reading(f.says(catch, ValueError("no such count"))),
        ),
        device(
            "OSError of the backend while sending",
            catch,
            "device",
            sending(f.refused(catch, OSError(5, "Input/output error"), 1)),
        ),
        device(
            "one torque not taken", catch, "no-answer", sending(f.not_taken(catch, 1))
        ),
        device(
            "no torque taken any more", catch, "no-answer", sending(f.not_taken(catch))
        ),
        device(
            "bus cut for good",
            catch,
            "no-answer",
            lambda inner: f.FaultyDevice(
                inner, send_fault=f.not_taken(catch), cut_s=catch
            ),
        ),
        device("idled from outside", catch, "device", check(f.IDLED)),
        device(
            "emergency stop of the device", catch, "emergency-stop", check(f.STOPPED)
        ),
        Injection(
            name="emergency stop by Ctrl-C",
            at_s=catch,
            expected="emergency-stop",
            clock=lambda: signalling(catch),
        ),
        Injection(
            name="loop away for 10 ms",
            at_s=catch,
            expected=None,
            clock=lambda: late({catch: 0.010}),
        ),
        Injection(
            name="loop away for 25 ms",
            at_s=catch,
            expected="overrun",
            clock=lambda: late({catch: 0.025}),
        ),
        Injection(
            name="five times 5 ms in 50 ms",
            at_s=catch,
            expected="overrun",
            clock=lambda: late({catch + 0.01 * n: 0.005 for n in range(5)}),
        ),
        Injection(
            name="loop away for 60 ms",
            at_s=catch,
            expected="overrun",
            clock=lambda: late({catch: 0.060}),
        ),
        Injection(
            name="exception in the model",
            at_s=catch,
            expected="controller",
            controller=model(catch, _fail),
        ),
        Injection(
            name="model gives no number",
            at_s=catch,
            expected="model",
            controller=model(catch, lambda _: math.nan),
        ),
        Injection(
            name="model gives nothing",
            at_s=catch,
            expected="model",
            controller=model(catch, lambda _: None),
        ),
        Injection(
            name="model gives 35 N·m",
            at_s=catch,
            expected="torque",
            controller=model(catch, lambda _: 35.0),
        ),
        Injection(
            name="model jumps to 17 N·m",
            at_s=pre,
            expected="torque-rate",
            controller=model(pre, lambda _: 17.0),
        ),
        Injection(name="grip lost in pre-catch", at_s=pre, expected=None, slip=True),
        Injection(name="grip lost in the catch", at_s=catch, expected=None, slip=True),
        Injection(name="grip lost in post-catch", at_s=post, expected=None, slip=True),
        Injection(name="full disk", at_s=catch, expected="process", full_disk=True),
    ]


def outcome(
    injection: Injection,
    folder: pathlib.Path,
    opener: Callable[..., Device] = open_device,
    n_stretches: int = 1,
) -> Outcome:
    """Run a session whose first presentation has the fault, to its end."""
    study, protocol = small_study(folder, injection.speed)
    made = Outcome(name=injection.name)
    devices: list[f.FaultyDevice] = []
    with warnings.catch_warnings(), _injected(injection, opener, devices, n_stretches):
        warnings.simplefilter("ignore", OverrunWarning)
        grades = SimulatedGrades(protocol)
        try:
            run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")
        except OSError as error:
            if error.errno != errno.ENOSPC:
                raise
            run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")
    for device in devices:
        device.inner.close()  # what even the bus that was cut leaves open
    log = read_log(study.log_file("R1", "test"))
    made.events = [event.kind for event in log]
    made.resumes = made.events[-2:] == ["grade", "complete"]
    shown = next(event for event in log if event.kind == "presented")
    path = study.sessions / str(shown.fields["recording"])
    columns = read_recording(path).columns  # checks its checksum
    # Whole: a row for every tick before the fault
    n_before = int(np.sum(columns["time_s"] < injection.at_s - 1e-9))
    made.intact = n_before == round(injection.at_s * 1000)
    noticed = next((event for event in log if event.kind == "fault"), None)
    if noticed is not None:
        made.kind = str(noticed.fields["kind"])
        if injection.full_disk:
            return made  # all went well, until the recording was to be written
        made.held_nm = float(noticed.fields["torque_nm"] or 0.0)
        _take_back(made, injection, devices[0], float(noticed.fields["time_s"] or 0.0))
    elif injection.slip:
        _let_go(made, injection, columns)
    return made


def _take_back(
    made: Outcome, injection: Injection, device: f.FaultyDevice, at_s: float
) -> None:
    made.detected_ms = 1e3 * (at_s - injection.at_s)
    after = [(t, abs(torque)) for t, torque in device.commands if t >= at_s]
    made.peak_nm = max((torque for _, torque in after), default=0.0)
    zeros = [t for t, torque in after if torque == 0.0]
    if math.isfinite(device.let_go_s):
        zeros.append(device.let_go_s)
    else:
        made.peak_nm = made.held_nm  # nobody can take it back
    made.zero_ms = 1e3 * (min(zeros) - at_s) if zeros else math.nan


def _let_go(
    made: Outcome, injection: Injection, columns: dict[str, np.ndarray]
) -> None:
    # The model is back in pre-catch, the torque that of (1): no fault of the device
    made.kind = "released"
    phase, torque = columns["phase"], np.abs(columns["command_torque_nm"])
    slipped = round(injection.at_s * 1000)
    released = slipped + int(np.argmax(phase[slipped:] == 0))
    made.detected_ms = float(released - slipped)
    made.held_nm = float(torque[released - 1])
    made.peak_nm = float(torque[released:].max())


@contextlib.contextmanager
def _injected(
    injection: Injection,
    opener: Callable[..., Device],
    devices: list[f.FaultyDevice],
    n_stretches: int,
) -> Iterator[None]:
    # The first presentation alone gets the fault, and as many stretches
    first = {"device": True, "clock": True, "controller": True}

    def is_first(what: str) -> bool:
        was, first[what] = first[what], False
        return was

    def open_faulty(name: str, **options) -> Device:
        inner = opener(name, **options)
        wrap = injection.wrap if is_first("device") else None
        device = (wrap or f.FaultyDevice)(inner)
        device.open()
        if isinstance(options["clock"], InjectedClock):
            options["clock"].begin()
        devices.append(device)
        return device

    def clock() -> SimulatedClock:
        use = is_first("clock") and injection.clock is not None
        return injection.clock() if use else SimulatedClock()

    def controller(protocol: Protocol, name: str) -> Controller:
        use = is_first("controller") and injection.controller is not None
        return (injection.controller if use else model_controller)(protocol, name)

    written = presenting.write_recording
    disk_is_full = [injection.full_disk]

    def write(recording, path):
        if disk_is_full.pop() if disk_is_full else False:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return written(recording, path)

    with (
        mock.patch.object(presenting, "open_device", open_faulty),
        mock.patch.object(presenting, "model_controller", controller),
        mock.patch.object(presenting, "write_recording", write),
        mock.patch.dict(CLOCKS, {"simulated": clock}),
        _stretching(injection, n_stretches),
    ):
        yield


@contextlib.contextmanager
def _stretching(injection: Injection, n_stretches: int) -> Iterator[None]:
    # The hand of the first presentation slips, and stretches so often
    first = {"hand", "loop"}
    run = presenting.run_presentation

    def hand(**options) -> SimulatedHand:
        if "hand" in first:
            first.remove("hand")
            options["again"] = (options["mean_speed"],) * (n_stretches - 1)
            options["returns"] = n_stretches > 1
            options["slip_time"] = injection.at_s if injection.slip else None
        return SimulatedHand(**options)

    def run_first(*arguments, **options):
        if "loop" in first and n_stretches > 1:
            first.remove("loop")
            options["stretches"] = StretchRules(n=n_stretches)
            options["max_duration_s"] = None
        return run(*arguments, **options)

    with (
        mock.patch.object(presenting, "SimulatedHand", hand),
        mock.patch.object(presenting, "run_presentation", run_first),
    ):
        yield


def small_study(
    folder: pathlib.Path, speed_deg_s: float, *, device: str = ""
) -> tuple[StudyPaths, Protocol]:
    """A study of one model and one rater, with its schedule drawn."""
    study = StudyPaths(folder)
    study.root.mkdir(exist_ok=True)
    text = PROTOCOL.format(speed=speed_deg_s) + device
    study.protocol.write_text(text, encoding="utf-8")
    protocol = read_protocol(study.protocol)
    write_schedules(protocol, study)
    return study, protocol


def row(made: Outcome) -> str:
    """One row of the table in docs/driver.md."""

    def cell(value: float, digits: int) -> str:
        return "" if math.isnan(value) else f"{value:.{digits}f}"

    zero = cell(made.zero_ms, 0)
    if math.isnan(made.zero_ms) and made.kind not in (None, "released", "process"):
        zero = "never"
    cells = [
        made.name,
        made.kind or "let pass",
        cell(made.detected_ms, 0),
        cell(made.held_nm, 1),
        cell(made.peak_nm, 1),
        zero,
        "yes" if made.intact else "no",
        "yes" if made.resumes else "no",
    ]
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    for injection in injections():
        with tempfile.TemporaryDirectory() as folder:
            print(row(outcome(injection, pathlib.Path(folder) / "study")))


if __name__ == "__main__":
    main()

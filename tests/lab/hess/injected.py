"""At least 25 faults, each put into a session, and what came of it.

``python -m tests.lab.hess.injected`` writes docs/evidence/driver_faults.csv.
"""

import contextlib
import errno
import math
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
from masrel.lab._event_log import read_log
from masrel.lab.hess import (
    Clock,
    Controller,
    Device,
    SimulatedHand,
    StretchRules,
    open_device,
    run_presentation,
)
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.recording import read_recording, write_recording
from masrel.lab.run._settings import model_controller
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.schedule.sheets import write_schedules

from . import faults as f
from .rig import ActingClock, missing

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
TABLE = pathlib.Path(__file__).parents[3] / "docs/evidence/driver_faults.csv"


def later_s(stretch: int, speed_deg_s: float = 92.0) -> float:
    """Return how long after the first the simulated hand begins a stretch, s."""
    # 118.5 deg there and, at 60 deg/s, back: half the ramps, and a rest after each
    there_and_back = 118.5 / speed_deg_s + 0.06 + 118.5 / 60.0 + 0.1 + 2.0 * 0.3
    return round((stretch - 1) * there_and_back, 3)


Wrap = Callable[[Device, Clock], f.FaultyDevice]


@dataclass(frozen=True, kw_only=True)
class Injection:
    """One fault: where it is put, and what is expected of it."""

    name: str
    at_s: float
    expected: str | None  # kind of fault; None where it is let pass
    wrap: Wrap | None = None
    acts: dict = field(default_factory=dict)  # of an `ActingClock`
    model: Callable[[float], float] | None = None  # what it makes of its torque
    slip: bool = False
    full_disk: bool = False
    speed: float = 92.0

    def first(self, n_stretches: int) -> dict[str, object]:
        """Return what the first presentation has that others have not."""
        again = (radians(self.speed),) * (n_stretches - 1)
        slips = self.at_s if self.slip else None
        rules = {"stretches": StretchRules(n=n_stretches), "max_duration_s": None}
        return {
            "wrap": self.wrap or f.FaultyDevice,
            "acts": self.acts,
            "model": self.model,
            "full_disk": self.full_disk,
            "hand": {"again": again, "returns": bool(again), "slip_time": slips},
            "loop": rules if again else {},
        }


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


def faulty(**faults) -> Wrap:
    return lambda inner, clock: f.FaultyDevice(inner, clock, **faults)


def reading(fault: f.ReadFault) -> Wrap:
    return faulty(read_fault=fault)


def sending(fault: f.SendFault) -> Wrap:
    return faulty(send_fault=fault)


class Wrong:
    """A joint model that goes wrong at a time; else like the one it stands for."""

    def __init__(self, joint, at_s: float, act: Callable[[float], float]) -> None:
        self.joint, self.at_s, self.act = joint, at_s, act

    def __getattr__(self, name: str):
        return getattr(self.joint, name)

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        torque = self.joint.step(time_s, angle, velocity)
        return torque if time_s < self.at_s - 1e-9 else self.act(torque)


def _fail(_torque: float) -> float:
    raise ZeroDivisionError("float division by zero")


def injections(stretch: int = 1) -> list[Injection]:
    """Return the faults, put into a stretch."""
    pre, catch, post = (at_s + later_s(stretch) for at_s in (PRE, CATCH, POST))
    slow = 4.0 + later_s(stretch, 15.0)

    def device(name: str, at_s: float, expected: str | None, wrap: Wrap, **options):
        return Injection(name=name, at_s=at_s, expected=expected, wrap=wrap, **options)

    def check(error) -> Wrap:
        return faulty(send_fault=f.ignored(catch), check_fault=f.says(catch, error))

    def away(name: str, gaps: dict[float, float], expected: str | None) -> Injection:
        acts = missing(gaps)
        return Injection(name=name, at_s=catch, expected=expected, acts=acts)

    def wrong(name: str, at_s: float, act, expected: str) -> Injection:
        return Injection(name=name, at_s=at_s, expected=expected, model=act)

    def slip(name: str, at_s: float) -> Injection:
        return Injection(name=name, at_s=at_s, expected=None, slip=True)

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
            faulty(send_fault=f.not_taken(catch), cut_s=catch),
        ),
        device("idled from outside", catch, "device", check(f.IDLED)),
        device(
            "emergency stop of the device", catch, "emergency-stop", check(f.STOPPED)
        ),
        Injection(
            name="emergency stop by Ctrl-C",
            at_s=catch,
            expected="emergency-stop",
            acts={catch: lambda _: signal.raise_signal(signal.SIGINT)},
        ),
        away("loop away for 10 ms", {catch: 0.010}, None),
        away("loop away for 25 ms", {catch: 0.025}, "overrun"),
        away(
            "five times 5 ms in 50 ms",
            {catch + 0.01 * n: 0.005 for n in range(5)},
            "overrun",
        ),
        away("loop away for 60 ms", {catch: 0.060}, "overrun"),
        wrong("exception in the model", catch, _fail, "controller"),
        wrong("model gives no number", catch, lambda _: math.nan, "model"),
        wrong("model gives nothing", catch, lambda _: None, "model"),
        wrong("model gives 35 N·m", catch, lambda _: 35.0, "torque"),
        wrong("model jumps to 17 N·m", pre, lambda _: 17.0, "torque-rate"),
        slip("grip lost in pre-catch", pre),
        slip("grip lost in the catch", catch),
        slip("grip lost in post-catch", post),
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
    first: dict = injection.first(n_stretches)

    def open_faulty(name: str, **options) -> Device:
        clock, inner = options["clock"], opener(name, **options)
        device = first.pop("wrap", f.FaultyDevice)(inner, clock)
        device.open()
        clock.begin_ns = clock.now_ns()  # from here on the presentation is timed
        devices.append(device)
        return device

    def clock() -> ActingClock:
        made = ActingClock(first.pop("acts", {}))
        made.begin_ns = math.inf
        return made

    def controller(protocol: Protocol, name: str) -> Controller:
        made = model_controller(protocol, name)
        if (act := first.pop("model", None)) is not None:
            made._joint = Wrong(made._joint, injection.at_s, act)
        return made

    def write(recording, path):
        if first.pop("full_disk", False):
            raise OSError(errno.ENOSPC, "full", str(path))
        return write_recording(recording, path)

    def hand(**options) -> SimulatedHand:
        return SimulatedHand(**options | first.pop("hand", {}))

    def run_first(*arguments, **options):
        return run_presentation(*arguments, **options | first.pop("loop", {}))

    with (
        mock.patch.multiple(
            "masrel.lab.run._present",
            open_device=open_faulty,
            model_controller=controller,
            write_recording=write,
            SimulatedHand=hand,
            run_presentation=run_first,
        ),
        mock.patch.dict("masrel.lab.run._presenter.CLOCKS", {"simulated": clock}),
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


def cell(value: float, digits: int) -> str:
    """One number of a table; nothing where there is none."""
    return "" if math.isnan(value) else f"{value:.{digits}f}"


def row(made: Outcome) -> str:
    """One row of the table of docs/evidence/driver.md."""
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
    return ",".join(cells)


def main() -> None:
    lines = [TABLE.read_text(encoding="utf-8").splitlines()[0]]
    for injection in injections():
        with tempfile.TemporaryDirectory() as folder:
            lines.append(row(outcome(injection, pathlib.Path(folder) / "study")))
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

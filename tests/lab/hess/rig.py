"""A bench for the tests: one presentation, on the simulated device or on a script."""

import math
from collections.abc import Callable, Sequence
from math import radians
from typing import Any, ClassVar

import numpy as np

from masrel.errors import DeviceError, DeviceTimeoutError
from masrel.lab.elbow import STANDARD_MODELS, JointModel
from masrel.lab.hess import (
    BackendOptions,
    Clock,
    Controller,
    Device,
    DeviceLimits,
    Presented,
    Reading,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.recording import Recording

from .faults import FaultyDevice, ReadFault

START, END = radians(30.0), radians(146.0)
LIMITS = DeviceLimits()
MODELS = ("HM1", "HM2", "HM3", "HM4")
PRE_CATCH, CATCH, POST_CATCH = range(3)  # positions in PHASES

Law = Callable[[float, float, float], float]


def stretching(speed_deg_s: float = 92.0, **options: Any) -> SimulatedHand:
    """A clamp that stretches from 30 to 146 deg."""
    way = {"start": START, "end": END, "mean_speed": radians(speed_deg_s)}
    return SimulatedHand(**{**way, **options})


def controls(model: str | JointModel = "HM3", **options: Any) -> Controller:
    joint = STANDARD_MODELS[model] if isinstance(model, str) else model
    return Controller(joint, **{"start_angle": START, **options})


def present(
    model: str | JointModel | Controller = "HM3",
    speed_deg_s: float = 92.0,
    *,
    slip_time: float | None = None,
    hand: Any = None,
    clock: SimulatedClock | None = None,
    read_fault: ReadFault | None = None,
    range_end: float = END,
    backend: BackendOptions | None = None,
    **options: Any,
) -> Presented:
    """Present on the simulated device; `options` are those of the loop."""
    clock = clock or SimulatedClock()
    hand = hand or stretching(speed_deg_s, slip_time=slip_time)
    if not isinstance(model, Controller):
        model = controls(model, start_angle=hand.start)
    inner = open_device(
        "simulated", clock=clock, hand=hand, range_end=range_end, options=backend
    )
    device: Device = inner
    if read_fault is not None:
        device = FaultyDevice(inner, clock, read_fault)
    with inner, device:
        options = {"limits": LIMITS, "end_angle": END, **options}
        return run_presentation(device, model, clock=clock, **options)


class ScriptedDevice(Device):
    """Reads a prescribed angle (rad) of time (s), keeps every command with its time."""

    name: ClassVar[str] = "scripted"
    simulated: ClassVar[bool] = True

    def __init__(
        self, clock: Clock | None = None, angle=lambda _time_s: START, **traits: Any
    ) -> None:
        self.clock = clock or SimulatedClock()
        self.angle = angle
        self.values = lambda _time_s: ()
        self.commands: list[tuple[int, float]] = []
        self.n_reads = 0
        self.late_ns = 0  # how old a reading is
        self.is_lost = lambda _n: False  # whether a reading gets no answer
        self.deaf_after = math.inf
        vars(self).update(traits)

    def _start(self) -> None:
        self.start_ns = self.clock.now_ns()

    def _read(self) -> Reading:
        self.n_reads += 1
        if self.is_lost(self.n_reads - 1):
            raise DeviceTimeoutError("scripted: no answer")
        now_ns = self.clock.now_ns()
        time_s = (now_ns - self.start_ns) * 1e-9
        return Reading(now_ns - self.late_ns, self.angle(time_s), self.values(time_s))

    def _send(self, torque_nm: float) -> None:
        if len(self.commands) >= self.deaf_after:
            raise DeviceTimeoutError("scripted: does not listen")
        self.commands.append((self.clock.now_ns(), torque_nm))

    def _stop(self) -> None:
        self.stopped = True


def scripted(
    angle: Callable[[float], float] = lambda _time_s: START,
    model: str | JointModel | Controller = "HM3",
    *,
    clock: SimulatedClock | None = None,
    device: ScriptedDevice | None = None,
    **options: Any,
) -> tuple[ScriptedDevice, Presented]:
    """Present on a scripted device; `options` are those of the loop."""
    device = device or ScriptedDevice(clock, angle)
    if not isinstance(model, Controller):
        model = controls(model, rate_hz=options.get("rate_hz", 1000))
    options = {"limits": LIMITS, "max_duration_s": 0.02, **options}
    device.open()
    presented = run_presentation(device, model, clock=device.clock, **options)
    device.close()
    return device, presented


def path(points_deg: Sequence[tuple[float, float]]) -> Callable[[float], float]:
    """An arm that goes in straight lines through (time s, angle deg), and trembles."""
    times, angles = zip(*points_deg, strict=True)

    def angle(time_s: float) -> float:
        tremor = 0.02 * math.sin(2.0 * math.pi * 9.0 * time_s)
        return radians(np.interp(time_s, times, angles) + tremor)

    return angle


class Heard:
    """What a watchdog hears, ms; from a time on it has ended."""

    def __init__(self, ends_ms: float = math.inf) -> None:
        self.clock, self.said, self.ends_ms = SimulatedClock(), [], ends_ms

    def beat(self) -> None:
        self.said.append(self.clock.now_ns() * 1e-6)
        if self.said[-1] >= self.ends_ms:
            raise DeviceError("watchdog: has ended")

    def rest(self) -> None:
        self.beat()
        self.said[-1] = "rest"


class Joint:
    """Any law of time, angle and speed, as a model and its own stepper."""

    kind: ClassVar[str] = "test"
    range_end: ClassVar[float] = END
    speed_threshold: ClassVar[float] = radians(20.0)

    def __init__(self, law: Law, *, is_passive: bool = False, phase: int = 0) -> None:
        self.step, self.is_passive, self.phase = law, is_passive, phase
        self.n_releases = 0

    def stepper(self, _start_angle: float) -> "Joint":
        return self

    def release(self) -> None:
        self.n_releases += 1

    def largest_slope(self, **_stretch: float) -> tuple[float, float]:
        return 0.0, 0.0


class ActingClock(SimulatedClock):
    """A simulated clock on which things happen, each once, at some s of the test."""

    def __init__(
        self, acts: dict[float, Callable[["ActingClock"], object]], start_ns: int = 0
    ) -> None:
        super().__init__(start_ns)
        self.acts, self.begin_ns = dict(acts), start_ns

    def miss(self, gap_s: float) -> None:
        super().sleep_until_ns(self.now_ns() + round(gap_s * 1e9))

    def sleep_until_ns(self, deadline_ns: int) -> None:
        super().sleep_until_ns(deadline_ns)
        since_ns = deadline_ns - self.begin_ns
        for at_s in [at for at in self.acts if since_ns >= round(at * 1e9)]:
            self.acts.pop(at_s)(self)


def missing(gaps: dict[float, float]) -> dict[float, Callable[[ActingClock], None]]:
    """A machine that is away for some s at chosen times."""
    return {at: lambda clock, gap=gap: clock.miss(gap) for at, gap in gaps.items()}


def law_of(
    model: JointModel, recording: Recording, velocity: np.ndarray | None = None
) -> np.ndarray:
    """What a model asks for, N·m, where it is fed what was read (n_samples,)."""
    return law_and_phases(model, recording, velocity)[0]


def law_and_phases(
    model: JointModel, recording: Recording, velocity: np.ndarray | None = None
) -> np.ndarray:
    """The same, and the phases it is in (2, n_samples)."""
    columns = recording.columns
    angle = np.rint(columns["angle_deg"] / 0.005) * radians(0.005)  # as it was read
    if velocity is None:
        velocity = np.radians(columns["velocity_deg_s"])
    joint = model.stepper(START)
    samples = zip(columns["time_s"], angle, velocity, strict=True)
    return np.array([(joint.step(*now), joint.phase) for now in samples]).T


def same_columns(one: Recording, other: Recording, n: int | None = None) -> bool:
    """Whether the first samples are the same to the last bit."""
    return all(
        column[:n].tobytes() == other.columns[name][:n].tobytes()
        for name, column in one.columns.items()
    )


def assert_straight_ramp(presented: Presented, kind: str) -> None:
    """After a fault the torque goes in a straight line to zero within 50 ms."""
    fault, columns = presented.fault, presented.recording.columns
    assert fault is not None
    assert fault.kind == kind
    since = columns["time_s"] - fault.time_s
    ramp = since > -1e-9
    line = fault.torque_nm * (1.0 - since[ramp] / 0.05)
    np.testing.assert_allclose(columns["command_torque_nm"][ramp], line, atol=1e-6)
    assert fault.torque_nm == 0.0 or abs(since[-1] - 0.05) < 1e-6
    assert abs(columns["command_torque_nm"][-1]) < 1e-9

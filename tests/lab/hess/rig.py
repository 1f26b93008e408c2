"""A bench for the tests: one presentation on the simulated device, and bad devices."""

import math
from math import radians
from typing import ClassVar

from masrel.errors import DeviceTimeoutError
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
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

START, END = radians(30.0), radians(146.0)
LIMITS = DeviceLimits(torque=20.0, speed=radians(400.0), missed_ticks=20)


def present(
    model: str,
    speed_deg_s: float,
    *,
    slip_time: float | None = None,
    limits: DeviceLimits = LIMITS,
    max_duration_s: float = 10.0,
    start_ns: int = 0,
) -> Presented:
    clock = SimulatedClock(start_ns)
    hand = SimulatedHand(
        start=START, end=END, mean_speed=radians(speed_deg_s), slip_time=slip_time
    )
    controller = Controller(STANDARD_MODELS[model], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand) as device:
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=limits,
            max_duration_s=max_duration_s,
            end_angle=END,
        )


class ScriptedDevice(Device):
    """Reads a prescribed angle (rad) of time (s), keeps every command with its time."""

    name: ClassVar[str] = "scripted"
    simulated: ClassVar[bool] = True

    def __init__(self, clock: SimulatedClock, angle=lambda _time_s: START) -> None:
        self.clock = clock
        self.angle = angle
        self.values = lambda _time_s: ()
        self.commands: list[tuple[int, float]] = []
        self.n_reads = 0
        self.silent_after = math.inf
        self.deaf_after = math.inf

    def _start(self) -> None:
        self.start_ns = self.clock.now_ns()

    def _read(self) -> Reading:
        self.n_reads += 1
        if self.n_reads > self.silent_after:
            raise DeviceTimeoutError("scripted: no answer")
        now_ns = self.clock.now_ns()
        time_s = (now_ns - self.start_ns) * 1e-9
        return Reading(now_ns, self.angle(time_s), self.values(time_s))

    def _send(self, torque_nm: float) -> None:
        if len(self.commands) >= self.deaf_after:
            raise DeviceTimeoutError("scripted: does not listen")
        self.commands.append((self.clock.now_ns(), torque_nm))

    def _stop(self) -> None:
        self.stopped = True

"""A device that fails on purpose: faults of readings and commands, at a chosen time.

It stands around any other device, whichever backend: what is wrong on a bus itself is
the matter of that bus' own emulator.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from math import radians
from typing import ClassVar

from masrel.errors import DeviceError, DeviceTimeoutError, EmergencyStopError
from masrel.lab.hess import Clock, Device, Reading

# Since the first reading: time s, the true reading -> what the loop gets
ReadFault = Callable[[float, Reading], Reading]
# Since the first reading: time s, torque -> what the device gets, or None for nothing
SendFault = Callable[[float, float], float | None]


@dataclass
class FaultyDevice(Device):
    """Reads and commands another device through faults."""

    inner: Device
    clock: Clock
    read_fault: ReadFault | None = None
    send_fault: SendFault | None = None
    check_fault: Callable[[float], None] | None = None
    cut_s: float = math.inf  # from then on it cannot even be let go
    commands: list[tuple[float, float]] = field(default_factory=list)  # s, N·m
    let_go_s: float = math.nan

    name: ClassVar[str] = "simulated"  # what the log and the loop shall see
    simulated: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self.start_ns: int | None = None
        self.time_s = 0.0

    def _start(self) -> None:
        self.inner.open()

    def _read(self) -> Reading:
        reading = self.inner.read()
        if self.start_ns is None:
            self.start_ns = reading.time_ns
        self.time_s = (reading.time_ns - self.start_ns) * 1e-9
        if self.read_fault is not None:
            reading = self.read_fault(self.time_s, reading)
        return reading

    def _send(self, torque_nm: float) -> None:
        if self.start_ns is not None:  # commands come between readings, too
            self.time_s = (self.clock.now_ns() - self.start_ns) * 1e-9
        torque: float | None = torque_nm
        if self.send_fault is not None:
            torque = self.send_fault(self.time_s, torque_nm)
        if torque is not None:
            self.commands.append((self.time_s, torque))
            self.inner.command(torque)

    def _check(self) -> None:
        if self.check_fault is not None:
            self.check_fault(self.time_s)

    def _stop(self) -> None:
        if self.time_s >= self.cut_s - 1e-9:
            raise DeviceTimeoutError("nobody is there to be idled")
        self.let_go_s = self.time_s
        self.inner.close()


def changed(
    start_s: float,
    change: Callable[[int, list[Reading]], Reading],
    n: float = math.inf,
) -> ReadFault:
    """Change the first n readings from a time on: which one it is, and all so far."""
    seen: list[Reading] = []
    count = 0

    def fault(time_s: float, reading: Reading) -> Reading:
        nonlocal count
        seen.append(reading)
        if time_s < start_s - 1e-9 or count >= n:
            return reading
        count += 1
        return change(count, seen)

    return fault


def dropped(start_s: float, n: float = math.inf, every: int = 1) -> ReadFault:
    """No answer to the first of every so many of n readings from a time on."""

    def change(count: int, seen: list[Reading]) -> Reading:
        if count % every == 1 % every:
            raise DeviceTimeoutError("no answer within a period")
        return seen[-1]

    return changed(start_s, change, n)


def late(start_s: float, by_s: float, n: float = math.inf) -> ReadFault:
    """Readings that are older by some time; the newest that can be there."""

    def change(_count: int, seen: list[Reading]) -> Reading:
        newest_ns = seen[-1].time_ns - round(by_s * 1e9)
        return next((r for r in reversed(seen) if r.time_ns <= newest_ns), seen[0])

    return changed(start_s, change, n)


def before(count: int, seen: list[Reading]) -> Reading:
    """The last reading before the fault."""
    return seen[max(0, len(seen) - 1 - count)]


def repeated(start_s: float, n: float = math.inf) -> ReadFault:
    """The last reading once more, time and all."""
    return changed(start_s, before, n)


def frozen(start_s: float) -> ReadFault:
    """One angle for ever, with the right times."""
    return changed(
        start_s, lambda n, seen: seen[-1]._replace(angle=before(n, seen).angle)
    )


def shifted(start_s: float, by: float, n: float = math.inf) -> ReadFault:
    """Angles that are off by some rad, n times or from then on."""
    return changed(
        start_s, lambda _, seen: seen[-1]._replace(angle=seen[-1].angle + by), n
    )


def early(start_s: float, by_s: float) -> ReadFault:
    """Readings from the future: a clock of its own that has run away."""
    by_ns = round(by_s * 1e9)
    return changed(
        start_s, lambda _, seen: seen[-1]._replace(time_ns=seen[-1].time_ns + by_ns)
    )


def drifting(start_s: float, rate: float) -> ReadFault:
    """An encoder that gains some rad/s on the arm."""

    def fault(time_s: float, reading: Reading) -> Reading:
        gained = rate * max(0.0, time_s - start_s)
        return reading._replace(angle=reading.angle + gained)

    return fault


def refused(start_s: float, error: Exception, n: float = math.inf) -> SendFault:
    """Sending n torques raises an error, from a time on."""
    count = 0

    def fault(time_s: float, torque: float) -> float | None:
        nonlocal count
        if time_s >= start_s - 1e-9 and count < n:
            count += 1
            raise error
        return torque

    return fault


def not_taken(start_s: float, n: float = math.inf) -> SendFault:
    """The device refuses n torques from a time on."""
    error = DeviceTimeoutError("the torque was not taken within a period")
    return refused(start_s, error, n)


def ignored(start_s: float) -> SendFault:
    """The device was idled from outside: it follows no torque and holds none."""
    return lambda time_s, torque: torque if time_s < start_s - 1e-9 else 0.0


def says(start_s: float, error: Exception) -> Callable[..., Reading]:
    """Its state is asked for, or a reading, and from a time on it raises an error."""

    def fault(time_s: float, reading: Reading | None = None) -> Reading | None:
        if time_s >= start_s - 1e-9:
            raise error
        return reading

    return fault


IDLED = DeviceError("the device is not in torque mode any more")
BUS_OFF = DeviceError("the bus is off")
STOPPED = EmergencyStopError("emergency stop: the pendant of the device")
WRAP = -2.0 * math.pi * 2**22 / (4096 * 18.8)  # 22 bits of counts at the elbow, rad
JUMP = radians(1.0)

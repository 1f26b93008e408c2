"""A device in a file that two processes share: what one commands, the other can idle.

Like an amplifier it holds its last torque for ever, whoever sent it. ``python -m
tests.lab.hess.shared FILE SECONDS`` presents on it, watched by a watchdog.
"""

import mmap
import struct
import sys
import time
from collections.abc import Callable
from math import radians
from pathlib import Path
from typing import ClassVar

from masrel.lab.hess import (
    Device,
    DeviceLimits,
    IdleCommand,
    Reading,
    RealClock,
    run_presentation,
)
from masrel.lab.hess._stop import (
    WATCHDOG,
    Watchdog,
    stop_on_key,
    stop_on_signals,
    watch,
    watched,
)

from .rig import START, controls

__all__ = [
    "WATCHDOG",
    "SharedDevice",
    "SharedFile",
    "Watchdog",
    "made",
    "stop_on_key",
    "stop_on_signals",
    "watch",
    "watched",
]

FORMAT = "=dqq"  # torque N·m; when it was sent or idled, ns; mode: 1 torque, 0 idle
SIZE = struct.calcsize(FORMAT)


class SharedFile:
    def __init__(self, path: Path) -> None:
        with path.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), SIZE)

    def write(self, torque: float, mode: int) -> None:
        self._map[:] = struct.pack(FORMAT, torque, time.monotonic_ns(), mode)

    def read(self) -> tuple[float, int, int]:
        return struct.unpack(FORMAT, self._map[:])


def made(path: Path) -> SharedFile:
    path.write_bytes(bytes(SIZE))
    return SharedFile(path)


class SharedDevice(Device):
    """An arm that goes from 30 deg on at 40 deg/s, whatever the torque."""

    name: ClassVar[str] = "shared"
    simulated: ClassVar[bool] = True

    def __init__(self, path: Path) -> None:
        self.path = path
        self.start_ns = 0

    def _start(self) -> None:
        self.file = SharedFile(self.path)
        self.file.write(0.0, 1)
        self.start_ns = time.monotonic_ns()

    def _read(self) -> Reading:
        now_ns = time.monotonic_ns()
        return Reading(now_ns, START + radians(40.0) * (now_ns - self.start_ns) * 1e-9)

    def _send(self, torque_nm: float) -> None:
        self.file.write(torque_nm, 1)

    def _stop(self) -> None:
        self.file.write(0.0, 0)

    def idle_command(self) -> IdleCommand:
        return IdleCommand("tests.lab.hess.shared", (str(self.path),))


def prepare(path: str) -> Callable[[], None]:
    """What the watchdog's process calls."""
    file = SharedFile(Path(path))
    return lambda: file.write(0.0, 0)


def main() -> None:
    path, duration_s = Path(sys.argv[1]), float(sys.argv[2])
    with SharedDevice(path) as device, watched(device, 0.05) as watchdog:
        run_presentation(
            device,
            controls("HM4"),
            clock=RealClock(),
            limits=DeviceLimits(missed_ticks=10_000),
            max_duration_s=duration_s,
            watchdog=watchdog,
        )


if __name__ == "__main__":
    main()

"""A watchdog: a small process that idles the device when this one falls silent.

An amplifier may hold its last torque for ever, so a control loop that was killed must
not be the only one who can take it back.
"""

import contextlib
import os
import select
import subprocess
import sys
from types import TracebackType
from typing import IO, Protocol, Self

from masrel.errors import DeviceError
from masrel.lab.hess.device import Device, IdleCommand

_READY_AFTER_S = 20.0  # a Python that starts, or ends, on a busy machine


class Watching(Protocol):
    """What the control loop tells that it is alive."""

    def beat(self) -> None:
        """Tell it now, and again before its time is over."""

    def rest(self) -> None:
        """Tell it that no beat follows for a while, and none is missed."""


class NoWatchdog:
    """Nobody watches: for a device that nothing else can reach."""

    def beat(self) -> None:
        """Tell nobody."""

    def rest(self) -> None:
        """Tell nobody."""


class Watchdog:
    """The process, as the control loop sees it: something to tell that it is alive."""

    # A context manager. The process idles the device when a `beat` is followed by
    # neither another nor `rest` for `timeout_s`, and when this process has ended,
    # however it ended.

    def __init__(self, idle: IdleCommand, timeout_s: float) -> None:
        self._idle = idle
        self._timeout_s = timeout_s
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe = -1

    def __enter__(self) -> Self:
        command = (
            sys.executable,
            "-m",
            "masrel.lab.hess._watchdog_process",
            repr(self._timeout_s),
            self._idle.module,
            *self._idle.arguments,
        )
        # In a session of its own, so that Ctrl-C does not reach it
        self._process = process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        if process.stdin is None or process.stdout is None:
            raise DeviceError("watchdog: needs pipes, got none")
        self._wait_until_ready(process, process.stdout)
        self._pipe = process.stdin.fileno()
        os.set_blocking(self._pipe, False)
        return self

    def _wait_until_ready(
        self, process: subprocess.Popen[bytes], output: IO[bytes]
    ) -> None:
        name = " ".join((self._idle.module, *self._idle.arguments))
        ready, _, _ = select.select([output], [], [], _READY_AFTER_S)
        if not ready:
            process.kill()
            self._reap()
            raise DeviceError(
                f"watchdog: needs a process that is ready within {_READY_AFTER_S:g} s, "
                f"{name} is not"
            )
        if output.readline() != b"ready\n":
            self._reap()
            raise DeviceError(
                f"watchdog: needs a process that can idle the device, {name} "
                f"ended with {process.returncode}"
            )

    def beat(self) -> None:
        """Tell the process that this one is alive and will say so again in time."""
        self._send(b".")

    def rest(self) -> None:
        """Tell the process that no beat follows for a while."""
        self._send(b"p")

    def _send(self, message: bytes) -> None:
        try:
            os.write(self._pipe, message)
        except BlockingIOError:
            return  # full of beats that it has not read: it is slow, not silent
        except OSError as error:
            raise DeviceError(f"watchdog: has ended ({error.strerror})") from error

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._process is not None and self._process.poll() is None:
            os.set_blocking(self._pipe, True)
            with contextlib.suppress(BrokenPipeError):  # it has just ended
                os.write(self._pipe, b"q")  # all is well: nothing to idle
        self._reap()

    def _reap(self) -> None:
        process = self._process
        if process is None:
            return
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()
        try:
            process.wait(_READY_AFTER_S)
        except subprocess.TimeoutExpired:
            process.kill()  # it has been told that there is nothing to idle
            process.wait()


def watched(device: Device, timeout_s: float) -> Watchdog | None:
    """Make a watchdog for a device, unless no other process can idle it."""
    idle = device.idle_command()
    return None if idle is None else Watchdog(idle, timeout_s)

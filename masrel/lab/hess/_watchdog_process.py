"""The process of a watchdog: waits for beats, idles the device when they stop.

``python -m masrel.lab.hess._watchdog_process TIMEOUT_S MODULE ARGUMENT...`` reads beats
from its standard input. It ends with 0 when it is told that all is well, with 3 after
it has idled the device, and with 1 and a sentence when it cannot.
"""

import contextlib
import importlib
import os
import select
import signal
import sys
from collections.abc import Callable

from masrel.errors import DeviceError
from masrel.lab.hess._clock import off_the_loop

_FAILED, _IDLED = 1, 3
_TRIES = 5  # a bus that fails once may work a moment later
_PRIORITY = 81  # above that of the loop, which may be what hangs


def main(arguments: list[str]) -> int:
    """Take hold of the device, say so, and watch -> exit code."""
    # Whoever stops the loop must not stop this first; it ends when its input does.
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if sys.platform == "linux":
        with contextlib.suppress(OSError):  # not permitted: as it is, then
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    timeout_s, module, *idle_arguments = arguments
    with off_the_loop():
        return _hold(float(timeout_s), module, idle_arguments)


def _hold(timeout_s: float, module: str, idle_arguments: list[str]) -> int:
    try:
        idle: Callable[[], None] = importlib.import_module(module).prepare(
            *idle_arguments
        )
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        return watch(0, timeout_s, idle)
    except DeviceError as error:
        sys.stderr.write(f"watchdog: {error}\n")
        return _FAILED


def watch(pipe: int, timeout_s: float, idle: Callable[[], None]) -> int:
    """Wait for beats until they stop or all is well -> exit code."""
    patience: float | None = None  # until the first beat
    while True:
        ready, _, _ = select.select([pipe], [], [], patience)
        beats = os.read(pipe, 65536) if ready else b""
        if b"q" in beats:
            return 0
        if not beats:  # silence, or nobody is there any more
            break
        patience = None if beats.endswith(b"p") else timeout_s
    for attempt in range(_TRIES):
        try:
            idle()
        except DeviceError:
            if attempt == _TRIES - 1:
                raise
        else:
            break
    return _IDLED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

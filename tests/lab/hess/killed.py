"""A loop that is killed or hangs, and how soon its watchdog has idled the device.

``python -m tests.lab.hess.killed N`` kills and stops it N times each, and prints
how long the torque stood.
"""

import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from .shared import made

PATIENCE_S = 30.0
LEAST_NM = 2.0


def torque_stood_ms(how: signal.Signals, path: Path) -> tuple[float, float]:
    """Send a signal to a loop at work -> torque then, N·m; how long it stood, ms."""
    for _ in range(10):
        torque, stood_ms = _signalled(how, path)
        # On busy cores a loop may be away for longer than its watchdog waits, and be
        # idled before the signal comes: then there was nothing to take back.
        if torque > 0.0:
            break
    return torque, stood_ms


def _signalled(how: signal.Signals, path: Path) -> tuple[float, float]:
    file = made(path)
    command = [
        sys.executable,
        "-W",
        "ignore",
        "-m",
        "tests.lab.hess.shared",
        str(path),
        "9",
    ]
    loop = subprocess.Popen(command)
    try:
        until = time.monotonic() + PATIENCE_S
        while file.read()[0] < LEAST_NM:
            if loop.poll() is not None or time.monotonic() > until:
                return 0.0, 0.0  # it was idled, or ended, before it had any
            time.sleep(0.002)
        sent_ns = time.monotonic_ns()
        os.kill(loop.pid, how)
        torque = file.read()[0]
        while (state := file.read())[2] != 0:
            if time.monotonic() > until:
                raise AssertionError(f"{state[0]} N·m stand for ever")
            time.sleep(0.0005)
        return torque, (state[1] - sent_ns) * 1e-6
    finally:
        loop.kill()
        loop.wait()


def main() -> None:
    n = int(sys.argv[1])
    for how in (signal.SIGKILL, signal.SIGSTOP):
        stood = []
        for _ in range(n):
            with tempfile.TemporaryDirectory() as folder:
                stood.append(torque_stood_ms(how, Path(folder) / "device")[1])
        print(
            f"{how.name}: median {statistics.median(stood):.1f} ms, "
            f"largest {max(stood):.1f} ms of {n}"
        )


if __name__ == "__main__":
    main()

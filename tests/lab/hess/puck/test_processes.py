"""A loop that is killed, on buses that two processes can share; and python-can.

python-can's bus inside a process cannot be shared; its multicast bus can, and so can
SocketCAN's virtual device where the kernel has one.

``python -m tests.lab.hess.puck.test_processes N`` kills and stops a loop N times each,
on the multicast bus, and prints how long the puck stayed in torque mode.
"""

import os
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import radians

import pytest

from masrel.errors import BusError
from masrel.lab.hess import RealClock, SimulatedClock, open_device
from masrel.lab.hess.puck import EmulatorOptions, PuckOptions
from tests.lab.hess.puck.rig import END, PuckEmulator, loose, open_link, opened

TIMEOUT_S = 0.1
# A watchdog notices silence after its timeout, or the end of the pipe at once; then it
# has to be scheduled on a busy machine, and sends two frames.
LONGEST_S = 2.0

# What is killed: a loop that beats and holds 1 N·m, bound for its next tick
LOOP = """
import sys, time
from masrel.lab.hess import RealClock, open_device
from masrel.lab.hess.puck import PuckOptions
from masrel.lab.hess._stop import watched

options = PuckOptions(interface=sys.argv[1], channel=sys.argv[2], patience_s=1.0)
device = open_device("puck", clock=RealClock(), options=options)
watchdog = watched(device, float(sys.argv[3])) if sys.argv[4] == "watched" else None
if watchdog is not None:
    watchdog.__enter__()
while True:
    device.read()
    device.command(1.0)
    if watchdog is not None:
        watchdog.beat()
    print("tick", flush=True)
    time.sleep(0.005)
"""


def channel_of(interface: str) -> str:
    if interface == "socketcan":
        return "vcan0"
    return f"239.74.163.2:{20_000 + os.getpid() % 40_000}"  # of this run alone


@pytest.fixture(params=["udp_multicast", "socketcan"])
def bus(request: pytest.FixtureRequest) -> Iterator[tuple[str, str, PuckEmulator]]:
    try:
        open_link(request.param, channel_of(request.param), clock=RealClock()).close()
    except BusError as error:
        pytest.skip(f"two processes can share no such bus here: {error}")
    with served(request.param) as made:
        yield made


@contextmanager
def served(interface: str) -> Iterator[tuple[str, str, PuckEmulator]]:
    """A bus with an emulated puck on it that is served by a thread."""
    channel = channel_of(interface)
    clock = RealClock()
    link = open_link(interface, channel, clock=clock)
    emulator = PuckEmulator(
        link=link,
        clock=clock,
        hand=loose(),
        range_end=END,
        options=EmulatorOptions(awake=True),
    )
    stop = threading.Event()

    def serve() -> None:
        while not stop.wait(0.0001):
            emulator.serve()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield interface, channel, emulator
    finally:
        stop.set()
        thread.join()
        emulator.close()


def started(interface: str, channel: str, how: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", LOOP, interface, channel, str(TIMEOUT_S), how]
    for _ in range(3):  # a busy machine may not answer in time as it is brought up
        loop = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert loop.stdout is not None
        if [loop.stdout.readline() for _ in range(20)] == ["tick\n"] * 20:
            return loop
        end(loop)
    raise AssertionError("the loop never came to 20 ticks: what it says is above")


def end(loop: subprocess.Popen[str]) -> None:
    loop.kill()
    loop.wait()
    if loop.stdout is not None:
        loop.stdout.close()


def idle_after_s(emulator: PuckEmulator, patience_s: float) -> float | None:
    begun = time.monotonic()
    while time.monotonic() - begun < patience_s:
        if emulator.mode == 0:
            return time.monotonic() - begun
        time.sleep(0.001)
    return None


def idled_after_s(
    bus: tuple[str, str, PuckEmulator], blow: signal.Signals
) -> float | None:
    """Send a signal to a watched loop -> how long its torque stood."""
    interface, channel, emulator = bus
    loop = started(interface, channel, "watched")
    try:
        assert emulator.torque == -144  # 1 N·m
        os.kill(loop.pid, blow)
        return idle_after_s(emulator, LONGEST_S)
    finally:
        end(loop)


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGSTOP])
def test_a_watchdog_idles_the_puck_of_a_loop_that_is_killed_or_hangs(
    bus: tuple[str, str, PuckEmulator], blow: signal.Signals
) -> None:
    assert idled_after_s(bus, blow) is not None
    _, _, emulator = bus
    assert emulator.torque == 0


def test_without_a_watchdog_the_puck_holds_its_torque(
    bus: tuple[str, str, PuckEmulator],
) -> None:
    interface, channel, emulator = bus
    loop = started(interface, channel, "alone")
    end(loop)
    assert idle_after_s(emulator, 0.5) is None
    assert emulator.torque == -144
    assert emulator.mode == 2


def test_the_next_driver_begins_with_zero_torque(
    bus: tuple[str, str, PuckEmulator],
) -> None:
    interface, channel, emulator = bus
    end(started(interface, channel, "alone"))
    options = PuckOptions(interface=interface, channel=channel, patience_s=1.0)
    with open_device("puck", clock=RealClock(), options=options) as device:
        assert emulator.torque == 0
        assert device.simulated
        assert device.read().angle == pytest.approx(radians(60.0), abs=radians(60.0))
    assert emulator.mode == 0


def test_a_bus_inside_the_process_has_no_watchdog() -> None:
    with opened(SimulatedClock(), loose()) as device:
        assert device.idle_command() is None


# What needs python-can, and what does without


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(
    "code",
    [
        "import masrel.lab.hess.puck",
        "import masrel.lab.hess._can",
        "from masrel.lab.hess.puck import fit_friction, steady_runs",
        "from masrel.lab.hess.puck import PuckOptions; PuckOptions()",
        "from masrel.cli import cli\ntry: cli(['device', '-h'])\nexcept SystemExit: 0",
    ],
)
def test_names_options_codec_and_help_load_no_python_can(code: str) -> None:
    done = run(f"{code}\nimport sys\nsys.exit('can' in sys.modules)")
    assert done.returncode == 0, done.stderr


def test_without_python_can_a_puck_says_what_to_install() -> None:
    code = (
        "import sys\n"
        "sys.modules['can'] = None\n"  # as if it were not there
        "sys.argv = ['masrel', 'device', 'probe']\n"
        "from masrel.cli import main\n"
        "main()"
    )
    done = run(code)
    assert done.returncode == 1
    assert done.stderr == (
        "masrel: puck: needs python-can; install it with: pip install 'masrel[can]'\n"
    )


if __name__ == "__main__":
    for blow in (signal.SIGKILL, signal.SIGSTOP):
        times_ms = []
        for _ in range(int(sys.argv[1])):
            with served("udp_multicast") as made:
                idle = idled_after_s(made, blow)
                times_ms.append(1e3 * (LONGEST_S if idle is None else idle))
        median_ms = statistics.median(times_ms)
        print(f"{blow.name}: median {median_ms:.0f} ms, most {max(times_ms):.0f} ms")

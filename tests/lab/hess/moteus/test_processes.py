"""An emulated moteus in a process of its own, and a loop that is killed."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from math import degrees, radians

import pytest

from masrel.errors import BusError, DeviceTimeoutError
from masrel.lab.hess import (
    Device,
    DeviceLimits,
    RealClock,
    open_device,
    run_presentation,
)
from masrel.lab.hess.moteus import MoteusOptions, connected
from tests.lab.hess.moteus.rig import loose
from tests.lab.hess.rig import END, MODELS, controls

# What is killed: a loop that beats and holds 0.2 N·m
LOOP = """
import sys, time
from masrel.lab.hess import RealClock, open_device
from masrel.lab.hess.moteus import MoteusOptions
from masrel.lab.hess._stop import watched

where = {"interface": "udp_multicast", "channel": sys.argv[1]}
options = MoteusOptions(**where, patience_s=1.0, watchdog_ms=100.0)
device = open_device("moteus", clock=RealClock(), options=options)
watchdog = watched(device, 0.05) if sys.argv[2] == "watched" else None
if watchdog is not None:
    watchdog.__enter__()
torque = 0.0
while True:
    device.read()
    device.command(torque)
    if watchdog is not None:
        watchdog.beat()
    torque = 0.2
    print("tick", flush=True)
    time.sleep(0.002)
"""


@pytest.fixture
def options() -> MoteusOptions:
    channel = f"239.74.163.2:{20_000 + os.getpid() % 40_000}"  # of this run alone
    where = {"interface": "udp_multicast", "channel": channel}
    made = MoteusOptions(**where, patience_s=1.0, watchdog_ms=100.0)
    try:
        made.open_link(RealClock()).close()
    except BusError as error:
        pytest.skip(f"two processes can share no such bus here: {error}")
    return made


@pytest.fixture
def emulator(options: MoteusOptions) -> Iterator:
    stop = threading.Event()
    with connected(options, clock=RealClock(), hand=loose()) as link:
        thread = threading.Thread(target=link.peer.run, args=(stop.is_set,))
        thread.start()
        try:
            yield link.peer
        finally:
            stop.set()
            thread.join()


def comes_to(emulator, *modes: int, within_s: float = 3.0) -> bool:
    end = time.monotonic() + within_s
    while emulator.mode not in modes and time.monotonic() < end:
        time.sleep(0.001)
    return emulator.mode in modes


@pytest.mark.parametrize(
    ("blow", "how", "modes"),
    [
        (signal.SIGKILL, "alone", (11,)),  # its own watchdog lets go
        # the watchdog's process stops it
        pytest.param(signal.SIGKILL, "watched", (0,), marks=pytest.mark.slow),
    ],
)
def test_a_loop_that_is_killed_or_hangs_leaves_no_torque(
    options: MoteusOptions, emulator, blow, how: str, modes: tuple[int, ...]
) -> None:
    command = [sys.executable, "-c", LOOP, options.channel, how]
    for _ in range(3):  # a busy machine may not answer in time as it is brought up
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as loop:
            try:
                assert loop.stdout is not None
                if all(loop.stdout.readline() == "tick\n" for _ in range(20)):
                    os.kill(loop.pid, blow)
                    assert comes_to(emulator, *modes)
                    assert emulator.torques[-1][1] == 0.0
                    return
            finally:
                loop.kill()
    raise AssertionError("the loop never came to 20 ticks: what it says is above")


def opened_soon(options: MoteusOptions) -> Device:
    for _ in range(2):
        with suppress(DeviceTimeoutError):
            return open_device("moteus", clock=RealClock(), options=options)
    return open_device("moteus", clock=RealClock(), options=options)


def test_one_in_a_process_of_its_own_is_driven_over_the_bus(
    options: MoteusOptions,
) -> None:
    where = ("--interface", options.interface, "--channel", options.channel)
    command = ("-m", "masrel", "device", "emulate", "--device", "moteus", *where)
    with subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.PIPE, text=True
    ) as other:
        try:
            assert other.stdout is not None
            assert other.stdout.readline().startswith("an emulated moteus is on")
            with opened_soon(options) as device:
                assert device.simulated
                assert device.idle_command() is not None
                begun = degrees(device.read().angle)
                for _ in range(300):
                    device.command(-1.0)
                    angle = degrees(device.read().angle)
                assert begun == pytest.approx(60.0, abs=0.01)
                assert angle > begun + 1.0
        finally:
            other.send_signal(signal.SIGINT)
        assert other.wait(10.0) == 0


# A moteus whose arm a hand stretches, for one presentation of a loop in real time
SERVED = """
import sys
from masrel.lab.hess import RealClock
from masrel.lab.hess.moteus import MoteusOptions, connected
from tests.lab.hess.rig import stretching

options = MoteusOptions(interface="udp_multicast", channel=sys.argv[1])
with connected(options, clock=RealClock(), hand=stretching(92.0)) as link:
    print("ready", flush=True)
    link.peer.run(lambda: False)
"""


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")
def test_300_presentations_in_real_time_over_the_bus(options: MoteusOptions) -> None:
    # No limits on the lateness of a machine that does other things, too
    late = {"missed_ticks": 10_000, "missed_replies": 20, "missed_replies_per_100": 100}
    late |= {"stale_time": 0.05, "watchdog_time": 0.1, "jump_angle": radians(5.0)}
    late |= {"frozen_time": 0.1}
    limits = DeviceLimits(**late, torque_rate=1e6, speed=radians(5000.0))
    missed = []
    for number in range(300):
        command = [sys.executable, "-c", SERVED, options.channel]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as other:
            try:
                assert other.stdout is not None
                assert other.stdout.readline() == "ready\n"
                clock = RealClock()
                with open_device("moteus", clock=clock, options=options) as device:
                    done = run_presentation(
                        device,
                        controls(MODELS[number % 4]),
                        clock=clock,
                        limits=limits,
                        end_angle=END,
                    )
            finally:
                other.kill()
        assert done.fault is None, (number, done.fault)
        missed.append(done.n_missed_ticks)
    print(f"missed ticks: {sum(missed)}, at most {max(missed)} in one")

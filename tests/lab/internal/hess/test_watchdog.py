"""When the loop falls silent, another process idles the device."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from masrel.errors import DeviceError
from masrel.lab.hess import IdleCommand, _watchdog
from masrel.lab.hess._watchdog import Watchdog, watched
from masrel.lab.hess._watchdog_process import watch
from tests.lab.hess.killed import LEAST_NM, torque_stood_ms
from tests.lab.hess.rig import ScriptedDevice, SimulatedClock
from tests.lab.hess.shared import SharedDevice, made


# A hung loop is noticed after 50 ms of silence; ten seconds are for a busy machine.
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_loop_that_is_killed_or_hangs_leaves_no_torque(how, tmp_path: Path) -> None:
    torque, stood_ms = torque_stood_ms(how, tmp_path / "device")
    assert torque >= LEAST_NM  # there was something to take back
    assert 0.0 <= stood_ms < 10_000.0


@pytest.fixture
def pipe():
    read, write = os.pipe()
    yield read, write
    os.close(read)


def watching(pipe, said: list[bytes], timeout_s: float = 0.05) -> tuple[int, int]:
    # Feeds the pipe from a thread -> exit code, how often it was idled
    read, write = pipe
    idled = []

    def feed() -> None:
        for word in said:
            if word == b" ":
                time.sleep(0.2)
            else:
                os.write(write, word)
        os.close(write)

    feeding = threading.Thread(target=feed)
    feeding.start()
    code = watch(read, timeout_s, lambda: idled.append(1))
    feeding.join()
    return code, len(idled)


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ([b".", b".", b"q"], (0, 0)),
        ([b" ", b".", b"q"], (0, 0)),  # nothing is missed before the first beat
        ([b".", b"p", b" ", b".", b"q"], (0, 0)),  # nor while the loop rests
        ([b".", b" ", b"q"], (3, 1)),  # silence
        ([b".", b"."], (3, 1)),  # the end of the process, between two beats
        ([b".", b"p"], (3, 1)),  # or while it rests
        ([], (3, 1)),  # or before it began
    ],
)
def test_the_process_idles_the_device_when_and_only_when_it_must(
    pipe, said: list[bytes], expected: tuple[int, int]
) -> None:
    assert watching(pipe, said) == expected


def test_it_tries_again_when_the_device_cannot_be_idled_at_once(pipe) -> None:
    read, write = pipe
    tries = []

    def idle() -> None:
        tries.append(1)
        if len(tries) < 4:
            raise DeviceError("busy")

    os.close(write)
    assert watch(read, 0.05, idle) == 3
    assert len(tries) == 4


def test_it_says_so_when_it_never_can(pipe) -> None:
    read, write = pipe

    def idle() -> None:
        raise DeviceError("nobody is there")

    os.close(write)
    with pytest.raises(DeviceError, match="nobody is there"):
        watch(read, 0.05, idle)


def test_a_loop_that_ends_well_leaves_the_device_to_itself(tmp_path: Path) -> None:
    path = tmp_path / "device"
    file = made(path)
    with Watchdog(IdleCommand("tests.lab.hess.shared", (str(path),)), 0.05) as dog:
        file.write(1.5, 1)
        dog.beat()
        dog.rest()
        time.sleep(0.15)
    assert file.read()[0] == 1.5
    assert file.read()[2] == 1


def test_a_dead_watchdog_is_noticed_by_the_loop(tmp_path: Path) -> None:
    path = tmp_path / "device"
    made(path)
    with Watchdog(IdleCommand("tests.lab.hess.shared", (str(path),)), 5.0) as dog:
        assert dog._process is not None
        dog._process.kill()
        dog._process.wait()
        with pytest.raises(DeviceError, match="watchdog: has ended"):
            dog.beat()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_watchdog_that_cannot_reach_the_device_is_refused(tmp_path: Path) -> None:
    nowhere = IdleCommand("tests.lab.hess.shared", (str(tmp_path / "none"),))
    with (
        pytest.raises(DeviceError, match="needs a process that can idle the device"),
        Watchdog(nowhere, 0.05),
    ):
        pass


def prepare() -> None:
    """Never ready: what a process does that hangs before it holds the device."""
    time.sleep(60.0)


def test_a_watchdog_that_is_never_ready_is_refused(monkeypatch) -> None:
    monkeypatch.setattr(_watchdog, "_READY_AFTER_S", 0.2)
    begun = time.monotonic()
    with (
        pytest.raises(DeviceError, match="watchdog: needs a process that is ready"),
        Watchdog(IdleCommand(__name__, ()), 0.05),
    ):
        pass
    assert time.monotonic() - begun < 10.0  # and it was not left behind


def test_a_watchdog_that_does_not_end_is_ended(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "device"
    made(path)
    with Watchdog(IdleCommand("tests.lab.hess.shared", (str(path),)), 5.0) as dog:
        process = dog._process
        assert process is not None
        process.send_signal(signal.SIGSTOP)
        monkeypatch.setattr(_watchdog, "_READY_AFTER_S", 0.2)
    assert process.returncode == -signal.SIGKILL


def test_the_process_says_in_one_line_why_it_cannot() -> None:
    command = (sys.executable, "-m", "masrel.lab.hess._watchdog_process", "0.05")
    done = subprocess.run(
        (*command, "masrel.lab.hess.puck._node", "none", "x", "1", "42", "8"),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("watchdog: puck: cannot open channel 'x' of ")
    assert done.stderr.count("\n") == 1


def test_only_a_device_that_another_process_can_reach_is_watched(tmp_path) -> None:
    with ScriptedDevice(SimulatedClock()) as device:
        assert watched(device, 0.05) is None
    path = tmp_path / "device"
    made(path)
    with SharedDevice(path) as device:
        assert isinstance(watched(device, 0.05), Watchdog)


def test_it_outlives_the_signals_that_end_its_parent(tmp_path: Path) -> None:
    path = tmp_path / "device"
    file = made(path)
    command = (sys.executable, "-m", "masrel.lab.hess._watchdog_process", "5.0")
    process = subprocess.Popen(
        (*command, "tests.lab.hess.shared", str(path)),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    with process:
        assert process.stdout.readline() == b"ready\n"
        file.write(2.0, 1)
        process.stdin.write(b".")
        process.stdin.flush()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            process.send_signal(number)
        process.stdin.close()
        assert process.wait(20.0) == 3
    assert file.read()[2] == 0

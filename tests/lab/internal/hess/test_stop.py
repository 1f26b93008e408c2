"""The emergency stop: who presses it, and that it stays pressed."""

import os
import pty
import select
import signal
import subprocess
import sys
import termios
import threading
import time
from math import radians
from pathlib import Path

import pytest

from masrel.errors import EmergencyStopError
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    EmergencyStop,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.hess._stop import stop_on_key, stop_on_signals
from masrel.lab.run import read_log
from tests.lab.hess.injected import small_study
from tests.lab.hess.rig import END, START


def test_it_stays_pressed_by_whoever_pressed_it_first() -> None:
    stop = EmergencyStop()
    stop.check()
    stop.press("first")
    stop.press("second")
    for _ in range(2):
        with pytest.raises(EmergencyStopError, match="emergency stop: first"):
            stop.check()


def test_pressed_in_a_catch_it_takes_the_torque_back_within_a_tenth_of_a_second():
    stop = EmergencyStop()

    class Pressing(SimulatedClock):
        def sleep_until_ns(self, deadline_ns: int) -> None:
            super().sleep_until_ns(deadline_ns)
            if deadline_ns == 700_000_000:
                stop.press("test")

    clock = Pressing()
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(92.0))
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand) as device:
        presented = run_presentation(
            device, controller, clock=clock, limits=DeviceLimits(), stop=stop
        )
        assert not device.is_open
    fault, columns = presented.fault, presented.recording.columns
    assert fault is not None
    assert (fault.kind, fault.time_s) == ("emergency-stop", pytest.approx(0.7))
    assert fault.torque_nm > 5.0
    assert columns["command_torque_nm"][-1] == 0.0
    assert columns["time_s"][-1] <= 0.8


def test_pressed_before_the_presentation_nothing_is_sent() -> None:
    stop = EmergencyStop()
    stop.press("test")
    clock = SimulatedClock()
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(92.0))
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand) as device:
        presented = run_presentation(
            device, controller, clock=clock, limits=DeviceLimits(), stop=stop
        )
    assert presented.fault is not None
    assert presented.recording.n_samples == 0


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_presses_it_and_is_itself_again_afterwards(name: str) -> None:
    number = signal.Signals[name]
    before = signal.getsignal(number)
    stop = EmergencyStop()
    with stop_on_signals(stop):
        signal.raise_signal(number)
    assert stop.reason == f"signal {name}"
    assert signal.getsignal(number) is before


def test_in_another_thread_signals_are_left_alone() -> None:
    before = signal.getsignal(signal.SIGINT)
    seen = []

    def elsewhere() -> None:
        with stop_on_signals(EmergencyStop()):
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert seen == [before]


@pytest.fixture
def terminal():
    keyboard, screen = pty.openpty()
    with os.fdopen(screen, "r", encoding="utf-8") as keys:
        yield keyboard, keys
    os.close(keyboard)


def test_any_key_of_a_terminal_presses_it(terminal) -> None:
    keyboard, keys = terminal
    settings = termios.tcgetattr(keys)
    stop = EmergencyStop()
    with stop_on_key(stop, keys):
        os.write(keyboard, b"x")  # without Enter
        until = time.monotonic() + 10.0
        while stop.reason is None and time.monotonic() < until:
            time.sleep(0.005)
    assert stop.reason == "key"
    assert termios.tcgetattr(keys) == settings


def test_a_key_stops_the_presentation_of_a_session(tmp_path: Path) -> None:
    # As a person has it: a terminal, the real clock, and a device that is at work
    patient = "[device]\nmissed_ticks_limit = 10000\nwatchdog_ms = 100\n"
    study, _ = small_study(tmp_path / "study", 60.0, device=patient)
    keyboard, screen = pty.openpty()
    command = (sys.executable, "-m", "masrel", "run", str(study.root), "--rater", "R1")
    session = subprocess.Popen(
        (*command, "--session", "test", "--clock", "real", "--quiet"),
        stdin=screen,
        stdout=screen,
        stderr=subprocess.DEVNULL,
    )
    os.close(screen)

    def read_until(words: bytes) -> None:
        shown = b""
        while words not in shown:
            ready, _, _ = select.select([keyboard], [], [], 30.0)
            assert ready, shown
            shown += os.read(keyboard, 4096)

    with session:
        read_until(b"Enter to begin")
        os.write(keyboard, b"\n")
        until = time.monotonic() + 30.0
        while not list(study.sessions.rglob("*.partial")):
            assert time.monotonic() < until
            time.sleep(0.002)
        os.write(keyboard, b"x")
        read_until(b"Present it again?")
        os.write(keyboard, b"no\n")
        assert session.wait(30.0) == 1
    os.close(keyboard)
    log = read_log(study.log_file("R1", "test"))
    assert [event.kind for event in log][:3] == ["session", "presented", "fault"]
    assert log[2].fields["words"] == "emergency stop: key"


def test_without_a_key_the_terminal_is_as_it_was(terminal) -> None:
    _, keys = terminal
    settings = termios.tcgetattr(keys)
    stop = EmergencyStop()
    n_threads = threading.active_count()
    with stop_on_key(stop, keys):
        assert threading.active_count() == n_threads + 1
    assert stop.reason is None
    assert termios.tcgetattr(keys) == settings
    assert threading.active_count() == n_threads


def test_a_terminal_that_goes_away_presses_it_and_is_left_alone() -> None:
    # As when its window is closed. The signal that then comes is another test's.
    keyboard, screen = pty.openpty()
    stop = EmergencyStop()
    with os.fdopen(screen, "r", encoding="utf-8") as keys, stop_on_key(stop, keys):
        os.close(keyboard)
        until = time.monotonic() + 10.0
        while stop.reason is None and time.monotonic() < until:
            time.sleep(0.005)
    assert stop.reason == "terminal lost"


def test_what_is_no_terminal_is_not_read(tmp_path) -> None:
    path = tmp_path / "answers"
    path.write_text("1+\n", encoding="utf-8")
    stop = EmergencyStop()
    with path.open(encoding="utf-8") as answers:
        with stop_on_key(stop, answers):
            pass
        assert answers.readline() == "1+\n"
    assert stop.reason is None


def test_a_standard_input_that_was_closed_is_no_terminal(monkeypatch) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    stop = EmergencyStop()
    with stop_on_key(stop, sys.stdin):
        assert stop.reason is None

"""What takes the torque back from outside: emergency stop, watchdog; and the scheduler.

``python -m tests.lab.hess.test_stop N`` kills and stops a watched loop N times each and
prints how long its torque stood.
"""

import os
import pty
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import termios
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from masrel.errors import DeviceError, EmergencyStopError
from masrel.lab.hess import EmergencyStop, IdleCommand, RealClock, SimulatedClock

from .rig import ActingClock, ScriptedDevice, present, scripted
from .shared import (
    WATCHDOG,
    SharedDevice,
    SharedFile,
    Watchdog,
    made,
    stop_on_key,
    stop_on_signals,
    watch,
    watched,
)

READY_AFTER_S = "masrel.lab.hess._stop._READY_AFTER_S"

# The button


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
    clock = ActingClock({0.7: lambda _: stop.press("test")})
    presented = present(clock=clock, stop=stop)
    fault, columns = presented.fault, presented.recording.columns
    assert fault is not None
    assert (fault.kind, fault.time_s) == ("emergency-stop", pytest.approx(0.7))
    assert fault.torque_nm > 5.0
    assert columns["command_torque_nm"][-1] == 0.0
    assert columns["time_s"][-1] <= 0.8
    # pressed before, nothing is sent
    again = present(stop=stop)
    assert again.fault is not None
    assert again.recording.n_samples == 0


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


def wait_for(condition, patience_s: float = 30.0) -> None:
    until = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.002)


def goes_away(keyboard: int) -> None:
    """As when its window is closed; the signal that then comes is another test's."""
    os.close(keyboard)


def type_x(keyboard: int) -> None:
    os.write(keyboard, b"x")  # without Enter


@pytest.mark.parametrize(
    ("act", "reason"),
    [(type_x, "key"), (goes_away, "terminal lost"), (None, None)],
    ids=["key", "goes away", "nothing"],
)
def test_a_terminal_presses_it_and_is_as_it_was(act, reason: str | None) -> None:
    keyboard, screen = pty.openpty()
    stop, n_threads = EmergencyStop(), threading.active_count()
    with os.fdopen(screen, "r", encoding="utf-8") as keys:
        settings = termios.tcgetattr(keys)
        with stop_on_key(stop, keys):
            assert threading.active_count() == n_threads + 1
            if act is not None:
                act(keyboard)
                wait_for(lambda: stop.reason is not None)
        assert stop.reason == reason
        assert threading.active_count() == n_threads
        if act is not goes_away:
            assert termios.tcgetattr(keys) == settings
    with suppress(OSError):
        os.close(keyboard)


def test_what_is_no_terminal_is_not_read(tmp_path) -> None:
    path = tmp_path / "answers"
    path.write_text("1+\n", encoding="utf-8")
    stop = EmergencyStop()
    with path.open(encoding="utf-8") as answers:
        with stop_on_key(stop, answers):
            pass
        assert answers.readline() == "1+\n"
    with stop_on_key(stop, None):  # a standard input that was closed
        assert stop.reason is None


# The watchdog: when the loop falls silent, another process idles the device

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
    command = (sys.executable, "-W", "ignore", "-m", "tests.lab.hess.shared")
    loop = subprocess.Popen((*command, str(path), "9"))
    try:
        wait_for(lambda: file.read()[0] >= LEAST_NM or loop.poll() is not None)
        if loop.poll() is not None:
            return 0.0, 0.0  # it was idled, or ended, before it had any
        # before, as the watchdog may idle it sooner than anything else can be read
        torque = file.read()[0]
        sent_ns = time.monotonic_ns()
        os.kill(loop.pid, how)
        wait_for(lambda: file.read()[2] == 0)
        return torque, (file.read()[1] - sent_ns) * 1e-6
    finally:
        loop.kill()
        loop.wait()


# A hung loop is noticed after 50 ms of silence; ten seconds are for a busy machine.
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_loop_that_is_killed_or_hangs_leaves_no_torque(how, tmp_path: Path) -> None:
    torque, stood_ms = torque_stood_ms(how, tmp_path / "device")
    assert torque >= LEAST_NM  # there was something to take back
    assert 0.0 <= stood_ms < 10_000.0


@pytest.mark.parametrize(
    ("said", "n_failing", "code"),
    [
        ("..q", 0, 0),
        (" .q", 0, 0),  # nothing is missed before the first beat
        (".p .q", 0, 0),  # nor while the loop rests
        (". q", 0, 3),  # silence
        ("..", 0, 3),  # the end of the process, between two beats
        (".p", 0, 3),  # or while it rests
        ("", 0, 3),  # or before it began
        ("", 3, 3),  # a device that cannot be idled at once is tried again
        ("", 99, None),
    ],
)
def test_the_process_idles_the_device_when_and_only_when_it_must(
    said: str, n_failing: int, code: int | None
) -> None:
    read, write = os.pipe()
    tries = []

    def feed() -> None:
        for word in said:
            time.sleep(0.2) if word == " " else os.write(write, word.encode())
        os.close(write)

    def idle() -> None:
        tries.append(1)
        if len(tries) <= n_failing:
            raise DeviceError("nobody is there")

    feeding = threading.Thread(target=feed)
    feeding.start()
    if code is None:
        with pytest.raises(DeviceError, match="nobody is there"):
            watch(read, 0.05, idle)
    else:
        assert watch(read, 0.05, idle) == code
        assert len(tries) == (n_failing + 1 if code == 3 else 0)
    feeding.join()
    os.close(read)


@pytest.fixture
def shared(tmp_path: Path) -> tuple[SharedFile, IdleCommand]:
    path = tmp_path / "device"
    return made(path), IdleCommand("tests.lab.hess.shared", (str(path),))


def test_a_loop_that_ends_well_leaves_the_device_to_itself(shared) -> None:
    file, idle = shared
    with Watchdog(idle, 0.05) as dog:
        file.write(1.5, 1)
        dog.beat()
        dog.rest()
        time.sleep(0.15)
    torque, _, mode = file.read()
    assert (torque, mode) == (1.5, 1)


def test_a_dead_watchdog_is_noticed_by_the_loop(shared) -> None:
    with Watchdog(shared[1], 5.0) as dog:
        assert dog._process is not None
        dog._process.kill()
        dog._process.wait()
        _, presented = scripted(clock=RealClock(), watchdog=dog)
    assert presented.fault is not None
    assert presented.fault.message.startswith("watchdog: has ended")


def prepare() -> None:
    """Never ready: what a process does that hangs before it holds the device."""
    time.sleep(60.0)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    ("idle", "patience_s", "words"),
    [
        (
            IdleCommand("tests.lab.hess.shared", ("/none",)),
            20.0,
            "needs a process that can idle the device",
        ),
        (IdleCommand(__name__, ()), 0.2, "needs a process that is ready"),
    ],
)
def test_a_watchdog_that_cannot_reach_the_device_is_refused(
    idle: IdleCommand, patience_s: float, words: str, monkeypatch
) -> None:
    monkeypatch.setattr(READY_AFTER_S, patience_s)
    begun = time.monotonic()
    with pytest.raises(DeviceError, match=f"watchdog: {words}"), Watchdog(idle, 0.05):
        pass
    assert time.monotonic() - begun < 10.0 + patience_s  # and it was not left behind


def test_a_watchdog_that_does_not_end_is_ended(shared, monkeypatch) -> None:
    with Watchdog(shared[1], 5.0) as dog:
        process = dog._process
        assert process is not None
        process.send_signal(signal.SIGSTOP)
        monkeypatch.setattr(READY_AFTER_S, 0.2)
    assert process.returncode == -signal.SIGKILL


def test_the_process_says_in_one_line_why_it_cannot() -> None:
    puck = ("masrel.lab.hess.puck._puck_device", "none", "x", "1", "42", "8")
    done = subprocess.run(
        (*WATCHDOG, "0.05", *puck),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("watchdog: puck: cannot open channel 'x' of ")
    assert done.stderr.count("\n") == 1


def test_only_a_device_that_another_process_can_reach_is_watched(shared) -> None:
    with ScriptedDevice(SimulatedClock()) as device:
        assert watched(device, 0.05) is None
    with SharedDevice(Path(shared[1].arguments[0])) as device:
        assert isinstance(watched(device, 0.05), Watchdog)


def test_it_outlives_the_signals_that_end_its_parent(shared) -> None:
    file, idle = shared
    process = subprocess.Popen(
        (*WATCHDOG, "5.0", idle.module, *idle.arguments),
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


# What the loop asks of the system, and that it says what it did not get

# Without privileges: a child that gives up root, and may neither lock nor schedule
UNPRIVILEGED = """
import os, resource
from masrel.lab.hess import RealClock
from tests.lab.hess.rig import scripted
for limit in (resource.RLIMIT_RTPRIO, resource.RLIMIT_MEMLOCK):
    resource.setrlimit(limit, (0, 0))
if os.getuid() == 0:
    os.setgroups([]); os.setgid(65534); os.setuid(65534)
print(scripted(clock=RealClock())[1].recording.facts["scheduling"])
"""


def locked_kb() -> int:
    with open("/proc/self/status", encoding="ascii") as status:
        line = next(line for line in status if line.startswith("VmLck:"))
    return int(line.split()[1])


def asked() -> tuple[object, ...]:
    return os.sched_getscheduler(0), os.sched_getaffinity(0), locked_kb() > 0


@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")
@pytest.mark.parametrize("is_alone", [False, True])
def test_it_says_of_each_whether_it_was_granted_and_gives_it_back(
    is_alone: bool,
) -> None:
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(allowed)} if is_alone else allowed)
    try:
        before, during = asked(), []
        facts = scripted(
            lambda _time_s: during.append(asked()) or 0.5, clock=RealClock()
        )[1].recording.facts
        scheduling, memory, timers = str(facts["scheduling"]).split(", ")
        (policy, affinity, is_locked), *_ = during
        where = f" on processor {max(affinity)}" if len(affinity) > 1 else ""
        is_fifo = policy == os.SCHED_FIFO
        assert is_fifo is (scheduling == f"SCHED_FIFO 80{where}")
        assert affinity == before[1]
        assert is_locked is (memory == "locked memory" or before[2])
        assert timers == "prompt timers"  # needs no privilege
        assert is_fifo or scheduling.startswith("no SCHED_FIFO (")
        assert asked() == before
    finally:
        os.sched_setaffinity(0, allowed)


def test_an_exception_gives_it_back_too() -> None:
    class Interrupted(RealClock):
        def sleep_until_ns(self, deadline_ns: int) -> None:
            raise KeyboardInterrupt(deadline_ns)

    before = asked()
    with pytest.raises(KeyboardInterrupt):
        scripted(clock=Interrupted())
    assert asked() == before
    assert resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] != 0 or not before[2]


def test_without_privileges_it_says_so_and_goes_on() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", UNPRIVILEGED],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == (
        "no SCHED_FIFO (Operation not permitted), "
        "no locked memory (Operation not permitted), prompt timers"
    )


if __name__ == "__main__":
    for how in (signal.SIGKILL, signal.SIGSTOP):
        stood = []
        for _ in range(int(sys.argv[1])):
            with tempfile.TemporaryDirectory() as folder:
                stood.append(torque_stood_ms(how, Path(folder) / "device")[1])
        print(
            f"{how.name}: median {statistics.median(stood):.1f} ms, "
            f"largest {max(stood):.1f} ms of {len(stood)}"
        )

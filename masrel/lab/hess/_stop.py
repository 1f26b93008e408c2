"""What takes the torque back from outside the loop: emergency stop and watchdog.

The emergency stop is a button that a key, a signal or anything else can press. An
amplifier may hold its last torque permanently, so a control loop that was killed must
not be the only one who can take it back: a watchdog is a small process that idles the
device when the loop falls silent.
"""

import importlib
import io
import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType, TracebackType
from typing import IO, Self, TextIO

from masrel.errors import DeviceError, EmergencyStopError
from masrel.lab.hess._clock import off_the_loop
from masrel.lab.hess.device import Device, IdleCommand

if sys.platform != "win32":
    import termios
    import tty

_ENTER = (b"\n", b"\r")
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")

_READY_AFTER_S = 20.0  # a Python that starts, or ends, on a busy machine

# What begins the process of a watchdog; after it come how long it waits, s, the module
# and the arguments of an `IdleCommand`. It reads beats from its standard input, and
# ends with 0 when it is told that all is well, with 3 after it has idled the device,
# and with 1 and a sentence when it cannot.
_BEGIN = "import sys; from masrel.lab.hess import _stop; "
WATCHDOG = (sys.executable, "-c", _BEGIN + "sys.exit(_stop.watch_over(sys.argv[1:]))")
_FAILED, _IDLED = 1, 3
_TRIES = 5  # a bus that fails once may work a moment later
_PRIORITY = 81  # above that of the loop, which may be what hangs


class EmergencyStop:
    """A button that stays pressed; the loop looks at it in every tick.

    Pressing it brings the torque to zero in the way of every fault. It is software,
    and no substitute for a switch in the supply of the motor.

    Attributes
    ----------
    reason : str or None
        Who pressed it first; None while it is not pressed.

    Examples
    --------
    >>> stop = EmergencyStop()
    >>> stop.press("key")
    >>> stop.check()
    Traceback (most recent call last):
        ...
    masrel.errors.EmergencyStopError: emergency stop: key
    """

    def __init__(self) -> None:
        self.reason: str | None = None

    def press(self, reason: str) -> None:
        """Press it; once it is pressed, again changes nothing.

        Parameters
        ----------
        reason : str
            Who presses it.
        """
        if self.reason is None:
            self.reason = reason

    def check(self) -> None:
        """Do nothing unless it is pressed.

        Raises
        ------
        EmergencyStopError
            If it is pressed.
        """
        if self.reason is not None:
            raise EmergencyStopError(f"emergency stop: {self.reason}")


@contextmanager
def stop_on_signals(stop: EmergencyStop) -> Iterator[None]:
    """Let signals that would end the process press the button instead."""
    # Outside the main thread, where Python lets nobody handle signals, it does nothing.
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def press(number: int, _frame: FrameType | None) -> None:
        stop.press(f"signal {signal.Signals(number).name}")

    numbers = [getattr(signal, name) for name in _SIGNALS if hasattr(signal, name)]
    before = {number: signal.signal(number, press) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def stop_on_key(
    stop: EmergencyStop,
    keys: TextIO | None,
    enter: Callable[[], object] | None = None,
) -> Iterator[None]:
    """Let any key of a terminal press the button, or Enter do something else."""
    if sys.platform == "win32" or keys is None or not keys.isatty():
        yield
        return
    terminal = keys.fileno()
    settings = termios.tcgetattr(terminal)
    tty.setcbreak(terminal)  # a key counts at once, without Enter
    try:
        with _waiting(lambda over: _wait_for_key(stop, terminal, over, enter)):
            yield
    finally:
        with suppress(termios.error):  # it may have gone away meanwhile
            termios.tcsetattr(terminal, termios.TCSAFLUSH, settings)


@contextmanager
def enter_on_empty_line(
    lines: TextIO | None, enter: Callable[[], object]
) -> Iterator[None]:
    """Take an empty line that comes now for Enter if the input is not a terminal."""
    buffer = getattr(lines, "buffer", None)
    is_terminal = lines is None or lines.isatty()
    if (
        sys.platform == "win32"
        or is_terminal
        or not isinstance(buffer, io.BufferedReader)
    ):
        yield
        return
    with _waiting(lambda over: _wait_for_line(buffer, over, enter)):
        yield


@contextmanager
def _waiting(wait: Callable[[int], None]) -> Iterator[None]:
    # Waits in a thread, which is given what can be read from once this is over
    read_end, write_end = os.pipe()
    thread = threading.Thread(target=wait, args=(read_end,), daemon=True)
    thread.start()
    try:
        yield
    finally:
        os.close(write_end)
        thread.join()
        os.close(read_end)


def _wait_for_line(
    buffer: io.BufferedReader, read_end: int, enter: Callable[[], object]
) -> None:
    # What else stands at the beginning of a line answers a question that is to come
    while True:
        ready, _, _ = select.select([buffer.fileno(), read_end], [], [])
        if read_end in ready or buffer.peek(1)[:1] != b"\n":
            return
        buffer.read(1)
        enter()


def _wait_for_key(
    stop: EmergencyStop,
    terminal: int,
    read_end: int,
    enter: Callable[[], object] | None,
) -> None:
    while True:
        ready, _, _ = select.select([terminal, read_end], [], [])
        if terminal not in ready:
            return
        try:
            key = os.read(terminal, 1)
        except OSError:
            key = b""
        if enter is None or key not in _ENTER:
            break
        enter()
    stop.press("key" if key else "terminal lost")


class Watching:
    """What the control loop tells that it is alive: nobody, unless it is a watchdog."""

    # Nobody watches a device that nothing else can reach.

    def beat(self) -> None:
        """Tell it now, and again before its time is over."""

    def rest(self) -> None:
        """Tell it that no beat follows for a while, and none is missed."""


class Watchdog(Watching):
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
        words = (repr(self._timeout_s), self._idle.module, *self._idle.arguments)
        # In a session of its own, so that Ctrl-C does not reach it
        self._process = process = subprocess.Popen(
            (*WATCHDOG, *words),
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
            with suppress(BrokenPipeError):  # it has just ended
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


def watch_over(arguments: list[str]) -> int:
    """Take hold of the device, say so, and watch -> exit code."""
    # Whoever stops the loop must not stop this first; it ends when its input does.
    for name in _SIGNALS:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if sys.platform == "linux":
        with suppress(OSError):  # not permitted: as it is, then
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    timeout_s, module, *idle_arguments = arguments
    with off_the_loop():
        try:
            device = importlib.import_module(module)
            idle: Callable[[], None] = device.prepare(*idle_arguments)
            sys.stdout.write("ready\n")
            sys.stdout.flush()
            return watch(0, float(timeout_s), idle)
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

"""The emergency stop: a key, a signal, or anything else that can press a button."""

import io
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TextIO

from masrel.errors import EmergencyStopError

if sys.platform != "win32":
    import termios
    import tty

_ENTER = (b"\n", b"\r")
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


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
    """Take an empty line that comes now for Enter, where the input is no terminal."""
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

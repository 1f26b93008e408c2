"""Clocks of a control loop, a real one and one that never waits; what makes it prompt.

On a real clock: its scheduling, its processor, locked memory, timers.
"""

import ctypes
import os
import sys
import time
from collections.abc import Iterator
from contextlib import (
    AbstractContextManager,
    ExitStack,
    contextmanager,
    nullcontext,
)
from typing import Protocol

from masrel.errors import ParameterError

_AWAKE_NS = 400_000  # the end of a sleep: a processor that rests wakes up late
_PRIORITY = 80  # of 1 to 99: above all ordinary work, below the kernel's own threads
_LOCK_CURRENT, _LOCK_FUTURE = 1, 2  # MCL_CURRENT, MCL_FUTURE of sys/mman.h
_SET_TIMER_SLACK = 29  # PR_SET_TIMERSLACK of sys/prctl.h
_SLACK_NS = 1
_USUAL_SLACK_NS = 50_000


class Clock(Protocol):
    """What the loop and the simulated device ask of a clock."""

    def now_ns(self) -> int:
        """Return the time.

        Returns
        -------
        int
            Time from an arbitrary zero, ns; it never goes back.
        """

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Sleep until an absolute time; return at once when it has passed.

        Parameters
        ----------
        deadline_ns : int
            When to return, ns on this clock.
        """


class RealClock:
    """The machine's monotonic clock: it cannot be set, so it cannot jump.

    Examples
    --------
    >>> clock = RealClock()
    >>> start = clock.now_ns()
    >>> clock.sleep_until_ns(start + 1_000_000)
    >>> clock.now_ns() - start >= 1_000_000
    True
    """

    def now_ns(self) -> int:
        """Return the monotonic time.

        Returns
        -------
        int
            Time from a zero that the system chose, ns.
        """
        return time.monotonic_ns()

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Sleep until an absolute time, the last 0.4 ms of it looking at the clock.

        Parameters
        ----------
        deadline_ns : int
            When to return, ns on this clock.
        """
        left_ns = deadline_ns - time.monotonic_ns()
        if left_ns > _AWAKE_NS:
            time.sleep((left_ns - _AWAKE_NS) * 1e-9)
        while time.monotonic_ns() < deadline_ns:
            pass


class SimulatedClock:
    """A clock on which a second takes no time: it stands still until told to sleep.

    Parameters
    ----------
    start_ns : int, optional
        Its time in the beginning, ns.

    Raises
    ------
    ParameterError
        If `start_ns` is negative.

    Examples
    --------
    >>> clock = SimulatedClock()
    >>> clock.sleep_until_ns(3_000_000_000)
    >>> clock.now_ns()
    3000000000
    """

    def __init__(self, start_ns: int = 0) -> None:
        if start_ns < 0:
            raise ParameterError(f"start_ns: needs 0 or more, got {start_ns}")
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the simulated time.

        Returns
        -------
        int
            Time, ns: `start_ns` and what has been slept since.
        """
        return self._now_ns

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Put the time forward, never back.

        Parameters
        ----------
        deadline_ns : int
            The new time, ns.
        """
        if deadline_ns > self._now_ns:
            self._now_ns = deadline_ns


def scheduled(clock: Clock) -> AbstractContextManager[str | None]:
    """Ask for real-time scheduling on a real clock -> what was granted, or None."""
    # Only where a tick comes at a time of the day does it matter how late it comes
    return real_time() if isinstance(clock, RealClock) else nullcontext()


@contextmanager
def real_time() -> Iterator[str]:
    """Ask for SCHED_FIFO, locked memory and prompt timers until the block ends.

    What has SCHED_FIFO begins on the processor that `off_the_loop` leaves to it.
    """
    # Only Linux has all three; elsewhere nothing is requested. The process may ask for
    # SCHED_FIFO and locked memory as root, or within ``ulimit -r`` and ``ulimit -l``.
    if sys.platform != "linux":
        yield f"ordinary scheduling: no other is available on {sys.platform}"
        return
    library = ctypes.CDLL(None, use_errno=True)
    with ExitStack() as back:
        outcomes = _fifo(back), _locked(back, library), _prompt(back, library)
        yield ", ".join(outcomes)


def _fifo(back: ExitStack) -> str:
    policy = os.sched_getscheduler(0)
    parameters = os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except OSError as error:
        return f"no SCHED_FIFO ({error.strerror})"
    back.callback(os.sched_setscheduler, 0, policy, parameters)
    return f"SCHED_FIFO {_PRIORITY}{_placed()}"


def _placed() -> str:
    # With SCHED_FIFO a thread stays where it is, unless another one needs the place:
    # then it may go, or two loops would be in each other's way
    allowed = os.sched_getaffinity(0)
    processor = _of_loop(allowed)
    if processor is None or not _moved({processor}):
        return ""
    _moved(allowed)
    return f" on processor {processor}"


@contextmanager
def off_the_loop() -> Iterator[list[int]]:
    """Keep this thread and what it starts off the processor of a loop.

    Gives the processors that the process of a loop is to have; none where all stays as
    it was.
    """
    allowed = os.sched_getaffinity(0) if sys.platform == "linux" else set()
    processor = _of_loop(allowed)
    if processor is None or not _moved(allowed - {processor}):
        yield []
        return
    try:
        yield sorted(allowed)
    finally:
        _moved(allowed)


def may_use(processors: list[int]) -> None:
    """Let this thread and what it starts have these processors, if there are any."""
    if processors:
        _moved(set(processors))


def _of_loop(allowed: set[int]) -> int | None:
    # The last one, for the first takes most interrupts; none where it is the only one
    return max(allowed) if len(allowed) > 1 else None


def _moved(processors: set[int]) -> bool:
    # Whether the system let this thread have these processors and no others
    if sys.platform != "linux":
        return False
    try:
        os.sched_setaffinity(0, processors)
    except OSError:
        return False
    return True


def _locked(back: ExitStack, library: ctypes.CDLL) -> str:
    if library.mlockall(_LOCK_CURRENT | _LOCK_FUTURE) != 0:
        return f"no locked memory ({os.strerror(ctypes.get_errno())})"
    back.callback(library.munlockall)
    return "locked memory"


def _prompt(back: ExitStack, library: ctypes.CDLL) -> str:
    # The kernel may let an ordinary thread's sleep end later by its timer slack.
    prctl = library.prctl
    prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]
    if prctl(_SET_TIMER_SLACK, _SLACK_NS, 0, 0, 0) != 0:
        return f"usual timers ({os.strerror(ctypes.get_errno())})"
    back.callback(prctl, _SET_TIMER_SLACK, _USUAL_SLACK_NS, 0, 0, 0)
    return "prompt timers"

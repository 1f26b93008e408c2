"""What makes a loop prompt: its scheduling, locked memory, timers, no collector."""

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from masrel.hess.clock import Clock, RealClock

_PRIORITY = 80  # of 1 to 99: above all ordinary work, below the kernel's own threads
_LOCK_CURRENT, _LOCK_FUTURE = 1, 2  # MCL_CURRENT, MCL_FUTURE of sys/mman.h
_SET_TIMER_SLACK = 29  # PR_SET_TIMERSLACK of sys/prctl.h
_SLACK_NS = 1
_USUAL_SLACK_NS = 50_000


@contextmanager
def scheduled(clock: Clock) -> Iterator[str | None]:
    """Ask for real-time scheduling on a real clock -> what was granted, or None."""
    # Only where a tick comes at a time of the day does it matter how late it comes
    if not isinstance(clock, RealClock):
        yield None
        return
    with real_time() as granted:
        yield granted


@contextmanager
def real_time() -> Iterator[str]:
    """Ask for SCHED_FIFO, locked memory and prompt timers until the block ends."""
    # Only Linux has all three; elsewhere nothing is requested. The process may ask for
    # SCHED_FIFO and locked memory as root, or within ``ulimit -r`` and ``ulimit -l``.
    if sys.platform != "linux":
        yield f"ordinary scheduling: none better is known on {sys.platform}"
        return
    library = ctypes.CDLL(None, use_errno=True)
    with contextlib.ExitStack() as granted:
        outcomes = (
            _fifo(granted),
            _locked(granted, library),
            _prompt(granted, library),
        )
        yield ", ".join(outcomes)


def _fifo(granted: contextlib.ExitStack) -> str:
    policy = os.sched_getscheduler(0)
    parameters = os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except OSError as error:
        return f"no SCHED_FIFO ({error.strerror})"
    granted.callback(os.sched_setscheduler, 0, policy, parameters)
    return f"SCHED_FIFO {_PRIORITY}"


def _locked(granted: contextlib.ExitStack, library: ctypes.CDLL) -> str:
    if library.mlockall(_LOCK_CURRENT | _LOCK_FUTURE) != 0:
        return f"no locked memory ({os.strerror(ctypes.get_errno())})"
    granted.callback(library.munlockall)
    return "locked memory"


def _prompt(granted: contextlib.ExitStack, library: ctypes.CDLL) -> str:
    # The kernel may let an ordinary thread's sleep end later by its timer slack.
    prctl = library.prctl
    prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]
    if prctl(_SET_TIMER_SLACK, _SLACK_NS, 0, 0, 0) != 0:
        return f"usual timers ({os.strerror(ctypes.get_errno())})"
    granted.callback(prctl, _SET_TIMER_SLACK, _USUAL_SLACK_NS, 0, 0, 0)
    return "prompt timers"

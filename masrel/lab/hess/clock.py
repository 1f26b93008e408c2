"""The clocks a control loop can run on: a real one, and one that never waits."""

import time
from typing import Protocol

from masrel.errors import ParameterError

_AWAKE_NS = 400_000  # the end of a sleep: a processor that rests wakes up late


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

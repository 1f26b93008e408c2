"""Replies that do not come: how many in a row, and how many of the last ones."""

from collections import deque

from masrel.errors import LimitExceededError
from masrel.hess.limits import DeviceLimits

__all__ = ["WINDOW_TICKS", "MissingReplies"]

WINDOW_TICKS = 100
"""Ticks of which `DeviceLimits.missed_replies_per_100` may be without a reading."""


class MissingReplies:
    """Count ticks without a new reading, and say when there are too many."""

    __slots__ = ("_limits", "_times", "_window_s", "n_in_a_row", "n_missed")

    def __init__(self, limits: DeviceLimits, period_s: float) -> None:
        self._limits = limits
        # The first and the last of 100 ticks are 99 periods apart; half of one more
        # is for a loop that comes late.
        self._window_s = (WINDOW_TICKS - 0.5) * period_s
        self._times: deque[float] = deque(maxlen=limits.missed_replies_per_100 + 1)
        self.n_missed = 0
        self.n_in_a_row = 0

    def another(self, time_s: float, words: str) -> None:
        """Count one more."""
        limits = self._limits
        self.n_missed += 1
        self.n_in_a_row += 1
        if self.n_in_a_row > limits.missed_replies:
            raise LimitExceededError(
                f"missed replies: needs a new reading after at most "
                f"{limits.missed_replies} ticks without, got {self.n_in_a_row} "
                f"in a row ({words})",
                "missed-replies",
            )
        times = self._times
        times.append(time_s)
        if len(times) == times.maxlen and time_s - times[0] < self._window_s:
            raise LimitExceededError(
                f"missed replies: needs at most {limits.missed_replies_per_100} of "
                f"{WINDOW_TICKS} ticks without a new reading, got {len(times)} "
                f"within {(time_s - times[0]) * 1e3:.1f} ms ({words})",
                "missed-replies",
            )

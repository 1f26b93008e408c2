"""What is to be done later, in the order in which it is due."""

import heapq
from collections.abc import Callable

__all__ = ["Act", "DueActs"]

Act = Callable[[int], None]
"""Called with the time at which it was due, ns."""


class DueActs:
    """Acts that wait for their time; those of one time keep their order."""

    __slots__ = ("_acts", "_n_added")

    def __init__(self) -> None:
        self._acts: list[tuple[int, int, Act]] = []
        self._n_added = 0

    def at(self, due_ns: int, act: Act) -> None:
        """Add an act."""
        self._n_added += 1  # what is due at the same time keeps its order
        heapq.heappush(self._acts, (due_ns, self._n_added, act))

    def next_ns(self) -> int | None:
        """Return when the next act is due."""
        return self._acts[0][0] if self._acts else None

    def act(self, now_ns: int) -> None:
        """Do what is due by now, and what that makes due by now."""
        while self._acts and self._acts[0][0] <= now_ns:
            due_ns, _, act = heapq.heappop(self._acts)
            act(due_ns)

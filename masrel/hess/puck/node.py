"""One puck at the other end of a bus: questions, settings and its position."""

import itertools

from masrel.errors import BusError, DeviceTimeoutError
from masrel.hess.clock import Clock
from masrel.hess.puck.arrivals import Arrivals
from masrel.hess.puck.bus import Frame, Link
from masrel.hess.puck.identifiers import to_puck
from masrel.hess.puck.positions import Position
from masrel.hess.puck.properties import ID, ROLE, SERIAL_NUMBER, STATUS, VERSION
from masrel.hess.puck.requests import encode_get, encode_set

__all__ = ["PuckNode"]

_SAMPLING_NS = 75_000
"""A puck samples its encoder this long after it is asked; said by a public driver."""

# What every puck answers, asked for its order among the answers, not for its value
_MARKERS = (VERSION, ROLE, SERIAL_NUMBER, ID, STATUS)

_MOST_WAITING = 1000  # frames; more than fit on the bus in 50 ms
_MOST_OVERDUE = 30  # more than fit on the bus in 1 ms


class PuckNode:
    """A puck, spoken to frame by frame."""

    __slots__ = (
        "_clock",
        "_in_doubt",
        "_link",
        "_markers",
        "_n_overdue",
        "_to",
        "arrivals",
        "heard",
        "puck",
    )

    def __init__(self, link: Link, clock: Clock, puck: int) -> None:
        self._link = link
        self._clock = clock
        self._to = to_puck(puck)
        self._in_doubt = False
        self._n_overdue = 0  # frames that came after the deadline
        self._markers = itertools.cycle(_MARKERS)
        self.puck = puck
        self.arrivals = Arrivals(puck)
        self.heard = self.arrivals.heard

    def tell(self, property_id: int, value: int) -> None:
        """Set a property; a puck does not acknowledge it."""
        self._link.send(Frame(self._to, encode_set(property_id, value)))

    def inquire(self, property_id: int) -> int:
        """Ask for a property and do not wait; the answer comes into `heard`."""
        return self._link.send(Frame(self._to, encode_get(property_id)))

    def ask(self, property_id: int, *, patience_s: float = 0.05) -> int:
        """Ask for a property and wait for the answer."""
        self.listen()
        self.heard.pop(property_id, None)
        deadline_ns = self.inquire(property_id) + round(patience_s * 1e9)
        self._n_overdue = 0
        while property_id not in self.heard:
            frame = self._received(deadline_ns)
            if frame is None:
                raise DeviceTimeoutError(
                    f"puck {self.puck}: no answer for property {property_id} within "
                    f"{patience_s * 1e3:g} ms"
                )
            self.arrivals.sort(frame)
        return self.heard.pop(property_id)

    def position(self, property_id: int, *, patience_s: float) -> tuple[int, int]:
        """Ask for the position and wait for it."""
        # An answer does not say which question it belongs to. So what waits is thrown
        # away first. After a question that stayed without an answer, which may only be
        # late, the next is followed by one for another property, each time another: a
        # puck answers in the order in which it is asked, so that the last position
        # before that answer is the one asked for.
        self.listen()
        asked_ns = self.inquire(property_id)
        marker = next(self._markers) if self._in_doubt else None
        if marker is not None:
            self.heard.pop(marker, None)
            self.inquire(marker)
        found = self._marked_position(asked_ns + round(patience_s * 1e9), marker)
        if found is None:
            raise DeviceTimeoutError(
                f"puck {self.puck}: no position within {patience_s * 1e3:g} ms"
            )
        return min(asked_ns + _SAMPLING_NS, self._clock.now_ns()), found.counts

    def _marked_position(self, deadline_ns: int, marker: int | None) -> Position | None:
        # The first position that comes; with a marker, the last before its answer
        found: Position | None = None
        self._n_overdue = 0
        while found is None if marker is None else marker not in self.heard:
            frame = self._received(deadline_ns)
            if frame is None:
                self.arrivals.n_late += found is not None  # that of an earlier question
                self._in_doubt = True
                return None
            position = self.arrivals.sort(frame)
            if position is not None:
                self.arrivals.n_late += found is not None
                found = position
        self._in_doubt = False  # nothing earlier can come any more
        return found

    def _received(self, deadline_ns: int) -> Frame | None:
        # What waits is taken after the deadline too, because this end may be late;
        # but not without end, because others may never fall silent.
        if self._clock.now_ns() > deadline_ns:
            self._n_overdue += 1
            if self._n_overdue > _MOST_OVERDUE:
                return None
        return self._link.receive(deadline_ns)

    def listen(self) -> None:
        """Take in what has come unasked: answers, errors, frames of others."""
        for _ in range(_MOST_WAITING):
            frame = self._link.receive(0)
            if frame is None:
                return
            if self.arrivals.sort(frame) is not None:
                self.arrivals.n_late += 1
        raise BusError(f"puck {self.puck}: the bus is flooded with frames", "flooded")

    def now_ns(self) -> int:
        """Return the time."""
        return self._clock.now_ns()

    def wait(self, duration_s: float) -> None:
        """Let time pass without a frame being sent."""
        self._clock.sleep_until_ns(self._clock.now_ns() + round(duration_s * 1e9))

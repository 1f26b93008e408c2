"""One puck on a bus: requests, settings, its position, and whether it still obeys."""

import itertools

from masrel.errors import BusError, DeviceTimeoutError, IdledError
from masrel.lab.hess.clock import Clock
from masrel.lab.hess.puck._bus import BUS_OFF, BUS_RESTARTED, Frame, Link
from masrel.lab.hess.puck._codec import (
    Position,
    decode_position,
    decode_reply,
    encode_get,
    encode_set,
    reply_identifiers,
    to_puck,
)
from masrel.lab.hess.puck._properties import (
    ID,
    ROLE,
    SERIAL_NUMBER,
    STATUS,
    TORQUE,
    VERSION,
)

_SAMPLING_NS = 75_000
"""From a request to the sample of the encoder, as one of the public drivers has it."""

# What every puck answers; requested for the order of the answers, not for the values
_MARKERS = (VERSION, ROLE, SERIAL_NUMBER, ID, STATUS)

_MAX_WAITING = 1000  # frames; more than fit on the bus in 50 ms
_MAX_OVERDUE = 30  # more than fit on the bus in 1 ms
_MAX_ERROR_FRAMES = 10  # on a bus of one joint there should be none
_MAX_UNANSWERED = 2  # polls in a row; one may get lost
_MAX_LOST_TORQUES = 1  # in a row; the next comes after a tick


class Receiver:
    """Sorts frames into positions, values of properties, errors and those of others."""

    __slots__ = (
        "_position_id",
        "_property_id",
        "_puck",
        "n_errors",
        "n_foreign",
        "n_late",
        "values",
    )

    def __init__(self, puck: int) -> None:
        self._puck = puck
        self._position_id, self._property_id = reply_identifiers(puck)
        self.values: dict[int, int] = {}  # the last of each property, by its number
        self.n_foreign = 0
        self.n_late = 0
        self.n_errors = 0

    def sort(self, frame: Frame) -> Position | None:
        """Return the position that a frame holds, and keep note of all else."""
        if frame.is_error:
            self._count_error(frame.identifier)
        elif frame.identifier == self._position_id:
            return decode_position(frame.data)
        elif frame.identifier == self._property_id:
            reply = decode_reply(frame.data)
            self.values[reply.property_id] = reply.value
        else:
            self.n_foreign += 1
        return None

    def _count_error(self, error_class: int) -> None:
        if error_class & BUS_RESTARTED:
            return
        if error_class & BUS_OFF:
            raise BusError(
                f"puck {self._puck}: bus off, the host's controller has given up",
                "bus-off",
            )
        self.n_errors += 1
        if self.n_errors > _MAX_ERROR_FRAMES:
            raise BusError(
                f"puck {self._puck}: needs at most {_MAX_ERROR_FRAMES} error frames, "
                f"the bus has reported {self.n_errors}, the last of class "
                f"{error_class:#05x}",
                "error-frames",
            )


class PuckNode:
    """A puck, spoken to frame by frame."""

    __slots__ = (
        "_clock",
        "_in_doubt",
        "_link",
        "_markers",
        "_n_overdue",
        "_to",
        "puck",
        "receiver",
        "values",
    )

    def __init__(self, link: Link, clock: Clock, puck: int) -> None:
        self._link = link
        self._clock = clock
        self._to = to_puck(puck)
        self._in_doubt = False  # whether a position may still come for an old request
        self._n_overdue = 0  # frames that came after the deadline
        self._markers = itertools.cycle(_MARKERS)
        self.puck = puck
        self.receiver = Receiver(puck)
        self.values = self.receiver.values

    def set(self, property_id: int, value: int) -> None:
        """Set a property; a puck does not acknowledge it."""
        self._link.send(Frame(self._to, encode_set(property_id, value)))

    def request(self, property_id: int) -> int:
        """Request a property without waiting, and return when, ns; see `values`."""
        return self._link.send(Frame(self._to, encode_get(property_id)))

    def get(self, property_id: int, *, patience_s: float = 0.05) -> int:
        """Request a property, wait for the reply, and return its value."""
        self.receive_waiting()
        self.values.pop(property_id, None)
        deadline_ns = self.request(property_id) + round(patience_s * 1e9)
        self._n_overdue = 0
        while property_id not in self.values:
            frame = self._next_frame(deadline_ns)
            if frame is None:
                raise DeviceTimeoutError(
                    f"puck {self.puck}: no answer for property {property_id} within "
                    f"{patience_s * 1e3:g} ms"
                )
            self.receiver.sort(frame)
        return self.values.pop(property_id)

    def position(self, property_id: int, *, patience_s: float) -> tuple[int, int]:
        """Request the position -> when it was sampled, ns, and the count."""
        # A reply does not say to which request it belongs. So what waits is thrown
        # away first. After a request that was not answered in time, whose reply may
        # only be late, the next is followed by one for another property, a different
        # one each time: a puck answers requests in their order, so that the last
        # position before that reply is the one that was requested now.
        self.receive_waiting()
        request_ns = self.request(property_id)
        marker = next(self._markers) if self._in_doubt else None
        if marker is not None:
            self.values.pop(marker, None)
            self.request(marker)
        position = self._marked_position(request_ns + round(patience_s * 1e9), marker)
        if position is None:
            raise DeviceTimeoutError(
                f"puck {self.puck}: no position within {patience_s * 1e3:g} ms"
            )
        return min(request_ns + _SAMPLING_NS, self._clock.now_ns()), position.counts

    def _marked_position(self, deadline_ns: int, marker: int | None) -> Position | None:
        # The first position that comes; with a marker, the last before its reply
        last: Position | None = None
        self._n_overdue = 0
        while last is None if marker is None else marker not in self.values:
            frame = self._next_frame(deadline_ns)
            if frame is None:
                self.receiver.n_late += last is not None  # that of an earlier request
                self._in_doubt = True
                return None
            position = self.receiver.sort(frame)
            if position is not None:
                self.receiver.n_late += last is not None
                last = position
        self._in_doubt = False  # nothing earlier can come any more
        return last

    def _next_frame(self, deadline_ns: int) -> Frame | None:
        # What waits is taken after the deadline too, because this end may be late;
        # but only so many frames, because others may never fall silent.
        if self._clock.now_ns() > deadline_ns:
            self._n_overdue += 1
            if self._n_overdue > _MAX_OVERDUE:
                return None
        return self._link.receive(deadline_ns)

    def receive_waiting(self) -> None:
        """Receive all frames that wait: late replies, errors, frames of others."""
        for _ in range(_MAX_WAITING):
            frame = self._link.receive(0)
            if frame is None:
                return
            if self.receiver.sort(frame) is not None:
                self.receiver.n_late += 1
        raise BusError(f"puck {self.puck}: the bus is flooded with frames", "flooded")

    def now_ns(self) -> int:
        """Return the time."""
        return self._clock.now_ns()

    def wait(self, duration_s: float) -> None:
        """Let time pass without sending a frame."""
        self._clock.sleep_until_ns(self._clock.now_ns() + round(duration_s * 1e9))


class Polls:
    """Requests the mode and the torque that a puck holds, in turn, every few torques.

    No setting is acknowledged. The loop does not wait for the replies: they come
    before the next position.
    """

    __slots__ = (
        "_checks_torque",
        "_every",
        "_mode_id",
        "_n_left",
        "_n_lost",
        "_n_unanswered",
        "_next_is_mode",
        "_node",
        "_torque_id",
        "_units",
    )

    def __init__(
        self,
        node: PuckNode,
        *,
        torque_id: int,
        mode_id: int,
        every: int,
        checks_torque: bool,
    ) -> None:
        self._node = node
        self._torque_id, self._mode_id = torque_id, mode_id
        self._every = self._n_left = every
        self._checks_torque = checks_torque
        self._next_is_mode = True
        self._n_unanswered = 0
        self._units = 0  # the torque it was set to when its torque was requested
        self._n_lost = 0

    def count_torque(self, units: int) -> None:
        """Count a torque that was sent, and poll when it is time."""
        self._n_left -= 1
        if self._n_left:
            return
        self._n_left = self._every
        self._n_unanswered += 1  # until the reply comes
        if self._next_is_mode or not self._checks_torque:
            self._node.request(self._mode_id)
        else:
            self._units = units
            self._node.request(self._torque_id)
        self._next_is_mode = not self._next_is_mode

    def check_replies(self) -> None:
        """Check the replies that have come; raise when too many have not."""
        values = self._node.values
        if values:
            if self._mode_id in values:
                self._check_mode(values[self._mode_id])
            if self._torque_id in values:
                self._check_torque(values[self._torque_id])
            values.clear()
        if self._n_unanswered > _MAX_UNANSWERED:
            raise self._timeout()

    def check_mode(self, *, patience_s: float) -> None:
        """Request the mode, wait for the reply, and check it."""
        try:
            mode = self._node.get(self._mode_id, patience_s=patience_s)
        except DeviceTimeoutError:
            self._n_unanswered += 1
            if self._n_unanswered > _MAX_UNANSWERED:
                raise self._timeout() from None
        else:
            self._check_mode(mode)

    def _check_mode(self, mode: int) -> None:
        self._n_unanswered = 0
        if mode != TORQUE:
            raise IdledError(
                f"puck {self._node.puck}: needs MODE {TORQUE}, somebody else "
                f"has set it to {mode}; an emergency stop, or a pendant?"
            )

    def _check_torque(self, units: int) -> None:
        self._n_unanswered = 0
        if units == self._units:
            self._n_lost = 0
            return
        self._n_lost += 1
        if self._n_lost > _MAX_LOST_TORQUES:
            raise BusError(
                f"puck {self._node.puck}: needs the torque it was told, "
                f"{self._units} current units, holds {units}, "
                f"{self._n_lost} times in a row: torques get lost",
                "lost-torques",
            )

    def _timeout(self) -> DeviceTimeoutError:
        return DeviceTimeoutError(
            f"puck {self._node.puck}: has not said its mode or torque "
            f"{self._n_unanswered} times in a row"
        )

"""What an emulated puck sends, and what else is on its bus while it does."""

from masrel.lab.hess.puck._bus import Frame, Link
from masrel.lab.hess.puck._codec import (
    POSITION_GROUP,
    PROPERTY_GROUP,
    SAFETY_NODE,
    encode_position,
    encode_reply,
    from_puck,
    to_puck,
)
from masrel.lab.hess.puck._emulated_state import EmulatedState

_SAMPLING_NS = 75_000  # from a request to the sample
_REPLY_NS = 150_000  # to the end of the reply
_DUPLICATE_NS = 100_000

_PROTOCOL_ERROR = 0x088  # class of an error frame: protocol violation, bus error


class EmulatedReplies:
    """Answers requests for properties and for the position, with faults."""

    __slots__ = (
        "_events",
        "_faults",
        "_frozen_counts",
        "_last_reply_ns",
        "_link",
        "_motor",
        "_options",
        "_puck",
        "_registers",
    )

    def __init__(self, link: Link, state: EmulatedState) -> None:
        self._link = link
        self._puck = state.puck
        self._options = state.options
        self._registers = state.registers
        self._motor = state.motor
        self._faults = state.faults
        self._events = state.events
        self._last_reply_ns = 0
        self._frozen_counts: int | None = None  # at which its encoder stands still

    def is_cut_off(self, now_ns: int) -> bool:
        """Return whether no frame comes or goes."""
        faults = self._faults
        return any(faults.active(kind, now_ns) for kind in ("unplugged", "bus-off"))

    def report_error(self, error_class: int) -> None:
        """Send an error frame, as the host's adapter would."""
        self._link.send(Frame(error_class, bytes(8), is_error=True))

    def reply(self, number: int, request_ns: int) -> None:
        """Reply with a property's value at the time when the reply is sent."""
        self._events.add(
            request_ns + _REPLY_NS, lambda due: self._reply_value(number, due)
        )

    def reply_position(self, request_ns: int) -> None:
        """Sample the encoder and reply, while others speak too."""
        self._events.add(request_ns + _SAMPLING_NS, self._sample)
        self._interfere(request_ns)

    def _reply_value(self, number: int, now_ns: int) -> None:
        value = self._registers.value(number)
        if value is None:
            return
        fits = -(2**15) <= value < 2**15
        size = self._options.reply_bytes if fits else 6
        data = encode_reply(number, value, size=size)
        self._schedule(Frame(from_puck(self._puck, PROPERTY_GROUP), data), now_ns)

    def _sample(self, now_ns: int) -> None:
        counts = self._encoder_counts(self._motor.counts(now_ns), now_ns)
        data = encode_position(
            counts + self._registers.offset,
            -counts if self._options.has_secondary else None,
            flagged=self._options.is_flagged,
        )
        frame = Frame(from_puck(self._puck, POSITION_GROUP), data)
        self._schedule(frame, now_ns + _REPLY_NS - _SAMPLING_NS)

    def _encoder_counts(self, counts: int, now_ns: int) -> int:
        # What a faulty encoder makes of a count
        if not self._faults.hit("frozen-encoder", now_ns):
            self._frozen_counts = None
        elif self._frozen_counts is None:
            self._frozen_counts = counts
        if self._frozen_counts is not None:
            counts = self._frozen_counts
        if self._faults.hit("wrapping-encoder", now_ns):
            counts %= self._options.counts_per_turn
        return counts + round(self._faults.amount("jumping-encoder", now_ns))

    def _schedule(self, frame: Frame, due_ns: int) -> None:
        if self._faults.hit("dropped-replies", due_ns):
            return
        if self._faults.hit("short-replies", due_ns):
            frame = frame._replace(data=frame.data[:-1])
        due_ns += round(self._faults.amount("late-replies", due_ns) * 1e9)
        # A puck answers requests in their order.
        self._last_reply_ns = due_ns = max(due_ns, self._last_reply_ns + 1)
        self._events.add(due_ns, lambda due: self._send(frame, due))
        if self._faults.hit("duplicated-replies", due_ns):
            self._events.add(due_ns + _DUPLICATE_NS, lambda due: self._send(frame, due))

    def _send(self, frame: Frame, now_ns: int) -> None:
        if not self.is_cut_off(now_ns):
            self._link.send(frame)

    def _interfere(self, now_ns: int) -> None:
        # What else is on the bus when a position is requested
        if self._options.is_noisy or self._faults.hit("foreign-frames", now_ns):
            other = self._puck % 31 + 1
            for frame in (
                Frame(from_puck(SAFETY_NODE, 0), bytes(8)),
                Frame(from_puck(other, POSITION_GROUP), b"\x12\x34\x56"),
                Frame(from_puck(other, PROPERTY_GROUP), b"\x88\x00\x00\x00"),
                Frame(to_puck(self._puck), b"\x30"),  # an echo of the host
            ):
                self._link.send(frame)
        if self._faults.hit("error-frames", now_ns):
            self.report_error(_PROTOCOL_ERROR)

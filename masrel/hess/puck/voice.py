"""What an emulated puck says, and what else is on its bus while it does."""

from masrel.hess.puck.bus import Frame, Link
from masrel.hess.puck.due import DueActs
from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.faults import ActiveFaults
from masrel.hess.puck.identifiers import (
    POSITION_GROUP,
    PROPERTY_GROUP,
    SAFETY_NODE,
    from_puck,
    to_puck,
)
from masrel.hess.puck.motor import EmulatedMotor
from masrel.hess.puck.positions import encode_position
from masrel.hess.puck.registers import Registers
from masrel.hess.puck.replies import encode_reply

__all__ = ["EmulatedVoice"]

_SAMPLING_NS = 75_000  # from a request to the sample
_ANSWER_NS = 150_000  # to the end of the answer
_DUPLICATE_NS = 100_000

_PROTOCOL_ERROR = 0x088  # class of an error frame: protocol violation, bus error


class EmulatedVoice:
    """Answers questions of properties and of the position, with faults."""

    __slots__ = (
        "_due",
        "_faults",
        "_frozen",
        "_last_answer_ns",
        "_link",
        "_motor",
        "_options",
        "_puck",
        "_registers",
    )

    def __init__(
        self,
        *,
        link: Link,
        puck: int,
        options: EmulatorOptions,
        registers: Registers,
        motor: EmulatedMotor,
        faults: ActiveFaults,
        due: DueActs,
    ) -> None:
        self._link = link
        self._puck = puck
        self._options = options
        self._registers = registers
        self._motor = motor
        self._faults = faults
        self._due = due
        self._last_answer_ns = 0
        self._frozen: int | None = None  # the count at which its encoder stands still

    def is_cut_off(self, now_ns: int) -> bool:
        """Return whether no frame comes or goes."""
        faults = self._faults
        return any(faults.active(kind, now_ns) for kind in ("unplugged", "bus-off"))

    def report(self, error_class: int) -> None:
        """Send an error frame, as the host's adapter would."""
        self._link.send(Frame(error_class, bytes(8), is_error=True))

    def answer(self, number: int, asked_ns: int) -> None:
        """Answer for a property, with the value it has when the answer is sent."""
        self._due.at(asked_ns + _ANSWER_NS, lambda due: self._value(number, due))

    def answer_position(self, asked_ns: int) -> None:
        """Sample the encoder and answer, while others speak too."""
        self._due.at(asked_ns + _SAMPLING_NS, self._sample)
        self._interfere(asked_ns)

    def _value(self, number: int, now_ns: int) -> None:
        value = self._registers.value(number)
        if value is None:
            return
        fits = -(2**15) <= value < 2**15
        size = self._options.reply_bytes if fits else 6
        data = encode_reply(number, value, size=size)
        self._reply(Frame(from_puck(self._puck, PROPERTY_GROUP), data), now_ns)

    def _sample(self, now_ns: int) -> None:
        counts = self._counted(self._motor.counts(now_ns), now_ns)
        data = encode_position(
            counts + self._registers.offset,
            -counts if self._options.has_secondary else None,
            flagged=self._options.is_flagged,
        )
        frame = Frame(from_puck(self._puck, POSITION_GROUP), data)
        self._reply(frame, now_ns + _ANSWER_NS - _SAMPLING_NS)

    def _counted(self, counts: int, now_ns: int) -> int:
        # What a faulty encoder makes of a count
        if not self._faults.hit("frozen-encoder", now_ns):
            self._frozen = None
        elif self._frozen is None:
            self._frozen = counts
        if self._frozen is not None:
            counts = self._frozen
        if self._faults.hit("wrapping-encoder", now_ns):
            counts %= self._options.counts_per_turn
        return counts + round(self._faults.amount("jumping-encoder", now_ns))

    def _reply(self, frame: Frame, due_ns: int) -> None:
        if self._faults.hit("dropped-replies", due_ns):
            return
        if self._faults.hit("short-replies", due_ns):
            frame = frame._replace(data=frame.data[:-1])
        due_ns += round(self._faults.amount("late-replies", due_ns) * 1e9)
        # A puck answers in the order in which it is asked.
        self._last_answer_ns = due_ns = max(due_ns, self._last_answer_ns + 1)
        self._due.at(due_ns, lambda due: self._send(frame, due))
        if self._faults.hit("duplicated-replies", due_ns):
            self._due.at(due_ns + _DUPLICATE_NS, lambda due: self._send(frame, due))

    def _send(self, frame: Frame, now_ns: int) -> None:
        if not self.is_cut_off(now_ns):
            self._link.send(frame)

    def _interfere(self, now_ns: int) -> None:
        # What else is on the bus when a position is asked for
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
            self.report(_PROTOCOL_ERROR)

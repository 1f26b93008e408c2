"""An emulated Puck on a CAN bus, with a simulated arm and faults on demand.

It does what the driver must cope with: it starts in its monitor, where the same
numbers mean other things; it leaves the bus while it wakes; it does not acknowledge a
setting; it brakes the arm when idle; and it holds its last torque for ever.
"""

import heapq
import threading
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from masrel.errors import FrameError
from masrel.hess.clock import Clock
from masrel.hess.hand import Hand
from masrel.hess.puck.bus import BUS_OFF, BUS_RESTARTED, Frame, Link
from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.faults import ActiveFaults
from masrel.hess.puck.frames import decode_request, encode_reply
from masrel.hess.puck.identifiers import (
    HOST,
    POSITION_GROUP,
    PROPERTY_GROUP,
    SAFETY_NODE,
    TORQUE_GROUP,
    from_puck,
    split_identifier,
    to_puck,
)
from masrel.hess.puck.motor import EmulatedMotor
from masrel.hess.puck.positions import encode_position
from masrel.hess.puck.registers import Registers
from masrel.hess.puck.states import IDLE, TORQUE
from masrel.hess.puck.torques import decode_torques
from masrel.hess.puck.transmission import Transmission

__all__ = ["PuckEmulator", "Setting"]

_SAMPLING_NS = 75_000  # from a request to the sample
_ANSWER_NS = 150_000  # to the end of the answer
_SETTING_NS = 110_000  # six bytes on the bus
_DUPLICATE_NS = 100_000
_NAP_NS = 10_000_000  # of an emulator with a thread of its own
_REMEMBERED = 10_000  # settings

_PROTOCOL_ERROR = 0x088  # class of an error frame: protocol violation, bus error


class Setting(NamedTuple):
    """What an emulated puck was told.

    Attributes
    ----------
    time_ns : int
        When it took effect.
    name : str
        The property, or its number where the table has no name for it.
    value : int
        Its new value.
    """

    time_ns: int
    name: str
    value: int


class PuckEmulator:
    """A puck, served by whoever shares its thread, or by a thread of its own.

    Parameters
    ----------
    link : Link
        Its end of the bus.
    clock : Clock
        The clock of the host.
    hand : Hand
        What moves the arm; its time begins when the puck first drives the motor.
    range_end : float
        Where the arm meets its end stop, rad.
    options : EmulatorOptions
        What it is like.
    puck : int, optional
        Its node.

    Attributes
    ----------
    registers : Registers
        Its properties.
    motor : EmulatedMotor
        Arm and motor.
    faults : ActiveFaults
        What fails.
    settings : deque of Setting
        What it was told, by others too, the last 10 000.
    n_disturbances : int
        Frames that came while it was off the bus to wake: a real host may be thrown
        off the bus by one.
    """

    def __init__(
        self,
        *,
        link: Link,
        clock: Clock,
        hand: Hand,
        range_end: float,
        options: EmulatorOptions,
        puck: int = 1,
    ) -> None:
        transmission = Transmission(
            counts_per_turn=options.counts_per_turn,
            units_per_nm=options.units_per_nm,
            gear_ratio=options.gear_ratio,
            direction=options.direction,
        )
        self._link = link
        self._clock = clock
        self._options = options
        self._puck = puck
        self._due: list[tuple[int, int, Callable[[int], None]]] = []
        self._n_scheduled = 0
        self._last_answer_ns = 0
        self.faults = ActiveFaults(options.faults)
        self._frozen: int | None = None
        self.registers = Registers(options, puck)
        self.motor = EmulatedMotor(
            hand=hand,
            range_end=range_end,
            transmission=transmission,
            braking=options.braking,
        )
        if (
            not options.awake
        ):  # it counts from where the arm was when it was switched on
            self.registers.offset = -self.motor.counts(clock.now_ns())
        self.settings: deque[Setting] = deque(maxlen=_REMEMBERED)
        self.n_disturbances = 0

    def next_due_ns(self) -> int | None:
        """Return when it will act next.

        Returns
        -------
        int or None
            Time, ns; None when it waits for a frame.
        """
        return self._due[0][0] if self._due else None

    def serve(self) -> None:
        """Do what is due by now, and take in the frames that wait."""
        self._act(self._clock.now_ns())  # before them: they come now
        while (frame := self._link.receive(0)) is not None:
            self._take(frame, self._clock.now_ns())
        self._act(self._clock.now_ns())

    def run(self, stop: threading.Event) -> None:
        """Serve until told to stop; for a thread or process of its own.

        Parameters
        ----------
        stop : threading.Event
            Ends it within 10 ms.
        """
        while not stop.is_set():
            nap_ns = self._clock.now_ns() + _NAP_NS
            due_ns = self.next_due_ns()
            frame = self._link.receive(
                nap_ns if due_ns is None else min(due_ns, nap_ns)
            )
            if frame is not None:
                self._take(frame, self._clock.now_ns())
            self._act(self._clock.now_ns())

    def close(self) -> None:
        """Leave the bus."""
        self._link.close()

    # Frames

    def _take(self, frame: Frame, now_ns: int) -> None:
        if frame.is_error or not self._is_for_me(frame):
            return
        if self._is_cut_off(now_ns):
            return
        if self.registers.is_waking:
            self.n_disturbances += 1
            return
        if self.faults.hit("dropped-requests", now_ns):
            return
        try:
            self._obey(frame, now_ns)
        except FrameError:
            return  # a puck says nothing to what it does not understand

    def _is_for_me(self, frame: Frame) -> bool:
        try:
            sender, receiver, is_group = split_identifier(frame.identifier)
        except FrameError:
            return False
        if sender != HOST:
            return False
        if is_group:
            return receiver in self.registers.groups
        return receiver == self._puck

    def _obey(self, frame: Frame, now_ns: int) -> None:
        if frame.identifier & 0x1F == TORQUE_GROUP and len(frame.data) == 8:
            torque = decode_torques(frame.data)[self.registers.slot]
            self._at(now_ns + _SETTING_NS, lambda due: self._drive(torque, due))
            return
        number, value = decode_request(frame.data)
        if value is not None:
            given = value
            self._at(now_ns + _SETTING_NS, lambda due: self._set(number, given, due))
        elif number == self.registers.position_number:
            self._at(now_ns + _SAMPLING_NS, self._sample)
            self._interfere(now_ns)
        else:
            self._at(now_ns + _ANSWER_NS, lambda due: self._answer(number, due))

    # Settings

    def _set(self, number: int, value: int, now_ns: int) -> None:
        registers = self.registers
        name = registers.name(number)
        if name == "T" and self.faults.hit("dropped-torques", now_ns):
            return
        self.settings.append(Setting(now_ns, name, value))
        if name == "T":
            self._drive(value, now_ns)
        elif name == "P":
            registers.offset = value - self.motor.counts(now_ns)
        elif name == "MODE":
            self._switch(value, now_ns)
        elif registers.set(number, value):  # it wakes
            wake_ns = round(self._options.wake_s * 1e9)
            self._at(now_ns + wake_ns, lambda _due: registers.wake())

    def _drive(self, units: int, now_ns: int) -> None:
        registers = self.registers
        registers.torque = max(-registers.highest, min(registers.highest, units))
        if registers.mode == TORQUE:
            self.motor.drive(registers.torque, now_ns)

    def _switch(self, mode: int, now_ns: int) -> None:
        self.registers.mode = mode
        if mode != TORQUE:
            self.registers.torque = 0
            self.motor.brake(now_ns)
            return
        if self.faults.start(now_ns):
            self._schedule_faults(now_ns)
        self.motor.drive(self.registers.torque, now_ns)

    # Answers

    def _answer(self, number: int, now_ns: int) -> None:
        value = self.registers.value(number)
        if value is None:
            return
        fits = -(2**15) <= value < 2**15
        size = self._options.reply_bytes if fits else 6
        data = encode_reply(number, value, size=size)
        self._reply(Frame(from_puck(self._puck, PROPERTY_GROUP), data), now_ns)

    def _sample(self, now_ns: int) -> None:
        counts = self._counted(self.motor.counts(now_ns), now_ns)
        data = encode_position(
            counts + self.registers.offset,
            -counts if self._options.has_secondary else None,
            flagged=self._options.is_flagged,
        )
        frame = Frame(from_puck(self._puck, POSITION_GROUP), data)
        self._reply(frame, now_ns + _ANSWER_NS - _SAMPLING_NS)

    def _counted(self, counts: int, now_ns: int) -> int:
        # What a faulty encoder makes of a count
        if not self.faults.hit("frozen-encoder", now_ns):
            self._frozen = None
        elif self._frozen is None:
            self._frozen = counts
        if self._frozen is not None:
            counts = self._frozen
        if self.faults.hit("wrapping-encoder", now_ns):
            counts %= self._options.counts_per_turn
        return counts + round(self.faults.amount("jumping-encoder", now_ns))

    def _reply(self, frame: Frame, due_ns: int) -> None:
        if self.faults.hit("dropped-replies", due_ns):
            return
        if self.faults.hit("short-replies", due_ns):
            frame = frame._replace(data=frame.data[:-1])
        due_ns += round(self.faults.amount("late-replies", due_ns) * 1e9)
        # A puck answers in the order in which it is asked.
        self._last_answer_ns = due_ns = max(due_ns, self._last_answer_ns + 1)
        self._at(due_ns, lambda due: self._send(frame, due))
        if self.faults.hit("duplicated-replies", due_ns):
            self._at(due_ns + _DUPLICATE_NS, lambda due: self._send(frame, due))

    def _send(self, frame: Frame, now_ns: int) -> None:
        if not self._is_cut_off(now_ns):
            self._link.send(frame)

    def _is_cut_off(self, now_ns: int) -> bool:
        faults = self.faults
        return any(faults.active(kind, now_ns) for kind in ("unplugged", "bus-off"))

    def _interfere(self, now_ns: int) -> None:
        # What else is on the bus when a position is asked for
        if self._options.is_noisy or self.faults.hit("foreign-frames", now_ns):
            other = self._puck % 31 + 1
            for frame in (
                Frame(from_puck(SAFETY_NODE, 0), bytes(8)),
                Frame(from_puck(other, POSITION_GROUP), b"\x12\x34\x56"),
                Frame(from_puck(other, PROPERTY_GROUP), b"\x88\x00\x00\x00"),
                Frame(to_puck(self._puck), b"\x30"),  # an echo of the host
            ):
                self._link.send(frame)
        if self.faults.hit("error-frames", now_ns):
            self._link.send(Frame(_PROTOCOL_ERROR, bytes(8), is_error=True))

    # Faults

    def _schedule_faults(self, start_ns: int) -> None:
        for fault in self._options.faults:
            begin_ns = start_ns + round(fault.start_s * 1e9)
            if fault.kind == "idled":
                self._at(begin_ns, self._idle)
            elif fault.kind == "reset":
                self._at(begin_ns, self._reset)
            elif fault.kind == "bus-off":
                self._at(begin_ns, lambda _due: self._report(BUS_OFF))
                if fault.end_s < float("inf"):
                    end_ns = start_ns + round(fault.end_s * 1e9)
                    self._at(end_ns, lambda _due: self._report(BUS_RESTARTED))

    def _report(self, error_class: int) -> None:
        self._link.send(Frame(error_class, bytes(8), is_error=True))

    def _idle(self, now_ns: int) -> None:
        self.settings.append(Setting(now_ns, "MODE", IDLE))
        self._switch(IDLE, now_ns)

    def _reset(self, now_ns: int) -> None:
        self._idle(now_ns)
        self.registers.fall_asleep()
        self.registers.offset = -self.motor.counts(now_ns)

    # Time

    def _at(self, due_ns: int, act: Callable[[int], None]) -> None:
        self._n_scheduled += 1  # what is due at the same time keeps its order
        heapq.heappush(self._due, (due_ns, self._n_scheduled, act))

    def _act(self, now_ns: int) -> None:
        while self._due and self._due[0][0] <= now_ns:
            due_ns, _, act = heapq.heappop(self._due)
            act(due_ns)
        self.motor.advance(now_ns)

"""An emulated Puck on a CAN bus, with a simulated arm and faults on demand.

It does what the driver must cope with: it starts in its monitor, where the same
numbers mean other things; it leaves the bus while it wakes; it does not acknowledge a
setting; it brakes the arm when idle; and it holds its last torque for ever.
"""

import threading
from collections import deque
from typing import NamedTuple

from masrel.errors import FrameError
from masrel.lab.hess.clock import Clock
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.puck._bus import BUS_OFF, BUS_RESTARTED, Frame, Link, open_link
from masrel.lab.hess.puck._codec import (
    HOST,
    TORQUE_GROUP,
    decode_request,
    decode_torques,
    split_identifier,
)
from masrel.lab.hess.puck._emulated_replies import EmulatedReplies
from masrel.lab.hess.puck._emulated_state import EmulatedState
from masrel.lab.hess.puck._properties import IDLE, TORQUE
from masrel.lab.hess.puck._puck_options import EmulatorOptions, PuckOptions

_SETTING_NS = 110_000  # six bytes on the bus
_NAP_NS = 10_000_000  # of an emulator with a thread of its own
_MAX_SETTINGS = 10_000  # that are remembered


class Setting(NamedTuple):
    """A property of an emulated puck that was set."""

    time_ns: int  # when it took effect
    name: str  # the property, or its number where the table has no name for it
    value: int  # its new value


class EmulatedSettings:
    """Takes settings, switches the motor, and lets the faults of a puck happen."""

    __slots__ = (
        "_events",
        "_faults",
        "_motor",
        "_options",
        "_registers",
        "_replies",
        "log",
    )

    def __init__(self, state: EmulatedState, replies: EmulatedReplies) -> None:
        self._options = state.options
        self._registers = state.registers
        self._motor = state.motor
        self._faults = state.faults
        self._events = state.events
        self._replies = replies
        self.log: deque[Setting] = deque(maxlen=_MAX_SETTINGS)

    def set(self, number: int, value: int, now_ns: int) -> None:
        """Set a property."""
        registers = self._registers
        name = registers.name(number)
        if name == "T" and self._faults.hit("dropped-torques", now_ns):
            return
        self.log.append(Setting(now_ns, name, value))
        if name == "T":
            self.drive(value, now_ns)
        elif name == "P":
            registers.offset = value - self._motor.counts(now_ns)
        elif name == "MODE":
            self._switch(value, now_ns)
        elif registers.set(number, value):  # it wakes
            wake_ns = round(self._options.wake_s * 1e9)
            self._events.add(now_ns + wake_ns, lambda _due: registers.wake())

    def drive(self, units: int, now_ns: int) -> None:
        """Take a torque, as the packed frame for four pucks sets it too."""
        registers = self._registers
        registers.torque = max(-registers.max_torque, min(registers.max_torque, units))
        if registers.mode == TORQUE:
            self._motor.drive(registers.torque, now_ns)

    def _switch(self, mode: int, now_ns: int) -> None:
        self._registers.mode = mode
        if mode != TORQUE:
            self._registers.torque = 0
            self._motor.brake(now_ns)
            return
        if self._faults.start(now_ns):
            self._schedule_faults(now_ns)
        self._motor.drive(self._registers.torque, now_ns)

    def _schedule_faults(self, start_ns: int) -> None:
        add, report = self._events.add, self._replies.report_error
        for fault in self._options.faults:
            begin_ns = start_ns + round(fault.start_s * 1e9)
            if fault.kind == "idled":
                add(begin_ns, self._idle)
            elif fault.kind == "reset":
                add(begin_ns, self._reset)
            elif fault.kind == "bus-off":
                add(begin_ns, lambda _due: report(BUS_OFF))
                if fault.end_s < float("inf"):
                    end_ns = start_ns + round(fault.end_s * 1e9)
                    add(end_ns, lambda _due: report(BUS_RESTARTED))

    def _idle(self, now_ns: int) -> None:
        self.log.append(Setting(now_ns, "MODE", IDLE))
        self._switch(IDLE, now_ns)

    def _reset(self, now_ns: int) -> None:
        self._idle(now_ns)
        self._registers.fall_asleep()
        self._registers.offset = -self._motor.counts(now_ns)


class PuckEmulator:
    """A puck, served by whoever shares its thread, or by a thread of its own."""

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
        self.link = link
        self._clock = clock
        self._puck = puck
        state = EmulatedState(options, puck, hand, range_end)
        self._events = state.events
        self.faults = state.faults
        self.registers = state.registers
        self.motor = state.motor
        if not options.awake:  # counts from where it was when it was switched on
            self.registers.offset = -self.motor.counts(clock.now_ns())
        self._replies = EmulatedReplies(link, state)
        self._settings = EmulatedSettings(state, self._replies)
        self.settings = self._settings.log
        self.n_disturbances = 0  # frames that came while it was waking

    def next_due_ns(self) -> int | None:
        """Return when it will act next."""
        return self._events.next_due_ns()

    def serve(self) -> None:
        """Do what is due by now, and take in the frames that wait."""
        self._act(self._clock.now_ns())  # before them: they come now
        while (frame := self.link.receive(0)) is not None:
            self._take_in(frame, self._clock.now_ns())
        self._act(self._clock.now_ns())

    def run(self, stop: threading.Event) -> None:
        """Serve until `stop` is set; for a thread or process of its own."""
        while not stop.is_set():
            nap_ns = self._clock.now_ns() + _NAP_NS
            due_ns = self.next_due_ns()
            frame = self.link.receive(nap_ns if due_ns is None else min(due_ns, nap_ns))
            if frame is not None:
                self._take_in(frame, self._clock.now_ns())
            self._act(self._clock.now_ns())

    def close(self) -> None:
        """Leave the bus."""
        self.link.close()

    def _take_in(self, frame: Frame, now_ns: int) -> None:
        if frame.is_error or not self._is_addressed(frame):
            return
        if self._replies.is_cut_off(now_ns):
            return
        if self.registers.is_waking:
            self.n_disturbances += 1
            return
        if self.faults.hit("dropped-requests", now_ns):
            return
        try:
            self._obey(frame, now_ns)
        except FrameError:
            return  # a puck does not answer what it does not understand

    def _is_addressed(self, frame: Frame) -> bool:
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
        settings, done_ns = self._settings, now_ns + _SETTING_NS
        if frame.identifier & 0x1F == TORQUE_GROUP and len(frame.data) == 8:
            torque = decode_torques(frame.data)[self.registers.slot]
            self._events.add(done_ns, lambda due: settings.drive(torque, due))
            return
        number, value = decode_request(frame.data)
        if value is not None:
            new = value
            self._events.add(done_ns, lambda due: settings.set(number, new, due))
        elif number == self.registers.position_id:
            self._replies.reply_position(now_ns)
        else:
            self._replies.reply(number, now_ns)

    def _act(self, now_ns: int) -> None:
        self._events.run_due(now_ns)
        self.motor.advance(now_ns)


def emulate(
    options: PuckOptions, *, clock: Clock, hand: Hand, range_end: float
) -> PuckEmulator:
    """Put the emulated puck of some options onto their bus."""
    return PuckEmulator(
        link=open_link(options.interface, options.channel, clock=clock),
        clock=clock,
        hand=hand,
        range_end=range_end,
        options=options.emulator or EmulatorOptions(),
        puck=options.puck,
    )

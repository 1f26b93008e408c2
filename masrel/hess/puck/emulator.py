"""An emulated Puck on a CAN bus, with a simulated arm and faults on demand.

It does what the driver must cope with: it starts in its monitor, where the same
numbers mean other things; it leaves the bus while it wakes; it does not acknowledge a
setting; it brakes the arm when idle; and it holds its last torque for ever.
"""

import threading

from masrel.errors import FrameError
from masrel.hess.clock import Clock
from masrel.hess.hand import Hand
from masrel.hess.puck.bus import Frame, Link
from masrel.hess.puck.due import DueActs
from masrel.hess.puck.emulated_settings import EmulatedSettings
from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.faults import ActiveFaults
from masrel.hess.puck.identifiers import HOST, TORQUE_GROUP, split_identifier
from masrel.hess.puck.motor import EmulatedMotor
from masrel.hess.puck.registers import Registers
from masrel.hess.puck.requests import decode_request
from masrel.hess.puck.torques import decode_torques
from masrel.hess.puck.transmission import Transmission
from masrel.hess.puck.voice import EmulatedVoice

__all__ = ["PuckEmulator"]

_SETTING_NS = 110_000  # six bytes on the bus
_NAP_NS = 10_000_000  # of an emulator with a thread of its own


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
        self._link = link
        self._clock = clock
        self._puck = puck
        self._due = DueActs()
        self.faults = ActiveFaults(options.faults)
        self.registers = Registers(options, puck)
        self.motor = _motor(hand, range_end, options)
        if not options.awake:  # counts from where it was when it was switched on
            self.registers.offset = -self.motor.counts(clock.now_ns())
        self._voice = EmulatedVoice(
            link=link,
            puck=puck,
            options=options,
            registers=self.registers,
            motor=self.motor,
            faults=self.faults,
            due=self._due,
        )
        self._settings = EmulatedSettings(
            options=options,
            registers=self.registers,
            motor=self.motor,
            faults=self.faults,
            voice=self._voice,
            due=self._due,
        )
        self.settings = self._settings.told
        self.n_disturbances = 0

    def next_due_ns(self) -> int | None:
        """Return when it will act next."""
        return self._due.next_ns()

    def serve(self) -> None:
        """Do what is due by now, and take in the frames that wait."""
        self._act(self._clock.now_ns())  # before them: they come now
        while (frame := self._link.receive(0)) is not None:
            self._take(frame, self._clock.now_ns())
        self._act(self._clock.now_ns())

    def run(self, stop: threading.Event) -> None:
        """Serve until told to stop; for a thread or process of its own."""
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
        if self._voice.is_cut_off(now_ns):
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
        puck = self._settings
        if frame.identifier & 0x1F == TORQUE_GROUP and len(frame.data) == 8:
            torque = decode_torques(frame.data)[self.registers.slot]
            self._due.at(now_ns + _SETTING_NS, lambda due: puck.drive(torque, due))
            return
        number, value = decode_request(frame.data)
        if value is not None:
            given = value
            self._due.at(now_ns + _SETTING_NS, lambda due: puck.set(number, given, due))
        elif number == self.registers.position_number:
            self._voice.answer_position(now_ns)
        else:
            self._voice.answer(number, now_ns)

    def _act(self, now_ns: int) -> None:
        self._due.act(now_ns)
        self.motor.advance(now_ns)


def _motor(hand: Hand, range_end: float, options: EmulatorOptions) -> EmulatedMotor:
    transmission = Transmission(
        counts_per_turn=options.counts_per_turn,
        units_per_nm=options.units_per_nm,
        gear_ratio=options.gear_ratio,
        direction=options.direction,
    )
    return EmulatedMotor(
        hand=hand,
        range_end=range_end,
        transmission=transmission,
        braking=options.braking,
    )

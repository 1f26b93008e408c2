"""What an emulated puck does when it is told something, and what befalls it."""

from collections import deque
from typing import NamedTuple

from masrel.hess.puck.bus import BUS_OFF, BUS_RESTARTED
from masrel.hess.puck.due import DueActs
from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.faults import ActiveFaults
from masrel.hess.puck.motor import EmulatedMotor
from masrel.hess.puck.registers import Registers
from masrel.hess.puck.states import IDLE, TORQUE
from masrel.hess.puck.voice import EmulatedVoice

__all__ = ["EmulatedSettings", "Setting"]

_REMEMBERED = 10_000


class Setting(NamedTuple):
    """What an emulated puck was told."""

    time_ns: int  # when it took effect
    name: str  # the property, or its number where the table has no name for it
    value: int  # its new value


class EmulatedSettings:
    """Takes settings, switches the motor, and lets the faults of a puck happen."""

    __slots__ = (
        "_due",
        "_faults",
        "_motor",
        "_options",
        "_registers",
        "_voice",
        "told",
    )

    def __init__(
        self,
        *,
        options: EmulatorOptions,
        registers: Registers,
        motor: EmulatedMotor,
        faults: ActiveFaults,
        voice: EmulatedVoice,
        due: DueActs,
    ) -> None:
        self._options = options
        self._registers = registers
        self._motor = motor
        self._faults = faults
        self._voice = voice
        self._due = due
        self.told: deque[Setting] = deque(maxlen=_REMEMBERED)

    def set(self, number: int, value: int, now_ns: int) -> None:
        """Set a property."""
        registers = self._registers
        name = registers.name(number)
        if name == "T" and self._faults.hit("dropped-torques", now_ns):
            return
        self.told.append(Setting(now_ns, name, value))
        if name == "T":
            self.drive(value, now_ns)
        elif name == "P":
            registers.offset = value - self._motor.counts(now_ns)
        elif name == "MODE":
            self._switch(value, now_ns)
        elif registers.set(number, value):  # it wakes
            wake_ns = round(self._options.wake_s * 1e9)
            self._due.at(now_ns + wake_ns, lambda _due: registers.wake())

    def drive(self, units: int, now_ns: int) -> None:
        """Take a torque, as the packed frame for four pucks sets it too."""
        registers = self._registers
        registers.torque = max(-registers.highest, min(registers.highest, units))
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
        for fault in self._options.faults:
            begin_ns = start_ns + round(fault.start_s * 1e9)
            if fault.kind == "idled":
                self._due.at(begin_ns, self._idle)
            elif fault.kind == "reset":
                self._due.at(begin_ns, self._reset)
            elif fault.kind == "bus-off":
                self._due.at(begin_ns, lambda _due: self._voice.report(BUS_OFF))
                if fault.end_s < float("inf"):
                    end_ns = start_ns + round(fault.end_s * 1e9)
                    self._due.at(end_ns, lambda _due: self._voice.report(BUS_RESTARTED))

    def _idle(self, now_ns: int) -> None:
        self.told.append(Setting(now_ns, "MODE", IDLE))
        self._switch(IDLE, now_ns)

    def _reset(self, now_ns: int) -> None:
        self._idle(now_ns)
        self._registers.fall_asleep()
        self._registers.offset = -self._motor.counts(now_ns)

"""An emulated Puck on a CAN bus, with a simulated arm and faults on demand.

It does what the driver must cope with: it starts in its monitor, where the same
numbers mean other things; it leaves the bus while it wakes; it does not acknowledge a
setting; it brakes the arm when idle; and it holds its last torque permanently.
"""

import math
from collections import deque
from typing import NamedTuple

from masrel.lab.hess._can import Frame, Link
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._emulated import EmulatedAmplifier, Motor
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.puck._bus import (
    POSITION_GROUP,
    PROPERTY_GROUP,
    SAFETY_NODE,
    SAMPLING_NS,
    decode_request,
    encode_position,
    encode_value,
    from_node,
    reply_identifiers,
)
from masrel.lab.hess.puck._puck_options import (
    ASLEEP,
    BROKEN,
    ERROR,
    ID,
    IDLE,
    READY,
    ROLE,
    SERIAL_NUMBER,
    STATUS,
    TORQUE,
    VERSION,
    EmulatorOptions,
    PuckOptions,
    Transmission,
    property_table,
)

_SETTING_NS = 110_000  # six bytes on the bus
_REPLY_NS = 150_000  # to the end of the reply
_MAX_SETTINGS = 10_000  # that are remembered

# What a puck answers before it has been woken; other numbers mean other things then.
_UNIVERSAL = {
    VERSION: "VERS",
    ROLE: "ROLE",
    SERIAL_NUMBER: "SN",
    ID: "ID",
    ERROR: "ERROR",
    STATUS: "STAT",
}
_MONITOR = {8: "LOCK", 9: "SAVE", 10: "LOAD"}
_FACTORY = {"MT": 4860, "GRPA": 0, "GRPB": 2, "GRPC": 5, "POLES": 12}
_MEASURED = {"TEMP": 31, "PTEMP": 33, "THERM": 30, "VBUS": 48}


class Setting(NamedTuple):
    """A property of an emulated puck that was set."""

    time_ns: int  # when it took effect
    name: str  # the property, or its number where the table has no name for it
    value: int  # its new value


class PuckEmulator(EmulatedAmplifier):
    """A puck."""

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
        super().__init__(
            link=link,
            clock=clock,
            faults=options.faults,
            motor=Motor(hand, range_end, options.arm),
            counts_per_turn=options.counts_per_turn,
            address=puck,  # as the host is node 0
        )
        self._transmission = Transmission(
            counts_per_turn=options.counts_per_turn,
            units_per_nm=options.units_per_nm,
            gear_ratio=options.gear_ratio,
            direction=options.direction,
        )
        self._options = options
        self._puck = puck
        self._table = options.properties or property_table(options.firmware)
        self._names = {number: name for name, number in self._table.numbers.items()}
        self._values: dict[str, int] = {
            **_FACTORY,
            **_MEASURED,
            "CTS": options.counts_per_turn,
            "IPNM": options.units_per_nm,
            "VERS": options.firmware,
            "ROLE": options.role,
            "SN": 4711,
            "ID": puck,
            "ERROR": 0,
        }
        self._is_awake, self._is_waking = options.awake, False
        self.mode, self.torque = IDLE, 0  # the latter in current units
        # Of the position that it reports: asleep it counts from where it was when it
        # was switched on
        self._offset = 0 if options.awake else -self._counts(clock.now_ns())
        self.settings: deque[Setting] = deque(maxlen=_MAX_SETTINGS)
        self.n_disturbances = 0  # frames that came while it was waking

    def _counts(self, now_ns: int) -> int:
        # Of the encoder, from full flexion
        return self._transmission.counts(self.motor.angle(now_ns))

    # What comes from the bus

    def _obey(self, frame: Frame, now_ns: int) -> None:
        if self._is_waking:
            self.n_disturbances += 1
            return
        number, value = decode_request(frame.data)
        if value is not None:
            new = value
            self._at(now_ns + _SETTING_NS, lambda due: self._set(number, new, due))
        elif self._name(number) == "P":
            self._at(now_ns + SAMPLING_NS, self._sample)
            self._interfere(now_ns)
        else:
            self._at(now_ns + _REPLY_NS, lambda due: self._reply(number, due))

    def _name(self, number: int) -> str:
        # What a number means now
        names = self._names if self._is_awake else _MONITOR
        return _UNIVERSAL.get(number) or names.get(number, str(number))

    # What it is told

    def _set(self, number: int, value: int, now_ns: int) -> None:
        name = self._name(number)
        if name == "T" and self.faults.hit("dropped-torques", now_ns):
            return
        self.settings.append(Setting(now_ns, name, value))
        if name == "T":
            self._drive(value, now_ns)
        elif name == "P":
            self._offset = value - self._counts(now_ns)
        elif name == "MODE":
            self._switch(value, now_ns)
        elif name == "STAT" and not self._is_awake and value == READY:
            self._is_waking = True
            self._at(now_ns + round(self._options.wake_s * 1e9), self._wake)
        elif self._is_awake and name in _FACTORY:
            self._values[name] = value

    def _wake(self, _now_ns: int) -> None:
        self._is_awake, self._is_waking = True, False

    def _drive(self, units: int, now_ns: int) -> None:
        most = self._values["MT"]
        self.torque = max(-most, min(most, units))
        if self.mode == TORQUE:
            self._turn(now_ns)

    def _switch(self, mode: int, now_ns: int) -> None:
        self.mode = mode
        if mode != TORQUE:
            self.torque = 0
            self.motor.brake(now_ns, self._options.braking)
            return
        self._begin_faults(now_ns)
        self._turn(now_ns)

    def _turn(self, now_ns: int) -> None:
        torque = self.faults.torque(self._transmission.torque(self.torque), now_ns)
        self.motor.drive(torque, now_ns)

    # What goes wrong by itself

    def _idle(self, now_ns: int) -> None:
        self.settings.append(Setting(now_ns, "MODE", IDLE))
        self._switch(IDLE, now_ns)

    def _reset(self, now_ns: int) -> None:
        # It loses what is not in permanent memory, the position first
        self._idle(now_ns)
        self._is_awake = False
        self._values.update(_FACTORY)
        self._offset = -self._counts(now_ns)

    def _foreign_frames(self) -> tuple[Frame, ...]:
        other = self._puck % 31 + 1
        return (
            Frame(from_node(SAFETY_NODE, 0), bytes(8)),
            Frame(from_node(other, POSITION_GROUP), b"\x12\x34\x56"),
            Frame(from_node(other, PROPERTY_GROUP), b"\x88\x00\x00\x00"),
            Frame(self._puck, b"\x30"),  # an echo of the host
        )

    # What it answers

    def _reply(self, number: int, now_ns: int) -> None:
        # With a property's value at the time when the reply is sent
        value = self._value(number)
        if value is None:
            return
        reply = Frame(reply_identifiers(self._puck)[1], encode_value(number, value))
        self._answer(reply, now_ns)

    def _value(self, number: int) -> int | None:
        name = self._name(number)
        if name == "STAT":
            awake = READY if self._is_awake else ASLEEP
            return BROKEN if self._options.has_error else awake
        if not self._is_awake and number not in _UNIVERSAL:
            return None
        live = {"MODE": self.mode, "T": self.torque}
        return live.get(name, self._values.get(name))

    def _sample(self, now_ns: int) -> None:
        counts = self._encoder_counts(self._counts(now_ns), now_ns)
        data = encode_position(counts + self._offset)
        reply = Frame(reply_identifiers(self._puck)[0], data)
        self._answer(reply, now_ns + _REPLY_NS - SAMPLING_NS)


def connected(
    options: PuckOptions,
    *,
    clock: Clock,
    hand: Hand | None = None,
    range_end: float = math.radians(146.0),
    all_nodes: bool = False,
) -> Link:
    """Join a bus for a while, with an emulated puck on it where there is a hand.

    Parameters
    ----------
    options : PuckOptions
        Which bus, and which puck on it.
    clock : Clock
        The clock of deadlines.
    hand : Hand or None, optional
        What moves the arm of an emulated puck.
    range_end : float, optional
        Where that arm meets its end stop, rad.
    all_nodes : bool, optional
        Whether to receive the frames of all nodes rather than of one puck.

    Returns
    -------
    Link
        This end of the bus, for a ``with`` block; its `peer` is the emulated puck.

    Raises
    ------
    DeviceError
        If the bus cannot be opened.
    """
    emulator = None
    if hand is not None:
        emulator = PuckEmulator(
            link=options.open_link(clock),
            clock=clock,
            hand=hand,
            range_end=range_end,
            options=options.emulator or EmulatorOptions(),
            puck=options.puck,
        )
    accepted = None if all_nodes else reply_identifiers(options.puck)
    return options.open_link(clock, accepted=accepted, peer=emulator)

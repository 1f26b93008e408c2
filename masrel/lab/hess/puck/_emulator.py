"""An emulated Puck on a CAN bus, with a simulated arm and faults on demand.

It does what the driver must cope with: it starts in its monitor, where the same
numbers mean other things; it leaves the bus while it wakes; it does not acknowledge a
setting; it brakes the arm when idle; and it holds its last torque for ever.
"""

import heapq
import math
from collections import Counter, deque
from collections.abc import Callable
from typing import NamedTuple

from masrel.errors import FrameError
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._simulated import Plant, PlantParameters
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.puck._bus import (
    BUS_OFF,
    BUS_RESTARTED,
    POSITION_GROUP,
    PROPERTY_GROUP,
    SAFETY_NODE,
    Frame,
    Link,
    decode_request,
    encode_position,
    encode_value,
    from_node,
    open_link,
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
    FaultKind,
    InjectedFault,
    PuckOptions,
    Transmission,
    property_table,
)

_SETTING_NS = 110_000  # six bytes on the bus
_SAMPLING_NS = 75_000  # from a request to the sample
_REPLY_NS = 150_000  # to the end of the reply
_DUPLICATE_NS = 100_000
_BRAKING_STEP_NS = 500_000
_MAX_SETTINGS = 10_000  # that are remembered

_PROTOCOL_ERROR = 0x088  # class of an error frame: protocol violation, bus error

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


class _Motor:
    """A simulated arm, driven by current units or braked, and read in counts."""

    def __init__(self, hand: Hand, range_end: float, options: EmulatorOptions) -> None:
        # The current units on the bus are the quantum already.
        parameters = PlantParameters(range_end=range_end, torque_step=0.0)
        self.plant = Plant(hand, parameters)
        self._transmission = Transmission(
            counts_per_turn=options.counts_per_turn,
            units_per_nm=options.units_per_nm,
            gear_ratio=options.gear_ratio,
            direction=options.direction,
        )
        self._braking = options.braking
        self._has_moved = self._is_driven = False

    def angle(self, now_ns: int) -> float:
        """Return where the arm is, rad."""
        self.advance(now_ns)
        return self.plant.angle_at(now_ns)

    def counts(self, now_ns: int) -> int:
        """Return the count of the encoder, from full flexion."""
        return self._transmission.counts(self.angle(now_ns))

    def drive(self, units: int, now_ns: int) -> None:
        """Turn with a torque until the next command."""
        if not self._has_moved:
            self._has_moved = True
            self.plant.begin(now_ns)
        self.advance(now_ns)
        self._is_driven = True
        self.plant.command(self._transmission.torque(units), now_ns)

    def brake(self, now_ns: int) -> None:
        """Short the windings: an idle motor damps the arm."""
        self.advance(now_ns)
        self._is_driven = False

    def advance(self, now_ns: int) -> None:
        """Let the arm move up to a time; it does not before it is first driven."""
        plant = self.plant
        if self._is_driven:
            plant.advance(now_ns)
        elif self._has_moved:
            while plant.now_ns + _BRAKING_STEP_NS <= now_ns:
                plant.command(self._braking * plant.velocity, plant.now_ns)
                plant.advance(plant.now_ns + _BRAKING_STEP_NS)


class _Faults:
    """The faults of one emulated puck, from when it is first in torque mode."""

    def __init__(self, faults: tuple[InjectedFault, ...]) -> None:
        self._faults = faults
        self._n_hit: Counter[FaultKind] = Counter()
        self.started_ns: int | None = None

    def active(self, kind: FaultKind, now_ns: int) -> InjectedFault | None:
        """Return the fault of a kind that is on."""
        if self.started_ns is None or not self._faults:
            return None
        since_s = (now_ns - self.started_ns) * 1e-9
        for fault in self._faults:
            if fault.kind == kind and fault.start_s <= since_s < fault.end_s:
                return fault
        return None

    def hit(self, kind: FaultKind, now_ns: int) -> InjectedFault | None:
        """Count a frame, and return the fault that affects it."""
        fault = self.active(kind, now_ns)
        if fault is None:
            return None
        self._n_hit[kind] += 1
        return fault if (self._n_hit[kind] - 1) % fault.every == 0 else None

    def amount(self, kind: FaultKind, now_ns: int) -> float:
        """Count a frame, and return how much of a fault affects it."""
        fault = self.hit(kind, now_ns)
        return 0.0 if fault is None else fault.amount


class PuckEmulator:
    """A puck, served by whoever waits for it."""

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
        self.motor = _Motor(hand, range_end, options)
        # Of the position that it reports: asleep it counts from where it was when it
        # was switched on
        self._offset = 0 if options.awake else -self.motor.counts(clock.now_ns())
        self.faults = _Faults(options.faults)
        self._frozen_counts: int | None = None  # at which its encoder stands still
        self._last_reply_ns = 0
        self._events: list[tuple[int, int, Callable[[int], None]]] = []
        self._n_events = 0
        self.settings: deque[Setting] = deque(maxlen=_MAX_SETTINGS)
        self.n_disturbances = 0  # frames that came while it was waking

    # Time: events wait for theirs, and those of one time keep their order

    def next_due_ns(self) -> int | None:
        """Return when it will act next."""
        return self._events[0][0] if self._events else None

    def serve(self) -> None:
        """Do what is due by now, and take in the frames that wait."""
        self._act(self._clock.now_ns())  # before them: they come now
        while (frame := self.link.receive(0)) is not None:
            self._take_in(frame, self._clock.now_ns())
        self._act(self._clock.now_ns())

    def close(self) -> None:
        """Leave the bus."""
        self.link.close()

    def _at(self, due_ns: int, event: Callable[[int], None]) -> None:
        # The event is called with the time at which it was due
        self._n_events += 1
        heapq.heappush(self._events, (due_ns, self._n_events, event))

    def _act(self, now_ns: int) -> None:
        while self._events and self._events[0][0] <= now_ns:
            due_ns, _, event = heapq.heappop(self._events)
            event(due_ns)
        self.motor.advance(now_ns)

    # What comes from the bus

    def _take_in(self, frame: Frame, now_ns: int) -> None:
        # A frame of the host to one puck has its number: the host is node 0
        is_addressed = frame.identifier == self._puck and not frame.is_error
        if not is_addressed or self._is_cut_off(now_ns):
            return
        if self._is_waking:
            self.n_disturbances += 1
        elif not self.faults.hit("dropped-requests", now_ns):
            try:
                self._obey(frame, now_ns)
            except FrameError:
                return  # a puck does not answer what it does not understand

    def _is_cut_off(self, now_ns: int) -> bool:
        # Whether no frame comes or goes
        active = self.faults.active
        return bool(active("unplugged", now_ns) or active("bus-off", now_ns))

    def _obey(self, frame: Frame, now_ns: int) -> None:
        number, value = decode_request(frame.data)
        if value is not None:
            new = value
            self._at(now_ns + _SETTING_NS, lambda due: self._set(number, new, due))
        elif self._name(number) == "P":
            self._at(now_ns + _SAMPLING_NS, self._sample)
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
            self._offset = value - self.motor.counts(now_ns)
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
            self.motor.drive(self.torque, now_ns)

    def _switch(self, mode: int, now_ns: int) -> None:
        self.mode = mode
        if mode != TORQUE:
            self.torque = 0
            self.motor.brake(now_ns)
            return
        if self.faults.started_ns is None:
            self.faults.started_ns = now_ns
            for fault in self._options.faults:
                self._schedule(fault, now_ns)
        self.motor.drive(self.torque, now_ns)

    # What goes wrong by itself

    def _schedule(self, fault: InjectedFault, start_ns: int) -> None:
        begin_ns = start_ns + round(fault.start_s * 1e9)
        if fault.kind == "idled":
            self._at(begin_ns, self._idle)
        elif fault.kind == "reset":
            self._at(begin_ns, self._reset)
        elif fault.kind == "bus-off":
            self._at(begin_ns, lambda _due: self._report_error(BUS_OFF))
            if fault.end_s < math.inf:
                end_ns = start_ns + round(fault.end_s * 1e9)
                self._at(end_ns, lambda _due: self._report_error(BUS_RESTARTED))

    def _idle(self, now_ns: int) -> None:
        self.settings.append(Setting(now_ns, "MODE", IDLE))
        self._switch(IDLE, now_ns)

    def _reset(self, now_ns: int) -> None:
        # It loses what is not in permanent memory, the position first
        self._idle(now_ns)
        self._is_awake = False
        self._values.update(_FACTORY)
        self._offset = -self.motor.counts(now_ns)

    def _report_error(self, error_class: int) -> None:
        # As the host's adapter would
        self.link.send(Frame(error_class, bytes(8), is_error=True))

    def _interfere(self, now_ns: int) -> None:
        # What else is on the bus when a position is requested
        if self.faults.hit("foreign-frames", now_ns):
            other = self._puck % 31 + 1
            for frame in (
                Frame(from_node(SAFETY_NODE, 0), bytes(8)),
                Frame(from_node(other, POSITION_GROUP), b"\x12\x34\x56"),
                Frame(from_node(other, PROPERTY_GROUP), b"\x88\x00\x00\x00"),
                Frame(self._puck, b"\x30"),  # an echo of the host
            ):
                self.link.send(frame)
        if self.faults.hit("error-frames", now_ns):
            self._report_error(_PROTOCOL_ERROR)

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
        counts = self._encoder_counts(self.motor.counts(now_ns), now_ns)
        data = encode_position(counts + self._offset)
        reply = Frame(reply_identifiers(self._puck)[0], data)
        self._answer(reply, now_ns + _REPLY_NS - _SAMPLING_NS)

    def _encoder_counts(self, counts: int, now_ns: int) -> int:
        # What a faulty encoder makes of a count
        if not self.faults.hit("frozen-encoder", now_ns):
            self._frozen_counts = None
        elif self._frozen_counts is None:
            self._frozen_counts = counts
        if self._frozen_counts is not None:
            counts = self._frozen_counts
        if self.faults.hit("wrapping-encoder", now_ns):
            counts %= self._options.counts_per_turn
        return counts + round(self.faults.amount("jumping-encoder", now_ns))

    def _answer(self, frame: Frame, due_ns: int) -> None:
        if self.faults.hit("dropped-replies", due_ns):
            return
        if self.faults.hit("short-replies", due_ns):
            frame = frame._replace(data=frame.data[:-1])
        due_ns += round(self.faults.amount("late-replies", due_ns) * 1e9)
        # A puck answers requests in their order.
        self._last_reply_ns = due_ns = max(due_ns, self._last_reply_ns + 1)
        self._at(due_ns, lambda due: self._send(frame, due))
        if self.faults.hit("duplicated-replies", due_ns):
            self._at(due_ns + _DUPLICATE_NS, lambda due: self._send(frame, due))

    def _send(self, frame: Frame, now_ns: int) -> None:
        if not self._is_cut_off(now_ns):
            self.link.send(frame)


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
            link=open_link(options.interface, options.channel, clock=clock),
            clock=clock,
            hand=hand,
            range_end=range_end,
            options=options.emulator or EmulatorOptions(),
            puck=options.puck,
        )
    return open_link(
        options.interface,
        options.channel,
        clock=clock,
        accepted=None if all_nodes else reply_identifiers(options.puck),
        peer=emulator,
    )

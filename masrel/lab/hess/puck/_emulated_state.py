"""What an emulated puck remembers: its properties, its arm, its faults, and events."""

import heapq
from collections.abc import Callable

from masrel.lab.hess._plant import Plant, PlantParameters
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.puck._properties import (
    ASLEEP,
    BROKEN,
    ERROR,
    ID,
    IDLE,
    MEMORY_WRITERS,
    READY,
    ROLE,
    SERIAL_NUMBER,
    STATUS,
    VERSION,
    property_table,
)
from masrel.lab.hess.puck._puck_options import EmulatorOptions, FaultKind, InjectedFault
from masrel.lab.hess.puck._transmission import Transmission

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
_FACTORY = {"MT": 4860, "PIDX": 1, "GRPA": 0, "GRPB": 2, "GRPC": 5, "POLES": 12}
_MEASURED = {"TEMP": 31, "PTEMP": 33, "THERM": 30, "VBUS": 48}

_BRAKING_STEP_NS = 500_000


class Registers:
    """What an emulated puck answers and remembers, asleep and awake."""

    def __init__(self, options: EmulatorOptions, puck: int) -> None:
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
        self.is_waking = False
        self.n_memory_writes = 0
        self.offset = 0  # of the position that it reports, counts
        self.mode = IDLE
        self.torque = 0  # current units
        self._has_error = options.has_error
        self._is_awake = options.awake
        if not options.awake:
            self.fall_asleep()

    @property
    def position_id(self) -> int:
        """Number of P; -1 while it is asleep and has none."""
        return self._table.number("P") if self._is_awake else -1

    @property
    def groups(self) -> tuple[int, ...]:
        """Groups that it listens to."""
        return tuple(self._values[name] for name in ("GRPA", "GRPB", "GRPC"))

    @property
    def slot(self) -> int:
        """Its place in a frame of packed torques, from 0."""
        return (self._values["PIDX"] - 1) % 4

    @property
    def max_torque(self) -> int:
        """Largest torque, current units."""
        return self._values["MT"]

    def name(self, number: int) -> str:
        """Return what a number means now."""
        if number in _UNIVERSAL:
            return _UNIVERSAL[number]
        names = self._names if self._is_awake else _MONITOR
        return names.get(number, str(number))

    def value(self, number: int) -> int | None:
        """Return what it answers; None when it does not."""
        if number == STATUS and self._has_error:
            return BROKEN
        if number == STATUS:
            return READY if self._is_awake else ASLEEP
        if not self._is_awake and number not in _UNIVERSAL:
            return None
        name = self.name(number)
        if name == "MODE":
            return self.mode
        return self.torque if name == "T" else self._values.get(name)

    def set(self, number: int, value: int) -> bool:
        """Set a property that neither moves nor brakes the arm -> whether it wakes."""
        name = self.name(number)
        if name in MEMORY_WRITERS:
            self.n_memory_writes += 1
        elif name == "STAT" and not self._is_awake and value == READY:
            self.is_waking = True
            return True
        elif self._is_awake and name in _FACTORY:
            self._values[name] = value
        return False

    def wake(self) -> None:
        """Come back onto the bus."""
        self.is_waking = False
        self._is_awake = True

    def fall_asleep(self) -> None:
        """Lose everything that is not in permanent memory, the position first."""
        self._is_awake = False
        self.mode = IDLE
        self.torque = 0
        self._values.update(_FACTORY)


class EmulatedMotor:
    """A simulated arm, driven by current units or braked, and read in counts."""

    __slots__ = (
        "_braking",
        "_hand",
        "_is_driven",
        "_parameters",
        "_plant",
        "_transmission",
    )

    def __init__(
        self,
        *,
        hand: Hand,
        range_end: float,
        transmission: Transmission,
        braking: float,
    ) -> None:
        self._hand = hand
        # The current units on the bus are the quantum already.
        self._parameters = PlantParameters(range_end=range_end, torque_step=0.0)
        self._transmission = transmission
        self._braking = braking
        self._is_driven = False
        self._plant: Plant | None = None
        Plant(hand, self._parameters, start_ns=0)  # refuses what does not fit

    @property
    def torque_nm(self) -> float:
        """Torque of the motor at the elbow now, N·m; positive resists extension."""
        return 0.0 if self._plant is None else self._plant.motor_torque

    @property
    def velocity(self) -> float:
        """Speed of the arm now, rad/s."""
        return 0.0 if self._plant is None else self._plant.velocity

    def angle(self, now_ns: int) -> float:
        """Return where the arm is, rad."""
        if self._plant is None:
            return self._hand.start
        self.advance(now_ns)
        return self._plant.angle_at(now_ns)

    def counts(self, now_ns: int) -> int:
        """Return the count of the encoder, from full flexion."""
        return self._transmission.counts(self.angle(now_ns))

    def drive(self, units: int, now_ns: int) -> None:
        """Turn with a torque until the next command."""
        if self._plant is None:
            self._plant = Plant(self._hand, self._parameters, start_ns=now_ns)
        self.advance(now_ns)
        self._is_driven = True
        self._plant.command(self._transmission.torque(units), now_ns)

    def brake(self, now_ns: int) -> None:
        """Short the windings: an idle motor damps the arm."""
        self.advance(now_ns)
        self._is_driven = False

    def advance(self, now_ns: int) -> None:
        """Let the arm move up to a time; it does not before it is first driven."""
        plant = self._plant
        if plant is None:
            return
        if self._is_driven:
            plant.advance(now_ns)
            return
        while plant.now_ns + _BRAKING_STEP_NS <= now_ns:
            plant.command(self._braking * plant.velocity, plant.now_ns)
            plant.advance(plant.now_ns + _BRAKING_STEP_NS)


class ActiveFaults:
    """The faults of one emulated puck, from when it is first in torque mode."""

    __slots__ = ("_faults", "_n_hit", "started_ns")

    def __init__(self, faults: tuple[InjectedFault, ...]) -> None:
        self._faults = faults
        self.started_ns: int | None = None
        self._n_hit: dict[FaultKind, int] = {}

    def start(self, now_ns: int) -> bool:
        """Let their time begin -> whether it had not begun before."""
        if self.started_ns is not None:
            return False
        self.started_ns = now_ns
        return True

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
        self._n_hit[kind] = n_hit = self._n_hit.get(kind, 0) + 1
        return fault if (n_hit - 1) % fault.every == 0 else None

    def amount(self, kind: FaultKind, now_ns: int) -> float:
        """Count a frame, and return how much of a fault affects it."""
        fault = self.hit(kind, now_ns)
        return 0.0 if fault is None else fault.amount


class EventQueue:
    """Events that wait for their time; those of one time keep their order."""

    __slots__ = ("_events", "_n_added")

    def __init__(self) -> None:
        self._events: list[tuple[int, int, Callable[[int], None]]] = []
        self._n_added = 0

    def add(self, due_ns: int, event: Callable[[int], None]) -> None:
        """Add an event, which will be called with the time at which it was due."""
        self._n_added += 1  # orders what is due at the same time
        heapq.heappush(self._events, (due_ns, self._n_added, event))

    def next_due_ns(self) -> int | None:
        """Return when the next event is due."""
        return self._events[0][0] if self._events else None

    def run_due(self, now_ns: int) -> None:
        """Run the events that are due by now, and those that they add."""
        while self._events and self._events[0][0] <= now_ns:
            due_ns, _, event = heapq.heappop(self._events)
            event(due_ns)


class EmulatedState:
    """Registers, motor, faults and events of one emulated puck."""

    __slots__ = ("events", "faults", "motor", "options", "puck", "registers")

    def __init__(
        self, options: EmulatorOptions, puck: int, hand: Hand, range_end: float
    ) -> None:
        self.options = options
        self.puck = puck
        self.registers = Registers(options, puck)
        self.motor = EmulatedMotor(
            hand=hand,
            range_end=range_end,
            transmission=Transmission(
                counts_per_turn=options.counts_per_turn,
                units_per_nm=options.units_per_nm,
                gear_ratio=options.gear_ratio,
                direction=options.direction,
            ),
            braking=options.braking,
        )
        self.faults = ActiveFaults(options.faults)
        self.events = EventQueue()

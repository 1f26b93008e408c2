"""The properties of an emulated puck, asleep and awake."""

from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.properties import (
    ERROR,
    ID,
    MONITOR_ANSWERS,
    ROLE,
    SERIAL_NUMBER,
    STATUS,
    VERSION,
    property_table,
)
from masrel.hess.puck.states import ASLEEP, BROKEN, IDLE, READY

__all__ = ["Registers"]

_WAKE = READY  # setting STAT to this wakes
_UNIVERSAL = {
    "VERS": VERSION,
    "ROLE": ROLE,
    "SN": SERIAL_NUMBER,
    "ID": ID,
    "ERROR": ERROR,
    "STAT": STATUS,
}
_FACTORY = {"MT": 4860, "PIDX": 1, "GRPA": 0, "GRPB": 2, "GRPC": 5, "POLES": 12}
_MEASURED = {"TEMP": 31, "PTEMP": 33, "THERM": 30, "VBUS": 48}


class Registers:
    """What an emulated puck answers and remembers."""

    def __init__(self, options: EmulatorOptions, puck: int) -> None:
        self.table = options.properties or property_table(options.firmware)
        self._names = {number: name for name, number in self.table.numbers.items()}
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
        self._universal = {number: name for name, number in _UNIVERSAL.items()}
        self.is_waking = False
        self.n_memory_writes = 0
        self.offset = 0
        self.mode = IDLE
        self.torque = 0
        self._has_error = options.has_error
        self._is_awake = options.awake
        if not options.awake:
            self.fall_asleep()

    @property
    def position_number(self) -> int:
        """Number of P; -1 while it is asleep and has none."""
        return self.table.number("P") if self._is_awake else -1

    @property
    def groups(self) -> tuple[int, ...]:
        """Groups it listens to."""
        return tuple(self._values[name] for name in ("GRPA", "GRPB", "GRPC"))

    @property
    def slot(self) -> int:
        """Its place in a frame of packed torques, from 0."""
        return (self._values["PIDX"] - 1) % 4

    @property
    def highest(self) -> int:
        """Largest torque, current units."""
        return self._values["MT"]

    def name(self, number: int) -> str:
        """Return what a number means now."""
        if number in self._universal:
            return self._universal[number]
        if not self._is_awake:
            return {8: "LOCK", 9: "SAVE", 10: "LOAD"}.get(number, str(number))
        return self._names.get(number, str(number))

    def value(self, number: int) -> int | None:
        """Return what it answers."""
        if number == STATUS and self._has_error:
            return BROKEN
        if number == STATUS:
            return READY if self._is_awake else ASLEEP
        if not self._is_awake and number not in MONITOR_ANSWERS:
            return None
        name = self.name(number)
        if name == "MODE":
            return self.mode
        return self.torque if name == "T" else self._values.get(name)

    def set(self, number: int, value: int) -> bool:
        """Set a property that neither moves nor brakes the motor."""
        name = self.name(number)
        if name in ("SAVE", "LOAD", "DEF", "LOCK"):
            self.n_memory_writes += 1
        elif name == "STAT" and not self._is_awake and value == _WAKE:
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

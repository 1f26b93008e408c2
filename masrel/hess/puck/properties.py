"""Numbers of a Puck's properties, which its firmware decides.

The same number means another property on another firmware, and setting the wrong one
may move an arm: a firmware whose numbers are not known is refused.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from masrel.errors import DeviceError, ParameterError

__all__ = [
    "ERROR",
    "ID",
    "MONITOR_ANSWERS",
    "ROLE",
    "SERIAL_NUMBER",
    "STATUS",
    "VERSION",
    "PropertyTable",
    "property_table",
]

# The same for every type and firmware
VERSION, ROLE, SERIAL_NUMBER, ID, ERROR, STATUS = 0, 1, 2, 3, 4, 5
MONITOR_ANSWERS = frozenset({VERSION, ROLE, SERIAL_NUMBER, ID, ERROR, STATUS})
"""What a puck answers before it has been woken; other numbers mean other things."""

NEEDED = ("MODE", "T", "MT", "P", "CTS", "IPNM", "GRPA", "GRPB", "GRPC")
"""What the driver sets and asks for."""

_WIDE = ("P", "CTS")  # 32 bits, which take the next number too
_NEVER_SET = frozenset({"SAVE", "LOAD", "DEF", "LOCK"})  # they write its memory

_OLDEST, _MOVED, _UNMOVED, _SWAPPED = 65, 114, 119, 132

# From 65 on; V has another number from 114 to 118, and two change places at 132.
_MODERN = {
    "MODE": 8,
    "TEMP": 9,
    "PTEMP": 10,
    "OTEMP": 11,
    "THERM": 20,
    "VBUS": 21,
    "IMOTOR": 22,
    "GRPA": 26,
    "GRPB": 27,
    "GRPC": 28,
    "SAVE": 30,
    "LOAD": 31,
    "DEF": 32,
    "T": 42,
    "MT": 43,
    "V": 44,
    "MV": 45,
    "P": 48,
    "MECH": 66,
    "CTS": 68,
    "PIDX": 70,
    "TSTOP": 78,
    "IPNM": 86,
    "POLES": 90,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PropertyTable:
    """Names of properties and their numbers, for one motor puck's firmware."""

    numbers: Mapping[str, int]  # number of each property by its name, 8 to 127

    def __post_init__(self) -> None:
        missing = [name for name in NEEDED if name not in self.numbers]
        if missing:
            raise ParameterError(f"properties: need {', '.join(missing)} too")
        taken: dict[int, str] = {}
        for name, number in self.numbers.items():
            if not 8 <= number <= 126:
                raise ParameterError(
                    f"properties.{name}: needs 8 to 126, got {number}; "
                    "0 to 7 are the same for every firmware"
                )
            for used in (number, number + 1) if name in _WIDE else (number,):
                if used in taken:
                    raise ParameterError(
                        f"properties.{name}: needs a number of its own, "
                        f"{used} is taken by {taken[used]}"
                    )
                taken[used] = name

    def number(self, name: str) -> int:
        """Return the number of a property."""
        try:
            return self.numbers[name]
        except KeyError:
            raise DeviceError(
                f"puck: property {name} is not in this firmware's table"
            ) from None

    def settable(self, name: str) -> int:
        """Return the number of a property that is to be set."""
        if name in _NEVER_SET:
            raise DeviceError(
                f"puck: {name} writes the puck's permanent memory and is never set"
            )
        return self.number(name)


def property_table(firmware: int) -> PropertyTable:
    """Return the property numbers of a firmware."""
    if firmware < _OLDEST or _MOVED <= firmware < _UNMOVED:
        raise DeviceError(
            f"puck: needs firmware {_OLDEST} to {_MOVED - 1}, or {_UNMOVED} or later, "
            f"got {firmware}"
        )
    swapped = firmware >= _SWAPPED
    later = {"EN": 94, "HOLD": 77} if swapped else {"EN": 77, "HOLD": 94}
    return PropertyTable(numbers={**_MODERN, **later})

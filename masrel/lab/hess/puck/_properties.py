"""Numbers of a Puck's properties, which depend on its firmware.

The same number means another property on another firmware, and setting the wrong one
may move an arm: a firmware whose numbers are not known is refused. In: the version of
a firmware, or a TOML file. Out: a `PropertyTable`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from masrel.errors import DeviceError, ParameterError
from masrel.lab._bounded_files import MAX_SMALL, parse_toml, read_regular

# The same for every type and firmware
VERSION, ROLE, SERIAL_NUMBER, ID, ERROR, STATUS = 0, 1, 2, 3, 4, 5

# Values of STAT: in its monitor, in error, or awake
# (Barrett WAM Arm User's Manual D1001 AH.00, p. 48)
ASLEEP, BROKEN, READY = 0, 1, 2
# Values of MODE; a puck has others, which this driver does not use
IDLE, TORQUE = 0, 2

REQUIRED = ("MODE", "T", "MT", "P", "CTS", "IPNM", "GRPA", "GRPB", "GRPC")
"""What the driver sets and requests."""

MEMORY_WRITERS = frozenset({"SAVE", "LOAD", "DEF", "LOCK"})
"""Setting one of these writes a puck's permanent memory."""

_WIDE = ("P", "CTS")  # 32 bits, which take the next number too

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
    """Names of properties and their numbers, for one motor puck's firmware.

    Attributes
    ----------
    numbers : mapping of str to int
        Number of each property by its name, 8 to 126; at least MODE, T, MT, P, CTS,
        IPNM, GRPA, GRPB and GRPC.

    Raises
    ------
    ParameterError
        If one that the driver needs is missing, a number is out of range, or one
        number stands for two properties.

    Examples
    --------
    >>> property_table(148).number("T")
    42
    """

    numbers: Mapping[str, int]

    def __post_init__(self) -> None:
        absent = [name for name in REQUIRED if name not in self.numbers]
        if absent:
            raise ParameterError(f"properties: need {', '.join(absent)} too")
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
        """Return the number of a property.

        Parameters
        ----------
        name : str
            Name of the property.

        Returns
        -------
        int
            Its number.

        Raises
        ------
        DeviceError
            If this firmware's table does not have it.
        """
        try:
            return self.numbers[name]
        except KeyError:
            raise DeviceError(
                f"puck: property {name} is not in this firmware's table"
            ) from None

    def settable(self, name: str) -> int:
        """Return the number of a property that is to be set.

        Parameters
        ----------
        name : str
            Name of the property.

        Returns
        -------
        int
            Its number.

        Raises
        ------
        DeviceError
            If the table does not have it, or setting it writes the puck's memory
            (SAVE, LOAD, DEF, LOCK): this driver never does.
        """
        if name in MEMORY_WRITERS:
            raise DeviceError(
                f"puck: {name} writes the puck's permanent memory and is never set"
            )
        return self.number(name)


def property_table(firmware: int) -> PropertyTable:
    """Return the property numbers of a firmware.

    Parameters
    ----------
    firmware : int
        What the puck answers for VERS.

    Returns
    -------
    PropertyTable
        Names and numbers.

    Raises
    ------
    DeviceError
        If the numbers of this firmware are not known: 65 to 113 and from 119 on are.

    Examples
    --------
    >>> property_table(116)
    Traceback (most recent call last):
        ...
    masrel.errors.DeviceError: puck: needs firmware 65 to 113, or 119 or later, got 116
    """
    if firmware < _OLDEST or _MOVED <= firmware < _UNMOVED:
        raise DeviceError(
            f"puck: needs firmware {_OLDEST} to {_MOVED - 1}, or {_UNMOVED} or later, "
            f"got {firmware}"
        )
    swapped = firmware >= _SWAPPED
    later = {"EN": 94, "HOLD": 77} if swapped else {"EN": 77, "HOLD": 94}
    return PropertyTable(numbers={**_MODERN, **later})


def read_property_table(path: Path) -> PropertyTable:
    """Read the property numbers of a firmware that the driver does not know.

    Parameters
    ----------
    path : Path
        A TOML file with one table, ``[properties]``: a number for every name.

    Returns
    -------
    PropertyTable
        Names and numbers.

    Raises
    ------
    ParameterError
        If the file is not such a table.
    OSError
        If it cannot be read.
    """
    try:
        document = parse_toml(read_regular(path, most=MAX_SMALL))
    except ValueError as error:
        raise ParameterError(f"{path}: not TOML ({error})") from error
    if set(document) != {"properties"} or not isinstance(document["properties"], dict):
        raise ParameterError(f"{path}: needs one table, [properties]")
    numbers = document["properties"]
    for name, number in numbers.items():
        if type(number) is not int:
            raise ParameterError(
                f"{path}: properties.{name}: needs a whole number, got {number!r}"
            )
    try:
        return PropertyTable(numbers=numbers)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from error

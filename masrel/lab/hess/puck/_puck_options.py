"""What a Puck's backend, and an emulated one, can be told; what a Puck's numbers mean.

Its properties by firmware, its counts and its units. The same number means another
property on another firmware, and setting the wrong one may move an arm: a firmware
whose numbers are not known is refused.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

import msgspec

from masrel._input import refuse
from masrel.errors import DeviceError, ParameterError
from masrel.lab._study_files import MAX_SMALL, parse_toml, read_regular
from masrel.lab.hess._can import BusOptions, check_direction
from masrel.lab.hess._emulated import InjectedFault
from masrel.lab.hess._simulated import PlantParameters
from masrel.lab.hess.device import _NOT_A_KEY
from masrel.lab.hess.limits import _check_not_negative, _check_positive

GEAR_RATIO = 18.8
"""Turns of the motor for one of the elbow (Park, Kim and Damiano 2012, Table II)."""

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

_LOWEST, _HIGHEST = 8, 126  # 0 to 7 are the same for every firmware

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
        number is given to two properties.

    Examples
    --------
    >>> property_table(148).number("T")
    42
    """

    numbers: Mapping[str, int]

    def __post_init__(self) -> None:
        taken: dict[int, str] = {}
        for name, number in self.numbers.items():
            if type(number) is not int or not _LOWEST <= number <= _HIGHEST:
                raise ParameterError(
                    f"properties.{name}: needs {_LOWEST} to {_HIGHEST}, got "
                    f"{number!r}; 0 to 7 are the same for every firmware"
                )
            for used in (number, number + 1) if name in _WIDE else (number,):
                if used in taken:
                    raise ParameterError(
                        f"properties.{name}: needs a number of its own, "
                        f"{used} is taken by {taken[used]}"
                    )
                taken[used] = name
        absent = [name for name in REQUIRED if name not in self.numbers]
        if absent:
            raise ParameterError(f"properties: need {', '.join(absent)} too")

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
        if name not in self.numbers:
            raise DeviceError(f"puck: property {name} is not in this firmware's table")
        return self.numbers[name]

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
    enable, hold = (94, 77) if firmware >= _SWAPPED else (77, 94)
    return PropertyTable(numbers={**_MODERN, "EN": enable, "HOLD": hold})


class _PropertyFile(msgspec.Struct, forbid_unknown_fields=True):
    """A file of property numbers."""

    properties: dict[str, Any]


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
        file = msgspec.convert(document, _PropertyFile)
        return PropertyTable(numbers=file.properties)
    except (ValueError, msgspec.ValidationError) as error:
        raise ParameterError(
            f"{path}: needs one table, [properties], of numbers: {error}"
        ) from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Transmission:
    """What lies between the elbow and the numbers on the bus."""

    # Values are rounded to the nearest, not down: rounding down would add half a step
    # to every angle and torque.

    counts_per_turn: int  # counts of the encoder per turn of the motor; the puck's CTS
    units_per_nm: int  # current units per N·m at the motor; the puck's IPNM
    gear_ratio: float = GEAR_RATIO  # turns of the motor for one of the elbow
    direction: Literal[1, -1] = 1  # whether counts grow with extension

    def __post_init__(self) -> None:
        _check_positive(
            counts_per_turn=self.counts_per_turn,
            units_per_nm=self.units_per_nm,
            gear_ratio=self.gear_ratio,
        )
        check_direction(self.direction)

    @property
    def angle_step(self) -> float:
        """What one count is at the elbow, rad."""
        return math.tau / (self.counts_per_turn * self.gear_ratio)

    @property
    def torque_step(self) -> float:
        """What one current unit is at the elbow, N·m."""
        return self.gear_ratio / self.units_per_nm

    def counts(self, angle: float) -> int:
        """Return the count of an angle."""
        return self.direction * round(angle / self.angle_step)

    def angle(self, counts: int) -> float:
        """Return the angle of a count."""
        return self.direction * counts * self.angle_step

    def units(self, torque_nm: float) -> int:
        """Return the current units of a torque."""
        return -self.direction * round(torque_nm / self.torque_step)

    def torque(self, units: int) -> float:
        """Return the torque of current units."""
        # Torque at the elbow, N·m; positive resists extension.
        return -self.direction * units * self.torque_step


_MAX_MOTOR_NODE = 7  # 8 to 31 are hands, sensors and the safety module


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulatorOptions:
    """What an emulated puck is like.

    Attributes
    ----------
    firmware : int
        What it answers for VERS.
    role : int
        What it answers for ROLE; the lowest five bits are 0 for a motor.
    has_error : bool
        Whether it reports an error, STAT 1.
    awake : bool
        Whether it is awake from the beginning, its position set.
    wake_s : float
        How long it is off the bus while it wakes, s.
    counts_per_turn, units_per_nm : int
        Its CTS and IPNM.
    gear_ratio : float
        Turns of its motor for one of the elbow.
    direction : {1, -1}
        Whether its counts grow with extension.
    braking : float
        Damping by the windings while it is idle, N·m·s/rad at the elbow; chosen.
    properties : PropertyTable or None
        Numbers of its properties; None for those of its firmware.
    arm : PlantParameters
        What its arm is like.
    faults : tuple of InjectedFault
        What fails, and when.

    Raises
    ------
    ParameterError
        If a value is outside its range.
    """

    firmware: int = 148
    role: int = 0
    has_error: bool = False
    awake: bool = False
    wake_s: float = 1.0
    counts_per_turn: int = 4096
    units_per_nm: int = 2700
    gear_ratio: float = GEAR_RATIO
    direction: Literal[1, -1] = 1
    braking: float = 1.0
    properties: PropertyTable | None = None
    arm: PlantParameters = field(default_factory=PlantParameters)
    faults: tuple[InjectedFault, ...] = ()

    def __post_init__(self) -> None:
        _check_not_negative(wake_s=self.wake_s, braking=self.braking)


@dataclass(frozen=True, slots=True, kw_only=True)
class PuckOptions(BusOptions):
    """Where a puck is, and how its device is to behave.

    Attributes
    ----------
    interface, channel : str
        Of python-can. On Linux "socketcan" and the name of the network device, whose
        bit rate the system sets.
    puck : int
        Its node, 1 to 7.
    gear_ratio : float
        Turns of the motor for one of the elbow.
    direction : {1, -1}
        Whether its counts grow with extension.
    largest_torque : float
        What it is told to limit its torque to (MT), N·m at the elbow. 28 N·m is what
        the motor has continuously; larger commands are refused before they are sent.
    patience_s : float
        How long to wait for a position, s: one period of the loop.
    checks_torque : bool
        Whether it is asked for its torque. A torque is not acknowledged: without,
        nobody notices that torques get lost while positions come.
    angle_after_reset : float or None
        Where the arm is held while a puck that has lost its position is opened, rad;
        None refuses to open such a puck.
    properties : PropertyTable or None
        Numbers of its properties, where its firmware is unknown to this driver.
    emulator : EmulatorOptions or None
        For an emulated puck on a bus inside this process: what it is like.

    Raises
    ------
    ParameterError
        If a value is outside its range.
    """

    name: ClassVar[str] = "puck"

    puck: int = 1
    gear_ratio: float = GEAR_RATIO
    largest_torque: float = 28.0
    checks_torque: bool = True
    angle_after_reset: float | None = field(default=None, metadata=_NOT_A_KEY)
    properties: PropertyTable | None = field(default=None, repr=False)
    emulator: EmulatorOptions | None = field(default=None, metadata=_NOT_A_KEY)

    def __post_init__(self) -> None:
        BusOptions.__post_init__(self)
        _check_positive(largest_torque=self.largest_torque)
        angle = self.angle_after_reset
        refuse(
            (
                not 1 <= self.puck <= _MAX_MOTOR_NODE,
                f"puck: needs a motor's node, 1 to {_MAX_MOTOR_NODE}, got {self.puck}",
            ),
            (
                angle is not None and not 0.0 <= angle <= math.pi,
                f"angle_after_reset: needs 0 to 180 degrees, got {angle} rad",
            ),
        )

    def emulated(self, start: float) -> Self:
        """Return the same for an emulated puck of this gear, direction and firmware.

        Parameters
        ----------
        start : float
            Where its arm is held when it is opened, rad.

        Returns
        -------
        PuckOptions
            With an emulator.

        Raises
        ------
        ParameterError
            If the bus is not inside this process.

        Examples
        --------
        >>> options = PuckOptions(interface="virtual", direction=-1).emulated(0.5)
        >>> options.emulator.direction
        -1
        """
        emulator = EmulatorOptions(
            gear_ratio=self.gear_ratio,
            direction=self.direction,
            properties=self.properties,
        )
        return replace(self, emulator=emulator, angle_after_reset=start)

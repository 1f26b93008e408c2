"""What a puck's backend, and an emulated puck, can be told."""

import math
from dataclasses import dataclass, field, replace
from typing import Literal, Self, get_args

from masrel.errors import ParameterError
from masrel.lab.hess.device import BackendOptions
from masrel.lab.hess.limits import _check_not_negative, _check_positive
from masrel.lab.hess.puck._properties import GEAR_RATIO, PropertyTable, check_direction

_MAX_MOTOR_NODE = 7  # 8 to 31 are hands, sensors and the safety module

_WITHOUT_HARDWARE = frozenset({"virtual", "udp_multicast"})

FaultKind = Literal[
    "dropped-requests",  # what the host sends gets lost, torques included
    "dropped-replies",  # the puck's answers get lost
    "dropped-torques",  # torques alone get lost
    "late-replies",  # `size` s later than they should
    "duplicated-replies",  # each a second time, 0.1 ms later
    "short-replies",  # one byte less
    "foreign-frames",  # the safety module, another puck, another host
    "error-frames",  # the bus reports a protocol error at every request
    "bus-off",  # the host's controller gives up, and restarts at the end
    "frozen-encoder",  # the count stands still
    "jumping-encoder",  # `size` counts are added
    "wrapping-encoder",  # whole turns of the motor are lost
    "idled",  # somebody else sets MODE to idle, once
    "reset",  # the supply fails for a moment, once
    "unplugged",  # nothing goes either way
]

_SIZES: dict[str, float] = {"late-replies": 0.0015, "jumping-encoder": 2000.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectedFault:
    """One fault of an emulated puck or its bus.

    Attributes
    ----------
    kind : str
        What fails: "dropped-requests", "dropped-replies", "dropped-torques",
        "late-replies", "duplicated-replies", "short-replies", "foreign-frames",
        "error-frames", "bus-off", "frozen-encoder", "jumping-encoder",
        "wrapping-encoder", "idled", "reset" or "unplugged".
    start_s : float
        When, s after the puck was first put into torque mode.
    end_s : float
        Until when, s.
    every : int
        How many frames there are to one that is affected.
    size : float or None
        How late, s, or how far, counts; None for 1.5 ms and for 2000 counts, 9.3 deg.

    Raises
    ------
    ParameterError
        If there is no such kind, or a value is outside its range.
    """

    kind: FaultKind
    start_s: float
    end_s: float = math.inf
    every: int = 1
    size: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in get_args(FaultKind):
            raise ParameterError(
                f"kind: needs one of {', '.join(get_args(FaultKind))}, got {self.kind}"
            )
        if not 0.0 <= self.start_s < self.end_s:
            raise ParameterError(
                "start_s, end_s: need 0 <= start_s < end_s, "
                f"got {self.start_s} and {self.end_s}"
            )
        if self.every < 1:
            raise ParameterError(f"every: needs 1 or more, got {self.every}")

    @property
    def amount(self) -> float:
        """How late, s, or how far, counts; 0 where nothing is."""
        return _SIZES.get(self.kind, 0.0) if self.size is None else self.size


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
    reply_bytes : {6, 4}
        Size of an answer that fits in either.
    is_flagged : bool
        Whether bit 7 of a position is set.
    has_secondary : bool
        Whether positions carry that of a second encoder.
    is_noisy : bool
        Whether others speak on the bus, too.
    braking : float
        Damping by the windings while it is idle, N·m·s/rad at the elbow; chosen.
    properties : PropertyTable or None
        Numbers of its properties; None for those of its firmware.
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
    reply_bytes: Literal[6, 4] = 6
    is_flagged: bool = False
    has_secondary: bool = False
    is_noisy: bool = False
    braking: float = 1.0
    properties: PropertyTable | None = None
    faults: tuple[InjectedFault, ...] = ()

    def __post_init__(self) -> None:
        _check_not_negative(wake_s=self.wake_s, braking=self.braking)
        if self.reply_bytes not in (4, 6):
            raise ParameterError(f"reply_bytes: needs 4 or 6, got {self.reply_bytes}")


@dataclass(frozen=True, slots=True, kw_only=True)
class PuckOptions(BackendOptions):
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
    poll_ticks : int
        Torques after which it is asked once for its mode, or for the torque it holds.
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

    interface: str = "socketcan"
    channel: str = "can0"
    puck: int = 1
    gear_ratio: float = GEAR_RATIO
    direction: Literal[1, -1] = 1
    largest_torque: float = 28.0
    patience_s: float = 0.001
    poll_ticks: int = 5
    checks_torque: bool = True
    angle_after_reset: float | None = None
    properties: PropertyTable | None = field(default=None, repr=False)
    emulator: EmulatorOptions | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.puck <= _MAX_MOTOR_NODE:
            raise ParameterError(
                f"puck: needs a motor's node, 1 to {_MAX_MOTOR_NODE}, got {self.puck}"
            )
        _check_positive(
            gear_ratio=self.gear_ratio,
            largest_torque=self.largest_torque,
            patience_s=self.patience_s,
        )
        check_direction(self.direction)
        if self.poll_ticks < 1:
            raise ParameterError(f"poll_ticks: needs 1 or more, got {self.poll_ticks}")
        angle = self.angle_after_reset
        if angle is not None and not 0.0 <= angle <= math.pi:
            raise ParameterError(
                f"angle_after_reset: needs 0 to 180 degrees, got {angle} rad"
            )
        if self.emulator is not None and self.interface != "virtual":
            raise ParameterError(
                "interface: needs 'virtual' for an emulated puck, "
                f"got {self.interface!r}"
            )

    @property
    def moves_hardware(self) -> bool:
        """Whether a motor may be on this bus.

        There is none on python-can's "virtual" and "udp_multicast", nor on a network
        device whose name begins with "vcan".
        """
        return self.interface not in _WITHOUT_HARDWARE and not self.channel.startswith(
            "vcan"
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

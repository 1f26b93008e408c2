"""What a puck's backend can be told."""

import math
from dataclasses import dataclass, field, replace
from typing import Literal, Self

from masrel.errors import ParameterError
from masrel.hess.device import BackendOptions
from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.properties import PropertyTable
from masrel.hess.puck.transmission import GEAR_RATIO

__all__ = ["PuckOptions"]

_MOTOR_PUCKS = 7  # 8 to 31 are hands, sensors and the safety module

_WITHOUT_HARDWARE = frozenset({"virtual", "udp_multicast"})


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
        if not 1 <= self.puck <= _MOTOR_PUCKS:
            raise ParameterError(
                f"puck: needs a motor's node, 1 to {_MOTOR_PUCKS}, got {self.puck}"
            )
        for name in ("gear_ratio", "largest_torque", "patience_s"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ParameterError(f"{name}: needs more than 0, got {value}")
        if self.direction not in (1, -1):
            raise ParameterError(f"direction: needs 1 or -1, got {self.direction}")
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

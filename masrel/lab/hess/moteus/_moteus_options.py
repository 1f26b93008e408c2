"""What a moteus' backend, and an emulated one, can be told; what its numbers mean."""

import math
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

from masrel._input import refuse
from masrel.lab.hess._can import BusOptions
from masrel.lab.hess._emulated import InjectedFault
from masrel.lab.hess._simulated import PlantParameters
from masrel.lab.hess.device import _NOT_A_KEY
from masrel.lab.hess.limits import _check_positive

# Registers
MODE, POSITION, VELOCITY, TORQUE = range(4)
HOME_STATE, VOLTAGE, TEMPERATURE, CODE = range(0x00C, 0x010)
COMMAND, FEEDFORWARD, MOST_TORQUE = 0x020, 0x022, 0x025
WATCHDOG, INTEGRAL_SCALE = 0x027, 0x02B
FIRMWARE, SERIAL_NUMBER, SET_POSITION = 0x101, 0x120, 0x131

# Modes
STOPPED, FAULT, PREPARING, DRIVEN, TIMEOUT = 0, 1, (2, 3, 4), 10, 11

OUTPUT_KNOWN = 2
"""Home state of a controller that knows where its output is."""

FAULTS = {
    32: "calibration",
    33: "motor-driver",
    34: "over-voltage",
    35: "encoder",
    36: "not-configured",
    37: "pwm-overrun",
    38: "over-temperature",
    39: "outside-limits",
    40: "under-voltage",
    41: "settings-changed",
    42: "commutation-unknown",
    43: "position-unknown",
    44: "driver-not-enabled",
    45: "stop-position",
    46: "timing",
    47: "feedforward-without-limit",
    48: "invalid-limits",
}
"""What a controller stops for, by its code."""

LIMITS = {
    96: "servo.max_velocity",
    97: "servo.max_power_W",
    98: "the largest voltage",
    99: "servo.max_current_A",
    100: "servo.fault_temperature",
    101: "servo.motor_fault_temperature",
    102: "the largest torque that it was told",
    103: "servopos.position_min or servopos.position_max",
}
"""What keeps a controller from giving the torque that it was told, by its code."""

FREE = 0
"""The one ``servo.timeout_mode`` that lets go of a person's arm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MoteusEmulatorOptions:
    """What an emulated moteus is like.

    Attributes
    ----------
    home_state : int
        Whether it knows where its output is: 2, or 0 or 1.
    timeout_mode : int
        What it does after silence: 0 lets go, 12 brakes with 5 N·m at most, 10 and 15
        without limit.
    lowest_angle_deg, highest_angle_deg : float
        The elbow's angles of its bounds of position; ``nan`` for none.
    arm : PlantParameters
        What its arm is like.
    faults : tuple of InjectedFault
        What fails, and when.
    """

    home_state: int = 2
    timeout_mode: int = FREE
    lowest_angle_deg: float = -4.0
    highest_angle_deg: float = 150.0
    arm: PlantParameters = field(default_factory=PlantParameters)
    faults: tuple[InjectedFault, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MoteusOptions(BusOptions):
    """Where a moteus is, and how its device is to behave: ``[device.moteus]``.

    Attributes
    ----------
    interface, channel : str
        Of python-can. On Linux "socketcan" and the name of the network device, whose
        bit rates the system sets.
    servo : int
        Its number, 1 to 127.
    direction : {1, -1}
        Whether its position grows with extension.
    gear_ratio : float
        Turns of its output for one of the elbow.
    zero_rev : float
        Its position where the elbow is fully flexed, turns.
    largest_torque_nm : float
        What it is told to limit its torque to, N·m at the elbow; larger commands are
        refused before they are sent.
    watchdog_ms : float
        After this time without a message it lets go, ms.
    patience_s : float
        How long to wait for an answer, s: one period of the loop.
    estimates_torque : bool
        Whether its own estimate of its torque is recorded.
    emulator : MoteusEmulatorOptions or None
        For an emulated moteus on a bus inside this process: what it is like.

    Raises
    ------
    ParameterError
        If a value is outside its range.
    """

    name: ClassVar[str] = "moteus"
    is_fd: ClassVar[bool] = True

    servo: int = 1
    zero_rev: float = 0.0
    largest_torque_nm: float = 20.0
    watchdog_ms: float = 20.0
    estimates_torque: bool = False
    emulator: MoteusEmulatorOptions | None = field(default=None, metadata=_NOT_A_KEY)

    def __post_init__(self) -> None:
        BusOptions.__post_init__(self)
        _check_positive(largest_torque_nm=self.largest_torque_nm)
        refuse(
            (not 1 <= self.servo <= 127, f"servo: needs 1 to 127, got {self.servo}"),
            (
                not math.isfinite(self.zero_rev),
                f"zero_rev: needs to be finite, got {self.zero_rev}",
            ),
            (
                not 2.0 <= self.watchdog_ms <= 100.0,
                f"watchdog_ms: needs 2 to 100 ms, got {self.watchdog_ms:g}",
            ),
        )

    def emulated(self, start: float) -> Self:  # noqa: ARG002 - it knows where its arm is
        """Return the same for an emulated moteus.

        Parameters
        ----------
        start : float
            Where its arm is held when it is opened, rad.

        Returns
        -------
        MoteusOptions
            With an emulator.

        Raises
        ------
        ParameterError
            If the bus is not inside this process.
        """
        return replace(self, emulator=MoteusEmulatorOptions())

    # What lies between the elbow and the numbers on the bus

    def position(self, angle: float) -> float:
        """Return its position, turns, at an angle of the elbow, rad."""
        return self.zero_rev + self.direction * self.gear_ratio * angle / math.tau

    def angle(self, position: float) -> float:
        """Return the angle of the elbow, rad, at a position, turns."""
        return self.direction * (position - self.zero_rev) * math.tau / self.gear_ratio

    def output_torque(self, torque_nm: float) -> float:
        """Return its torque, N·m, for one at the elbow; positive resists extension."""
        return -self.direction * torque_nm / self.gear_ratio

    def torque(self, output_nm: float) -> float:
        """Return the torque at the elbow, N·m, for one at its output."""
        return -self.direction * output_nm * self.gear_ratio

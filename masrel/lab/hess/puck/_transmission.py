"""From the elbow to the motor and back: angles to counts, torques to current units."""

import math
from dataclasses import dataclass
from typing import Literal

from masrel.errors import ParameterError

GEAR_RATIO = 18.8
"""Turns of the motor for one of the elbow (Park, Kim and Damiano 2012, Table II)."""


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
        for name in ("counts_per_turn", "units_per_nm", "gear_ratio"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ParameterError(f"{name}: needs more than 0, got {value}")
        if self.direction not in (1, -1):
            raise ParameterError(f"direction: needs 1 or -1, got {self.direction}")

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

"""From the elbow to the motor and back: angles to counts, torques to current units."""

import math
from dataclasses import dataclass
from typing import Literal

from masrel.errors import ParameterError

__all__ = ["GEAR_RATIO", "Transmission"]

GEAR_RATIO = 18.8
"""Turns of the motor for one of the elbow (Park, Kim and Damiano 2012, Table II)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Transmission:
    """What lies between the elbow and the numbers on the bus.

    Values are rounded to the nearest, not down: rounding down would add half a step
    to every angle and torque.

    Attributes
    ----------
    counts_per_turn : int
        Counts of the encoder per turn of the motor; the puck's CTS.
    units_per_nm : int
        Current units per N·m at the motor; the puck's IPNM.
    gear_ratio : float, optional
        Turns of the motor for one of the elbow.
    direction : {1, -1}, optional
        Whether counts grow with extension.

    Raises
    ------
    ParameterError
        If a value is outside its range.

    Examples
    --------
    At the elbow, one count is 0.0047 deg and one unit 0.007 N·m:

    >>> puck = Transmission(counts_per_turn=4096, units_per_nm=2700)
    >>> round(math.degrees(puck.angle_step), 6), round(puck.torque_step, 5)
    (0.004675, 0.00696)

    A torque that resists extension pulls towards smaller counts:

    >>> puck.units(1.0), puck.counts(math.radians(90))
    (-144, 19251)
    """

    counts_per_turn: int
    units_per_nm: int
    gear_ratio: float = GEAR_RATIO
    direction: Literal[1, -1] = 1

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
        """Return the count of an angle.

        Parameters
        ----------
        angle : float
            Elbow angle, rad.

        Returns
        -------
        int
            Nearest count; 0 at full flexion.
        """
        return self.direction * round(angle / self.angle_step)

    def angle(self, counts: int) -> float:
        """Return the angle of a count.

        Parameters
        ----------
        counts : int
            Count of the encoder.

        Returns
        -------
        float
            Elbow angle, rad.
        """
        return self.direction * counts * self.angle_step

    def units(self, torque_nm: float) -> int:
        """Return the current units of a torque.

        Parameters
        ----------
        torque_nm : float
            Torque at the elbow, N·m; positive resists extension.

        Returns
        -------
        int
            Nearest current unit; positive towards growing counts.
        """
        return -self.direction * round(torque_nm / self.torque_step)

    def torque(self, units: int) -> float:
        """Return the torque of current units.

        Parameters
        ----------
        units : int
            Current units.

        Returns
        -------
        float
            Torque at the elbow, N·m; positive resists extension.
        """
        return -self.direction * units * self.torque_step

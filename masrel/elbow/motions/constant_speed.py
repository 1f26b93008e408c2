"""A stretch at one speed."""

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.motions.checks import check_stretch
from masrel.elbow.piece import Piece

__all__ = ["ConstantSpeed"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantSpeed:
    """A stretch at one speed from the first instant to the last, a `Motion`.

    Attributes
    ----------
    start, end : float
        Angles, rad.
    speed : float
        Angular speed, rad/s.

    Raises
    ------
    ParameterError
        If the angles are not in order within 0 to 180 degrees, or the speed is not
        more than 0.

    Examples
    --------
    >>> ConstantSpeed(start=0.5, end=2.5, speed=1.0).duration
    2.0
    """

    start: float
    end: float
    speed: float

    def __post_init__(self) -> None:
        check_stretch(self.start, self.end, speed=self.speed)

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return (self.end - self.start) / self.speed

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle at times within the duration, rad."""
        return np.asarray((self.start - origin) + self.speed * np.asarray(time))

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity, rad/s."""
        return np.full(np.shape(time), self.speed)

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration, rad/s²."""
        return np.zeros(np.shape(time))

    def pieces(self) -> Iterator[Piece]:
        """Give the one piece, a line."""
        travel = Decimal(self.end) - Decimal(self.start)
        yield Piece(
            length=travel / Decimal(self.speed), angle=(Decimal(self.start), travel)
        )

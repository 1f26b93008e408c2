"""An arm that rests."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.piece import Piece
from masrel.errors import ParameterError

__all__ = ["Hold"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """An arm held still, a `Motion`.

    Attributes
    ----------
    start : float
        Where, rad.
    duration : float
        How long, s.

    Raises
    ------
    ParameterError
        If the angle is outside 0 to 180 degrees, or the duration is not more than 0.

    Examples
    --------
    >>> float(Hold(start=0.5, duration=2.0).velocity(1.0))
    0.0
    """

    start: float
    duration: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.start <= math.pi:
            raise ParameterError(
                f"start: needs 0 to 180 degrees, got {math.degrees(self.start):g}"
            )
        if not 0.0 < self.duration < math.inf:
            raise ParameterError(
                f"duration: needs more than 0 s and finite, got {self.duration:g}"
            )

    @property
    def end(self) -> float:
        """Where, rad."""
        return self.start

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle, rad."""
        return np.full(np.shape(time), self.start - origin)

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity, rad/s."""
        return np.zeros(np.shape(time))

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration, rad/s²."""
        return np.zeros(np.shape(time))

    def pieces(self) -> Iterator[Piece]:
        """Give the one piece, a constant."""
        yield Piece(length=Decimal(self.duration), angle=(Decimal(self.start),))

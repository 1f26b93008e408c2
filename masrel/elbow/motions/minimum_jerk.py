"""A stretch as arms make it by themselves: from rest to rest, as smooth as can be."""

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.motions.checks import check_stretch
from masrel.elbow.piece import Piece
from masrel.elbow.polynomial import ZERO

__all__ = ["MinimumJerk"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MinimumJerk:
    """A stretch from rest to rest with the least squared jerk, a `Motion`.

    Attributes
    ----------
    start, end : float
        Angles, rad.
    mean_speed : float
        Travel over duration, rad/s; the peak speed is 1.875 times that.

    Raises
    ------
    ParameterError
        As of `ConstantSpeed`.

    References
    ----------
    .. [1] Flash, T., Hogan, N. (1985). The coordination of arm movements. Journal
       of Neuroscience, 5(7), 1688-1703.
       https://doi.org/10.1523/JNEUROSCI.05-07-01688.1985

    Examples
    --------
    >>> motion = MinimumJerk(start=0.5, end=2.5, mean_speed=1.0)
    >>> float(motion.velocity(1.0))
    1.875
    """

    start: float
    end: float
    mean_speed: float

    def __post_init__(self) -> None:
        check_stretch(self.start, self.end, mean_speed=self.mean_speed)

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return (self.end - self.start) / self.mean_speed

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle at times within the duration, rad."""
        s = np.asarray(time) / self.duration
        # quintic of [1]; products, as powers of a number and of an array may differ
        share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        return np.asarray((self.start - origin) + (self.end - self.start) * share)

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity at times within the duration, rad/s."""
        s = np.asarray(time) / self.duration
        rest = s * (1.0 - s)
        return np.asarray(30.0 * self.mean_speed * rest * rest)

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration at times within the duration, rad/s²."""
        s = np.asarray(time) / self.duration
        rate = self.mean_speed / self.duration
        return np.asarray(60.0 * rate * s * (1.0 - s) * (1.0 - 2.0 * s))

    def pieces(self) -> Iterator[Piece]:
        """Give the one piece, the quintic of [1]."""
        travel = Decimal(self.end) - Decimal(self.start)
        yield Piece(
            length=travel / Decimal(self.mean_speed),
            angle=(
                Decimal(self.start),
                ZERO,
                ZERO,
                10 * travel,
                -15 * travel,
                6 * travel,
            ),
        )

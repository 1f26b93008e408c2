"""What a movement of the arm has to offer, whatever its kind."""

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.piece import Piece

__all__ = ["Floats", "Motion"]

Floats = NDArray[np.float64]


class Motion(Protocol):
    """A movement as a function of time, made of polynomial pieces; SI units.

    It may go either way and rest. Events, peaks and integrals come from its pieces,
    which are exact; samples come from `angle`, `velocity` and `acceleration`.
    """

    @property
    def start(self) -> float:
        """Angle where it starts, rad."""
        ...

    @property
    def end(self) -> float:
        """Angle where it ends, rad."""
        ...

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        ...

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.
        origin : float, optional
            Angle to count from, rad. A difference of near angles keeps its digits so,
            which it would lose if `origin` were subtracted afterwards.

        Returns
        -------
        ndarray, shape of `time`
            Angles, rad; the same bits for one time as for many at once.
        """
        ...

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Velocities, rad/s, positive in extension. Where it jumps, the later one.
        """
        ...

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Accelerations, rad/s². Where it jumps, the later one.
        """
        ...

    def pieces(self) -> Iterator[Piece]:
        """Give the movement piece by piece.

        Yields
        ------
        Piece
            The next piece, of a polynomial of at most fifth degree. Read it within
            `masrel.elbow.polynomial.exactly`.
        """
        ...

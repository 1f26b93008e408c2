"""What a movement of the arm is, whatever its kind: a row of polynomial pieces."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from masrel.lab.elbow._polynomials import Polynomial, bernstein, derivative

Floats = NDArray[np.float64]


class Piece(NamedTuple):
    """A time in which the angle is a polynomial of at most fifth degree."""

    start: float  # s
    length: float  # s
    angle: Polynomial  # rad from the motion's origin, over s since the start
    # between these the speed is, rad/s
    slowest: float
    fastest: float


def piece_of(start: float, length: float, angle: Polynomial) -> Piece:
    """Return a piece, its speed bounded by Bernstein coefficients."""
    speeds = bernstein(derivative(angle), length)
    return Piece(start, length, angle, min(speeds), max(speeds))


class Rows(NamedTuple):
    """The same pieces as arrays."""

    start: Floats  # (n_pieces,), s
    angle: Floats  # (n_coefficients, n_pieces)


def rows_of(pieces: Sequence[Piece]) -> Rows:
    """Return some pieces as arrays."""
    width = max(len(piece.angle) for piece in pieces)
    padded = [[*p.angle, *[0.0] * (width - len(p.angle))] for p in pieces]
    return Rows(np.array([p.start for p in pieces]), np.array(padded).T)


class Motion(ABC):
    """A movement as a function of time, made of polynomial pieces; SI units.

    It may go either way and rest. Samples, events and loads come from its pieces.
    """

    __slots__ = ()

    # Every kind has these, as fields or properties of its own; a property here would be
    # the default of a field.
    if TYPE_CHECKING:

        @property
        def start(self) -> float:
            """Angle where it starts, rad."""

        @property
        def end(self) -> float:
            """Angle where it ends, rad."""

        @property
        def duration(self) -> float:
            """How long it takes, s."""

    origin = property(attrgetter("start"), doc="Angle the pieces count from, rad.")

    @abstractmethod
    def pieces(self) -> Sequence[Piece]:
        """Return the pieces in order of time."""

    def rows(self) -> Rows:
        """Return the pieces as arrays."""
        return rows_of(self.pieces())

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Return angles at times within the duration.

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
        first, travel = self._at(time, 0)
        return np.asarray(((self.origin - origin) + first) + travel)

    def velocity(self, time: Floats | float) -> Floats:
        """Return angular velocities at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Velocities, rad/s, positive in extension. Where it jumps, the later one.
        """
        return self._at(time, 1)[1]

    def acceleration(self, time: Floats | float) -> Floats:
        """Return angular accelerations at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Accelerations, rad/s². Where it jumps, the later one.
        """
        return self._at(time, 2)[1]

    def _at(self, time: Floats | float, order: int) -> tuple[Floats, Floats]:
        # where the piece of each time begins, rad, and what came since, or a derivative
        rows, times = self.rows(), np.asarray(time)
        place = np.maximum(np.searchsorted(rows.start, times, side="right") - 1, 0)
        since, total = times - rows.start[place], np.zeros(times.shape)
        p: Polynomial = [*0.0 * rows.angle[:1], *rows.angle[1:]]
        for _ in range(order):
            p = derivative(p)
        for column in p[::-1]:
            if np.ndim(column):
                total = total * since + column[place]
        return rows.angle[0][place], total

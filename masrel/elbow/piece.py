"""One piece of a motion: the angle as a polynomial, exactly."""

from dataclasses import dataclass
from decimal import Decimal

from masrel.elbow.polynomial import ONE, Polynomial, derivative, moved, scaled

__all__ = ["Piece"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A stretch of time in which the angle is a polynomial.

    Attributes
    ----------
    length : Decimal
        How long it takes, s; more than 0.
    angle : tuple of Decimal
        Coefficients of the angle, rad, in the share of `length` that has passed.

    Examples
    --------
    >>> from decimal import Decimal
    >>> piece = Piece(length=Decimal(2), angle=(Decimal(1), Decimal(3)))
    >>> piece.velocity
    (Decimal('1.5'),)
    """

    length: Decimal
    angle: Polynomial

    @property
    def velocity(self) -> Polynomial:
        """Coefficients of the angular velocity, rad/s."""
        return scaled(derivative(self.angle), ONE / self.length)

    @property
    def acceleration(self) -> Polynomial:
        """Coefficients of the angular acceleration, rad/s²."""
        return scaled(derivative(self.velocity), ONE / self.length)

    def part(self, low: Decimal, high: Decimal) -> "Piece":
        """Return the piece between two shares of its length.

        Parameters
        ----------
        low, high : Decimal
            Shares; from a high to a low one it is the movement backwards.

        Returns
        -------
        Piece
            The part.
        """
        return Piece(
            length=self.length * abs(high - low), angle=moved(self.angle, low, high)
        )

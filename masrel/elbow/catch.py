"""Where in a movement the angle passes the catch angle.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2) and (6).
"""

from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise

from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.piece import Piece
from masrel.elbow.polynomial import (
    Polynomial,
    added,
    product,
    quotient,
    scaled,
    value,
)
from masrel.elbow.roots import cuts

__all__ = ["Onset", "catch_share"]


_ROUNDING = Decimal("1e-40")
# Of a speed: one as near as that to ν_H is ν_H, but for rounding of 50 digits.


@dataclass(frozen=True, slots=True, kw_only=True)
class Onset:
    """Where the mean speed of (2) begins.

    Attributes
    ----------
    piece : Piece
        The piece in which the movement begins.
    share : Decimal
        Share of its length.
    time : Decimal
        s.
    angle : Decimal
        rad.
    """

    piece: Piece
    share: Decimal
    time: Decimal
    angle: Decimal


@dataclass(frozen=True, slots=True, kw_only=True)
class _CatchAngle:
    """L, α, ν_L and θ_L of (2) and (6)."""

    constant: Decimal
    slope: Decimal
    slowest: Decimal
    smallest: Decimal

    @property
    def largest(self) -> Decimal:
        return self.constant - self.slope * self.slowest  # (6), first line

    @property
    def fastest(self) -> Decimal:
        return (self.constant - self.smallest) / self.slope  # ν_H

    def at(self, mean_speed: Decimal) -> Decimal:
        if mean_speed - self.fastest > _ROUNDING * mean_speed:
            return self.smallest  # (6), third line
        return self.constant - self.slope * max(mean_speed, self.slowest)  # (2)


def catch_share(
    parameters: ElbowParameters,
    onset: Onset,
    piece: Piece,
    time: Decimal,
    between: tuple[Decimal, Decimal],
) -> tuple[Decimal, Decimal] | None:
    """Find where an extension first passes the catch angle.

    Both sides of θ > θ_catch(v̄) are compared between all places where the answer may
    change: no shape of the speed is taken for granted.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    onset : Onset
        Where the movement began, here or in a piece before.
    piece : Piece
        A piece of it.
    time : Decimal
        When the piece begins, s.
    between : tuple of two Decimal
        Shares of the piece between which the arm is faster than ν_th.

    Returns
    -------
    tuple of two Decimal, or None
        The share of the piece, and the mean speed there, rad/s; None if it is not
        passed in this piece.
    """
    angles = _CatchAngle(
        constant=Decimal(parameters.catch_angle_constant),
        slope=Decimal(parameters.catch_slope),
        slowest=Decimal(parameters.slowest_mean_speed),
        smallest=Decimal(parameters.smallest_catch_angle),
    )
    low, high = between
    if value(piece.angle, high) <= min(angles.smallest, angles.largest):
        return None  # in extension the end of the piece is its largest angle
    way, since = _mean(onset, piece, time)

    def mean_speed(share: Decimal) -> Decimal:
        return value(way, share) / value(since, share)

    for left, right in pairwise(cuts(_limits(angles, piece, way, since), low, high)):
        middle = left + (right - left) / 2
        if value(piece.angle, middle) > angles.at(mean_speed(middle)):
            return left, mean_speed(left)
    return None


def _mean(onset: Onset, piece: Piece, time: Decimal) -> tuple[Polynomial, Polynomial]:
    # v̄ of (2) as a quotient of two polynomials in the share of the piece; in the piece
    # of the onset, where both would vanish, their common root is divided out
    if piece is onset.piece:
        return quotient(piece.angle, onset.share), (piece.length,)
    way = (piece.angle[0] - onset.angle, *piece.angle[1:])
    return way, (time - onset.time, piece.length)


def _limits(
    angles: _CatchAngle, piece: Piece, way: Polynomial, since: Polynomial
) -> list[Polynomial]:
    # where θ passes a line of (6), or v̄ goes from one line to the next
    def above(angle: Decimal) -> Polynomial:
        return (piece.angle[0] - angle, *piece.angle[1:])

    def faster(speed: Decimal) -> Polynomial:
        return added(way, scaled(since, -speed))

    between = added(product(above(angles.constant), since), scaled(way, angles.slope))
    return [
        between,  # θ = L - α v̄, both sides times the time since the onset
        above(angles.largest),
        above(angles.smallest),
        faster(angles.slowest),
        faster(angles.fastest),
    ]

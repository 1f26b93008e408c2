"""Square roots and sines as fractions of 40 digits, for weights that are irrational."""

import math
from fractions import Fraction

__all__ = ["sine_squared", "square_root"]

_SCALE = 10**40
# π to 60 digits (OEIS A000796)
_PI = Fraction(3141592653589793238462643383279502884197169399375105820974944, 10**60)


def square_root(value: Fraction) -> Fraction:
    """Return √value, rounded down to 40 decimals; exact for a square of such."""
    return Fraction(
        math.isqrt(value.numerator * _SCALE**2 // value.denominator), _SCALE
    )


def sine_squared(turns: Fraction) -> Fraction:
    """Return sin²(π · turns) = (1 - cos(2π · turns)) / 2, to 40 decimals."""
    arc = min(turns, 1 - turns)  # sin² is the same on both sides of a half turn
    angle = 2 * _PI * min(arc, Fraction(1, 2) - arc)  # in [0, π/2]
    # Series of the cosine, in integers with ten digits more than are kept.
    scale = _SCALE * 10**10
    square = angle * angle
    total, term, n = scale, scale, 0
    while term:
        n += 2
        term = term * square.numerator // (square.denominator * n * (n - 1))
        total += -term if n % 4 else term
    if arc > Fraction(1, 4):
        total = -total  # cos(π - x) = -cos x
    rounded = (scale - total + 10**10) // (2 * 10**10)
    return Fraction(rounded, _SCALE)

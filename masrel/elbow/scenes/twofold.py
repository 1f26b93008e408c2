"""Numbers of 32 digits as the unevaluated sum of two floats, array by array.

What decimals are to one scene, these are to thousands: an event is found in floats and
corrected in 32 digits, so that it is rounded once.
"""

from typing import Union

import numpy as np

from masrel.elbow.motion import Floats

__all__ = ["Operand", "Twofold"]

_SPLIT = 134217729.0  # 2²⁷ + 1, which halves the digits of a float

Operand = Union["Twofold", Floats, float]


class Twofold:
    """Numbers of 32 digits; the higher part is the float nearest to each.

    Parameters
    ----------
    high : ndarray or float
        The higher part.
    low : ndarray or float, optional
        The lower part, at most half a unit in the last place of the higher.

    References
    ----------
    .. [1] Dekker, T. J. (1971). A floating-point technique for extending the available
       precision. Numerische Mathematik, 18, 224-242.
       https://doi.org/10.1007/BF01397083

    Examples
    --------
    >>> third = Twofold(np.array([1.0])) / 3.0
    >>> left = third * 3.0 - 1.0
    >>> bool(abs(left.high[0]) < 1e-31)
    True
    """

    __slots__ = ("high", "low")
    __array_ufunc__ = None  # ndarray + Twofold is a Twofold

    def __init__(self, high: Floats | float, low: Floats | float = 0.0) -> None:
        self.high = np.asarray(high, dtype=np.float64)
        self.low = np.asarray(low, dtype=np.float64)

    @classmethod
    def difference(cls, a: Floats | float, b: Floats | float) -> "Twofold":
        """Subtract floats without rounding.

        Parameters
        ----------
        a, b : ndarray or float
            The two.

        Returns
        -------
        Twofold
            a - b.
        """
        return cls(*_sum(np.asarray(a), -np.asarray(b)))

    @classmethod
    def product(cls, a: Floats | float, b: Floats | float) -> "Twofold":
        """Multiply floats without rounding.

        Parameters
        ----------
        a, b : ndarray or float
            The factors.

        Returns
        -------
        Twofold
            Their product.
        """
        return cls(*_product(np.asarray(a), np.asarray(b)))

    def __add__(self, other: Operand) -> "Twofold":
        if not isinstance(other, Twofold):
            s, e = _sum(self.high, np.asarray(other))
            return Twofold(*_quick(s, e + self.low))
        s, e = _sum(self.high, other.high)
        t, f = _sum(self.low, other.low)
        s, e = _quick(s, e + t)
        return Twofold(*_quick(s, e + f))

    __radd__ = __add__

    def __neg__(self) -> "Twofold":
        return Twofold(-self.high, -self.low)

    def __sub__(self, other: Operand) -> "Twofold":
        return self + -other

    def __rsub__(self, other: Operand) -> "Twofold":
        return -self + other

    def __mul__(self, other: Operand) -> "Twofold":
        if not isinstance(other, Twofold):
            p, e = _product(self.high, np.asarray(other))
            return Twofold(*_quick(p, e + self.low * other))
        p, e = _product(self.high, other.high)
        return Twofold(*_quick(p, e + (self.high * other.low + self.low * other.high)))

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> "Twofold":
        b = other if isinstance(other, Twofold) else Twofold(other)
        first = self.high / b.high
        left = self - b * first
        second = left.high / b.high
        left = left - b * second
        s, e = _quick(first, second)
        return Twofold(*_quick(s, e + left.high / b.high))

    def __rtruediv__(self, other: Floats | float) -> "Twofold":
        return Twofold(other) / self

    def sqrt(self) -> "Twofold":
        """Return the square roots.

        Returns
        -------
        Twofold
            The roots; 0 of 0.
        """
        root = np.sqrt(self.high)
        left = self - Twofold.product(root, root)
        with np.errstate(divide="ignore", invalid="ignore"):
            more = np.where(root > 0.0, left.high / (2.0 * root), 0.0)
        return Twofold(*_quick(root, more))

    def where(self, condition: np.ndarray, other: "Twofold") -> "Twofold":
        """Take these numbers where a condition holds, and others elsewhere.

        Parameters
        ----------
        condition : ndarray of bool
            Where these.
        other : Twofold
            The others.

        Returns
        -------
        Twofold
            The chosen.
        """
        return Twofold(
            np.where(condition, self.high, other.high),
            np.where(condition, self.low, other.low),
        )

    def take(self, rows: np.ndarray) -> "Twofold":
        """Return some of the numbers.

        Parameters
        ----------
        rows : ndarray of int
            Which.

        Returns
        -------
        Twofold
            Those.
        """
        return Twofold(self.high[rows], self.low[rows])

    def put(self, rows: np.ndarray, others: "Twofold") -> None:
        """Replace some of the numbers.

        Parameters
        ----------
        rows : ndarray of int
            Which.
        others : Twofold
            What stands there from now on.
        """
        self.high[rows], self.low[rows] = others.high, others.low


def _sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


def _quick(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    # of |a| >= |b|
    s = a + b
    return s, b - (s - a)


def _product(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    p = a * b
    c, d = _SPLIT * a, _SPLIT * b
    a_high, b_high = c - (c - a), d - (d - b)
    a_low, b_low = a - a_high, b - b_high
    error = ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low
    return p, error

"""Plain floats behind the operations of numbers of 32 digits.

What finds events in 32 digits finds them in 16 with these, in a fraction of the time.
"""

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.twofold import Operand, Twofold

__all__ = ["Onefold"]

_NOTHING = np.zeros(())


class Onefold(Twofold):
    """Floats, rounded at every step.

    Parameters
    ----------
    high : ndarray or float
        The floats.
    low : ndarray or float, optional
        What is left of 32 digits; it is dropped.

    Examples
    --------
    >>> third = Onefold(np.array([1.0])) / 3.0
    >>> float((third * 3.0 - 1.0).high[0])
    0.0
    """

    __slots__ = ()

    def __init__(self, high: Floats | float, low: Floats | float = 0.0) -> None:
        del low
        self.high, self.low = np.asarray(high, dtype=np.float64), _NOTHING

    @classmethod
    def difference(cls, a: Floats | float, b: Floats | float) -> Twofold:
        """Subtract floats.

        Parameters
        ----------
        a, b : ndarray or float
            The two.

        Returns
        -------
        Onefold
            a - b.
        """
        return cls(np.asarray(a) - b)

    @classmethod
    def product(cls, a: Floats | float, b: Floats | float) -> Twofold:
        """Multiply floats.

        Parameters
        ----------
        a, b : ndarray or float
            The factors.

        Returns
        -------
        Onefold
            Their product.
        """
        return cls(np.asarray(a) * b)

    def __add__(self, other: Operand) -> Twofold:
        return Onefold(self.high + _floats(other))

    __radd__ = __add__

    def __neg__(self) -> Twofold:
        return Onefold(-self.high)

    def __sub__(self, other: Operand) -> Twofold:
        return Onefold(self.high - _floats(other))

    def __rsub__(self, other: Operand) -> Twofold:
        return Onefold(_floats(other) - self.high)

    def __mul__(self, other: Operand) -> Twofold:
        return Onefold(self.high * _floats(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Twofold:
        return Onefold(self.high / _floats(other))

    def __rtruediv__(self, other: Operand) -> Twofold:
        return Onefold(_floats(other) / self.high)

    def sqrt(self) -> Twofold:
        """Return the square roots.

        Returns
        -------
        Onefold
            The roots.
        """
        return Onefold(np.sqrt(self.high))

    def where(self, condition: np.ndarray, other: Twofold) -> Twofold:
        """Take these floats where a condition holds, and others elsewhere.

        Parameters
        ----------
        condition : ndarray of bool
            Where these.
        other : Onefold
            The others.

        Returns
        -------
        Onefold
            The chosen.
        """
        return Onefold(np.where(condition, self.high, other.high))

    def take(self, rows: np.ndarray) -> Twofold:
        """Return some of the floats.

        Parameters
        ----------
        rows : ndarray of int
            Which.

        Returns
        -------
        Onefold
            Those.
        """
        return Onefold(self.high[rows])

    def put(self, rows: np.ndarray, others: Twofold) -> None:
        """Replace some of the floats.

        Parameters
        ----------
        rows : ndarray of int
            Which.
        others : Onefold
            What stands there from now on.
        """
        self.high[rows] = others.high


def _floats(value: Operand) -> Floats | float:
    return value.high if isinstance(value, Twofold) else value

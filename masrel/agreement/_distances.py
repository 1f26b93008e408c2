"""Disagreement of categories so many that no table has a place for every two of them.

In: the values of the categories. Out: an operator that takes the place of a matrix of
disagreement: `p @ v` of masses p, and v of pairs of categories.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Codes = NDArray[np.signedinteger[Any]]

_MAX_EXPONENT = 400  # of two, of numbers whose squares and sums of them are floats


def small_enough(values: Floats) -> Floats:
    """Return values times a power of two, so that their squares are floats."""
    exponent = int(np.frexp(np.abs(values).max(initial=0.0))[1])
    return values if abs(exponent) <= _MAX_EXPONENT else np.ldexp(values, -exponent)


class Distances:
    """v as an operator: (n_categories, n_categories), symmetric, 0 on its diagonal."""

    __array_ufunc__ = None  # `p @ v` is left to `__rmatmul__`

    def __init__(self, n_categories: int) -> None:
        self.n = n_categories

    def __len__(self) -> int:
        return self.n

    def __rmatmul__(self, masses: Floats) -> Floats:
        """Return Σ_l m_l v_lk, (..., n_categories)."""
        raise NotImplementedError

    def __getitem__(self, pair: tuple[Codes, Codes]) -> Floats:
        """Return v of pairs of categories."""
        raise NotImplementedError

    def sum(self) -> float:
        """Return Σ_kl v_kl."""
        raise NotImplementedError

    def matrix(self) -> Floats:
        """Return every v_kl."""
        k = np.arange(self.n)
        return self[np.broadcast_arrays(k[:, None], k)]  # type: ignore[index]


class Differing(Distances):
    """1 for any two categories."""

    def __rmatmul__(self, masses: Floats) -> Floats:
        return np.asarray(masses.sum(axis=-1, keepdims=True) - masses)

    def __getitem__(self, pair: tuple[Codes, Codes]) -> Floats:
        return np.asarray(pair[0] != pair[1], dtype=np.float64)

    def sum(self) -> float:
        """Return Σ_kl v_kl."""
        return self.n * (self.n - 1.0)


class Line(Distances):
    """Distances on a line times a factor, and their squares times another."""

    def __init__(
        self, values: Floats, *, linear: float = 0.0, square: float = 0.0
    ) -> None:
        super().__init__(len(values))
        low, high = float(values.min()), float(values.max())
        self.values = values - (low + 0.5 * (high - low))
        self._factors = linear, square
        self._order = np.argsort(values)

    def __rmatmul__(self, masses: Floats) -> Floats:
        # Σ_l m_l |x_k - x_l| = x_k (2 M_k - M) + S - 2 S_k of sums up to x_k, which are
        # many: with some digits to spare where the machine has them
        (linear, square), x = self._factors, self.values[self._order]
        m = masses[..., self._order]
        mass, mean = (y.sum(axis=-1, keepdims=True) for y in (m, m * x))
        between = np.zeros(m.shape)
        if linear:
            up_to = np.cumsum(m, axis=-1, dtype=np.longdouble)
            moment = np.cumsum(m * x, axis=-1, dtype=np.longdouble)
            between += linear * (x * (2.0 * up_to - mass) + mean - 2.0 * moment)
        if square:
            squares = (m * x * x).sum(axis=-1, keepdims=True)
            between += square * (x * (x * mass - 2.0 * mean) + squares)
        dot = np.empty(m.shape)
        dot[..., self._order] = between
        return dot

    def __getitem__(self, pair: tuple[Codes, Codes]) -> Floats:
        d = np.abs(self.values[pair[0]] - self.values[pair[1]])
        linear, square = self._factors
        return np.asarray(d * (linear + square * d))

    def sum(self) -> float:
        """Return Σ_kl v_kl."""
        return float((np.ones(self.n) @ self).sum())

    def nodes(self) -> tuple[Floats, Floats] | None:
        """Return shares L of every value in three nodes, and v of the nodes, if any.

        Squares of distances are polynomials of second degree in either value, so that
        with Lagrange's shares L_j(x), v(x, y) = Σ_ij L_i(x) v_ij L_j(y) for all x, y.
        """
        # -> (n_categories, 3), (3, 3)
        linear, square = self._factors
        half = float(abs(self.values).max())
        if linear or not half:
            return None
        t = self.values / half
        shares = np.stack([t * (t - 1.0) / 2.0, 1.0 - t * t, t * (t + 1.0) / 2.0])
        at = half * np.arange(-1.0, 2.0)
        return shares.T, square * (at[:, None] - at) ** 2

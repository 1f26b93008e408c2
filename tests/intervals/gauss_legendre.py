"""The same posterior by another way: sums of logarithms, and Gauss-Legendre panels.

The polynomial is multiplied out factor by factor, and no gamma function is asked. The
density is integrated in panels over all that matters of logit ρ.
"""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Counts = Sequence[Sequence[int]]


class ByPanels:
    """The posterior of ρ given counts (n_items, n_categories).

    π ~ Dirichlet(a, ...), a rational; ρ ~ Beta(shape, shape).
    """

    def __init__(
        self,
        counts: Counts,
        a: Fraction = Fraction(1),
        shape: float = 1.0,
        panels: int = 400,
    ) -> None:
        self._terms, self._powers = _log_terms(counts, a)
        sizes = [sum(row) for row in counts]
        self._below = [sum(n > j for n in sizes) for j in range(max(sizes))]
        self._shape = shape
        low, high = self._limits()
        self.edges = np.linspace(low, high, panels + 1)
        self._x, self._w = np.polynomial.legendre.leggauss(12)
        points = self._points(self.edges[:-1], self.edges[1:])
        log = self.log_density(points.ravel()).reshape(points.shape)
        self._top = float(log.max())
        width = 0.5 * np.diff(self.edges)
        self._cells = (np.exp(log - self._top) @ self._w) * width

    def log_density(self, logit: Floats) -> Floats:
        """Of logit ρ, up to a constant; term by term."""
        log_a = -logit
        out = np.empty(logit.size)
        for start in range(0, logit.size, 256):
            part = log_a[start : start + 256]
            terms = self._terms + np.multiply.outer(part, self._powers)
            top = terms.max(axis=1)
            out[start : start + 256] = top + np.log(
                np.exp(terms - top[:, None]).sum(axis=1)
            )
        for j, n in enumerate(self._below):
            out -= n * (log_a if j == 0 else np.logaddexp(log_a, math.log(j)))
        spread = np.logaddexp(0.0, logit) + np.logaddexp(0.0, -logit)
        return np.asarray(out - self._shape * spread)

    def probability(self, logit: float) -> float:
        """That logit ρ is at most this."""
        panel = int(np.searchsorted(self.edges, logit)) - 1
        start = self.edges[panel]
        points = self._points(np.array([start]), np.array([logit]))[0]
        density = np.exp(self.log_density(points) - self._top)
        part = float(density @ self._w) * 0.5 * (logit - float(start))
        return (float(self._cells[:panel].sum()) + part) / float(self._cells.sum())

    def quantile(self, share: float) -> float:
        """Of ρ, by halving the panel it lies in."""
        cumulative = self._cells.cumsum() / self._cells.sum()
        panel = int(np.searchsorted(cumulative, share))
        low, high = self.edges[panel], self.edges[panel + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            if self.probability(middle) < share:
                low = middle
            else:
                high = middle
        return 1.0 / (1.0 + math.exp(-low))

    def _points(self, low: Floats, high: Floats) -> Floats:
        half = 0.5 * (high - low)[:, None]
        return np.asarray(low[:, None] + half * (self._x + 1.0))

    def _limits(self) -> tuple[float, float]:
        # where the density is above exp(-50) of its largest value on a wide grid
        low, high = -130.0, 130.0
        for _ in range(6):
            grid = np.linspace(low, high, 261)
            log = self.log_density(grid)
            above = np.flatnonzero(log > log.max() - 50.0)
            low, high = grid[max(above[0] - 1, 0)], grid[min(above[-1] + 1, 260)]
        return float(low), float(high)


def _log_terms(counts: Counts, a: Fraction) -> tuple[Floats, Floats]:
    # log of each coefficient of A^t, and t
    lowest, product = 0, np.zeros(1)  # of logarithms
    for above in _above(counts):
        category = np.zeros(1)
        for j, n in enumerate(above):
            for _ in range(n if j else 0):
                category = _log_times(category, np.array([math.log(j), 0.0]))
        category = category + _log_moments(a, above[0], category.size)
        lowest, product = lowest + above[0], _log_times(product, category)
    log_moments = _log_moments(a * len(counts[0]), lowest, product.size)
    return product - log_moments, lowest + np.arange(product.size, dtype=np.float64)


def _above(counts: Counts) -> list[list[int]]:
    # N_kj of each category k
    depths = range(max(sum(row) for row in counts))
    return [[sum(n > j for n in c) for j in depths] for c in zip(*counts, strict=True)]


def _log_moments(a: Fraction, first: int, n: int) -> Floats:
    # log Γ(a + t) / Γ(a) for t = first, first + 1, ...
    logs = np.log(float(a) + np.arange(first + n - 1))
    return np.concatenate([[0.0], logs.cumsum()])[first:]


def _log_times(one: Floats, two: Floats) -> Floats:
    if one.size > two.size:
        one, two = two, one
    out = np.full(one.size + two.size - 1, -np.inf)
    for i, log in enumerate(one):
        part = out[i : i + two.size]
        np.logaddexp(part, log + two, out=part)
    return out

"""What resamples are drawn from: items, clusters of items, or raters."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.kernel import Floats
from masrel.intervals.case import Case

__all__ = ["Pool", "acceleration", "item_pool", "rater_pool"]

_BLOCK = 4_000_000  # numbers held at once while values are computed


@dataclass(frozen=True, slots=True, kw_only=True)
class Pool:
    """Distinct members, of which as many are drawn as there are.

    Attributes
    ----------
    times : ndarray of int64, shape (n_members,)
        How often each is there.
    rows : ndarray, shape (n_members, n_features), or None
        Features of each, where a resample is a sum of them; None for raters.
    sums : callable
        How often each is drawn, (..., n_members), to sums (..., n_features).
    values : callable
        Sums (..., n_features) to the coefficient (...), ``nan`` where undefined.
    """

    times: NDArray[np.int64] = field(compare=False, repr=False)
    rows: Floats | None = field(compare=False, repr=False)
    sums: Callable[[Floats], Floats]
    values: Callable[[Floats], Floats]

    @property
    def n(self) -> int:
        """How many are drawn."""
        return int(self.times.sum())

    @property
    def shares(self) -> Floats:
        """Probability of each at a draw, (n_members,)."""
        return np.asarray(self.times / self.n)

    def of_counts(self, counts: NDArray[np.integer[Any]]) -> Floats:
        """Return the coefficient of resamples, a block of them at a time.

        Parameters
        ----------
        counts : ndarray of int, shape (n_resamples, n_members)
            How often each member is drawn.

        Returns
        -------
        ndarray, shape (n_resamples,)
            Values, ``nan`` where undefined.
        """
        found = np.empty(len(counts))
        width = max(counts.shape[1], 1 if self.rows is None else self.rows.shape[1])
        step = max(1, _BLOCK // width)
        for start in range(0, len(counts), step):
            block = counts[start : start + step].astype(np.float64)
            found[start : start + step] = self.values(self.sums(block))
        return found

    def without(self) -> Floats:
        """Return the coefficient with one of each member left out, (n_members,)."""
        if self.rows is not None:
            return self.values(self.times @ self.rows - self.rows)
        return self.values(self.sums(self.times - np.eye(self.times.size)))


def item_pool(case: Case) -> Pool:
    """Return the items, those with equal features together.

    Parameters
    ----------
    case : Case
        A question.

    Returns
    -------
    Pool
        Distinct rows of features.
    """
    rows, kind = np.unique(case.rows, axis=0, return_inverse=True)
    times = np.bincount(kind.ravel(), weights=case.times).astype(np.int64)
    return Pool(
        times=times, rows=rows, sums=lambda taken: taken @ rows, values=case.values
    )


def rater_pool(case: Case) -> Pool:
    """Return the raters, of whom none is paired with a copy of itself.

    Parameters
    ----------
    case : Case
        A question about a coefficient whose raters can be resampled.

    Returns
    -------
    Pool
        Every rater once: two who always agree are still two.
    """
    if case.kernel.rater_sums is None:
        raise TypeError(f"{case.entry.name} has no sums over raters")
    n_raters = case.patterns.codes.shape[1]
    return Pool(
        times=np.ones(n_raters, dtype=np.int64),
        rows=None,
        sums=case.kernel.rater_sums(case.patterns, case.times, case.v),
        values=case.values,
    )


def acceleration(pool: Pool) -> float:
    """Return how the spread of an estimate changes with its size.

    Parameters
    ----------
    pool : Pool
        What is resampled.

    Returns
    -------
    float
        A sixth of the skewness of the values with one member left out, equation
        (14.15) of Efron and Tibshirani (1993); those undefined are passed over.
    """
    left = pool.without()
    known = ~np.isnan(left)
    left, times = left[known], pool.times[known]
    if left.size == 0:
        return 0.0
    deviation = times @ left / times.sum() - left
    spread = float(times @ deviation**2)
    if spread <= 0.0:
        return 0.0
    return float(times @ deviation**3 / (6.0 * spread**1.5))

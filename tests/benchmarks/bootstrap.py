"""Bootstrap intervals by scipy, of statistics as the textbooks have them.

Part of ``python -m docs.make.benchmarks intervals``.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int64]
Formula = Callable[[NDArray[np.int64]], float]
Coefficient = Literal["fleiss_kappa", "gwet_ac"]


def made(n: int, r: int, q: int, seed: int = 1) -> Codes:
    """Ratings of items that differ, codes 0 to q - 1."""
    rng = np.random.default_rng(seed)
    shares = rng.dirichlet(np.ones(q), n).cumsum(axis=1)
    return (rng.random((n, r, 1)) > shares[:, None, :-1]).sum(axis=2)


def counted(codes: Codes, q: int) -> NDArray[np.int64]:
    """Raters per item and category."""
    return np.stack([(codes == k).sum(axis=1) for k in range(q)], axis=1)


def fleiss(counts: NDArray[np.int64]) -> float:
    """Fleiss' kappa of (n_items, n_categories), as its textbook has it."""
    r = counts.sum(axis=1)
    observed = ((counts * (counts - 1)).sum(axis=1) / (r * (r - 1))).mean()
    shares = counts.sum(axis=0) / counts.sum()
    chance = (shares**2).sum()
    return float((observed - chance) / (1.0 - chance))


def gwet(counts: NDArray[np.int64]) -> float:
    """Gwet's AC1 of (n_items, n_categories), as its textbook has it."""
    r = counts.sum(axis=1)
    observed = ((counts * (counts - 1)).sum(axis=1) / (r * (r - 1))).mean()
    shares = (counts / r[:, None]).mean(axis=0)
    chance = (shares * (1.0 - shares)).sum() / (counts.shape[1] - 1)
    return float((observed - chance) / (1.0 - chance))


FORMULAS: dict[Coefficient, Formula] = {"fleiss_kappa": fleiss, "gwet_ac": gwet}


def scipy_loop(
    counts: Codes, formula: Formula, n_resamples: int, seed: int = 1
) -> tuple[float, ...]:
    """scipy.stats.bootstrap with a Python statistic of the drawn items."""
    from scipy.stats import bootstrap as theirs

    found = theirs(
        (np.arange(len(counts)),),
        lambda items: formula(counts[items]),
        n_resamples=n_resamples,
        vectorized=False,
        method="percentile",
        rng=seed,
    )
    return tuple(found.confidence_interval)


def scipy_vectorized(
    counts: Codes, name: Coefficient, n_resamples: int, seed: int = 1
) -> tuple[float, ...]:
    """scipy.stats.bootstrap with a statistic of many resamples at once."""
    from scipy.stats import bootstrap as theirs

    n, q = counts.shape
    r = int(counts[0].sum())

    def statistic(items: Codes, axis: int = -1) -> NDArray[np.float64]:
        taken = np.moveaxis(counts[items], axis - 1, -2)
        observed = ((taken * taken).sum(axis=(-1, -2)) / n - r) / (r * (r - 1))
        squares = ((taken.sum(axis=-2) / (r * n)) ** 2).sum(axis=-1)
        chance = squares if name == "fleiss_kappa" else (1.0 - squares) / (q - 1)
        return np.asarray((observed - chance) / (1.0 - chance))

    found = theirs(
        (np.arange(n),),
        statistic,
        n_resamples=n_resamples,
        vectorized=True,
        batch=max(1, 2_000_000 // n),
        method="percentile",
        rng=seed,
    )
    return tuple(found.confidence_interval)

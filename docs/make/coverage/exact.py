"""The exact posterior of the Dirichlet-multinomial model, in long double.

Rising factorials of A π_k are polynomials in A π_k with positive coefficients; with
π ~ Dirichlet(1, ..., 1) integrated out, one polynomial in A remains.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import expit, gammaln, log_expit

from docs.make.coverage.studies import Floats

Key = tuple[tuple[int, ...], ...]
_COARSE = np.linspace(-16.0, 24.0, 61)  # logit ρ
_NEGLIGIBLE = 30.0  # e-fold below the largest density


def posterior_ends(counts: NDArray[np.int64], tails: tuple[float, ...]) -> Floats:
    """Quantiles of ρ, (n_studies, n_tails), of counts (n_studies, n_items, k)."""
    n_raters = int(counts[0, 0].sum())
    deeper = (counts[..., None] > np.arange(n_raters)).sum(axis=1)  # (s, k, r)
    n_items = counts.shape[1]
    rows = [tuple(sorted(map(tuple, study))) for study in deeper.tolist()]
    return np.array([_quantiles(row, n_items, tails) for row in rows])


@lru_cache(maxsize=100_000)
def _quantiles(key: Key, n_items: int, tails: tuple[float, ...]) -> tuple[float, ...]:
    logs = _logs(key)
    coarse = _log_density(logs, _COARSE, len(key[0]), n_items)
    place = np.flatnonzero(coarse > coarse.max() - _NEGLIGIBLE)
    first, last = max(place[0] - 1, 0), min(place[-1] + 1, _COARSE.size - 1)
    grid = np.linspace(_COARSE[first], _COARSE[last], 121)
    density = _log_density(logs, grid, len(key[0]), n_items)
    fine = np.linspace(grid[0], grid[-1], 4_001)
    values = np.exp(CubicSpline(grid, density - density.max())(fine))
    below = np.concatenate([[0.0], np.cumsum(values[1:] + values[:-1])])
    return tuple(expit(np.interp(tails, below / below[-1], fine)).tolist())


def _logs(key: Key) -> Floats:
    # logarithms of the coefficients of A^t
    total = np.ones(1, dtype=np.longdouble)
    for powers in key:
        if powers[0]:
            total = np.convolve(total, _moments(powers))
    with np.errstate(divide="ignore"):
        logs = np.log(total).astype(np.float64)
    return np.asarray(logs - gammaln(len(key) + np.arange(total.size)))


def _log_density(logs: Floats, logit: Floats, n_raters: int, n_items: int) -> Floats:
    # of logit ρ, A = (1 - ρ) / ρ
    log_rho, log_rest = log_expit(logit), log_expit(-logit)
    terms = logs + np.multiply.outer(log_rest - log_rho, np.arange(logs.size))
    top = terms.max(axis=1)
    above = top + np.log(np.exp(terms - top[:, None]).sum(axis=1))
    # ρ (A + j) = 1 - ρ + j ρ, so A + j without overflow where ρ is small
    depths = np.arange(n_raters)
    below = np.log(np.exp(log_rest)[:, None] + depths * np.exp(log_rho)[:, None])
    below -= log_rho[:, None]
    return np.asarray(above - n_items * below.sum(axis=1) + log_rho + log_rest)


@lru_cache(maxsize=100_000)
def _moments(powers: tuple[int, ...]) -> NDArray[np.longdouble]:
    # coefficients of Π_j (x + j)^powers[j], each times Γ(1 + t)
    polynomial = np.zeros(powers[0] + 1, dtype=np.longdouble)
    polynomial[-1] = 1.0
    for depth, power in enumerate(powers[1:], start=1):
        polynomial = np.convolve(polynomial, _power(depth, power))
    return polynomial * _factorials(polynomial.size)


@lru_cache(maxsize=20_000)
def _power(depth: int, power: int) -> NDArray[np.longdouble]:
    # ascending coefficients of (x + depth)^power
    polynomial = np.ones(1, dtype=np.longdouble)
    for _ in range(power):
        polynomial = np.convolve(
            polynomial, np.array([depth, 1.0], dtype=np.longdouble)
        )
    return polynomial


@lru_cache(maxsize=4_000)
def _factorials(size: int) -> NDArray[np.longdouble]:
    steps = np.arange(size, dtype=np.longdouble)
    steps[0] = 1.0
    return np.cumprod(steps)

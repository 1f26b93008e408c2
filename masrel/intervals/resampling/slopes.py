"""How an estimate moves with what is drawn, and how certain that makes it."""

from collections.abc import Callable
from typing import cast

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals.resampling.pool import Pool

__all__ = ["acceleration", "influence", "standard_errors", "studentized"]

_STEP = 1e-30  # of the imaginary part: its square is nothing beside 1
_NEAR = 1e-9  # so little that only what jumps moves
_NO_SPREAD = 1e-9  # of the standard error of the estimate: rounding, not spread


def influence(pool: Pool, counts: Floats) -> Floats:
    """Return how fast the coefficient moves with one more of each member."""
    # counts (n_resamples, n_members) -> (n_resamples, n_members)
    # The derivative of an analytic f at x is the imaginary part of f(x + ih) / h, to
    # the last digits, because nothing is subtracted [1]_. Items are moved along an
    # orthogonal basis of their features, which has few directions; raters one by one.
    # Of a member that is not drawn it may be ``nan``, or no derivative at all.
    # [1] Squire, W., Trapp, G. (1998). Using complex variables to estimate derivatives
    # of real functions. SIAM Review, 40(1), 110-112.
    # https://doi.org/10.1137/S003614459631241X
    if pool.rows is None:
        return _slopes(lambda at: pool.values(pool.sums(at)), counts, np.eye(pool.n))
    directions, along = pool.directions
    sums = pool.sums(counts)
    slopes = _slopes(pool.values, sums, directions) @ along
    # Where nobody has a feature, as a rater without a pair, a value may jump if the
    # least part of one is added: there, only along the rows that are drawn.
    bare = ((sums == 0.0) & pool.rows.any(axis=0)).any(axis=-1)
    if bare.any():
        slopes[bare] = _slopes(pool.values, sums[bare], pool.rows)
    return slopes


def _slopes(
    values: Callable[[Floats], Floats], at: Floats, directions: Floats
) -> Floats:
    # (..., n), (n_directions, n) -> (..., n_directions); what takes floats here takes
    # complex numbers too
    slopes = np.empty((*at.shape[:-1], len(directions)))
    plain = values(at)
    with np.errstate(invalid="ignore", divide="ignore"):  # undefined ones
        for k, along in enumerate(directions):
            turned = values(cast("Floats", at + 1j * _STEP * along))
            jumps = np.abs(turned.real - plain) > _NEAR
            slopes[..., k] = np.where(jumps, np.nan, turned.imag / _STEP)
    return slopes


def standard_errors(pool: Pool, counts: Floats) -> Floats:
    """Return the delta-method standard error of the coefficient on each resample."""
    # -> (n_resamples,)
    moved = influence(pool, counts)
    moved = np.where(counts > 0.0, moved, 0.0)  # nobody asks after those not drawn
    mean = (counts * moved).sum(axis=-1, keepdims=True) / pool.n
    return np.asarray(np.sqrt((counts * (moved - mean) ** 2).sum(axis=-1)))


def studentized(pool: Pool, counts: Floats, value: float, error: float) -> Floats:
    """Return how many of its own standard errors each resample is off."""
    # -> (n_resamples,)
    off = pool.values(pool.sums(counts)) - value
    errors = standard_errors(pool, counts)
    flat = errors <= _NO_SPREAD * error
    ratio = off / np.where(flat, 1.0, errors)
    same = np.abs(off) <= _NO_SPREAD * error
    endless = np.where(same, 0.0, np.copysign(np.inf, off))
    return np.where(flat & ~np.isnan(off), endless, ratio)


def acceleration(pool: Pool) -> float:
    """Return how the spread of an estimate changes with its size."""
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

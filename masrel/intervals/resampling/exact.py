"""Every resample of a pool with its probability, equal ones together."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats
from masrel.errors import ParameterError
from masrel.intervals.resampling.compositions import compositions, n_compositions
from masrel.intervals.resampling.enumerated import Enumerated
from masrel.intervals.resampling.pool import Pool
from masrel.intervals.resampling.resamples import Resamples
from masrel.intervals.resampling.states import box, merged_states, transformed_states

__all__ = ["enumerate_resamples"]

_MOST = 300_000  # resamples, or sums of them, that are enumerated rather than drawn
_MOST_COUNTED = 60_000  # the same where a statistic is none of sums alone
_FEW = 5_000  # resamples that are enumerated before anything else is tried
_BOX = 3_000_000  # places of a table whose transform is taken
_BLOCK = 1 << 14  # numbers held at once while values are computed


def enumerate_resamples(
    pool: Pool, statistic: Callable[[Floats], Floats] | None, *, insist: bool
) -> Resamples | None:
    """Take every distinct resample once, with its probability."""
    n_distinct = n_compositions(pool.n, pool.times.size)
    if n_distinct > _FEW and statistic is None:
        found = _merged(pool, n_distinct, insist)
        if found is not None:
            return found
    if n_distinct <= (_MOST if insist or statistic is None else _MOST_COUNTED):
        return _enumerated(pool, statistic)
    if insist:
        raise ParameterError(
            f"exact: there are {_about(n_distinct)} distinct resamples, with more than "
            f"{_MOST} different sums of features: too many; draw some of them instead"
        )
    return None


def _about(count: int) -> str:
    if count < 10**9:
        return str(count)
    return f"{count:.2g}" if count < 10**300 else "more than 1e+300"


def _enumerated(pool: Pool, statistic: Callable[[Floats], Floats] | None) -> Resamples:
    counts, weights = compositions(pool.n, pool.shares)
    values = _in_blocks(statistic or pool.of_counts, counts)
    return _resamples(values, weights, "resamples")


def _merged(pool: Pool, n_distinct: int, insist: bool) -> Resamples | None:
    lattice = pool.lattice
    if lattice is None:
        return None
    size = math.prod(box(lattice.steps, pool.shares, pool.n).tolist())
    if size <= min(_BOX, 10 * n_distinct):
        states = transformed_states(lattice, pool.shares, pool.n)
    elif insist and n_distinct > _MOST:
        merged = merged_states(lattice, pool.shares, pool.n, _MOST)
        if merged is None:
            return None
        states = merged
    else:
        return None
    steps, weights = states
    if weights.size > _MOST:
        return None
    values = _in_blocks(lambda block: pool.values(lattice.sums(block, pool.n)), steps)
    return _resamples(values, weights, "sums of resamples")


def _in_blocks(
    statistic: Callable[[Floats], Floats], numbers: NDArray[np.integer[Any]]
) -> Floats:
    # (n, width) integers -> (n,)
    found = np.empty(len(numbers))
    step = max(256, _BLOCK // max(numbers.shape[1], 1))
    for start in range(0, len(numbers), step):
        block = numbers[start : start + step]
        found[start : start + step] = statistic(block.astype(np.float64))
    return found


def _resamples(values: Floats, weights: Floats, what: str) -> Resamples:
    lost = np.isnan(values)
    n_lost, n = int(lost.sum()), values.size
    notes: tuple[str, ...] = ()
    if n_lost:
        gone = float(weights[lost].sum())
        notes = (
            f"undefined, and left out: {n_lost} of {n} distinct {what}, of probability "
            f"{gone:.2g}",
        )
        values, weights = values[~lost], weights[~lost]
    return Resamples(
        source=Enumerated.of(values, weights),
        n_resamples=None,
        n_undefined=n_lost,
        words=f"exact bootstrap distribution, {n} {what}",
        notes=notes,
    )

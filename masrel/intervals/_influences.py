"""How far each item, or cluster of items, moves a coefficient: the delta method.

In: an `IntervalProblem`. Out: the derivative of the coefficient in the weight of every
item, added up over clusters where items come in such.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals._problem import Integers, IntervalProblem, blocks

_STEP = 1e-30  # of a derivative by a complex step, which cancels no digits [1]
_PLACES = 1 << 20  # complex numbers at once
_MAX_SLOPES = 1 << 12  # sums whose slopes are found one by one

# [1] Squire, W., Trapp, G. (1998). Using complex variables to estimate derivatives of
# real functions. SIAM Review, 40(1), 110-112. https://doi.org/10.1137/S003614459631241X


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitInfluences:
    """What each unit adds to the error of a coefficient."""

    moves: Floats = field(compare=False, repr=False)  # (n_units,)
    n_units: int  # those that the coefficient knows of


def unit_influences(problem: IntervalProblem, units: Integers) -> UnitInfluences:
    """Return the derivative of the coefficient in the weight of each unit."""
    # units (n_items,): the unit of every row of the ratings, from 0
    n_items, n_features = len(problem.used.codes), len(problem.sums)
    # of all sums once, or along each item where there are more sums than items
    slopes = None
    if n_features <= min(n_items, _MAX_SLOPES):
        slopes = _derivatives(problem, np.eye(n_features))
    moves, known = np.zeros(n_items), np.zeros(n_items, dtype=bool)
    for block in blocks(n_items):
        part = replace(problem.used, codes=problem.used.codes[block])
        features = problem.features(part)
        moves[block] = (
            _derivatives(problem, features) if slopes is None else features @ slopes
        )
        known[block] = features.any(axis=1)  # without a pair some have none
    n_units = int(units.max(initial=-1)) + 1
    return UnitInfluences(
        moves=np.bincount(units, weights=moves, minlength=n_units).astype(float),
        n_units=len(np.unique(units[known])),
    )


def sample_factor(influences: UnitInfluences) -> float:
    """Return by what the squares of influences are multiplied: n/(n - 1)."""
    n = influences.n_units
    return n / (n - 1) if n > 1 else math.nan


def _derivatives(problem: IntervalProblem, directions: Floats) -> Floats:
    # of the coefficient in the sums; directions (n, n_features) -> (n,)
    n, n_features = directions.shape
    derivatives = np.full(n, math.nan)
    if math.isnan(problem.value):
        return derivatives
    rows = max(1, _PLACES // n_features)
    for start in range(0, n, rows):
        part = slice(start, start + rows)
        stepped = problem.sums + 1j * _STEP * directions[part]
        derivatives[part] = np.imag(problem.values(stepped)) / _STEP
    return derivatives

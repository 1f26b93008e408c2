"""How far each item, or cluster of items, moves a coefficient: the delta method.

In: an `IntervalProblem`. Out: the derivative of the coefficient in the weight of every
item, added up over clusters where items come in such.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from masrel.agreement._engine import Floats
from masrel.intervals._problem import Integers, IntervalProblem


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitInfluences:
    """What each unit adds to the error of a coefficient."""

    moves: Floats = field(compare=False, repr=False)  # (n_units,)
    n_units: int  # those that the coefficient knows of


def unit_influences(problem: IntervalProblem, units: Integers) -> UnitInfluences:
    """Return the derivative of the coefficient in the weight of each unit."""
    # units (n_items,): the unit of every row of the ratings, from 0
    features = problem.formula.features(problem.used.codes, problem.v)
    moves = features.dot(problem.slopes(problem.sums))
    n_units = int(units.max(initial=-1)) + 1
    of_units = np.bincount(units, weights=moves, minlength=n_units).astype(float)
    known = np.unique(units[features.matters])
    # their mean is 0 but for coefficients that correct for small samples
    of_units[known] -= of_units[known].sum() / max(len(known), 1)
    return UnitInfluences(moves=of_units, n_units=len(known))


def sample_factor(influences: UnitInfluences) -> float:
    """Return by what the squares of influences are multiplied: n/(n - 1)."""
    n = influences.n_units
    return n / (n - 1) if n > 1 else math.nan

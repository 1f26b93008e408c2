"""What a bootstrap draws, and the rule by which its ends come from it."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import ParameterError
from masrel.intervals._problem import IntervalProblem, warn_small
from masrel.intervals.resampling.endpoints import Kind, Rule
from masrel.intervals.resampling.pool import Pool, cluster_pool, item_pool, rater_pool
from masrel.intervals.resampling.slopes import acceleration, standard_errors

__all__ = ["pool_of", "rule_of"]


def pool_of(
    problem: IntervalProblem, clusters: Sequence[object] | NDArray[Any] | None
) -> tuple[Pool, tuple[str, ...], str]:
    """Find out what is resampled."""
    if problem.target == "both":
        raise ParameterError(
            'target: the bootstrap resamples "items" or "raters"; for both use the '
            "jackknife"
        )
    if problem.target == "raters":
        if clusters is not None:
            raise ParameterError('clusters: are of items, and need target="items"')
        pool = rater_pool(problem)
        return pool, warn_small(pool.n, 5, "raters"), ""
    if clusters is None:
        pool = item_pool(problem)
        return pool, warn_small(pool.n, 16, "items"), ""
    pool = cluster_pool(problem, clusters)
    return pool, warn_small(pool.n, 16, "clusters"), f" of {pool.n} clusters"


def rule_of(problem: IntervalProblem, pool: Pool, kind: Kind) -> Rule:
    """Prepare how ends come from resamples."""
    rule = Rule(kind=kind, level=problem.level, value=problem.value)
    if math.isnan(problem.value):
        return rule
    if kind == "bca":
        return dataclasses.replace(rule, skew=acceleration(pool))
    if kind == "studentized":
        (error,) = standard_errors(pool, pool.times[None].astype(np.float64))
        return dataclasses.replace(rule, error=float(error))
    return rule

"""Standard errors that others publish and packages print, by name."""

import math
import warnings
from collections.abc import Callable
from typing import Literal, get_args

import numpy as np

from masrel.agreement import WeightsLike
from masrel.agreement._counts import item_counts
from masrel.agreement._kernel import Floats, weighted_disagreement
from masrel.agreement._pairs import pair_table
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate
from masrel.intervals._problem import IntervalProblem
from masrel.intervals.jackknife import _variance_of, _without_rater

ErrorName = Literal["delta", "over_n", "cohen", "irrcac", "unconditional"]
"""Which standard error an analytic interval is made of."""

NAMES: dict[ErrorName, str] = {
    "delta": "delta method",
    "over_n": "delta method over n",
    "cohen": "Cohen's error",
    "irrcac": "irrCAC's error",
    "unconditional": "Gwet's unconditional error",
}
"""What each is called in the method of an interval."""


def check_error(error: str, target: str) -> None:
    """Check the name of an error, and that it answers for the target."""
    if error not in get_args(ErrorName):
        raise ParameterError(
            f"error: needs one of {', '.join(get_args(ErrorName))}, got {error!r}"
        )
    if error == "unconditional" and target != "both":
        raise ParameterError(
            "target: the unconditional error generalises to other items and raters, so "
            f'"both"; got "{target}"'
        )
    if error != "unconditional" and target != "items":
        raise ParameterError(
            'target: the delta method generalises to other items only, so "items"; for '
            'other raters use the jackknife, for both error="unconditional"; got '
            f'"{target}"'
        )


def published_error(
    problem: IntervalProblem,
    estimate: Estimate,
    error: ErrorName,
    weights: WeightsLike,
) -> float:
    """Return the standard error of an estimate by the formula of that name."""
    if error == "over_n":
        # items with a pair in a test-retest: others are no part of that sample
        n = problem.n_items if problem.entry.shape == "pairs" else estimate.n_items
        return estimate.standard_error * math.sqrt((n - 1) / n)
    if error == "cohen":
        return _cohen(problem)
    if error == "irrcac":
        return _irrcac(problem, weights)
    if error == "unconditional":
        return _unconditional(problem, estimate)
    return estimate.standard_error


def _cohen(problem: IntervalProblem) -> float:
    # √[(Σ_kl w_kl² p_kl - p_o²) / (n (1 - p_e)²)], Cohen (1968), which without weights
    # is √[p_o (1 - p_o) / (n (1 - p_e)²)], Cohen (1960): as if p_e were known. A
    # constant that is added to all weights changes nothing: w = -v.
    if problem.entry.name != "cohen_kappa":
        raise ParameterError(
            f'error: "cohen" is of Cohen\'s κ alone, got {problem.entry.title}'
        )
    v = problem.v
    p = pair_table(problem.used.codes, len(v)).astype(np.float64)
    n = p.sum()
    p /= n
    expected = (v * np.outer(p.sum(axis=1), p.sum(axis=0))).sum()
    observed = (v * p).sum()
    return math.sqrt(((v - observed) ** 2 * p).sum() / n) / float(expected)


def _irrcac(problem: IntervalProblem, weights: WeightsLike) -> float:
    entry = problem.entry
    if entry.name == "krippendorff_alpha":
        counts = item_counts(problem.patterns).astype(np.float64)
        return _irrcac_of_alpha(counts, problem.freq.astype(np.float64), problem.v)
    if entry.name not in _VARIANCE_BY_NAME:
        raise ParameterError(
            f'error: irrCAC has none of {entry.title} that "over_n" would not give'
        )
    function: Callable[..., Estimate] = entry.function
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # given before
        other = function(problem.coded, weights=weights, variance="irrcac")
    return other.standard_error


_VARIANCE_BY_NAME = (
    "percent_agreement",
    "fleiss_kappa",
    "brennan_prediger",
    "gwet_ac",
    "conger_kappa",
)


def _irrcac_of_alpha(counts: Floats, freq: Floats, v: Floats) -> float:
    # Of the m items with r_i ≥ 2 ratings, r the mean of those and n their sum, with P
    # the agreement and p_e what irrCAC takes for chance,
    #   x_i = [P_i - p_a (r_i - r)/r - p_e - 2 (1 - α') (e_i - p_e)] / (1 - p_e),
    #   P_i = Σ_k n_ik (Σ_l w_kl n_il - 1) / (r (r_i - 1)),  P' their mean,
    #   e_i = Σ_k n_ik Σ_l w_kl p_l / r - p_e (r_i - r)/r,   α' = (P' - p_e)/(1 - p_e),
    #   p_a = P' + (1 - P')/n,   SE² = Σ (x_i - α')² / (m (m - 1)).
    # It takes the factor of alpha for small samples into p_a, and out of all else.
    size = counts.sum(axis=1)
    counts, freq, size = counts[size > 1], freq[size > 1], size[size > 1]
    m, mean = freq.sum(), freq @ size / freq.sum()
    p = freq @ counts / (freq @ size)
    p_e = 1.0 - p @ v @ p
    of_items = size / mean - weighted_disagreement(counts, v) / (mean * (size - 1.0))
    agreement = freq @ of_items / m
    p_a = agreement + (1.0 - agreement) / (freq @ size)
    alpha = (agreement - p_e) / (1.0 - p_e)
    excess = (size - mean) / mean
    chance = (size - counts @ (p @ v)) / mean - p_e * excess
    x = of_items - p_a * excess - p_e - 2.0 * (1.0 - alpha) * (chance - p_e)
    squares = freq @ (x / (1.0 - p_e) - alpha) ** 2
    return math.sqrt(squares / (m * (m - 1.0)))


def _unconditional(problem: IntervalProblem, estimate: Estimate) -> float:
    # √(V_items + V_raters): the variance over items with these raters, and the
    # jackknife's over raters with these items
    of_raters = _variance_of(*_without_rater(problem), problem.n_paired_raters)
    return math.sqrt(estimate.standard_error**2 + of_raters)

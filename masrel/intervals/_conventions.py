"""Standard errors as other programs print them, for those who need an old number."""

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from masrel.agreement import COEFFICIENTS
from masrel.agreement._engine import disagreement_within, standard_error
from masrel.agreement.category import _null_error
from masrel.errors import ParameterError
from masrel.estimates import Estimate
from masrel.intervals._problem import IntervalProblem

Convention = Literal["irrcac", "spss", "over_n"]
"""Whose standard error an analytic interval is made of, where it is not our own."""


def _over_n(problem: IntervalProblem, estimate: Estimate) -> float:
    # items with a pair in a test-retest: others are no part of that sample
    n = problem.n_items if problem.entry.shape == "pairs" else estimate.n_items
    return estimate.standard_error * math.sqrt((n - 1) / n)


def _irrcac(problem: IntervalProblem, estimate: Estimate) -> float:
    # it takes n u_i + κ (s_i n/n' - 1), s_i = 1 with a pair, as n' items have
    features = problem.formula.features(problem.patterns.codes, problem.v)
    moves = features.dot(problem.slopes(problem.sums))
    paired = (problem.patterns.codes >= 0).sum(axis=1) > 1
    moves += estimate.value * (paired / estimate.n_items_paired - 1.0 / problem.n_items)
    return standard_error(moves, problem.freq, None)


def _irrcac_of_alpha(problem: IntervalProblem, _estimate: Estimate) -> float:
    # Of the m items with r_i ≥ 2 ratings, r the mean of those and n their sum, with P
    # the agreement and p_e what irrCAC takes for chance,
    #   x_i = [P_i - p_a (r_i - r)/r - p_e - 2 (1 - α') (e_i - p_e)] / (1 - p_e),
    #   P_i = Σ_k n_ik (Σ_l w_kl n_il - 1) / (r (r_i - 1)),  P' their mean,
    #   e_i = Σ_k n_ik Σ_l w_kl p_l / r - p_e (r_i - r)/r,   α' = (P' - p_e)/(1 - p_e),
    #   p_a = P' + (1 - P')/n,   SE² = Σ (x_i - α')² / (m (m - 1)).
    # It takes the factor of alpha for small samples into p_a, and out of all else.
    codes, v = problem.patterns.codes, problem.v
    rated = codes >= 0
    size, freq = rated.sum(axis=1), problem.freq  # every item has a pair of ratings
    m, n = int(freq.sum()), float(freq @ size)
    mean = n / m
    often = np.broadcast_to(freq[:, None], codes.shape)[rated]
    p = np.bincount(codes[rated], often, minlength=len(v)) / n
    others = p @ v
    p_e = 1.0 - others @ p
    within = disagreement_within(codes, v, None)
    of_items = size / mean - within / (mean * (size - 1.0))
    agreement = freq @ of_items / m
    p_a = agreement + (1.0 - agreement) / n
    alpha = (agreement - p_e) / (1.0 - p_e)
    excess = (size - mean) / mean
    between = np.where(rated, others[codes], 0.0).sum(axis=1)
    chance = (size - between) / mean - p_e * excess
    x = of_items - p_a * excess - p_e - 2.0 * (1.0 - alpha) * (chance - p_e)
    squares = freq @ (x / (1.0 - p_e) - alpha) ** 2
    return math.sqrt(squares / (m * (m - 1.0)))


def _null(problem: IntervalProblem, _estimate: Estimate) -> float:
    return _null_error(problem.item_counts(), problem.n_raters)


_RATERS_ALIKE = ("percent_agreement", "fleiss_kappa", "brennan_prediger", "gwet_ac")

_ErrorOf = Callable[[IntervalProblem, Estimate], float]

_ERRORS: dict[str, dict[str, _ErrorOf]] = {
    "irrcac": {
        **dict.fromkeys((*_RATERS_ALIKE, "conger_kappa"), _irrcac),
        "krippendorff_alpha": _irrcac_of_alpha,
        **dict.fromkeys(("cohen_kappa", "scott_pi"), _over_n),
    },
    # of several raters that of the hypothesis that κ is 0: Fleiss, Nee, Landis (1979)
    "spss": {"cohen_kappa": _over_n, "fleiss_kappa": _null},
    "over_n": dict.fromkeys(COEFFICIENTS, _over_n),
}


def error_by(
    convention: Convention, problem: IntervalProblem, estimate: Estimate
) -> float:
    """Return the standard error of an estimate as another program prints it."""
    function = _ERRORS[convention].get(problem.entry.name)
    if function is None or (function is _null and not problem.unweighted):
        raise ParameterError(
            f'convention: "{convention}" has no error of {problem.entry.title} with '
            f"these weights; it has one of {', '.join(_ERRORS[convention])}"
        )
    return function(problem, estimate)

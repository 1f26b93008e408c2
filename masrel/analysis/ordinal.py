"""Ordered logistic regression with errors clustered by rater.

P(grade ≤ g) = 1/(1 + exp(x·β - τ_g)).
"""

import math
import sys
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

__all__ = ["OrdinalData", "OrdinalFit", "fit_ordinal", "is_separated", "odds_ratio"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class OrdinalData:
    """Grades and what they are regressed on."""

    # (n_ratings, n_predictors): standardized predictors
    values: Floats = field(compare=False, repr=False)
    # (n_ratings,): grades, 0 for the least that was given
    codes: NDArray[np.int64] = field(compare=False, repr=False)
    # (n_ratings,): who gave them, from 0 on
    raters: NDArray[np.int64] = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class OrdinalFit:
    """A regression of grades."""

    coefficients: Floats = field(compare=False, repr=False)  # (n_predictors,): β
    # (n_predictors, n_predictors): of their errors, clustered by rater
    covariance: Floats = field(compare=False, repr=False)
    thresholds: Floats = field(compare=False, repr=False)  # (n_grades - 1,): τ
    log_likelihood: float  # at the maximum


def is_separated(data: OrdinalData) -> bool:
    """Say whether the likelihood has no maximum, by a linear program."""
    # [1] Albert, A., Anderson, J. A. (1984). On the existence of maximum likelihood
    # estimates in logistic regression models. Biometrika, 71(1), 1-10.
    # https://doi.org/10.1093/biomet/71.1.1
    # A direction (β, τ) in which no rating's interval τ_(g-1) < x·β < τ_g shrinks at
    # either end, and some end moves away: then the likelihood grows for ever.
    n, p = data.values.shape
    n_thresholds = int(data.codes.max())
    upper, lower = data.codes < n_thresholds, data.codes > 0
    rows = np.zeros((int(upper.sum() + lower.sum()), p + n_thresholds))
    ends = int(upper.sum())
    rows[:ends, :p] = data.values[upper]
    rows[np.arange(ends), p + data.codes[upper]] = -1.0  # x·β ≤ τ_g
    rows[ends:, :p] = -data.values[lower]
    rows[np.arange(ends, rows.shape[0]), p + data.codes[lower] - 1] = 1.0
    found = linprog(
        rows.sum(axis=0),  # the smaller, the further the ends move away
        A_ub=rows,
        b_ub=np.zeros(rows.shape[0]),
        bounds=(-1.0, 1.0),
        method="highs",
    )
    return bool(found.fun < -1e-7 * n)


def fit_ordinal(data: OrdinalData) -> OrdinalFit:
    """Fit the regression by maximum likelihood."""
    from statsmodels.miscmodels.ordinal_model import OrderedModel

    model = OrderedModel(data.codes, data.values, distr="logit")
    found = model.fit(method="bfgs", disp=False, gtol=1e-8, maxiter=1000)
    p = data.values.shape[1]
    inverse = np.linalg.inv(model.hessian(found.params))
    scores = np.asarray(model.score_obs(found.params))
    n_raters = int(data.raters.max()) + 1
    by_rater = np.zeros((n_raters, scores.shape[1]))
    np.add.at(by_rater, data.raters, scores)
    meat = by_rater.T @ by_rater * n_raters / (n_raters - 1)
    covariance = (inverse @ meat @ inverse)[:p, :p]
    thresholds = np.asarray(model.transform_threshold_params(found.params))[1:-1]
    return OrdinalFit(
        coefficients=np.asarray(found.params[:p]),
        covariance=covariance,
        thresholds=thresholds,
        log_likelihood=float(found.llf),
    )


def odds_ratio(coefficient: float) -> float:
    """Turn a coefficient into what it multiplies the odds by."""
    if coefficient > math.log(sys.float_info.max):
        return math.inf
    return math.exp(coefficient)

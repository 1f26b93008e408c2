"""Analytic intervals from a standard error: other items, same raters."""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from masrel._input import check_option, refuse
from masrel.agreement import COEFFICIENTS, Label, Metric, WeightsLike
from masrel.agreement._engine import NO_SPREAD, ONE_PAIR, WHOLE, Features, Integers
from masrel.agreement.kappas import _null_error
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval, Target, Unit, _Convention
from masrel.intervals._question import (
    HELD,
    IntervalProblem,
    Statistic,
    cluster_codes,
    cluster_sums,
    pose_problem,
    warn_small,
)

# What an interval is taken from, and on which scale
_Distribution = Literal["t", "normal", "logit", "fisher"]

_METHODS: dict[_Distribution, str] = {
    "t": "t(n-1)",
    "normal": "normal",
    "logit": "t(n-1) on the logit",
    "fisher": "t(n-1) on Fisher's z",
}

_NAMES: dict[_Convention, str] = {
    "irrcac": "irrCAC's error",
    "spss": "SPSS's error",
    "over_n": "delta method over n",
}

# What intervals are taken from that are printed with these errors
_PRINTED: dict[_Convention, _Distribution] = {
    "irrcac": "t",
    "spss": "normal",
    "over_n": "normal",
}


def analytic(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    metric: Metric | None = None,
    level: float = 0.95,
    distribution: _Distribution = "t",
    convention: _Convention | None = None,
    clusters: object = None,
) -> Interval:
    """Compute an interval from a standard error.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    ratings : nested sequence, array_like or DataFrame
        What the coefficient takes.
    target : {"items"}
        The standard error takes items as the sample and says nothing of raters.
    categories : sequence, optional
        The declared scale in order.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    metric : str, optional
        Krippendorff's difference function in place of weights; see
        `krippendorff_alpha`, which alone takes one.
    level : float, optional
        Nominal level.
    distribution : {"t", "normal", "logit", "fisher"}, optional
        Student's t with n - 1 degrees, n the items with a pair of ratings; the
        normal; or t on the logit of the
        position between the ends of the parameter space or on Fisher's z.
    convention : {"irrcac", "spss", "over_n"}, optional
        Take the standard error that another program prints in place of ours; see Notes.
    clusters : sequence of labels, length n_items, optional
        The cluster of every item, such as the patient of a site: n are then clusters.
        By default each item is independent.

    Returns
    -------
    Interval
        A confidence interval; ``nan`` with a reason when undefined.

    Raises
    ------
    ParameterError
        If an option is invalid, the target is not "items", or the convention has no
        error of the coefficient.
    RatingsError
        If the ratings do not fit the coefficient.

    Warns
    -----
    SmallSampleWarning
        Below 10 items with a pair of ratings.
    UndefinedStatisticWarning
        If the estimate or its standard error is undefined or 0.

    Notes
    -----
    "over_n" is the delta method's with n in place of n - 1: for Cohen's kappa Fleiss,
    Cohen and Everitt's [2]_, which SPSS and the R packages vcd and psych print (psych's
    of weighted kappa has a fault), with "normal" their interval. "irrcac" is what the
    package irrCAC prints, also for Krippendorff's alpha; but for alpha it is ours where
    every item has at least two ratings. "spss" is "over_n" for Cohen's kappa, and for
    Fleiss' kappa that of the hypothesis that kappa is 0 [3]_.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 5.
    .. [2] Fleiss, J. L., Cohen, J., Everitt, B. S. (1969). Large sample standard
       errors of kappa and weighted kappa. Psychological Bulletin, 72(5), 323-327.
       https://doi.org/10.1037/h0028106
    .. [3] Fleiss, J. L., Nee, J. C. M., Landis, J. R. (1979). Large sample variance of
       kappa in the case of different sets of raters. Psychological Bulletin, 86(5),
       974-977. https://doi.org/10.1037/0033-2909.86.5.974

    Examples
    --------
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]] * 5
    >>> interval = analytic("cohen_kappa", ratings, target="items")
    >>> round(interval.low, 3), round(interval.high, 3)
    (0.14, 0.86)

    As R's vcd and psych print it:

    >>> interval = analytic(
    ...     "cohen_kappa", ratings, target="items", convention="over_n",
    ...     distribution="normal",
    ... )
    >>> round(interval.low, 3), round(interval.high, 3)
    (0.171, 0.829)
    """
    check_option("distribution", distribution, _METHODS)
    if convention is not None:
        check_option("convention", convention, _NAMES)
    problem = pose_problem(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        metric=metric,
        level=level,
    )
    refuse(
        (
            target != "items",
            "target: the delta method generalises to other items only: needs "
            f'"items", got "{target}"; for other raters, or both, use the '
            "jackknife",
        ),
        (
            clusters is not None and convention is not None,
            f'clusters: cannot be combined with a convention, got "{convention}"',
        ),
    )
    return _with_error(problem, weights, distribution, convention, clusters)[1]


def _by_convention(
    coefficient: Statistic,
    ratings: object,
    *,
    convention: _Convention,
    target: Target,
    categories: Sequence[Label] | None,
    weights: "WeightsLike",
    level: float,
) -> Estimate:
    """Return an estimate with the error and the interval of another program."""
    problem = pose_problem(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        level=level,
    )
    estimate, interval = _with_error(problem, weights, _PRINTED[convention], convention)
    return replace(estimate, interval=interval)


def _with_error(
    problem: IntervalProblem,
    weights: "WeightsLike",
    distribution: _Distribution,
    convention: _Convention | None,
    clusters: object = None,
) -> tuple[Estimate, Interval]:
    """Return an estimate with a standard error, and the interval that it makes."""
    if problem.entry.metric == "ordinal":
        problem = replace(problem, notes=(HELD,))
    # it is given below
    with warnings.catch_warnings(action="ignore", category=UndefinedStatisticWarning):
        estimate = problem.entry(problem.coded, weights=weights)
    unit: Unit | None = None if clusters is None else "clusters"
    method, error = "delta method", estimate.standard_error
    if problem.entry.has_interval:  # and, beside it, no error of its own
        error = problem.item_features.error(problem.slopes(problem.sums), problem.freq)
    n, n_items = estimate.n_items_paired, estimate.n_items
    if convention is not None:
        method, error = _NAMES[convention], _error_by(convention, problem, estimate)
    method = f"{method}, {_METHODS[distribution]}"
    if clusters is not None:
        method = f"{method}, of clusters"
        error, n = _clustered_error(problem, cluster_codes(problem, clusters))
    estimate = replace(estimate, standard_error=error)
    # artanh x is half the logit of (x + 1)/2, so that both give the same ends
    lowest = {"logit": problem.entry.lowest, "fisher": -1.0}.get(distribution)
    reason = estimate.reason or _why_undefined(estimate, error, n, lowest)
    if reason is not None:
        return estimate, problem.undefined(reason, method=method, unit=unit)
    notes = warn_small(n, 10, unit or "items", None if unit else n_items)
    # irrCAC's t counts items of one rating, too
    counts_all = _ERRORS.get(convention or "", {}).get(problem.entry.name) is _irrcac
    df = math.inf if distribution == "normal" else (n_items if counts_all else n) - 1
    return estimate, problem.by_t(
        error, df, lowest=lowest, method=method, unit=unit, notes=notes
    )


def _why_undefined(
    estimate: Estimate, error: float, n: int, lowest: float | None
) -> str | None:
    if estimate.n_items_paired < 2:
        return ONE_PAIR
    if n < 2:
        return "one cluster has no standard error"
    if not error > 0.0:
        return NO_SPREAD
    if lowest is not None and not lowest < estimate.value < 1.0:
        return "the estimate is at an end of the parameter space"
    return None


def _clustered_error(problem: IntervalProblem, clusters: Integers) -> tuple[float, int]:
    """Return the delta-method error with clusters as the sample, and how many."""
    # √[n/(n - 1) Σ_c s_c²], s_c the sum of the influences of a cluster's items:
    # Vanbelle, S. (2017). Comparing dependent kappa coefficients obtained on multilevel
    # data. Biometrical Journal, 59(5), 1016-1034. https://doi.org/10.1002/bimj.201600093
    sums, known, n_paired = cluster_sums(problem, clusters)
    rows, none = sums[known], np.empty((known.sum(), 0))
    features = Features(rows.T, none.astype(np.int64), none, 0)
    once = np.ones(len(rows), dtype=np.int64)
    return features.error(problem.slopes(problem.sums), once), n_paired


# -- standard errors as other programs print them --------------------------------------


def _over_n(problem: IntervalProblem, estimate: Estimate) -> float:
    # items with a pair in a test-retest: others are no part of that sample
    n = problem.n_items if problem.entry.shape == "pairs" else estimate.n_items
    return estimate.standard_error * math.sqrt((n - 1) / n)


def _irrcac(problem: IntervalProblem, estimate: Estimate) -> float:
    # it takes n u_i + κ (s_i n/n' - 1), s_i = 1 with a pair, as n' items have
    paired = (problem.codes >= 0).sum(axis=1) > 1
    more = estimate.value * (paired / estimate.n_items_paired - 1.0 / problem.n_items)
    slope = problem.slopes(problem.sums)
    return problem.item_features.error(slope, problem.freq, more=more)


def _irrcac_of_alpha(problem: IntervalProblem, _estimate: Estimate) -> float:
    # Of the m items with r_i ≥ 2 ratings, r the mean of those and n their sum, with P
    # the agreement and p_e what irrCAC takes for chance,
    #   x_i = [P_i - p_a (r_i - r)/r - p_e - 2 (1 - α') (e_i - p_e)] / (1 - p_e),
    #   P_i = Σ_k n_ik (Σ_l w_kl n_il - 1) / (r (r_i - 1)),  P' their mean,
    #   e_i = Σ_k n_ik Σ_l w_kl p_l / r - p_e (r_i - r)/r,   α' = (P' - p_e)/(1 - p_e),
    #   p_a = P' + (1 - P')/n,   SE² = Σ (x_i - α')² / (m (m - 1)).
    # It takes the factor of alpha for small samples into p_a, and out of all else.
    # every item that matters has a pair of ratings
    codes, v, freq = problem.codes[problem.freq > 0], problem.v, problem.freq
    freq = freq[freq > 0]
    rated = codes >= 0
    size = rated.sum(axis=1)
    m, n = int(freq.sum()), float(freq @ size)
    mean = n / m
    often = np.broadcast_to(freq[:, None], codes.shape)[rated]
    p = np.bincount(codes[rated], often, minlength=len(v)) / n
    others = p @ v
    p_e = 1.0 - others @ p
    # the first of alpha's features is Σ_kl v_kl n_ik n_il / (r_i - 1)
    within = problem.item_features.dense[0, problem.freq > 0] / WHOLE
    of_items = (size - within) / mean
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


_ERRORS: dict[str, dict[str, Callable[[IntervalProblem, Estimate], float]]] = {
    "irrcac": {
        **dict.fromkeys(("percent_agreement", "fleiss_kappa"), _irrcac),
        **dict.fromkeys(("brennan_prediger", "gwet_ac", "conger_kappa"), _irrcac),
        "krippendorff_alpha": _irrcac_of_alpha,
        **dict.fromkeys(("cohen_kappa", "scott_pi"), _over_n),
    },
    # of several raters that of the hypothesis that κ is 0: Fleiss, Nee, Landis (1979)
    "spss": {"cohen_kappa": _over_n, "fleiss_kappa": _null},
    "over_n": {
        name: _over_n
        for name, of in COEFFICIENTS.items()
        if of.formula is not None and not of.has_interval
    },
}


def _error_by(
    convention: _Convention, problem: IntervalProblem, estimate: Estimate
) -> float:
    function = _ERRORS[convention].get(problem.entry.name)
    if function is None or (function is _null and not problem.unweighted):
        with_weights = "" if function is None else " with weights"
        raise ParameterError(
            f'convention: "{convention}" has no standard error for '
            f"{problem.entry.title}{with_weights}, only for "
            f"{', '.join(_ERRORS[convention])}"
        )
    is_defined = estimate.reason is None and estimate.n_items > 1
    return function(problem, estimate) if is_defined else math.nan

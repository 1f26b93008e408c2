"""Analytic intervals from the delta-method standard error: other items, same raters."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, get_args

from masrel.agreement import Label, Metric, WeightsLike
from masrel.agreement._kernel import NO_SPREAD, ONE_PAIR
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval, Target, Unit
from masrel.intervals._clusters import ClusterSums, clustered_error, clusters_of
from masrel.intervals._problem import (
    HELD,
    IntervalProblem,
    Statistic,
    pose_problem,
    warn_small,
)
from masrel.intervals._published_errors import (
    NAMES,
    ErrorName,
    check_error,
    published_error,
)

_Distribution = Literal["t", "normal", "logit", "fisher"]
"""What an interval is taken from, and on which scale."""

_METHODS: dict[_Distribution, str] = {
    "t": "t(n-1)",
    "normal": "normal",
    "logit": "t(n-1) on the logit",
    "fisher": "t(n-1) on Fisher's z",
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
    error: ErrorName = "delta",
    clusters: object = None,
) -> Interval:
    """Compute an interval from a standard error.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    ratings : nested sequence, array_like or DataFrame
        What the coefficient takes.
    target : {"items", "both"}
        The standard error takes items as the sample and says nothing of raters; with
        the unconditional error, "both".
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
    error : {"delta", "over_n", "cohen", "irrcac", "unconditional"}, optional
        Ours, or the one that others publish, by name; see Notes.
    clusters : sequence of labels, length n_items, optional
        The cluster of every item, such as the patient of a site: n are then clusters.
        Each item by itself when not given.

    Returns
    -------
    Interval
        A confidence interval; ``nan`` with a reason when undefined.

    Raises
    ------
    ParameterError
        If an option is invalid, the error does not answer for the target, or is not
        of the coefficient.
    RatingsError
        If the ratings do not fit the coefficient.

    Warns
    -----
    SmallSampleWarning
        Below 10 items with a pair of ratings, and with the unconditional error below 5
        raters.
    UndefinedStatisticWarning
        If the estimate or its standard error is undefined or 0.

    Notes
    -----
    "over_n" is the delta method's with n in place of n - 1: for Cohen's kappa Fleiss,
    Cohen and Everitt's [2]_, which the R packages vcd and psych print (psych's of
    weighted kappa has a fault), with "normal" their interval. "cohen" is Cohen's own
    [3]_, √[p_o (1 - p_o) / (n (1 - p_e)²)], as if chance agreement were known, and with
    weights that of [4]_. "irrcac" is what the package irrCAC prints, also of
    Krippendorff's alpha; the two are the same where every item has at least two
    ratings, but for alpha. "unconditional" is Gwet's [5]_ for other items and raters:
    the variance over items with these raters, and the jackknife's over raters. The
    degrees of freedom are the smaller of n - 1 and those of the raters.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 5.
    .. [2] Fleiss, J. L., Cohen, J., Everitt, B. S. (1969). Large sample standard
       errors of kappa and weighted kappa. Psychological Bulletin, 72(5), 323-327.
       https://doi.org/10.1037/h0028106
    .. [3] Cohen, J. (1960). A coefficient of agreement for nominal scales.
       Educational and Psychological Measurement, 20(1), 37-46, equation 7.
       https://doi.org/10.1177/001316446002000104
    .. [4] Cohen, J. (1968). Weighted kappa. Psychological Bulletin, 70(4), 213-220.
       https://doi.org/10.1037/h0026256
    .. [5] Gwet, K. L. (2008). Variance estimation of nominal-scale inter-rater
       reliability with random selection of raters. Psychometrika, 73(3), 407-430.
       https://doi.org/10.1007/s11336-007-9054-8

    Examples
    --------
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]] * 5
    >>> interval = analytic("cohen_kappa", ratings, target="items")
    >>> round(interval.low, 3), round(interval.high, 3)
    (0.14, 0.86)

    As R's vcd and psych print it:

    >>> interval = analytic(
    ...     "cohen_kappa", ratings, target="items", error="over_n",
    ...     distribution="normal",
    ... )
    >>> round(interval.low, 3), round(interval.high, 3)
    (0.171, 0.829)
    """
    if distribution not in get_args(_Distribution):
        raise ParameterError(
            f"distribution: needs one of {', '.join(get_args(_Distribution))}, "
            f"got {distribution!r}"
        )
    problem = pose_problem(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        metric=metric,
        level=level,
        delta=error == "delta" and clusters is None,
    )
    check_error(error, target)
    if problem.entry.metric == "ordinal":
        problem = replace(problem, notes=(HELD,))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # given below
        estimate = problem.entry(problem.coded, weights=weights)
    if error != "delta" and estimate.reason is None and estimate.n_items > 1:
        by_name = published_error(problem, estimate, error, weights)
        estimate = replace(estimate, standard_error=by_name)
    n_clusters = None
    if clusters is not None:
        if error != "delta":
            raise ParameterError(f'clusters: needs error "delta", got "{error}"')
        codes = clusters_of(problem, clusters)
        n_clusters = ClusterSums.of(problem, codes).n_paired
        if estimate.reason is None and n_clusters > 1:
            by_cluster = clustered_error(problem, codes)
            estimate = replace(estimate, standard_error=by_cluster)
    return _interval_around_estimate(problem, estimate, distribution, error, n_clusters)


def _interval_around_estimate(
    problem: IntervalProblem,
    estimate: Estimate,
    distribution: _Distribution,
    error: ErrorName,
    n_clusters: int | None,
) -> Interval:
    unit: Unit | None = None
    method = f"{NAMES[error]}, {_METHODS[distribution]}"
    if error == "unconditional":
        method, unit = method.replace("n-1", "min(n, r)-1"), "raters"
    elif n_clusters is not None:
        method, unit = f"{method}, of clusters", "clusters"
    reason = _why_undefined(estimate, n_clusters)
    if reason is not None:
        return problem.undefined(reason, method=method, unit=unit)
    df = estimate.n_items_paired - 1
    if n_clusters is not None:
        df = n_clusters - 1
        notes = warn_small(n_clusters, 10, "clusters")
    else:
        notes = warn_small(df + 1, 10, "items", estimate.n_items)
    if unit == "raters":
        notes += warn_small(problem.n_paired_raters, 5, "raters", estimate.n_raters)
        df = min(df, problem.n_paired_raters - 1)
    lowest = None
    if distribution in ("logit", "fisher"):
        # artanh x is half the logit of (x + 1)/2, so that both give the same ends
        lowest = problem.entry.lowest if distribution == "logit" else -1.0
        if not lowest < estimate.value < 1.0:
            reason = "the estimate is not inside the ends of the parameter space"
            return problem.undefined(reason, method=method, unit=unit)
    if distribution == "normal":
        from scipy.special import ndtri  # loaded only when an interval needs it

        quantile = float(ndtri(0.5 + 0.5 * problem.level))
    else:
        quantile = problem.student_t(df)
    half = quantile * estimate.standard_error
    return problem.around(
        estimate.value, half, lowest=lowest, method=method, unit=unit, notes=notes
    )


def _why_undefined(estimate: Estimate, n_clusters: int | None) -> str | None:
    """Return why there is no interval, if there is none."""
    if estimate.reason is not None:
        return estimate.reason
    if estimate.n_items_paired < 2:
        return ONE_PAIR
    if math.isnan(estimate.standard_error):
        return "with one of the raters left out the estimate is undefined"
    if n_clusters is not None and n_clusters < 2:
        return "one cluster has no standard error"
    return None if estimate.standard_error > 0.0 else NO_SPREAD

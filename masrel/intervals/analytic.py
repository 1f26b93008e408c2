"""Analytic intervals from the delta-method standard error: other items, same raters."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, get_args

from masrel.agreement import Label, Metric, WeightsLike
from masrel.agreement._engine import NO_SPREAD, ONE_PAIR
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval, Target, Unit
from masrel.intervals._clusters import ClusterSums, clustered_error, clusters_of
from masrel.intervals._conventions import Convention, error_by
from masrel.intervals._problem import (
    HELD,
    IntervalProblem,
    Statistic,
    pose_problem,
    warn_small,
)

_Distribution = Literal["t", "normal", "logit", "fisher"]
"""What an interval is taken from, and on which scale."""

_METHODS: dict[_Distribution, str] = {
    "t": "t(n-1)",
    "normal": "normal",
    "logit": "t(n-1) on the logit",
    "fisher": "t(n-1) on Fisher's z",
}

_NAMES: dict[Convention, str] = {
    "irrcac": "irrCAC's error",
    "spss": "SPSS's error",
    "over_n": "delta method over n",
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
    convention: Convention | None = None,
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
        Each item by itself when not given.

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
    package irrCAC prints, also of Krippendorff's alpha; but for alpha it is ours where
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
    if distribution not in get_args(_Distribution):
        raise ParameterError(
            f"distribution: needs one of {', '.join(get_args(_Distribution))}, "
            f"got {distribution!r}"
        )
    if convention not in (None, *_NAMES):
        raise ParameterError(
            f"convention: needs one of {', '.join(_NAMES)}, got {convention!r}"
        )
    problem = pose_problem(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        metric=metric,
        level=level,
        delta=convention is None and clusters is None,
    )
    if target != "items":
        raise ParameterError(
            'target: the delta method generalises to other items only, so "items"; for '
            f'other raters, or both, use the jackknife; got "{target}"'
        )
    if problem.entry.metric == "ordinal":
        problem = replace(problem, notes=(HELD,))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # given below
        estimate = problem.entry(problem.coded, weights=weights)
    method = f"delta method, {_METHODS[distribution]}"
    if convention is not None:
        method = f"{_NAMES[convention]}, {_METHODS[distribution]}"
        if estimate.reason is None and estimate.n_items > 1:
            error = error_by(convention, problem, estimate)
            estimate = replace(estimate, standard_error=error)
    n_clusters = None
    if clusters is not None:
        if convention is not None:
            raise ParameterError(f'clusters: needs no convention, got "{convention}"')
        codes = clusters_of(problem, clusters)
        n_clusters = ClusterSums.of(problem, codes).n_paired
        if estimate.reason is None and n_clusters > 1:
            by_cluster = clustered_error(problem, codes)
            estimate = replace(estimate, standard_error=by_cluster)
    return _interval_around_estimate(
        problem, estimate, distribution, method, n_clusters
    )


def _interval_around_estimate(
    problem: IntervalProblem,
    estimate: Estimate,
    distribution: _Distribution,
    method: str,
    n_clusters: int | None,
) -> Interval:
    unit: Unit | None = None
    if n_clusters is not None:
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

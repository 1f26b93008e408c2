"""Analytic intervals from the delta-method standard error: other items, same raters."""

import math
import warnings
from collections.abc import Sequence
from typing import Literal, get_args

from masrel.agreement import Label, WeightsLike
from masrel.agreement._kernel import NO_SPREAD
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval, Target
from masrel.intervals._problem import (
    IntervalProblem,
    Statistic,
    pose_problem,
    warn_small,
)

_Distribution = Literal["t", "normal", "logit", "fisher"]
"""What an interval is taken from, and on which scale."""

_METHODS: dict[_Distribution, str] = {
    "t": "delta method, t(n-1)",
    "normal": "delta method, normal",
    "logit": "delta method, t(n-1) on the logit",
    "fisher": "delta method, t(n-1) on Fisher's z",
}


def analytic(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    level: float = 0.95,
    distribution: _Distribution = "t",
) -> Interval:
    """Compute an interval from the delta-method standard error.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    ratings : nested sequence, array_like or DataFrame
        What the coefficient takes.
    target : {"items"}
        The standard error takes items as the sample; it says nothing of raters.
    categories : sequence, optional
        The declared scale in order.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    level : float, optional
        Nominal level.
    distribution : {"t", "normal", "logit", "fisher"}, optional
        Student's t with n - 1 degrees, the normal, or t on the logit of the
        position between the ends of the parameter space or on Fisher's z.

    Returns
    -------
    Interval
        A confidence interval; ``nan`` with a reason when undefined.

    Raises
    ------
    ParameterError
        If an option is invalid, or `target` is not "items".
    RatingsError
        If the ratings do not fit the coefficient.

    Warns
    -----
    SmallSampleWarning
        Below 10 items.
    UndefinedStatisticWarning
        If the estimate or its standard error is undefined or 0.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 5.

    Examples
    --------
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]] * 5
    >>> interval = analytic("cohen_kappa", ratings, target="items")
    >>> round(interval.low, 3), round(interval.high, 3)
    (0.14, 0.86)
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
        level=level,
    )
    if target != "items":
        raise ParameterError(
            'target: the delta method generalises to other items only, so "items"; for '
            f'other raters use the jackknife; got "{target}"'
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # given below
        estimate = problem.entry(problem.coded, weights=weights)
    return _interval_around_estimate(problem, estimate, distribution)


def _interval_around_estimate(
    problem: IntervalProblem, estimate: Estimate, distribution: _Distribution
) -> Interval:
    method = _METHODS[distribution]
    reason = _why_undefined(estimate)
    if reason is not None:
        return problem.undefined(reason, method=method, unit=None)
    notes = warn_small(estimate.n_items, 10, "items")
    lowest = None
    if distribution in ("logit", "fisher"):
        # artanh x is half the logit of (x + 1)/2, so that both give the same ends
        lowest = problem.entry.lowest if distribution == "logit" else -1.0
        if not lowest < estimate.value < 1.0:
            reason = "the estimate is not inside the ends of the parameter space"
            return problem.undefined(reason, method=method, unit=None)
    if distribution == "normal":
        from scipy.special import ndtri  # loaded only when an interval needs it

        quantile = float(ndtri(0.5 + 0.5 * problem.level))
    else:
        quantile = problem.student_t(estimate.n_items - 1)
    half = quantile * estimate.standard_error
    return problem.around(
        estimate.value, half, lowest=lowest, method=method, unit=None, notes=notes
    )


def _why_undefined(estimate: Estimate) -> str | None:
    """Return why there is no interval, if there is none."""
    if estimate.reason is not None or estimate.standard_error > 0.0:
        return estimate.reason
    if math.isnan(estimate.standard_error):
        return "one item has no standard error"
    return NO_SPREAD

"""Analytic intervals from the delta-method standard error: other items, same raters."""

import math
import warnings
from collections.abc import Sequence
from typing import Literal, get_args

from numpy.typing import ArrayLike

from masrel.agreement import Label, WeightName
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval, Target
from masrel.intervals.case import Case, open_case
from masrel.intervals.quantiles import normal, student_t
from masrel.intervals.samples import warn_small
from masrel.intervals.statistic import Statistic
from masrel.intervals.transforms import Transform, around

__all__ = ["Distribution", "analytic"]

Distribution = Literal["t", "normal", "logit", "fisher"]
"""What an interval is taken from, and on which scale."""


def analytic(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
    level: float = 0.95,
    distribution: Distribution = "t",
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
        If an option is none, or `target` is not "items".
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
    >>> found = analytic("cohen_kappa", ratings, target="items")
    >>> round(found.low, 3), round(found.high, 3)
    (0.14, 0.86)
    """
    if distribution not in get_args(Distribution):
        raise ParameterError(
            f"distribution: needs one of {', '.join(get_args(Distribution))}, "
            f"got {distribution!r}"
        )
    case = open_case(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        level=level,
    )
    _check_target(case)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # said below
        estimate = case.entry(ratings, categories=categories, weights=weights)
    method = f"delta method, {_WORDS[distribution]}"
    reason = _undefined(estimate)
    if reason is not None:
        return case.undefined(reason, method=method, unit=None)
    return _closed(case, estimate, distribution, method)


def _closed(
    case: Case, estimate: Estimate, distribution: Distribution, method: str
) -> Interval:
    notes = warn_small(estimate.n_items, 10, "items")
    low, high = _ends(case, estimate, distribution)
    if math.isnan(low):
        reason = "the estimate is not inside the ends of the parameter space"
        return case.undefined(reason, method=method, unit=None)
    return case.closed(low, high, method=method, unit=None, notes=notes)


def _check_target(case: Case) -> None:
    if case.target != "items":
        raise ParameterError(
            'target: the delta method speaks of other items only, so "items"; for '
            f'other raters use the jackknife; got "{case.target}"'
        )


def _undefined(estimate: Estimate) -> str | None:
    # why there is no interval, if there is none
    if estimate.reason is not None or estimate.standard_error > 0.0:
        return estimate.reason
    if math.isnan(estimate.standard_error):
        return "one item has no standard error"
    return (
        "the standard error is 0: every item agrees alike, which does not mean that "
        "there is no uncertainty"
    )


def _ends(
    case: Case, estimate: Estimate, distribution: Distribution
) -> tuple[float, float]:
    if distribution == "normal":
        half = normal(case.level) * estimate.standard_error
    else:
        half = student_t(case.level, estimate.n_items - 1) * estimate.standard_error
    transform = _TRANSFORMS.get(distribution, "none")
    return around(estimate.value, half, transform, case.entry.lowest)


_WORDS = {
    "t": "t(n-1)",
    "normal": "normal",
    "logit": "t(n-1) on the logit",
    "fisher": "t(n-1) on Fisher's z",
}
_TRANSFORMS: dict[Distribution, Transform] = {"logit": "logit", "fisher": "fisher"}

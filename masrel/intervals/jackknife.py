"""Jackknife intervals: leave out items, raters, or both, one at a time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement import Label, WeightName
from masrel.estimates import Interval, Target
from masrel.intervals.case import Case, open_case
from masrel.intervals.quantiles import student_t
from masrel.intervals.spread import Spread, spread
from masrel.intervals.statistic import Statistic

__all__ = ["around_estimate", "jackknife"]


def jackknife(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
    level: float = 0.95,
) -> Interval:
    """Compute a jackknife interval with Student's t.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    ratings : nested sequence, array_like or DataFrame
        What the coefficient takes. For test-retest agreement an item is left out
        with the ratings of all its raters.
    target : {"items", "raters", "both"}
        What a new study would draw anew, and so what is left out.
    categories : sequence, optional
        The declared scale in order.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    level : float, optional
        Nominal level.

    Returns
    -------
    Interval
        A confidence interval around the estimate; ``nan`` with a reason when
        undefined.

    Raises
    ------
    ParameterError
        If an option is none, or `target` is not "items" with two raters: leaving
        one out leaves no pair.
    RatingsError
        If the ratings do not fit the coefficient.

    Warns
    -----
    SmallSampleWarning
        Below 5 raters or 10 items, of those that are left out.
    UndefinedStatisticWarning
        If the estimate is undefined, or is with one left out, or never changes.

    Notes
    -----
    For "both" the variances of leaving out items and of leaving out raters are
    added, and the degrees of freedom are Satterthwaite's. The disagreement of one
    rater on one item is in both, so this interval is rather too wide than too
    narrow.

    References
    ----------
    .. [1] Efron, B., Stein, C. (1981). The jackknife estimate of variance. Annals of
       Statistics, 9(3), 586-596. https://doi.org/10.1214/aos/1176345462
    .. [2] Satterthwaite, F. E. (1946). An approximate distribution of estimates of
       variance components. Biometrics Bulletin, 2(6), 110-114.
       https://doi.org/10.2307/3002019

    Examples
    --------
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]] * 5
    >>> found = jackknife("cohen_kappa", ratings, target="items")
    >>> round(found.low, 3), round(found.high, 3)
    (0.122, 0.878)
    """
    case = open_case(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        level=level,
    )
    return around_estimate(case, spread(case))


def around_estimate(case: Case, found: Spread) -> Interval:
    """Make the interval of a spread."""
    target = case.target
    words = "two-way" if target == "both" else target.removesuffix("s")
    if found.reason is not None:
        return case.undefined(found.reason, method=f"{words} jackknife", unit=target)
    half = student_t(case.level, found.df) * float(np.sqrt(found.variance))
    t = "t" if target == "both" else f"t({found.df:g})"
    return case.closed(
        case.value - half,
        case.value + half,
        method=f"{words} jackknife, {t}",
        unit=target,
        notes=found.notes,
    )

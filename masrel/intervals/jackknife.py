"""Jackknife intervals: leave out items, raters, or both, one at a time."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import Label
from masrel.agreement.kernel import Floats
from masrel.agreement.weights import WeightName
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target
from masrel.intervals.case import (
    Case,
    Statistic,
    open_case,
    student_t,
    warn_small,
)

__all__ = ["jackknife", "jackknife_variance", "without_item"]


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
    units = {"items": ("items",), "raters": ("raters",), "both": ("items", "raters")}
    method = f"{'two-way' if target == 'both' else target.removesuffix('s')} jackknife"
    if np.isnan(case.value):
        return case.undefined(
            "the estimate itself is undefined", method=method, unit=target
        )
    parts: list[tuple[float, int]] = []
    notes: list[str] = []
    for unit in units[target]:
        replicates, times = (without_item if unit == "items" else _without_rater)(case)
        if np.isnan(replicates).any():
            reason = f"with one of the {unit} left out the estimate is undefined"
            return case.undefined(reason, method=method, unit=target)
        n = int(times.sum())
        parts.append((jackknife_variance(replicates, times), n - 1))
        notes += warn_small(n, 10 if unit == "items" else 5, unit)
    variance = sum(part for part, _ in parts)
    if not variance > 0.0:
        reason = (
            f"leaving out any of the {' or '.join(units[target])} leaves the estimate "
            "as it is, so the jackknife cannot say how uncertain it is"
        )
        return case.undefined(reason, method=method, unit=target)
    df = variance**2 / sum(part**2 / n for part, n in parts)  # Satterthwaite [2]
    half = student_t(level, df) * float(np.sqrt(variance))
    return case.closed(
        case.value - half,
        case.value + half,
        method=f"{method}, t({df:g})" if target != "both" else f"{method}, t",
        unit=target,
        notes=notes,
    )


Integers = NDArray[np.int64]


def jackknife_variance(replicates: Floats, times: Integers) -> float:
    """Return the jackknife's variance of an estimate.

    Parameters
    ----------
    replicates : ndarray, shape (n_distinct,)
        The estimate without a unit of each kind.
    times : ndarray of int64, shape (n_distinct,)
        Units of each kind.

    Returns
    -------
    float
        (n - 1)/n times the sum of squared deviations from their mean, (1.1) of [1] in
        `jackknife`.
    """
    n = int(times.sum())
    moved = replicates - replicates[0]  # so that no change at all is exactly 0
    deviations = moved - times @ moved / n
    return float((n - 1) / n * (times @ deviations**2))


def without_item(case: Case) -> tuple[Floats, Integers]:
    """Return the estimate without an item of each pattern, and how many there are.

    Parameters
    ----------
    case : Case
        A question.

    Returns
    -------
    tuple of ndarray
        Values, ``nan`` of a single item, and items, both (n_patterns,).
    """
    if case.n_items < 2:
        return np.full(1, np.nan), np.ones(1, dtype=np.int64)
    # sums without an item are the total less its features
    return case.values(case.sums - case.rows), case.times


def _without_rater(case: Case) -> tuple[Floats, Integers]:
    # features are made anew, because pairs of raters go
    width = 2 if case.entry.shape == "pairs" else 1  # columns of a rater
    codes = case.patterns.codes
    n_raters = codes.shape[1] // width
    fewest = 2 if width == 2 else 3
    if n_raters < fewest:
        raise ParameterError(
            f'target: "{case.target}" needs at least {fewest} raters, because one is '
            f"left out; got {n_raters}"
        )
    values = []
    for rater in range(n_raters):
        rest = np.delete(codes, np.s_[rater * width : (rater + 1) * width], axis=1)
        left = dataclasses.replace(case.patterns, codes=rest)
        sums = case.times @ case.kernel.features(left, case.v)
        values.append(float(case.values(sums)))
    return np.array(values), np.ones(n_raters, dtype=np.int64)

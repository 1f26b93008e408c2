"""The difference of two coefficients: of the same items, or of independent ones."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import Label, Significance, WeightsLike
from masrel.errors import (
    ParameterError,
    RatingsError,
    UndefinedStatisticWarning,
)
from masrel.estimates import Estimate, Interval, Unit
from masrel.intervals._clusters import ClusterSums, clusters_of
from masrel.intervals._problem import (
    IntervalProblem,
    Statistic,
    pose_problem,
    warn_small,
)
from masrel.intervals.jackknife import _variance_of

_Design = Literal["dependent", "independent"]
"""Whether both sets of ratings are of the same items, row by row."""


def difference(
    coefficient: Statistic,
    first: object,
    second: object,
    *,
    design: _Design,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    level: float = 0.95,
    clusters: object = None,
) -> Estimate:
    """Estimate how much a coefficient of some ratings exceeds that of others.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    first, second : nested sequence, array_like or DataFrame
        What the coefficient takes.
    design : {"dependent", "independent"}
        Same items in the same order, such as before and after training; or other
        items, such as two clinics.
    categories : sequence, optional
        The declared scale in order; should be given, so that both have the same.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    level : float, optional
        Nominal level.
    clusters : sequence of labels, optional
        The cluster of every item, such as the patient of a site, which leaves as a
        whole: one label an item, of the same items or with gaps in either set for
        items of the other; of independent ones a pair of such, with no label in both.

    Returns
    -------
    Estimate
        First less second, with its jackknife standard error over items and its
        interval by Student's t, which generalises to other items: n - 1 degrees for the
        same items, n those with a pair of ratings in the set that has fewer of them;
        Satterthwaite's for independent ones. `observed` and `chance` are differences,
        too.

    Raises
    ------
    ParameterError
        If an option is invalid, or the coefficient has no such interval.
    RatingsError
        If the ratings do not fit the coefficient, or not each other.

    Warns
    -----
    SmallSampleWarning
        Below 10 items.
    UndefinedStatisticWarning
        If an estimate is undefined, or is with one item left out.

    Notes
    -----
    Leaving one item out of both sets of ratings at once keeps what they have in
    common; comparing two intervals by eye would not. The raters are taken as they
    are, whether both sets have the same or each has its own. `difference_test` has
    the p-value.

    References
    ----------
    .. [1] Gwet, K. L. (2016). Testing the difference of correlated agreement
       coefficients for statistical significance. Educational and Psychological
       Measurement, 76(4), 609-637. https://doi.org/10.1177/0013164415596420
    .. [2] Efron, B., Stein, C. (1981). The jackknife estimate of variance. Annals of
       Statistics, 9(3), 586-596. https://doi.org/10.1214/aos/1176345462

    Examples
    --------
    >>> before = [["a", "b"], ["b", "b"], ["a", "a"], ["b", "a"]] * 5
    >>> after = [["a", "a"], ["b", "b"], ["a", "a"], ["b", "a"]] * 5
    >>> estimate = difference("fleiss_kappa", after, before, design="dependent")
    >>> round(estimate.value, 3), round(estimate.interval.low, 3)
    (0.467, 0.08)
    """
    compared = _compare(
        coefficient, first, second, design, categories, weights, level, clusters
    )
    one, other = compared.one, compared.other
    return Estimate(
        coefficient=f"difference of {one.coefficient}",
        weights=one.weights,
        value=compared.value,
        standard_error=math.sqrt(compared.variance),
        interval=_interval(compared),
        observed=one.observed - other.observed,
        chance=one.chance - other.chance,
        n_items=min(one.n_items, other.n_items),
        n_items_paired=min(one.n_items_paired, other.n_items_paired),
        n_raters=min(one.n_raters, other.n_raters),
        n_categories=one.n_categories,
        reason=one.reason or other.reason,
    )


def difference_test(
    coefficient: Statistic,
    first: object,
    second: object,
    *,
    design: _Design,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    clusters: object = None,
) -> Significance:
    """Test whether a coefficient is the same of some ratings as of others.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    first, second : nested sequence, array_like or DataFrame
        What the coefficient takes.
    design : {"dependent", "independent"}
        Same items in the same order, or other items; see `difference`.
    categories : sequence, optional
        The declared scale in order; should be given, so that both have the same.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    clusters : sequence of labels, optional
        The cluster of every item; see `difference`.

    Returns
    -------
    Significance
        The difference over its jackknife standard error, with the two-sided p-value
        of Student's t by which `difference` makes its interval: an interval of level
        1 - p ends at 0. `n_items` are those of the smaller set.

    Raises
    ------
    ParameterError
        If an option is invalid, or the coefficient has no such interval.
    RatingsError
        If the ratings do not fit the coefficient, or not each other.

    Warns
    -----
    UndefinedStatisticWarning
        If an estimate is undefined, or is with one item left out, or leaving out any
        item leaves the difference as it is.

    References
    ----------
    .. [1] Gwet, K. L. (2016). Testing the difference of correlated agreement
       coefficients for statistical significance. Educational and Psychological
       Measurement, 76(4), 609-637. https://doi.org/10.1177/0013164415596420

    Examples
    --------
    >>> before = [["a", "b"], ["b", "b"], ["a", "a"], ["b", "a"]] * 5
    >>> after = [["a", "a"], ["b", "b"], ["a", "a"], ["b", "a"]] * 5
    >>> print(difference_test("fleiss_kappa", after, before, design="dependent"))
    difference_test: 2.527, t(19), p = 0.0205
    """
    # an interval has a level, a test has none: any will do
    compared = _compare(
        coefficient, first, second, design, categories, weights, 0.5, clusters
    )
    statistic = p = math.nan
    if compared.reason is not None:
        warnings.warn(
            f"the test of a difference is undefined: {compared.reason}",
            UndefinedStatisticWarning,
            stacklevel=2,
        )
    else:
        from scipy.special import stdtr  # loaded only when a p-value is needed

        statistic = compared.value / math.sqrt(compared.variance)
        p = min(1.0, 2.0 * float(stdtr(compared.df, -abs(statistic))))
    return Significance(
        name="difference_test",
        hypothesis="both coefficients are the same",
        statistic=statistic,
        distribution="t",
        df=(compared.df,),
        p_value=p,
        n_items=min(compared.one.n_items, compared.other.n_items),
        reason=compared.reason,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Compared:
    """Two estimates, and how their difference varies."""

    problems: list[IntervalProblem]
    # one, other: the coefficient of both sets of ratings
    one: Estimate
    other: Estimate
    value: float  # the first less the second
    variance: float
    df: float
    reason: str | None  # why the variance makes neither interval nor test, or None
    unit: Unit  # what was left out
    n_units: int  # those with a pair of ratings in the set that has fewer


def _compare(
    coefficient: Statistic,
    first: object,
    second: object,
    design: _Design,
    categories: Sequence[Label] | None,
    weights: "WeightsLike",
    level: float,
    clusters: object,
) -> _Compared:
    """Check both sets of ratings, and estimate their difference and its variance."""
    if design not in get_args(_Design):
        raise ParameterError(
            f"design: needs one of {', '.join(get_args(_Design))}, got {design!r}"
        )
    problems = [
        pose_problem(
            coefficient,
            ratings,
            target="items",
            categories=categories,
            weights=weights,
            level=level,
        )
        for ratings in (first, second)
    ]
    unit: Unit = "items" if clusters is None else "clusters"
    n_units = min(problem.n_paired_items for problem in problems)
    if clusters is not None:
        variance, df, n_units = _of_clusters(problems[0], problems[1], design, clusters)
    else:
        variance_of = _dependent if design == "dependent" else _independent
        variance, df = variance_of(*problems)
    one, other = (problem.entry(problem.coded, weights=weights) for problem in problems)
    return _Compared(
        problems=problems,
        one=one,
        other=other,
        value=one.value - other.value,
        variance=variance,
        df=df,
        reason=one.reason or other.reason or _no_variance(variance, unit),
        unit=unit,
        n_units=n_units,
    )


def _no_variance(variance: float, unit: Unit) -> str | None:
    left_out = unit.removesuffix("s")
    if math.isnan(variance):
        return f"with one {left_out} left out an estimate is undefined"
    if variance == 0.0:
        return f"leaving out any {left_out} leaves the difference as it is"
    return None


def _of_clusters(
    one: IntervalProblem, other: IntervalProblem, design: _Design, clusters: object
) -> tuple[float, float, int]:
    """Return the jackknife variance over clusters, its degrees and how many."""
    if design == "independent":
        first, second = _cluster_pair(one, other, clusters)
        parts = [
            (_variance_of(of.values_without(problem), _once(of.known), of.n_paired), of)
            for problem, of in ((one, first), (other, second))
        ]
        n = min(first.n_paired, second.n_paired)
        return *_satterthwaite([(v, of.n_paired - 1) for v, of in parts]), n
    if len(one.coded.codes) != len(other.coded.codes):
        raise RatingsError(
            "design: dependent ratings need the same rows, got "
            f"{len(one.coded.codes)} and {len(other.coded.codes)}"
        )
    codes = clusters_of(one, clusters)
    first, second = ClusterSums.of(one, codes), ClusterSums.of(other, codes)
    known, n = first.known | second.known, min(first.n_paired, second.n_paired)
    moved = one.values(one.sums - first.sums) - other.values(other.sums - second.sums)
    return _variance_of(moved[known], _once(known), n), float(n - 1), n


def _once(known: NDArray[np.bool_]) -> NDArray[np.int64]:
    return np.ones(int(known.sum()), dtype=np.int64)


def _cluster_pair(
    one: IntervalProblem, other: IntervalProblem, clusters: object
) -> tuple[ClusterSums, ClusterSums]:
    """Return the clusters of independent ratings, which must be different ones."""
    if not isinstance(clusters, Sequence) or len(clusters) != 2:
        raise ParameterError(
            "clusters: independent ratings need a pair of sequences, one label an item"
        )
    codes = [
        clusters_of(problem, of)
        for problem, of in zip((one, other), clusters, strict=True)
    ]
    shared = set(clusters[0]) & set(clusters[1])
    if shared:
        raise ParameterError(
            "clusters: independent ratings need other clusters, got "
            f"{min(map(str, shared))!r} in both"
        )
    return ClusterSums.of(one, codes[0]), ClusterSums.of(other, codes[1])


def _dependent(one: IntervalProblem, other: IntervalProblem) -> tuple[float, float]:
    """Return the jackknife variance of the difference and its degrees of freedom."""
    # items without any rating are left out of a problem: they must be the same ones
    rated = [np.max(problem.coded.codes, axis=1) >= 0 for problem in (one, other)]
    if len(rated[0]) != len(rated[1]):
        raise RatingsError(
            "design: dependent ratings need the same items, got "
            f"{len(rated[0])} and {len(rated[1])}"
        )
    if (rated[0] != rated[1]).any():
        row = int(np.flatnonzero(rated[0] != rated[1])[0])
        raise RatingsError(
            f"design: dependent ratings need both for every item, row {row} has "
            "ratings in one of them only"
        )
    n = min(one.n_paired_items, other.n_paired_items)
    if n < 2:
        return math.nan, 0.0
    first, second = (problem.features(problem.used) for problem in (one, other))
    matters = first.any(axis=1) | second.any(axis=1)  # the item to either of them
    # both coefficients without item i, from the sums less its features
    moved = one.values(one.sums - first) - other.values(other.sums - second)
    freq = np.ones(int(matters.sum()), dtype=np.int64)
    return _variance_of(moved[matters], freq, n), float(n - 1)


def _independent(one: IntervalProblem, other: IntervalProblem) -> tuple[float, float]:
    """Return the sum of both jackknife variances and Satterthwaite's degrees [2]_."""
    parts = [
        (
            _variance_of(
                problem.values_without(problem.sums, problem.rows),
                problem.freq,
                problem.n_paired_items,
            ),
            problem.n_paired_items - 1,
        )
        for problem in (one, other)
    ]
    return _satterthwaite(parts)


def _satterthwaite(parts: Sequence[tuple[float, int]]) -> tuple[float, float]:
    """Return the sum of variances, and its degrees of freedom [2]_."""
    variance = sum(part for part, _ in parts)
    if not variance > 0.0:
        return variance, float(min(df for _, df in parts))
    return variance, variance**2 / sum(part**2 / max(df, 1) for part, df in parts)


def _interval(compared: _Compared) -> Interval:
    unit = compared.unit
    method = f"{unit.removesuffix('s')} jackknife of the difference, t"
    problems, value = compared.problems, compared.value
    smaller = min(problems, key=lambda problem: problem.n_paired_items)
    if compared.reason is not None:
        return smaller.undefined(compared.reason, method=method, unit=unit)
    half = smaller.student_t(compared.df) * math.sqrt(compared.variance)
    n_items = smaller.n_items if unit == "items" else None
    notes = warn_small(compared.n_units, 10, unit, n_items)
    width = 1.0 - min(problem.min_value for problem in problems)  # of its space
    if value - half < -width or value + half > width:
        notes += (f"cut at the ends of the parameter space [{-width:g}, {width:g}]",)
    return Interval(
        low=max(value - half, -width),
        high=min(value + half, width),
        level=smaller.level,
        kind="confidence",
        method=method,
        target="items",
        unit=unit,
        notes=notes,
    )

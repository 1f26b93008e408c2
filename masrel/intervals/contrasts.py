"""Differences of coefficients between ratings of the same or of different items.

One engine: the coefficient of every set of ratings without each item, or each cluster.
How these move together is the jackknife's covariance of the coefficients: a difference
of two, all differences of several, and the test that all are the same follow from it.
Beside them stand two tests that independent coefficients are the same.
"""

import itertools
import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np

from masrel._input import check_option, refuse
from masrel.agreement import Label, Metric, Significance, WeightsLike, count_ratings
from masrel.agreement._codes import item_counts, read_only
from masrel.agreement._engine import Floats, divide, student_t, tested, undefined
from masrel.agreement._labels import is_row
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval
from masrel.intervals._question import (
    IntervalProblem,
    Statistic,
    cluster_codes,
    cluster_sums,
    pose_problem,
    warn_small,
)
from masrel.intervals.jackknife import _variance_of

# Whether both sets of ratings are of the same items, row by row
_Design = Literal["dependent", "independent"]

# How several intervals hold at once
_Simultaneous = Literal["max_t", "bonferroni", "scheffe"]

_Units = Literal["items", "clusters"]  # what the sample is of

_METHODS: dict[_Simultaneous, str] = {
    "max_t": "the largest of correlated t",
    "bonferroni": "Bonferroni's t",
    "scheffe": "Hotelling's T²",
}
_FLAT = 1e-12  # of the largest variance: a direction in which nothing varies
_ANGLES = 1 << 13  # of a half turn
_DIRECTIONS = 1 << 15
_SAME = "all coefficients are the same"


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
    """Estimate the difference of a coefficient between two sets of ratings.

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
        First minus second, with its jackknife standard error over items and its
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
    unit: _Units = "items" if clusters is None else "clusters"
    method = f"{unit.removesuffix('s')} jackknife of the difference, t"
    smaller = min(compared.problems, key=lambda problem: problem.n_paired_items)
    if compared.reason is not None:
        interval = smaller.undefined(compared.reason, method=method, unit=unit)
        return replace(compared.estimate, interval=interval)
    value = compared.estimate.value
    half = student_t(level, compared.df) * compared.estimate.standard_error
    n_items = smaller.n_items if unit == "items" else None
    notes = warn_small(compared.n_units, 10, unit, n_items)
    width = 1.0 - min(problem.min_value for problem in compared.problems)
    low, high = max(value - half, -width), min(value + half, width)
    if (low, high) != (value - half, value + half):
        notes += (f"the interval was cut at {-width:g} or {width:g}",)
    interval = Interval(
        low=low,
        high=high,
        level=level,
        kind="confidence",
        method=method,
        target="items",
        unit=unit,
        units_are="left out",
        notes=notes,
    )
    return replace(compared.estimate, interval=interval)


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
    """Test whether a coefficient is the same for two sets of ratings.

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
    estimate = compared.estimate
    return _tested(
        "difference_test",
        "both coefficients are the same",
        "t",
        (compared.df,),
        estimate.n_items,
        statistic=estimate.value / (estimate.standard_error or math.nan),
        reason=compared.reason,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Compared:
    """The difference of two estimates, and how it varies."""

    problems: list[IntervalProblem]
    estimate: Estimate
    df: float
    reason: str | None  # why there is neither interval nor test, or None
    n_units: int  # left out, with a pair of ratings in the set that has fewer


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
    check_option("design", design, get_args(_Design))
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
    if design == "dependent":
        _check_same_items(problems, clusters)
        (of_first, of_second), n_units = _without_units(problems, clusters)
        variance = _variance_of(of_first - of_second, n_units)
        df = n_units - 1.0
    else:
        pair: Any = [None, None]
        if clusters is not None:
            pair = _checked_pair(clusters)
        of_sets = [
            _without_units([problem], of)
            for problem, of in zip(problems, pair, strict=True)
        ]
        parts = [_variance_of(values, n) for (values,), n in of_sets]
        variance, n_units = sum(parts), min(n for _, n in of_sets)
        # Satterthwaite's degrees of freedom
        squares = sum(
            part**2 / max(n - 1, 1) for part, (_, n) in zip(parts, of_sets, strict=True)
        )
        df = variance**2 / squares if variance > 0.0 else n_units - 1.0
    one, other = (problem.entry(problem.coded, weights=weights) for problem in problems)
    unit = "item" if clusters is None else "cluster"
    reason = one.reason or other.reason
    if reason is None and math.isnan(variance):
        reason = f"an estimate is undefined when one {unit} is left out"
    elif reason is None and variance == 0.0:
        reason = f"the difference stays the same whichever {unit} is left out"
    estimate = Estimate(
        coefficient=f"difference of {one.coefficient}",
        weights=one.weights,
        value=one.value - other.value,
        standard_error=math.sqrt(variance),
        observed=one.observed - other.observed,
        chance=one.chance - other.chance,
        n_items=min(one.n_items, other.n_items),
        n_items_paired=min(one.n_items_paired, other.n_items_paired),
        n_raters=min(one.n_raters, other.n_raters),
        n_categories=one.n_categories,
        reason=one.reason or other.reason,
    )
    return _Compared(
        problems=problems,
        estimate=estimate,
        df=df,
        reason=reason,
        n_units=n_units,
    )


def _check_same_items(problems: Sequence[IntervalProblem], clusters: object) -> None:
    one, other = (problem.coded.codes for problem in problems)
    needed = f"the same items, got {len(one)} and {len(other)}"
    refuse(
        (len(one) != len(other), f"design: dependent ratings need {needed}"),
        error=RatingsError,
    )
    is_in_one = (one >= 0).any(axis=1) != (other >= 0).any(axis=1)
    refuse(
        (
            clusters is None and is_in_one.any(),
            "design: dependent ratings need every item in both, but row "
            f"{int(is_in_one.argmax())} has ratings in only one",
        ),
        error=RatingsError,
    )


def _checked_pair(clusters: object) -> Sequence[object]:
    if not isinstance(clusters, Sequence) or len(clusters) != 2:
        raise ParameterError(
            "clusters: independent ratings need a pair of sequences, one label per item"
        )
    if all(map(is_row, clusters)) and (shared := set(clusters[0]) & set(clusters[1])):
        raise ParameterError(
            "clusters: independent ratings need different clusters, got "
            f"{min(map(str, shared))!r} in both"
        )
    return clusters


def _without_units(
    problems: Sequence[IntervalProblem], clusters: object
) -> tuple[Floats, int]:
    """Return coefficients of several sets without each item, or each cluster.

    Only units that matter are left out, each of all sets at once: (n_sets, n_units);
    and how many of these have a pair of ratings, of the set that has the fewest.
    """
    each = np.arange(len(problems[0].coded.codes))
    units = each if clusters is None else cluster_codes(problems[0], clusters)
    sums, known, n_paired = zip(
        *(cluster_sums(problem, units) for problem in problems), strict=True
    )
    matters = np.any(known, axis=0)
    without = [
        problem.values(problem.sums - of_set[matters])
        for problem, of_set in zip(problems, sums, strict=True)
    ]
    return np.array(without), min(n_paired)


def _covariance(without: Floats, n: int) -> Floats:
    """Return the jackknife covariance of the coefficients, (n_sets, n_sets)."""
    if n < 2:
        return np.full((len(without),) * 2, math.nan)
    moved = without - without.mean(axis=1, keepdims=True)
    return np.asarray((n - 1) / n * (moved @ moved.T))


# -- all differences of several --------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Differences:
    """Differences of every two of several coefficients of the same items.

    Attributes
    ----------
    names : tuple of str
        What each set of ratings is called.
    estimates : tuple of Estimate
        The coefficient of each; its `standard_error` takes every item as a unit.
    standard_errors : ndarray, shape (n_sets,)
        Standard errors of the coefficients, with clusters if there are any.
    correlation : ndarray, shape (n_sets, n_sets)
        How the coefficients are correlated.
    values : ndarray, shape (n_sets, n_sets)
        The coefficient of the row minus that of the column.
    errors : ndarray, shape (n_sets, n_sets)
        Standard errors of these.
    low, high : ndarray, shape (n_sets, n_sets)
        Simultaneous intervals; ``nan`` where undefined and on the diagonal.
    p_values : ndarray, shape (n_sets, n_sets)
        Adjusted for all differences, as the intervals are.
    level : float
        Probability with which all intervals hold at once.
    method : str
        How the intervals were made, in words.
    quantile : float
        By how many standard errors they go either way.
    equality : Significance
        Hotelling's test that all coefficients are the same.
    n_units : int
        Items, or clusters.
    unit : {"items", "clusters"}
        What the sample is of.
    notes : tuple of str
        What the reader must know before relying on it.
    reason : str or None
        Why intervals and tests are undefined, or None.
    """

    names: tuple[str, ...]
    estimates: tuple[Estimate, ...] = field(repr=False)
    standard_errors: Floats = field(compare=False, repr=False)
    correlation: Floats = field(compare=False, repr=False)
    values: Floats = field(compare=False, repr=False)
    errors: Floats = field(compare=False, repr=False)
    low: Floats = field(compare=False, repr=False)
    high: Floats = field(compare=False, repr=False)
    p_values: Floats = field(compare=False, repr=False)
    level: float
    method: str
    quantile: float
    equality: Significance
    n_units: int
    unit: _Units
    notes: tuple[str, ...] = ()
    reason: str | None = None

    def __str__(self) -> str:
        first = self.estimates[0].coefficient
        pairs = itertools.combinations(range(len(self.names)), 2)
        lines = (
            f"{self.names[one]} - {self.names[other]}: {self.values[one, other]:.3f} "
            f"[{self.low[one, other]:.3f}, {self.high[one, other]:.3f}], "
            f"p = {self.p_values[one, other]:.3g}"
            for one, other in pairs
        )
        head = f"{first}: {self.n_units} {self.unit}, {self.method}"
        return "\n".join([head, *lines, str(self.equality)])


def differences(
    coefficient: Statistic,
    sets: "Sequence[object] | Mapping[str, object]",
    *,
    clusters: object = None,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    metric: Metric | None = None,
    level: float = 0.95,
    simultaneous: _Simultaneous = "max_t",
) -> Differences:
    """Estimate all differences of a coefficient between ratings of the same items.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    sets : sequence or mapping of ratings, length 2 or more
        Ratings of the same items in the same order, such as those of several pairs of
        raters, occasions or methods; the keys of a mapping name them.
    clusters : sequence of labels, length n_items, optional
        The cluster of every item, such as the patient of a site. By default each item
        is independent.
    categories : sequence, optional
        The declared scale in order; should be given, so that all have the same.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    metric : str, optional
        Krippendorff's difference function in place of weights; see
        `krippendorff_alpha`, which alone takes one.
    level : float, optional
        Probability with which all intervals hold at once.
    simultaneous : {"max_t", "bonferroni", "scheffe"}, optional
        By the distribution of the largest of the t-statistics with the correlations
        they have; by Bonferroni's t; or by Hotelling's T², which holds for every
        other comparison of the coefficients, too, and is the widest of few.

    Returns
    -------
    Differences
        Matrices of differences with their simultaneous intervals and adjusted
        p-values, and the test that all coefficients are the same. They generalise to
        other items, or clusters, graded by the same raters.

    Raises
    ------
    ParameterError
        If an option is invalid, or the coefficient has no such interval.
    RatingsError
        If the ratings do not fit the coefficient, or not each other.

    Warns
    -----
    SmallSampleWarning
        Below 10 items or clusters.
    UndefinedStatisticWarning
        If a coefficient is undefined, or there are too few items or clusters.

    Notes
    -----
    The covariance of two coefficients is (n - 1)/n Σ_c d_c d'_c over n clusters c, or
    items, with d_c how far the coefficient without the cluster lies from the mean of
    these: the jackknife's, which is that of [1]_ where there are many. An item without
    ratings in one of the sets adds nothing to that one. For two sets the difference,
    its error, interval and p-value are those of `difference`.

    References
    ----------
    .. [1] Vanbelle, S. (2017). Comparing dependent kappa coefficients obtained on
       multilevel data. Biometrical Journal, 59(5), 1016-1034.
       https://doi.org/10.1002/bimj.201600093
    .. [2] Hothorn, T., Bretz, F., Westfall, P. (2008). Simultaneous inference in
       general parametric models. Biometrical Journal, 50(3), 346-363.
       https://doi.org/10.1002/bimj.200810425

    Examples
    --------
    >>> expert = ["a", "b", "a", "b", "a", "b", "b", "a", "a", "b"] * 4
    >>> first = ["a", "b", "a", "b", "a", "b", "a", "a", "a", "b"] * 4
    >>> second = ["a", "b", "b", "b", "a", "a", "a", "a", "b", "b"] * 4
    >>> print(differences("cohen_kappa", {
    ...     "first": list(zip(expert, first)), "second": list(zip(expert, second)),
    ... }))
    cohen_kappa: 40 items, item jackknife, the largest of correlated t
    first - second: 0.600 [0.300, 0.900], p = 0.000237
    differences: 16.39, F(1, 39), p = 0.000237
    """
    check_option("simultaneous", simultaneous, _METHODS)
    if isinstance(sets, str) or not isinstance(sets, Iterable):
        raise ParameterError(f"sets: needs ratings of two sets or more, got {sets!r}")
    named = dict(sets) if isinstance(sets, Mapping) else dict(enumerate(sets))
    names = tuple(map(str, named))
    refuse((len(names) < 2, f"sets: needs two or more, got {len(names)}"))
    problems = [
        pose_problem(
            coefficient,
            ratings,
            target="items",
            categories=categories,
            weights=weights,
            metric=metric,
            level=level,
        )
        for ratings in named.values()
    ]
    n_items = [len(problem.coded.codes) for problem in problems]
    first = f"sets: need the same items, got {n_items[0]} in {names[0]!r}"
    refuse(
        *(
            (n != n_items[0], f"{first} and {n} in {name!r}")
            for name, n in zip(names, n_items, strict=True)
        ),
        error=RatingsError,
    )
    without, n_units = _without_units(problems, clusters)
    covariance = _covariance(without, n_units)
    # it is given below
    with warnings.catch_warnings(action="ignore", category=UndefinedStatisticWarning):
        estimates = tuple(
            problem.entry(problem.coded, weights=weights) for problem in problems
        )
    unit: _Units = "items" if clusters is None else "clusters"
    reason = _why_undefined(estimates, names, without, n_units, unit)
    notes = () if reason is not None else warn_small(n_units, 10, unit)
    each = np.array([estimate.value for estimate in estimates])
    values, errors = each[:, None] - each, np.zeros((len(each),) * 2)
    for i, j in itertools.combinations(range(len(each)), 2):
        errors[i, j] = errors[j, i] = math.sqrt(
            _variance_of(without[i] - without[j], n_units)
        )
    if reason is None and not errors.any():
        reason = (
            f"all differences stay the same whichever {unit.removesuffix('s')} is "
            "left out"
        )
    elif reason is None and simultaneous == "scheffe":
        reason = _too_few(len(each), n_units)
    quantile, p_values = math.nan, np.full_like(errors, math.nan)
    if reason is None:
        quantile, p_values = _adjusted(
            covariance, n_units - 1.0, values, errors, level, simultaneous
        )
    half = np.where(errors > 0.0, quantile * errors, math.nan)
    alone = np.sqrt(np.diag(covariance))
    arrays = {
        "standard_errors": alone,
        "correlation": divide(covariance, np.outer(alone, alone)),
        "values": values,
        "errors": errors,
        "low": values - half,
        "high": values + half,
        "p_values": p_values,
    }
    return Differences(
        names=names,
        estimates=estimates,
        **{name: read_only(array) for name, array in arrays.items()},
        level=level,
        method=f"{unit.removesuffix('s')} jackknife, {_METHODS[simultaneous]}",
        quantile=quantile,
        equality=_hotelling(
            each, covariance, n_units, reason or _too_few(len(each), n_units)
        ),
        n_units=n_units,
        unit=unit,
        notes=notes,
        reason=reason,
    )


def _why_undefined(
    estimates: Sequence[Estimate],
    names: Sequence[str],
    without: Floats,
    n_units: int,
    unit: _Units,
) -> str | None:
    for name, estimate in zip(names, estimates, strict=True):
        if estimate.reason is not None:
            return f"{name}: {estimate.reason}"
    if n_units < 2:
        return f"needs at least 2 {unit} with ratings in every set"
    for name, values in zip(names, without, strict=True):
        if np.isnan(values).any():
            return (
                f"{name}: the estimate is undefined when one {unit.removesuffix('s')} "
                "is left out"
            )
    return None


def _too_few(g: int, n: int) -> str | None:
    needed = f"{g} coefficients need at least {g} items or clusters, got {n}"
    return None if n >= g else needed


def _adjusted(
    covariance: Floats,
    df: float,
    values: Floats,
    errors: Floats,
    level: float,
    simultaneous: _Simultaneous,
) -> tuple[float, Floats]:
    """Return the quantile of all intervals, and the adjusted p-values."""
    from scipy.optimize import brentq
    from scipy.special import fdtrc, fdtri, stdtr

    g = len(values)
    t = np.abs(values / np.where(errors > 0.0, errors, math.nan))
    one, other = np.nonzero(np.triu(errors) > 0.0)
    if simultaneous == "bonferroni" or len(one) == 1:  # of two sets they are the same
        m = len(one)
        quantile = student_t(1.0 - (1.0 - level) / m, df)
        return quantile, np.minimum(1.0, 2.0 * m * stdtr(df, -t))
    if simultaneous == "scheffe":
        rest = df + 2.0 - g  # K - g + 1
        factor = (g - 1.0) * df / rest
        quantile = math.sqrt(factor * float(fdtri(g - 1.0, rest, level)))
        return quantile, fdtrc(g - 1.0, rest, t**2 / factor)
    sizes, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.maximum(sizes, 0.0))  # root @ root.T is the covariance
    contrasts = (root[one] - root[other]) / errors[one, other][:, None]
    exceeded, rank = _largest_t(contrasts, df)
    p_values = np.full_like(t, math.nan)
    p_values[one, other] = p_values[other, one] = [exceeded(x) for x in t[one, other]]
    # between that of one statistic and that of every contrast there is
    low = student_t(level, df)
    high = math.sqrt(rank * float(fdtri(rank, df, level)))
    if exceeded(low) <= 1.0 - level:  # all statistics are one, but for rounding
        return low, p_values
    quantile = brentq(
        lambda x: exceeded(x) - (1.0 - level), low, max(low, high) + 1e-9, xtol=1e-9
    )
    return float(quantile), p_values


def _largest_t(contrasts: Floats, df: float) -> tuple[Callable[[float], float], int]:
    """Return the probability that the largest |a_k·Z|/S exceeds a number, and a rank.

    Z is normal and S² a χ² over its degrees of freedom, so that |Z|²/(p S²) has an F
    distribution whatever the direction of Z: only directions are summed over. In one
    or two dimensions that is exact; in more the directions are those of a lattice,
    the same every time.
    """
    # Takes contrasts a (n_statistics, n_dimensions), of unit length
    from scipy.special import fdtrc, ndtri

    _, sizes, turned = np.linalg.svd(contrasts, full_matrices=False)
    rank = int((sizes > _FLAT * max(sizes.max(), 1.0)).sum())
    if rank <= 2:
        angles = (np.arange(_ANGLES) + 0.5) * (math.pi / _ANGLES)
        directions = np.column_stack([np.cos(angles), np.sin(angles)])[:, :rank]
    else:
        # a Kronecker lattice: multiples of powers of the root of x^(rank + 1) = x + 1
        root = np.roots([1.0, *[0.0] * (rank - 1), -1.0, -1.0]).real.max()
        steps = root ** -np.arange(1.0, rank + 1.0)
        places = (0.5 + np.arange(1, _DIRECTIONS + 1)[:, None] * steps) % 1.0
        directions = ndtri(np.clip(places, 1e-12, 1.0 - 1e-12))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    largest = np.zeros(len(directions))
    for contrast in contrasts @ turned[:rank].T:
        np.maximum(largest, abs(directions @ contrast), out=largest)

    def exceeded(quantile: float) -> float:
        return float(fdtrc(rank, df, (quantile / largest) ** 2 / rank).mean())

    return exceeded, rank


def _hotelling(values: Floats, v: Floats, n: int, reason: str | None) -> Significance:
    """Test that all coefficients are the same: T² = (Cκ)ᵀ (C V Cᵀ)⁻¹ Cκ."""
    g, statistic = len(values), math.nan
    df = (g - 1.0, n - g + 1.0)
    if reason is None:
        # C takes each from the first
        sizes, axes = np.linalg.eigh(v[1:, 1:] - v[1:, :1] - v[:1, 1:] + v[0, 0])
        if sizes[0] <= _FLAT * np.abs(v).max():
            reason = (
                "some of the coefficients never differ, or always differ by the same "
                "amount"
            )
        else:
            t_squared = float(((axes.T @ (values[1:] - values[0])) ** 2 / sizes).sum())
            statistic = t_squared * (n - g + 1.0) / ((n - 1.0) * (g - 1.0))
    return _tested("differences", _SAME, "F", df, n, statistic, reason)


# -- independent coefficients ----------------------------------------------------------


def equality_test(estimates: Sequence[Estimate]) -> Significance:
    """Test whether independent coefficients are the same: Fleiss' weighted χ².

    Parameters
    ----------
    estimates : sequence of Estimate, length 2 or more
        The same coefficient of groups of other items, each with its standard error.

    Returns
    -------
    Significance
        Σ (κ_g - κ̄)² / SE_g², with κ̄ the mean weighted by 1 / SE_g², and its p-value
        from χ² with one degree less than there are groups. `n_items` are those of all
        groups.

    Raises
    ------
    ParameterError
        If there are fewer than two, or they are of different coefficients.

    Warns
    -----
    UndefinedStatisticWarning
        If a coefficient is undefined, or its standard error is 0.

    Notes
    -----
    It takes any coefficient, weights and number of raters, and any standard error:
    that of clustered items, too. It needs large groups: with 40 to 100 items each it
    rejects a true hypothesis in some 7 % of studies instead of 5. For two raters and
    two categories `donner_test` keeps its level in smaller ones.

    References
    ----------
    .. [1] Fleiss, J. L. (1981). Statistical Methods for Rates and Proportions, 2nd
       ed., ch. 13. Wiley.

    Examples
    --------
    >>> from masrel.agreement import cohen_kappa, count_table
    >>> tables = [[[40, 6], [5, 29]], [[55, 20], [15, 30]], [[20, 3], [4, 8]]]
    >>> print(equality_test([cohen_kappa(count_table(table)) for table in tables]))
    equality_test: 7.971, chi-squared(2), p = 0.0186
    """
    checked: list[Any] = list(estimates) if is_row(estimates) else [estimates]
    refuse(
        (
            len(checked) < 2 or not all(isinstance(e, Estimate) for e in checked),
            "estimates: needs two or more of type Estimate, got "
            f"{', '.join(type(e).__name__ for e in checked) or 'none'}",
        )
    )
    if len(kinds := {(e.coefficient, e.weights): None for e in checked}) > 1:
        of_kinds = (f"{name} ({weights})" for name, weights in kinds)
        raise ParameterError(
            f"estimates: needs the same coefficient for all, got {', '.join(of_kinds)}"
        )
    n_items = sum(e.n_items for e in checked)
    test = partial(
        _tested, "equality_test", _SAME, "chi-squared", (len(checked) - 1.0,), n_items
    )
    for place, e in enumerate(checked):
        if e.reason is not None or not e.standard_error > 0.0:
            reason = e.reason or f"its standard error is {e.standard_error:g}"
            return test(reason=f"estimate {place}: {reason}")
    values = np.array([e.value for e in checked])
    precision = np.array([e.standard_error for e in checked]) ** -2.0
    away = values - precision @ values / precision.sum()
    return test(statistic=float(precision @ away**2))


def donner_test(
    groups: Sequence[object], *, categories: Sequence[Label] | None = None
) -> Significance:
    """Test whether independent kappas of two raters and two categories are the same.

    Parameters
    ----------
    groups : sequence of ratings, length 2 or more
        Each of its own items and two raters, ``(n_items, 2)`` labels, or what
        `count_table` makes of a contingency table; items with a missing rating are
        left out.
    categories : sequence, optional
        The two categories; those met when not given.

    Returns
    -------
    Significance
        The goodness of fit of one intraclass kappa to how many items of each group
        have both ratings in the first category, in the second, or one in each, each
        group with its own prevalence: χ² with one degree less than there are groups.

    Raises
    ------
    ParameterError
        If there are fewer than two groups.
    RatingsError
        If ratings are not of two raters and two categories.

    Warns
    -----
    UndefinedStatisticWarning
        If a group has ratings of one category alone, or none.

    Notes
    -----
    The intraclass kappa is Scott's π: the raters are taken to use both categories
    alike. At kappas of about .6 in four groups of 45 to 100 items it rejected a true
    hypothesis in 5.0 % of 20 000 simulated studies, and Fleiss' weighted χ²
    (`equality_test`) in 6.8 %: for two raters and two categories take this one, for
    all else that.

    References
    ----------
    .. [1] Donner, A., Eliasziw, M., Klar, N. (1996). Testing the homogeneity of kappa
       statistics. Biometrics, 52(1), 176-183. https://doi.org/10.2307/2533154

    Examples
    --------
    >>> from masrel.agreement import count_table
    >>> tables = [[[40, 6], [5, 29]], [[55, 20], [15, 30]], [[20, 3], [4, 8]]]
    >>> print(donner_test([count_table(table) for table in tables]))
    donner_test: 7.047, chi-squared(2), p = 0.0295
    """
    if not is_row(groups):
        raise ParameterError(
            f"groups: needs the ratings of two groups or more, got {groups!r}"
        )
    tables = [_concordance(ratings, k, categories) for k, ratings in enumerate(groups)]
    refuse((len(tables) < 2, f"groups: needs two or more, got {len(tables)}"))
    observed = np.array(tables, dtype=np.float64)  # (n_groups, 3): both, one, neither
    n_items = observed.sum(axis=1)
    df, n = (len(tables) - 1.0,), int(n_items.sum())
    test = partial(_tested, "donner_test", _SAME, "chi-squared", df, n)
    for place, (both, one, neither) in enumerate(tables):
        if one == 0 and 0 in (both, neither):
            return test(reason=f"group {place}: all its ratings are in one category")
    p = (2.0 * observed[:, 0] + observed[:, 1]) / (2.0 * n_items)
    between = p * (1.0 - p)
    kappa = 1.0 - observed[:, 1] / (2.0 * n_items * between)
    pooled = float((n_items * between) @ kappa / (n_items @ between))  # (2) of [1]
    shares = np.column_stack(
        [
            p * p + pooled * between,
            2.0 * between * (1.0 - pooled),
            (1.0 - p) ** 2 + pooled * between,
        ]
    )
    expected = n_items[:, None] * shares
    if not (expected > 0.0).all():
        return test(
            reason="in all groups the two raters agree on every item, or on none"
        )
    return test(statistic=float(((observed - expected) ** 2 / expected).sum()))


def _concordance(
    ratings: object, place: int, categories: Sequence[Label] | None
) -> tuple[int, int, int]:
    # items with both, one and no rating in the first category
    try:
        counted = count_ratings(ratings, categories)
    except RatingsError as error:
        raise RatingsError(f"groups: group {place}: {error}") from error
    used, freq = counted.n_categories, counted.freq
    rows = item_counts(counted.codes, max(used, 1), counted.repeats)
    refuse(
        (used == 0, f"groups: group {place}: needs a rating, got none"),
        (
            used > 2 or rows.sum(axis=1).max(initial=0) > 2,
            f"groups: group {place}: needs two raters and two categories, got "
            f"{counted.n_raters} and {used}",
        ),
        error=RatingsError,
    )
    is_whole = rows.sum(axis=1) == 2
    of_first = np.bincount(rows[is_whole, 0], freq[is_whole], minlength=3)
    both, one, neither = of_first[::-1].astype(int).tolist()
    return both, one, neither


_TITLES = {
    "difference_test": "the test of a difference",
    "differences": "the test of equality",
    "equality_test": "the test of equality",
    "donner_test": "Donner's test",
}


def _tested(
    name: str,
    hypothesis: str,
    distribution: str,
    df: tuple[float, ...],
    n_items: int,
    statistic: float = math.nan,
    reason: str | None = None,
) -> Significance:
    """Return a statistic with its p-value, or warn why it is undefined."""
    if reason is not None:
        statistic = math.nan
        undefined(_TITLES[name], reason)
    return tested(name, hypothesis, distribution, df, n_items, statistic, reason)

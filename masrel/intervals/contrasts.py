"""Differences of coefficients: between ratings of the same items, or of others.

One engine: the coefficient of every set of ratings without each item, or each cluster.
How these move together is the jackknife's covariance of the coefficients: a difference
of two, all differences of several, and the test that all are the same follow from it.
"""

import itertools
import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from masrel.agreement import Label, Metric, Significance, WeightsLike
from masrel.agreement._engine import Floats
from masrel.agreement._labels import is_row
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval
from masrel.intervals._clusters import ClusterSums, cluster_codes, clusters_of
from masrel.intervals._max_t import MaxT
from masrel.intervals._problem import (
    Integers,
    IntervalProblem,
    Statistic,
    pose_problem,
    warn_small,
)
from masrel.intervals.jackknife import _variance_of

_Design = Literal["dependent", "independent"]
"""Whether both sets of ratings are of the same items, row by row."""

_Simultaneous = Literal["max_t", "bonferroni", "scheffe"]
"""How several intervals hold at once."""

_Units = Literal["items", "clusters"]
"""What the sample is of."""

_METHODS: dict[_Simultaneous, str] = {
    "max_t": "the largest of correlated t",
    "bonferroni": "Bonferroni's t",
    "scheffe": "Hotelling's T²",
}
_FLAT = 1e-12  # of the largest variance: a direction in which nothing varies


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
    one, other = compared.estimates
    return Estimate(
        coefficient=f"difference of {one.coefficient}",
        weights=one.weights,
        value=compared.value,
        standard_error=compared.error,
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

        statistic = compared.value / compared.error
        p = min(1.0, 2.0 * float(stdtr(compared.df, -abs(statistic))))
    return Significance(
        name="difference_test",
        hypothesis="both coefficients are the same",
        statistic=statistic,
        distribution="t",
        df=(compared.df,),
        p_value=p,
        n_items=min(e.n_items for e in compared.estimates),
        reason=compared.reason,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Compared:
    """Two estimates, and how their difference varies."""

    problems: list[IntervalProblem]
    estimates: list[Estimate]
    value: float  # the first less the second
    error: float
    df: float
    reason: str | None  # why there is neither interval nor test, or None
    unit: _Units  # what was left out
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
    if design == "dependent":
        units = _same_units(problems, clusters)
        joint = _Joint.of(problems, [units, units])
        variance, df, n = joint.variance(0, 1), float(joint.n - 1), joint.n
    else:
        pair = [clusters] * 2 if clusters is None else _cluster_pair(clusters)
        joints = [
            _Joint.of([problem], [_units_of(problem, of)])
            for problem, of in zip(problems, pair, strict=True)
        ]
        variance, df = _satterthwaite([(of.variance(0), of.n - 1) for of in joints])
        n = min(of.n for of in joints)
    unit: _Units = "items" if clusters is None else "clusters"
    one, other = (problem.entry(problem.coded, weights=weights) for problem in problems)
    return _Compared(
        problems=problems,
        estimates=[one, other],
        value=one.value - other.value,
        error=math.sqrt(variance),
        df=df,
        reason=one.reason or other.reason or _no_variance(variance, unit),
        unit=unit,
        n_units=n,
    )


def _no_variance(variance: float, unit: _Units) -> str | None:
    left_out = unit.removesuffix("s")
    if math.isnan(variance):
        return f"with one {left_out} left out an estimate is undefined"
    if variance == 0.0:
        return f"leaving out any {left_out} leaves the difference as it is"
    return None


def _same_units(problems: Sequence[IntervalProblem], clusters: object) -> Integers:
    """Return the unit of every item of two sets, which must be the same items."""
    one, other = (problem.coded.codes for problem in problems)
    if len(one) != len(other):
        raise RatingsError(
            f"design: dependent ratings need the same items, got {len(one)} and "
            f"{len(other)}"
        )
    if clusters is not None:
        return clusters_of(problems[0], clusters)
    is_in_one = (one >= 0).any(axis=1) != (other >= 0).any(axis=1)
    if is_in_one.any():
        raise RatingsError(
            "design: dependent ratings need both for every item, row "
            f"{int(is_in_one.argmax())} has ratings in one of them only"
        )
    return np.arange(len(one))


def _units_of(problem: IntervalProblem, clusters: object) -> Integers:
    if clusters is None:
        return np.arange(len(problem.coded.codes))
    return clusters_of(problem, clusters)


def _cluster_pair(clusters: object) -> Sequence[object]:
    """Check the clusters of independent ratings, which must be different ones."""
    if not isinstance(clusters, Sequence) or len(clusters) != 2:
        raise ParameterError(
            "clusters: independent ratings need a pair of sequences, one label an item"
        )
    if all(map(is_row, clusters)) and (shared := set(clusters[0]) & set(clusters[1])):
        raise ParameterError(
            "clusters: independent ratings need other clusters, got "
            f"{min(map(str, shared))!r} in both"
        )
    return clusters


def _satterthwaite(parts: Sequence[tuple[float, int]]) -> tuple[float, float]:
    """Return the sum of variances, and its degrees of freedom [2]_."""
    variance = sum(part for part, _ in parts)
    if not variance > 0.0:
        return variance, float(min(df for _, df in parts))
    return variance, variance**2 / sum(part**2 / max(df, 1) for part, df in parts)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Joint:
    """Coefficients of several sets with each item, or cluster, left out."""

    without: Floats = field(repr=False)  # (n_sets, n_units), of units that matter
    n: int  # those with a pair of ratings, of the set that has the fewest

    @classmethod
    def of(
        cls, problems: Sequence[IntervalProblem], units: Sequence[Integers]
    ) -> "_Joint":
        """Leave out each unit; `units` are those of the items of each set."""
        sums = [
            ClusterSums.of(problem, of)
            for problem, of in zip(problems, units, strict=True)
        ]
        matters = np.any([of.known for of in sums], axis=0)
        without = [
            problem.values_without(problem.sums, of.sums[matters])
            for problem, of in zip(problems, sums, strict=True)
        ]
        return cls(without=np.array(without), n=min(of.n_paired for of in sums))

    def variance(self, one: int, other: int | None = None) -> float:
        """Return the jackknife variance of a coefficient, or of a difference."""
        moved = self.without[one]
        if other is not None:
            moved = moved - self.without[other]
        return _variance_of(moved, np.ones(moved.size, dtype=np.int64), self.n)

    @property
    def covariance(self) -> Floats:
        """The jackknife covariance of the coefficients, (n_sets, n_sets)."""
        if self.n < 2:
            return np.full((len(self.without),) * 2, math.nan)
        moved = self.without - self.without.mean(axis=1, keepdims=True)
        return np.asarray((self.n - 1) / self.n * (moved @ moved.T))


def _interval(compared: _Compared) -> Interval:
    unit = compared.unit
    method = f"{unit.removesuffix('s')} jackknife of the difference, t"
    problems, value = compared.problems, compared.value
    smaller = min(problems, key=lambda problem: problem.n_paired_items)
    if compared.reason is not None:
        return smaller.undefined(compared.reason, method=method, unit=unit)
    half = smaller.student_t(compared.df) * compared.error
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Differences:
    """How several coefficients of the same items differ, each two of them.

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
        The coefficient of the row less that of the column.
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
        lines = [f"{first}: {self.n_units} {self.unit}, {self.method}"]
        for one, other in itertools.combinations(range(len(self.names)), 2):
            place = one, other
            lines.append(
                f"{self.names[one]} - {self.names[other]}: {self.values[place]:.3f} "
                f"[{self.low[place]:.3f}, {self.high[place]:.3f}], "
                f"p = {self.p_values[place]:.3g}"
            )
        return "\n".join([*lines, str(self.equality)])


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
        The cluster of every item, such as the patient of a site; each item by itself
        when not given.
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
    ratings in one of the sets adds nothing to that one. Of two sets the difference, its
    error, interval and p-value are those of `difference`.

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
    if simultaneous not in get_args(_Simultaneous):
        raise ParameterError(
            f"simultaneous: needs one of {', '.join(get_args(_Simultaneous))}, "
            f"got {simultaneous!r}"
        )
    names, tables = _named_sets(sets)
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
        for ratings in tables
    ]
    units = _units_of_all(problems, names, clusters)
    joint = _Joint.of(problems, [units] * len(problems))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # given below
        estimates = tuple(
            problem.entry(problem.coded, weights=weights) for problem in problems
        )
    unit: _Units = "items" if clusters is None else "clusters"
    reason = _why_undefined(estimates, names, joint, unit)
    notes = () if reason is not None else warn_small(joint.n, 10, unit)
    if reason is not None:
        warnings.warn(
            f"differences are undefined: {reason}",
            UndefinedStatisticWarning,
            stacklevel=2,
        )
    arrays, quantile = _all_pairs(joint, estimates, level, simultaneous, reason)
    for array in arrays.values():
        array.setflags(write=False)
    return Differences(
        names=names,
        estimates=estimates,
        **arrays,
        level=level,
        method=f"{unit.removesuffix('s')} jackknife, {_METHODS[simultaneous]}",
        quantile=quantile,
        equality=_hotelling(arrays["values"], joint, reason),
        n_units=joint.n,
        unit=unit,
        notes=notes,
        reason=reason,
    )


def _named_sets(
    sets: "Sequence[object] | Mapping[str, object]",
) -> tuple[tuple[str, ...], list[object]]:
    if isinstance(sets, Mapping):
        names, tables = tuple(map(str, sets)), list(sets.values())
    elif isinstance(sets, str) or not isinstance(sets, Iterable):
        raise ParameterError(f"sets: needs ratings of two sets or more, got {sets!r}")
    else:
        tables = list(sets)
        names = tuple(str(place) for place in range(len(tables)))
    if len(tables) < 2:
        raise ParameterError(f"sets: needs two or more, got {len(tables)}")
    return names, tables


def _units_of_all(
    problems: Sequence[IntervalProblem], names: Sequence[str], clusters: object
) -> Integers:
    """Return the unit of every item, the same in all sets."""
    n_items = len(problems[0].coded.codes)
    for problem, name in zip(problems, names, strict=True):
        if len(problem.coded.codes) != n_items:
            raise RatingsError(
                f"sets: need the same items, got {n_items} in {names[0]!r} and "
                f"{len(problem.coded.codes)} in {name!r}"
            )
    return np.arange(n_items) if clusters is None else cluster_codes(clusters, n_items)


def _why_undefined(
    estimates: Sequence[Estimate], names: Sequence[str], joint: _Joint, unit: _Units
) -> str | None:
    for name, estimate in zip(names, estimates, strict=True):
        if estimate.reason is not None:
            return f"{name}: {estimate.reason}"
    if joint.n < 2:
        return f"needs at least 2 {unit} with ratings in every set"
    for name, values in zip(names, joint.without, strict=True):
        if np.isnan(values).any():
            left_out = unit.removesuffix("s")
            return f"{name}: with one {left_out} left out the estimate is undefined"
    return None


def _all_pairs(
    joint: _Joint,
    estimates: Sequence[Estimate],
    level: float,
    simultaneous: _Simultaneous,
    reason: str | None,
) -> tuple[dict[str, Floats], float]:
    """Return the matrices of `Differences`, and the quantile of all intervals."""
    covariance, g = joint.covariance, len(estimates)
    each = np.array([estimate.value for estimate in estimates])
    values = each[:, None] - each
    errors = np.zeros((g, g))
    for i, j in itertools.combinations(range(g), 2):
        errors[i, j] = errors[j, i] = math.sqrt(joint.variance(i, j))
    quantile, p_values = math.nan, np.full((g, g), math.nan)
    if reason is None:
        quantile, p_values = _adjusted(joint, values, errors, level, simultaneous)
    half = np.where(errors > 0.0, quantile * errors, math.nan)
    alone = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore"):
        correlation = covariance / np.outer(alone, alone)
    arrays = {
        "standard_errors": alone,
        "correlation": correlation,
        "values": values,
        "errors": errors,
        "low": values - half,
        "high": values + half,
        "p_values": p_values,
    }
    return arrays, quantile


def _adjusted(
    joint: _Joint,
    values: Floats,
    errors: Floats,
    level: float,
    simultaneous: _Simultaneous,
) -> tuple[float, Floats]:
    """Return the quantile of all intervals, and the adjusted p-values."""
    from scipy.special import fdtrc, fdtri, stdtr, stdtrit

    g, df = len(values), joint.n - 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.abs(np.where(errors > 0.0, values / errors, math.nan))
    pairs = [pair for pair in itertools.combinations(range(g), 2) if errors[pair] > 0]
    if not pairs:
        return math.nan, t
    if simultaneous == "bonferroni":
        quantile = float(stdtrit(df, 1.0 - 0.5 * (1.0 - level) / len(pairs)))
        return quantile, np.minimum(1.0, 2.0 * len(pairs) * stdtr(df, -t))
    if simultaneous == "scheffe":
        rest = df + 2.0 - g  # K - g + 1
        if rest <= 0.0:
            return math.nan, np.full_like(t, math.nan)
        factor = (g - 1.0) * df / rest
        quantile = math.sqrt(factor * float(fdtri(g - 1.0, rest, level)))
        return quantile, fdtrc(g - 1.0, rest, t**2 / factor)
    sizes, axes = np.linalg.eigh(joint.covariance)
    root = axes * np.sqrt(np.maximum(sizes, 0.0))  # root @ root.T is the covariance
    distribution = MaxT(
        np.array([(root[i] - root[j]) / errors[i, j] for i, j in pairs]), df
    )
    p_values = np.full_like(t, math.nan)
    for i, j in pairs:
        p_values[i, j] = p_values[j, i] = distribution.exceeded(t[i, j])
    return distribution.quantile(level), p_values


def _hotelling(values: Floats, joint: _Joint, reason: str | None) -> Significance:
    """Test that all coefficients are the same: T² = (Cκ)ᵀ (C V Cᵀ)⁻¹ Cκ."""
    from scipy.special import fdtrc

    name, g, n = "differences", len(values), joint.n
    statistic = p = math.nan
    df = (g - 1.0, n - g + 1.0)
    if reason is None:
        # C takes each from the first
        away = values[1:, 0]
        v = joint.covariance
        of_away = v[1:, 1:] - v[1:, :1] - v[:1, 1:] + v[0, 0]
        sizes, axes = np.linalg.eigh(of_away)
        if n < g:
            reason = f"{g} coefficients need at least {g} items or clusters, got {n}"
        elif sizes[0] <= _FLAT * np.abs(v).max():
            reason = "some of the coefficients never differ, or always as much"
        else:
            t_squared = float(((axes.T @ away) ** 2 / sizes).sum())
            statistic = t_squared * (n - g + 1.0) / ((n - 1.0) * (g - 1.0))
            p = float(fdtrc(*df, statistic))
        if reason is not None:
            warnings.warn(
                f"the test of equality is undefined: {reason}",
                UndefinedStatisticWarning,
                stacklevel=4,
            )
    return Significance(
        name=name,
        hypothesis="all coefficients are the same",
        statistic=statistic,
        distribution="F",
        df=df,
        p_value=p,
        n_items=n,
        reason=reason,
    )

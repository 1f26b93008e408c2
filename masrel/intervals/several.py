"""Several coefficients of the same items, or clusters: how each two of them differ."""

import itertools
import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from masrel.agreement import Label, Metric, Significance, WeightsLike
from masrel.agreement._engine import Floats, Integers
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.estimates import Estimate
from masrel.intervals._clusters import cluster_codes
from masrel.intervals._influences import sample_factor, unit_influences
from masrel.intervals._max_t import MaxT
from masrel.intervals._problem import (
    IntervalProblem,
    Statistic,
    pose_problem,
    warn_small,
)

_Simultaneous = Literal["max_t", "bonferroni", "scheffe"]
"""How intervals of all differences hold together."""

_Units = Literal["items", "clusters"]
"""What the sample is of."""

_METHODS: dict[str, str] = {
    "max_t": "delta method, the largest of correlated t",
    "bonferroni": "delta method, Bonferroni's t",
    "scheffe": "delta method, Hotelling's T²",
}
_FLAT = 1e-12  # of the largest variance: a direction in which nothing varies


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
    The covariance of two coefficients is n/(n - 1) Σ_c s_c s'_c over n clusters c,
    with s_c the sum over the items of a cluster of the derivatives of the coefficient
    in the weight of the item [1]_. An item without ratings in one of the sets adds
    nothing to that one. Of two sets `difference` has the jackknife interval of the
    same question.

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
    cohen_kappa: 40 items, delta method, the largest of correlated t
    first - second: 0.600 [0.306, 0.894], p = 0.000189
    differences: 17.01, F(1, 39), p = 0.000189
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
    unit: _Units = "items" if clusters is None else "clusters"
    joint = _joint(problems, names, clusters)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # given below
        estimates = tuple(
            problem.entry(problem.coded, weights=weights) for problem in problems
        )
    reason = _why_undefined(estimates, names, joint, unit)
    notes = () if reason is not None else warn_small(joint.n_units, 10, unit)
    if reason is not None:
        warnings.warn(
            f"differences are undefined: {reason}",
            UndefinedStatisticWarning,
            stacklevel=2,
        )
    return _compare(
        names, estimates, joint, unit, level, simultaneous, notes=notes, reason=reason
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Joint:
    """Coefficients with what they have in common."""

    values: Floats  # (n_sets,)
    covariance: Floats  # (n_sets, n_sets)
    n_units: int  # of the set that has the fewest


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


def _joint(
    problems: Sequence[IntervalProblem], names: Sequence[str], clusters: object
) -> _Joint:
    """Return the coefficients, and their covariance over items or clusters."""
    n_items = len(problems[0].coded.codes)
    for problem, name in zip(problems, names, strict=True):
        if len(problem.coded.codes) != n_items:
            raise RatingsError(
                f"sets: need the same items, got {n_items} in {names[0]!r} and "
                f"{len(problem.coded.codes)} in {name!r}"
            )
    units: Integers = np.arange(n_items)
    if clusters is not None:
        units = cluster_codes(clusters, n_items)
    of_sets = [unit_influences(problem, units) for problem in problems]
    # K/(K - 1) Σ_c s_c s'_c of [1]; sets with different K share it
    moves = np.array([math.sqrt(sample_factor(of)) * of.moves for of in of_sets])
    return _Joint(
        values=np.array([problem.value for problem in problems]),
        covariance=moves @ moves.T,
        n_units=min(of.n_units for of in of_sets),
    )


def _why_undefined(
    estimates: Sequence[Estimate], names: Sequence[str], joint: _Joint, unit: str
) -> str | None:
    for name, estimate in zip(names, estimates, strict=True):
        if estimate.reason is not None:
            return f"{name}: {estimate.reason}"
    if joint.n_units < 2:
        return f"needs at least 2 {unit} with ratings in every set"
    return None


def _compare(
    names: tuple[str, ...],
    estimates: tuple[Estimate, ...],
    joint: _Joint,
    unit: _Units,
    level: float,
    simultaneous: _Simultaneous,
    *,
    notes: tuple[str, ...],
    reason: str | None,
) -> Differences:
    covariance, g = joint.covariance, len(names)
    diagonal = np.diag(covariance)
    values = joint.values[:, None] - joint.values
    # what rounding leaves of a variance of 0 is none
    variances = diagonal[:, None] + diagonal - 2.0 * covariance
    variances[variances <= _FLAT * (diagonal[:, None] + diagonal)] = 0.0
    errors = np.sqrt(variances)
    quantile, p_values = math.nan, np.full((g, g), math.nan)
    if reason is None:
        quantile, p_values = _adjusted(joint, values, errors, level, simultaneous)
    half = np.where(errors > 0.0, quantile * errors, math.nan)
    with np.errstate(invalid="ignore"):
        correlation = covariance / np.sqrt(np.outer(diagonal, diagonal))
    arrays = {
        "standard_errors": np.sqrt(diagonal),
        "correlation": correlation,
        "values": values,
        "errors": errors,
        "low": values - half,
        "high": values + half,
        "p_values": p_values,
    }
    for array in arrays.values():
        array.setflags(write=False)
    return Differences(
        names=names,
        estimates=estimates,
        **arrays,
        level=level,
        method=_METHODS[simultaneous],
        quantile=quantile,
        equality=_hotelling(joint, reason),
        n_units=joint.n_units,
        unit=unit,
        notes=notes,
        reason=reason,
    )


def _adjusted(
    joint: _Joint,
    values: Floats,
    errors: Floats,
    level: float,
    simultaneous: _Simultaneous,
) -> tuple[float, Floats]:
    """Return the quantile of all intervals, and the adjusted p-values."""
    from scipy.special import fdtrc, fdtri, stdtr, stdtrit

    g, df = len(values), joint.n_units - 1.0
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


def _hotelling(joint: _Joint, reason: str | None) -> Significance:
    """Test that all coefficients are the same: T² = (Cκ)ᵀ (C V Cᵀ)⁻¹ Cκ."""
    from scipy.special import fdtrc

    name, g, n = "differences", len(joint.values), joint.n_units
    statistic = p = math.nan
    df = (g - 1.0, n - g + 1.0)
    if reason is None:
        # C takes each from the first
        away = joint.values[1:] - joint.values[0]
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

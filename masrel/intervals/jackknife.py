"""Jackknife intervals: leave out items, raters, or both, one at a time."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from masrel._input import refuse
from masrel.agreement import Label, Metric, WeightsLike
from masrel.agreement._engine import Floats, Integers
from masrel.estimates import Interval, Target, Unit
from masrel.intervals._question import (
    COLUMNS,
    ROUNDING,
    IntervalProblem,
    Statistic,
    cluster_codes,
    cluster_sums,
    pose_problem,
    warn_small,
)


def jackknife(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    metric: Metric | None = None,
    level: float = 0.95,
    clusters: object = None,
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
        Population that the interval is about, and so what is left out: items, raters,
        or both.
    categories : sequence, optional
        The declared scale in order.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    metric : str, optional
        Krippendorff's difference function in place of weights; see
        `krippendorff_alpha`, which alone takes one.
    level : float, optional
        Nominal level.
    clusters : sequence of labels, length n_items, optional
        The cluster of every item, such as the patient of a site: what is left out then,
        with `target` "items". By default each item is independent.

    Returns
    -------
    Interval
        A confidence interval around the estimate; ``nan`` with a reason when
        undefined.

    Raises
    ------
    ParameterError
        If an option is invalid, or `target` is not "items" with two raters: leaving
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
    Items with a single rating are left out in turn, too, where they affect chance
    agreement; but (n - 1)/n and the degrees of freedom count items with a pair of
    ratings, and raters of a pair.

    For "both" the variances of leaving out items and of leaving out raters are
    added, and the degrees of freedom are the fewer of the two: other items and other
    raters cannot give a surer answer than either alone. The disagreement of one rater
    on one item is in both variances, so this interval is rather too wide than too
    narrow.

    References
    ----------
    .. [1] Efron, B., Stein, C. (1981). The jackknife estimate of variance. Annals of
       Statistics, 9(3), 586-596. https://doi.org/10.1214/aos/1176345462

    Examples
    --------
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]] * 5
    >>> interval = jackknife("cohen_kappa", ratings, target="items")
    >>> round(interval.low, 3), round(interval.high, 3)
    (0.122, 0.878)
    """
    problem = pose_problem(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        metric=metric,
        level=level,
    )
    codes = None if clusters is None else cluster_codes(problem, clusters)
    return _leave_out(problem, codes).interval()


@dataclass(frozen=True, slots=True, kw_only=True)
class _LeftOut:
    """How much an estimate moves when units are left out one at a time."""

    problem: IntervalProblem
    unit: Unit  # what was left out
    variance: float  # ``nan`` when undefined
    df: float  # its degrees of freedom
    notes: tuple[str, ...]  # what is small
    reason: str | None  # why it makes no interval, or None

    def interval(self, *, lowest: float | None = None) -> Interval:
        """Return an interval around the value, or on the logit above `lowest`."""
        unit = "two-way" if self.unit == "both" else self.unit.removesuffix("s")
        method = f"{unit} jackknife"
        if self.reason is not None:
            return self.problem.undefined(self.reason, method=method, unit=self.unit)
        scale = "" if lowest is None else " on the logit"
        interval = self.problem.by_t(
            math.sqrt(self.variance),
            self.df,
            lowest=lowest,
            method=f"{method}, t({self.df:g}){scale}",
            unit=self.unit,
            notes=self.notes,
        )
        return replace(interval, units_are="left out")


def _leave_out(problem: IntervalProblem, clusters: Integers | None = None) -> _LeftOut:
    """Leave out items, raters, or both, as the target says, or clusters of items."""
    target: Unit = problem.target if clusters is None else "clusters"
    units: tuple[Unit, ...] = ("items", "raters") if target == "both" else (target,)
    variance, df, reason = 0.0, problem.max_df, None
    notes: tuple[str, ...] = ()
    if math.isnan(problem.value):
        variance, units, reason = math.nan, (), "the estimate itself is undefined"
    for unit in units:
        if unit == "items":
            values = problem.values(problem.sums - problem.features(problem.codes))
            n = problem.n_paired_items
        elif clusters is not None:
            sums, known, n = cluster_sums(problem, clusters)
            values = problem.values(problem.sums - sums[known])
        else:
            values = np.array(
                [problem.values(sums) for sums, _ in _without_raters(problem)]
            )
            n = problem.n_paired_raters
        freq = problem.freq if unit == "items" else np.ones(len(values), dtype=np.int64)
        variance += _variance_of(values, n, freq)
        if np.isnan(values).any():
            reason = f"the estimate is undefined when one of the {unit} is left out"
            break
        # Satterthwaite's degrees for a sum would lie above the fewer ones.
        df = min(df, n - 1)
        notes += warn_small(n, 5 if unit == "raters" else 10, unit, int(freq.sum()))
    if reason is None and not variance > 0.0:
        reason = (
            f"the estimate stays the same whichever of the {' or '.join(units)} is "
            "left out, so the jackknife cannot show how uncertain it is"
        )
    return _LeftOut(
        problem=problem,
        unit=target,
        variance=variance,
        df=df,
        notes=notes,
        reason=reason,
    )


def _variance_of(replicates: Floats, n: int, freq: Integers | None = None) -> float:
    """Return (n - 1)/n Σ (θ_i - mean)² of estimates with one left out [1]_."""
    # Takes replicates (n_distinct,), freq (n_distinct,); n are those with a pair. What
    # is observed is a mean over these alone, whose variance this factor makes unbiased;
    # single ratings move the mean of chance by little, and there 1 would do as well.
    if n < 2:  # nothing is left
        return math.nan
    if freq is None:
        freq = np.ones(replicates.size, dtype=np.int64)
    moved = replicates - replicates[0]  # so that no change at all is exactly 0
    deviations = moved - freq @ moved / freq.sum()
    variance = float((n - 1) / n * (freq @ deviations**2))
    return 0.0 if math.sqrt(variance) <= ROUNDING else variance


def _without_raters(problem: IntervalProblem) -> Iterator[tuple[Floats, Floats]]:
    """Return sums, and features of the rows, without one rater after the other."""
    # -> (n_features,), (n_rows, n_features), made anew, because pairs of raters go.
    # Items that not every rater rated may matter once the one is gone who did not.
    width = COLUMNS[problem.entry.shape]
    fewest = 2 if width == 2 else 3
    refuse(
        (
            problem.n_raters < fewest,
            f'target: "{problem.target}" needs at least {fewest} raters, because one '
            f"is left out; got {problem.n_raters}",
        )
    )
    for first in range(0, problem.codes.shape[1], width):
        left_out = np.s_[first : first + width]
        rows = problem.features(np.delete(problem.codes, left_out, axis=1))
        yield problem.often @ rows, rows


def _variance_of_cells(problem: IntervalProblem) -> float:
    """Return the variance that leaving out items and leaving out raters both hold."""
    # that of a rater on an item, (n - 1)(r - 1)/(n r) Σ_ij (κ_-i-j - κ_-i - κ_-j + κ)²
    without_item = problem.values(problem.sums - problem.features(problem.codes))
    cells = 0.0
    for sums, rows in _without_raters(problem):
        without_both = problem.values(sums - rows)
        cell = without_both - without_item - float(problem.values(sums)) + problem.value
        cells += float(problem.freq @ cell**2)
    n, r = problem.n_paired_items, problem.n_paired_raters
    variance = (n - 1) * (r - 1) / (n * r) * cells
    return variance if math.isfinite(variance) else 0.0

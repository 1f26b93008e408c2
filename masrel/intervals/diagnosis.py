"""Which rater, which pair of raters, which category: where agreement is lost."""

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np

from masrel.agreement import CodedRatings, Label, Metric, WeightsLike
from masrel.agreement._engine import Array, Floats, Integers, divide
from masrel.agreement._rows import distinct_rows
from masrel.agreement._weights import MANY
from masrel.errors import MasrelWarning, ParameterError
from masrel.estimates import Estimate
from masrel.intervals._confusion import (
    PairCounts,
    category_arrays,
    confusion_arrays,
)
from masrel.intervals._problem import (
    IntervalProblem,
    Statistic,
    find_entry,
    pose_problem,
    rows_problem,
    warn_small,
)
from masrel.intervals.jackknife import _variance_of

_MAX_KEYS = 1 << 22  # rows that can differ, up to which equal ones are put together


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """Where raters agree and where they do not.

    Arrays of intervals are ``nan`` where none were asked for, or are undefined.

    Attributes
    ----------
    estimate : Estimate
        The coefficient of all raters, without the reference.
    raters : tuple of str
        What the raters are called, without the reference.
    categories : tuple of str, int or float
        The scale.
    reference : str or None
        The rater that the others are held against, if there is one.
    level : float
        Level of the intervals.
    pair_values, pair_low, pair_high : ndarray, shape (n_raters, n_raters)
        The coefficient of every two raters; ``nan`` on the diagonal.
    pair_items : ndarray, shape (n_raters, n_raters)
        Items that both rated.
    mean_values : ndarray, shape (n_raters,)
        The mean of a rater's pairs that have a value.
    without_values : ndarray, shape (n_raters,)
        The coefficient without the rater; ``nan`` of two raters.
    changes, change_errors, change_low, change_high : ndarray, shape (n_raters,)
        By how much that exceeds the coefficient of all, with its jackknife standard
        error over items and its interval: above 0, the others agree better without.
    reference_values, reference_low, reference_high : ndarray, shape (n_raters,)
        The coefficient of each rater and the reference; ``nan`` without one.
    category_counts : ndarray, shape (n_categories,)
        Ratings in each category.
    category_values, category_low, category_high : ndarray, shape (n_categories,)
        Specific agreement: of the ratings in a category, the share that meets the same
        of another rater of the item.
    confusion : ndarray, shape (n_raters, n_categories, n_categories)
        How often a rating of the reference, or else of any other rater (row), met one
        of this rater (column).
    shares, share_low, share_high : ndarray, shape (n_raters, n_categories, \
n_categories)
        The same as shares of the rows.
    notes : tuple of str
        What the reader must know before relying on it.
    """

    estimate: Estimate
    raters: tuple[str, ...]
    categories: tuple[Label, ...]
    reference: str | None
    level: float
    pair_values: Floats = field(compare=False, repr=False)
    pair_low: Floats = field(compare=False, repr=False)
    pair_high: Floats = field(compare=False, repr=False)
    pair_items: Integers = field(compare=False, repr=False)
    mean_values: Floats = field(compare=False, repr=False)
    without_values: Floats = field(compare=False, repr=False)
    changes: Floats = field(compare=False, repr=False)
    change_errors: Floats = field(compare=False, repr=False)
    change_low: Floats = field(compare=False, repr=False)
    change_high: Floats = field(compare=False, repr=False)
    reference_values: Floats = field(compare=False, repr=False)
    reference_low: Floats = field(compare=False, repr=False)
    reference_high: Floats = field(compare=False, repr=False)
    category_counts: Integers = field(compare=False, repr=False)
    category_values: Floats = field(compare=False, repr=False)
    category_low: Floats = field(compare=False, repr=False)
    category_high: Floats = field(compare=False, repr=False)
    confusion: Integers = field(compare=False, repr=False)
    shares: Floats = field(compare=False, repr=False)
    share_low: Floats = field(compare=False, repr=False)
    share_high: Floats = field(compare=False, repr=False)
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        lines = [str(self.estimate), "rater: mean of pairs, all without, change"]
        width = max(map(len, self.raters))
        for place, rater in enumerate(self.raters):
            lines.append(
                f"{rater:<{width}}  {self.mean_values[place]:6.3f}  "
                f"{self.without_values[place]:6.3f}  {self.changes[place]:+.3f}"
                + _ends(self.change_low[place], self.change_high[place])
            )
        lines.append("category: ratings, agreement on it")
        width = max(len(str(category)) for category in self.categories)
        for place, category in enumerate(self.categories):
            lines.append(
                f"{category!s:<{width}}  {self.category_counts[place]:6d}  "
                f"{self.category_values[place]:6.3f}"
                + _ends(self.category_low[place], self.category_high[place])
            )
        return "\n".join(lines)


def _ends(low: float, high: float) -> str:
    return "" if math.isnan(low) else f"  [{low:.3f}, {high:.3f}]"


def diagnose(
    ratings: object,
    *,
    coefficient: Statistic = "fleiss_kappa",
    target: Literal["items"] | None = None,
    raters: Sequence[str] | None = None,
    reference: str | int | None = None,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    metric: Metric | None = None,
    level: float = 0.95,
) -> Diagnosis:
    """Say which rater, which pair and which category agreement is lost on.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    coefficient : str or callable, optional
        Name of a coefficient that takes more than two raters and two, or its public
        function.
    target : {"items"}, optional
        "items" for intervals that generalise to other items, graded by these raters;
        without it there are none. What a pair or a rater does says nothing of others.
    raters : sequence of str, optional
        What the raters are called; the columns of a DataFrame, else their places.
    reference : str or int, optional
        Name, or place, of a rater who is right: the others are held against this one,
        who is then left out of all else.
    categories : sequence, optional
        The declared scale in order.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    metric : str, optional
        Krippendorff's difference function in place of weights; see
        `krippendorff_alpha`, which alone takes one.
    level : float, optional
        Nominal level, of each interval by itself.

    Returns
    -------
    Diagnosis
        Pairs of raters, what each rater adds or takes, categories, and confusions.

    Raises
    ------
    ParameterError
        If an option is invalid, the coefficient does not take as many raters, or is
        no function of sums over items.
    RatingsError
        If the ratings do not fit the coefficient.

    Warns
    -----
    SmallSampleWarning
        Below 10 items, with intervals.
    UndefinedStatisticWarning
        If the coefficient of all raters is undefined.

    Notes
    -----
    The interval of a pair is that of `estimate` of the two alone. That of a change is
    that of `difference` of the same items, first without the rater, then with all.
    Shares are ratios of sums over items; their intervals are Clopper and Pearson's at
    the number of single items that would vary as much [1]_, of one rater against a
    reference exact. Many intervals are shown at once, and some miss by chance: they
    tell where to look, not whom to blame.

    References
    ----------
    .. [1] Korn, E. L., Graubard, B. I. (1998). Confidence intervals for proportions
       with small expected number of positive counts estimated from survey data. Survey
       Methodology, 24(2), 193-201.

    Examples
    --------
    >>> ratings = [["a", "a", "b"], ["b", "b", "b"], ["a", "a", "a"], ["b", "b", "a"]]
    >>> print(diagnose(ratings * 5, raters=["Kim", "Lee", "Ann"], target="items"))
    fleiss_kappa: 0.3333 (SE 0.15)
    rater: mean of pairs, all without, change
    Kim   0.500   0.000  -0.333  [-0.499, -0.168]
    Lee   0.500   0.000  -0.333  [-0.499, -0.168]
    Ann   0.000   1.000  +0.667  [0.339, 0.995]
    category: ratings, agreement on it
    a      30   0.667  [0.438, 0.849]
    b      30   0.667  [0.438, 0.849]
    """
    if target not in ("items", None):
        raise ParameterError(
            "target: a rater, a pair and a category are those of these ratings, so "
            f'"items", or None for no intervals; got {target!r}'
        )
    entry = find_entry(coefficient, metric)
    if entry.shape != "ratings":
        raise ParameterError(
            f"coefficient: needs one of several raters, and {entry.title} is of each "
            "rater's grades of two sessions"
        )
    coded = entry.code(ratings, categories)
    if coded.n_categories > MANY:
        raise ParameterError(
            f"ratings: a table of confusions needs at most {MANY} different grades, "
            f"got {coded.n_categories}; for measurements there are limits of agreement "
            "and ICC"
        )
    pose = partial(pose_problem, entry, target="items", weights=weights, level=level)
    problem = everybody = pose(coded, categories=None)
    names = _names(ratings, raters, coded.codes.shape[1])
    right = None if reference is None else _place(reference, names)
    others = [place for place in range(len(names)) if place != right]
    if right is not None:
        rest = replace(coded, codes=coded.codes[:, others])
        problem = pose(rest, categories=None)
    estimate = entry(problem.coded, weights=weights)
    at = None if target is None else level
    notes = () if at is None else warn_small(estimate.n_items, 10, "items")
    codes, freq = _counted_rows(coded)
    counts = PairCounts.of(codes, freq, coded.n_categories)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)  # the arrays say it
        arrays = {
            **_of_raters(_pairs(everybody, counts, at), others, right),
            **_changes(problem, codes[:, others], freq, at),
            **category_arrays(codes, freq, counts, others, at),
            **confusion_arrays(codes, freq, counts, others, right, at),
        }
    for array in arrays.values():
        array.setflags(write=False)
    return Diagnosis(
        estimate=estimate,
        raters=tuple(names[place] for place in others),
        categories=coded.categories,
        reference=None if right is None else names[right],
        level=level,
        notes=notes,
        **arrays,
    )


def _names(
    ratings: object, raters: Sequence[str] | None, n_raters: int
) -> tuple[str, ...]:
    if raters is not None and (
        isinstance(raters, str) or not isinstance(raters, Iterable)
    ):
        raise ParameterError(f"raters: needs a name for each, got {raters!r}")
    columns = raters if raters is not None else getattr(ratings, "columns", None)
    names = tuple(map(str, range(n_raters) if columns is None else columns))
    if len(names) != n_raters:
        raise ParameterError(
            f"raters: needs a name for each of {n_raters}, got {len(names)}"
        )
    return names


def _place(reference: str | int, names: Sequence[str]) -> int:
    """Return which rater is the reference."""
    if isinstance(reference, str) and reference in names:
        return names.index(reference)
    is_place = isinstance(reference, int | np.integer)
    if (
        is_place
        and not isinstance(reference, bool)
        and 0 <= int(reference) < len(names)
    ):
        return int(reference)
    raise ParameterError(
        f"reference: needs one of {', '.join(names)}, got {reference!r}"
    )


def _counted_rows(coded: CodedRatings) -> tuple[Integers, Integers]:
    """Return rows of ratings and how often each occurs, or all where many differ."""
    # -> (n_rows, n_raters), (n_rows,)
    codes = coded.codes
    if (coded.n_categories + 1) ** codes.shape[1] <= _MAX_KEYS:
        return distinct_rows(codes, coded.n_categories)
    return codes, np.ones(len(codes), dtype=np.int64)


def _pairs(
    problem: IntervalProblem, counts: PairCounts, level: float | None
) -> tuple[Floats, Integers]:
    """Return value, low and high of every pair, (3, n_raters, n_raters), and items."""
    r = counts.n_raters
    pairs = np.full((3, r, r), math.nan)
    if level is not None:
        # Imported here: values alone load no scipy.
        from masrel.intervals._choice import choose_interval
    for one, other in counts.pairs():
        of_pair = rows_problem(problem, *counts.of_pair(one, other))
        pairs[0, one, other] = of_pair.value
        if level is not None:
            interval, _ = choose_interval(of_pair, unweighted=of_pair.unweighted)
            pairs[1:, one, other] = interval.low, interval.high
    return np.fmax(pairs, pairs.transpose(0, 2, 1)), counts.shared()


def _of_raters(
    pairs: tuple[Floats, Integers], others: Sequence[int], right: int | None
) -> dict[str, Array]:
    """Return what pairs say of the raters, and of each with the reference."""
    values, items = pairs
    among = values[:, others][:, :, others]
    defined = ~np.isnan(among[0])
    reference = np.full((3, len(others)), math.nan)
    if right is not None:
        reference = values[:, others, right]
    return {
        "pair_values": among[0],
        "pair_low": among[1],
        "pair_high": among[2],
        "pair_items": items[np.ix_(others, others)],
        "mean_values": divide(
            np.where(defined, among[0], 0.0).sum(axis=1),
            defined.sum(axis=1).astype(np.float64),
        ),
        "reference_values": reference[0],
        "reference_low": reference[1],
        "reference_high": reference[2],
    }


def _changes(
    problem: IntervalProblem, codes: Integers, freq: Integers, level: float | None
) -> dict[str, Array]:
    """Return the coefficient without each rater, and how much that differs."""
    r = codes.shape[1]
    without, errors, half = (np.full(r, math.nan) for _ in range(3))
    active = np.flatnonzero((codes >= 0).any(axis=0))
    rows = problem.features(replace(problem.coded, codes=codes[:, active]))
    sums, n_paired = freq @ rows, _n_paired(rows, codes, freq)
    moved = problem.values_without(sums, rows) if level is not None else np.empty(0)
    for column, rater in enumerate(active if len(active) > 2 else ()):
        rest = np.delete(codes[:, active], column, axis=1)
        others = problem.features(replace(problem.coded, codes=rest))
        of_others = freq @ others
        without[rater] = problem.values(of_others)
        if level is not None:
            # as `difference` of the same items, without the rater and with
            change = problem.values_without(of_others, others) - moved
            n = min(n_paired, _n_paired(others, rest, freq))
            matters = rows.any(axis=1) | others.any(axis=1)
            errors[rater] = math.sqrt(_variance_of(change[matters], freq[matters], n))
            half[rater] = problem.student_t(n - 1) * errors[rater]
    changes = without - problem.value
    half[errors == 0.0] = math.nan  # leaving out any item leaves it as it is
    return {
        "without_values": without,
        "changes": changes,
        "change_errors": errors,
        "change_low": changes - half,
        "change_high": changes + half,
    }


def _n_paired(rows: Floats, codes: Integers, freq: Integers) -> int:
    """Return how many items matter that have a pair of ratings."""
    return int(freq @ (rows.any(axis=1) & ((codes >= 0).sum(axis=1) > 1)))

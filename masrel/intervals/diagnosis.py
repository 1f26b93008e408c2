"""Diagnosis of disagreement: by rater, by pair of raters, and by category."""

import itertools
import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np

from masrel._input import refuse
from masrel.agreement import Label, Metric, WeightsLike
from masrel.agreement._codes import distinct_rows, item_counts, read_only
from masrel.agreement._engine import Array, Floats, Integers, divide, student_t
from masrel.agreement._weights import MANY
from masrel.errors import MasrelWarning
from masrel.estimates import Estimate
from masrel.intervals._question import (
    IntervalProblem,
    Statistic,
    find_entry,
    of_rows,
    pose_problem,
    warn_small,
)
from masrel.intervals.jackknife import _variance_of, _without_raters


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
        The rater with whom the others are compared, if there is one.
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
        width = max(map(len, self.raters), default=0)
        raters = (
            f"{rater:<{width}}  {self.mean_values[place]:6.3f}  "
            f"{self.without_values[place]:6.3f}  {self.changes[place]:+.3f}"
            + _ends(self.change_low[place], self.change_high[place])
            for place, rater in enumerate(self.raters)
        )
        wide = max((len(str(category)) for category in self.categories), default=0)
        categories = (
            f"{category!s:<{wide}}  {self.category_counts[place]:6d}  "
            f"{self.category_values[place]:6.3f}"
            + _ends(self.category_low[place], self.category_high[place])
            for place, category in enumerate(self.categories)
        )
        return "\n".join(
            (
                *(str(self.estimate), "rater: mean of pairs, all without, change"),
                *(*raters, "category: ratings, agreement on it", *categories),
            )
        )


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
    """Find the raters, pairs of raters and categories that disagree.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    coefficient : str or callable, optional
        Name of a coefficient that takes more than two raters and two, or its public
        function.
    target : {"items"}, optional
        "items" for intervals that generalise to other items, graded by these raters;
        without it no interval is given. Each interval is for one pair or rater alone.
    raters : sequence of str, optional
        What the raters are called; the columns of a DataFrame, else their places.
    reference : str or int, optional
        Name, or place, of a rater who is right: the others are compared with this one,
        who is then left out of all other estimates.
    categories : sequence, optional
        The declared scale in order.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    metric : str, optional
        Krippendorff's difference function in place of weights; see
        `krippendorff_alpha`, which alone takes one.
    level : float, optional
        Nominal level of each interval separately.

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
        Below 10 items with a pair of ratings, with intervals.
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
    entry = find_entry(coefficient, metric)
    refuse(
        (
            target not in ("items", None),
            'target: intervals generalise to other items: needs "items", or None '
            f"for no intervals, got {target!r}",
        ),
        (
            entry.shape != "ratings",
            f"coefficient: needs one that compares raters, but {entry.title} compares "
            "each rater's grades of two sessions",
        ),
    )
    coded = entry.code(ratings, categories)
    refuse(
        (
            coded.n_categories > MANY,
            f"ratings: a confusion table needs at most {MANY} different grades, got "
            f"{coded.n_categories}; for measurements use limits of agreement or an ICC",
        )
    )
    pose = partial(
        pose_problem,
        entry,
        target="items",
        categories=None,
        weights=weights,
        level=level,
    )
    problem = everybody = pose(coded)
    names = _names(ratings, raters, coded.codes.shape[1])
    right = None if reference is None else _place(reference, names)
    others = [place for place in range(len(names)) if place != right]
    if right is not None:
        problem = pose(replace(coded, codes=coded.codes[:, others]))
    estimate = entry(problem.coded, weights=weights)
    at = None if target is None else level
    notes = (
        ()
        if at is None
        else warn_small(estimate.n_items_paired, 10, "items", estimate.n_items)
    )
    codes, freq = distinct_rows(coded.codes, coded.n_categories)
    # the arrays say it
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        arrays = {
            **_of_pairs(everybody, codes, freq, others, right, at),
            **_changes(problem, codes[:, others], freq, at),
            **_category_arrays(codes[:, others], freq, coded.n_categories, at),
            **_confusions(codes, freq, coded.n_categories, others, right, at),
        }
    return Diagnosis(
        estimate=estimate,
        raters=tuple(names[place] for place in others),
        categories=coded.categories,
        reference=None if right is None else names[right],
        level=level,
        notes=notes,
        **{name: read_only(array) for name, array in arrays.items()},
    )


def _names(
    ratings: object, raters: Sequence[str] | None, n_raters: int
) -> tuple[str, ...]:
    are_names = isinstance(raters, Iterable) and not isinstance(raters, str)
    needed, columns = "raters: needs a name for each", getattr(ratings, "columns", None)
    refuse((raters is not None and not are_names, f"{needed}, got {raters!r}"))
    columns = columns if raters is None else raters
    names = tuple(map(str, range(n_raters) if columns is None else columns))
    refuse((len(names) != n_raters, f"{needed} of {n_raters}, got {len(names)}"))
    return names


def _place(reference: str | int, names: Sequence[str]) -> int:
    """Return which rater is the reference."""
    places: dict[object, int] = dict(zip(names, range(len(names)), strict=True))
    if isinstance(reference, int | np.integer) and not isinstance(reference, bool):
        places = {place: place for place in range(len(names))}
    needed = f"needs one of {', '.join(names)}, got {reference!r}"
    refuse((reference not in places, f"reference: {needed}"))
    return places[reference]


def _of_pairs(
    problem: IntervalProblem,
    codes: Integers,
    freq: Integers,
    others: Sequence[int],
    right: int | None,
    level: float | None,
) -> dict[str, Array]:
    """Return what pairs say of the raters, and of each with the reference."""
    r, size = codes.shape[1], problem.coded.n_categories + 1
    pairs = np.full((3, r, r), math.nan)  # value, low and high
    items = np.zeros((r, r), dtype=np.int64)  # that both rated
    if level is not None:
        # Imported here: values alone load no scipy.
        from masrel.intervals.choose import _choose_interval
    for one, other in itertools.combinations(range(r), 2):
        # ratings of the one by those of the other; the first of either is missing
        places = (codes[:, one].astype(np.int64) + 1) * size + codes[:, other] + 1
        table = np.bincount(places, freq, minlength=size * size).reshape(size, size)
        items[one, other] = items[other, one] = table[1:, 1:].sum()
        table[0, 0] = 0.0  # rated by neither
        rows = np.argwhere(table > 0.0)
        of_pair = of_rows(problem, rows - 1, table[tuple(rows.T)].astype(np.int64))
        pairs[0, one, other] = of_pair.value
        if level is not None:
            interval, _ = _choose_interval(of_pair)
            pairs[1:, one, other] = interval.low, interval.high
    items[np.diag_indices(r)] = freq @ (codes >= 0)
    pairs = np.fmax(pairs, pairs.transpose(0, 2, 1))
    among = pairs[:, others][:, :, others]
    defined = ~np.isnan(among[0])
    none = np.full((3, len(others)), math.nan)
    reference = none if right is None else pairs[:, others, right]
    return {
        "pair_values": among[0],
        "pair_low": among[1],
        "pair_high": among[2],
        "pair_items": items[np.ix_(others, others)],
        "mean_values": divide(
            np.where(defined, among[0], 0.0).sum(axis=1), defined.sum(axis=1) * 1.0
        ),
        "reference_values": reference[0],
        "reference_low": reference[1],
        "reference_high": reference[2],
    }


def _changes(
    problem: IntervalProblem, codes: Integers, freq: Integers, level: float | None
) -> dict[str, Array]:
    """Return the coefficient without each rater, and how much that differs."""
    without, errors, half = (np.full(codes.shape[1], math.nan) for _ in range(3))
    active = np.flatnonzero((codes >= 0).any(axis=0))
    everyone = of_rows(problem, codes[:, active], freq)
    moved = everyone.values(everyone.sums - everyone.features(everyone.codes))
    rated = everyone.codes >= 0
    left_out = _without_raters(everyone) if len(active) > 2 else ()
    for rater, is_rated, (sums, rows) in zip(active, rated.T, left_out, strict=False):
        without[rater] = everyone.values(sums)
        if level is not None:
            # as `difference` of the same items, without the rater and with
            change = everyone.values(sums - rows) - moved
            matters = rows.any(axis=1)
            has_pair = matters & (rated.sum(axis=1) - is_rated > 1)
            n = min(everyone.n_paired_items, int(freq @ has_pair))
            often = freq * (matters | (everyone.freq > 0))
            errors[rater] = math.sqrt(_variance_of(change, n, often))
            half[rater] = student_t(level, n - 1) * errors[rater]
    changes = without - problem.value
    half[errors == 0.0] = math.nan  # leaving out any item leaves it as it is
    return {
        "without_values": without,
        "changes": changes,
        "change_errors": errors,
        "change_low": changes - half,
        "change_high": changes + half,
    }


# -- categories, and shares of ratings -------------------------------------------------


def _category_arrays(
    codes: Integers, freq: Integers, n_categories: int, level: float | None
) -> dict[str, Array]:
    """Return how often each category is used, and how often raters agree on it."""
    chosen = item_counts(codes, n_categories).astype(np.float64)  # (n_rows, q)
    met = np.maximum(chosen.sum(axis=1, keepdims=True) - 1.0, 0.0)  # others of the item
    same, pairs = chosen * (chosen - 1.0), chosen * met
    low, high = np.full((2, n_categories), np.nan)
    if level is not None:
        low, high = _share_interval(
            level,
            parts=freq @ same,
            wholes=freq @ pairs,
            squares=freq @ same**2,
            products=freq @ (same * pairs),
            whole_squares=freq @ pairs**2,
            n_items=freq @ (pairs > 0.0).astype(np.float64),
        )
    return {
        "category_counts": (freq @ chosen).astype(np.int64),
        "category_values": divide(freq @ same, freq @ pairs),
        "category_low": low,
        "category_high": high,
    }


def _confusions(
    codes: Integers,
    freq: Integers,
    n_categories: int,
    others: Sequence[int],
    right: int | None,
    level: float | None,
) -> dict[str, Array]:
    """Return what ratings of others, or of the reference, each rater's ratings met."""
    shape = (len(others), n_categories, n_categories)
    confusion, (low, high) = np.zeros(shape), np.full((2, *shape), np.nan)
    wide = shape[1:]  # a row of a table has one whole
    held_against = others if right is None else [right]
    met = item_counts(codes[:, held_against], n_categories).astype(np.float64)
    for place, rater in enumerate(others):
        mine = item_counts(codes[:, [rater]], n_categories)
        # of other raters, or of the reference: (n_rows, n_categories)
        of_others = met - mine if right is None else met
        weighed = (mine * freq[:, None]).astype(np.float64)
        confusion[place] = of_others.T @ weighed
        if level is None:
            continue
        squares = (of_others**2).T @ weighed  # Σ a², which is Σ ab
        n_items = ((of_others > 0.0).T.astype(np.float64) @ weighed).sum(axis=1)
        low[place], high[place] = _share_interval(
            level,
            parts=confusion[place],
            wholes=np.broadcast_to(confusion[place].sum(axis=1)[:, None], wide),
            squares=squares,
            products=squares,
            whole_squares=np.broadcast_to(squares.sum(axis=1)[:, None], wide),
            n_items=np.broadcast_to(n_items[:, None], wide),
        )
    rows = np.broadcast_to(confusion.sum(axis=2, keepdims=True), shape)
    return {
        "confusion": confusion.astype(np.int64),
        "shares": divide(confusion, rows),
        "share_low": low,
        "share_high": high,
    }


def _share_interval(
    level: float,
    *,
    parts: Floats,
    wholes: Floats,
    squares: Floats,
    products: Floats,
    whole_squares: Floats,
    n_items: Floats,
) -> tuple[Floats, Floats]:
    """Return Clopper and Pearson's intervals of shares at the effective size [1]."""
    # Takes sums over items of parts a of wholes b: Σ a, Σ b, Σ a², Σ ab, Σ b², and how
    # many items have b > 0; an array has one for each share
    # [1] Korn, E. L., Graubard, B. I. (1998). Confidence intervals for proportions with
    # small expected number of positive counts estimated from survey data. Survey
    # Methodology 24, 193-201.
    from scipy.special import betaincinv, stdtrit

    share = divide(parts, wholes)
    # Σa/Σb = s varies by Σ (a - s b)² / (Σb)², that of m single ones by s(1 - s)/m
    variance = divide(
        squares - 2.0 * share * products + share * share * whole_squares, wholes**2
    )
    varies = variance > 1e-12 * share * (1.0 - share)
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.where(varies, share * (1.0 - share) / variance, n_items)
        # the variance is known from the items: by t, not from as many single ones
        upper = 0.5 + 0.5 * level
        many = stdtrit(np.maximum(wholes - 1.0, 1.0), upper)
        few = stdtrit(np.maximum(n_items - 1.0, 1.0), upper)
        size = np.minimum(size * (many / few) ** 2, wholes)
        x = share * size
        low = betaincinv(np.maximum(x, 1e-300), size - x + 1.0, 1.0 - upper)
        high = betaincinv(x + 1.0, np.maximum(size - x, 1e-300), upper)
    low = np.where(share <= 0.0, 0.0, low)
    high = np.where(share >= 1.0, 1.0, high)
    none = np.isnan(share)
    return np.where(none, np.nan, low), np.where(none, np.nan, high)

"""Krippendorff's alpha: disagreement of pairable ratings against what chance gives."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from operator import mul
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement._counts import (
    CountedRatings,
    ItemTable,
    count_ratings,
    item_counts,
    take_counts,
)
from masrel.agreement._data import CodedRatings
from masrel.agreement._kernel import (
    NO_CHANCE,
    NO_PAIR,
    Floats,
    Kernel,
    check_population,
    divide,
    standard_error,
    undefined,
    weighted_disagreement,
)
from masrel.agreement._labels import Label
from masrel.agreement.influence import Linear
from masrel.agreement.metrics import Metric, metric_weights
from masrel.agreement.tally import SizeGroup
from masrel.agreement.weights import (
    WeightName,
    Weights,
    declared_weights,
)
from masrel.errors import ParameterError
from masrel.estimates import Estimate

__all__ = [
    "KRIPPENDORFF_KERNEL",
    "krippendorff_alpha",
    "krippendorff_alpha_from_counts",
]


def krippendorff_alpha(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike | None" = None,
    metric: Metric | None = None,
    population: int | None = None,
) -> Estimate:
    """Estimate Krippendorff's alpha from an item × rater table.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree, as for the other coefficients; see
        `declared_weights`. Identity unless `metric` is given.
    metric : {"nominal", "ordinal", "interval", "ratio"}, optional
        Krippendorff's own difference function instead of weights. His ordinal metric
        counts the ratings between two grades and is not the weights "ordinal".
    population : int, optional
        Items there are in all, for the finite-population correction.

    Returns
    -------
    Estimate
        The coefficient with its standard error over items with at least two
        ratings; `n_items` counts those. With the ordinal metric, which depends on
        the ratings, the error takes it as it was found.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If an option is none, both `weights` and `metric` are given, or they do not
        fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or all ratings are in one category;
        the value is then ``nan``.

    Notes
    -----
    Items with fewer than two ratings are left out altogether. Chance draws two
    ratings without replacement, so duplicating all items changes the value; with
    many items it tends to Fleiss' kappa.

    References
    ----------
    .. [1] Krippendorff, K. (2004). Content Analysis, 2nd ed., ch. 11.
    .. [2] Hayes, A. F., Krippendorff, K. (2007). Answering the call for a standard
       reliability measure for coding data. Communication Methods and Measures,
       1(1), 77-89. https://doi.org/10.1080/19312450709336664

    Examples
    --------
    Two raters agree on two items and differ on a third:

    >>> round(krippendorff_alpha([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.444
    """
    counted = count_ratings(ratings, categories)
    v = _disagreement(counted, weights, metric)
    return _estimate(counted, v, population)


def krippendorff_alpha_from_counts(
    counts: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike | None" = None,
    metric: Metric | None = None,
    population: int | None = None,
) -> Estimate:
    """Estimate Krippendorff's alpha from how many raters chose each category.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.
    categories, weights, metric, population : optional
        As of `krippendorff_alpha`; categories are 1 to n_categories unless given.

    Returns
    -------
    Estimate
        As of `krippendorff_alpha`; `n_raters` is the largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.
    ParameterError
        As `krippendorff_alpha`.

    Warns
    -----
    UndefinedStatisticWarning
        As `krippendorff_alpha`.

    Examples
    --------
    >>> round(krippendorff_alpha_from_counts([[2, 0], [0, 2], [1, 1]]).value, 3)
    0.444
    """
    counted = take_counts(counts, categories)
    v = _disagreement(counted, weights, metric)
    return _estimate(counted, v, population)


class _Sums(NamedTuple):
    # α = 1 - (n - 1) A / B over the n ratings of items that have at least two
    n_items: int
    n_ratings: int
    pairs: int  # multiple of every n_i - 1
    above: int  # A = Σ_i V_i / (n_i - 1), times `pairs`
    products: list[int]  # Σ_l v_kl n_l
    below: int  # B = Σ_kl v_kl n_k n_l

    @classmethod
    def of(cls, usable: list[SizeGroup], weights: Weights) -> "_Sums":
        size, n_items, totals, above = usable[0]
        pairs = size - 1
        for size, n_alike, of_size, apart in usable[1:]:
            common = math.lcm(pairs, size - 1)
            above = above * (common // pairs) + apart * (common // (size - 1))
            n_items, pairs = n_items + n_alike, common
            totals = [a + b for a, b in zip(totals, of_size, strict=True)]
        products = weights.products(totals)
        below = sum(map(mul, totals, products))
        return cls(n_items, sum(totals), pairs, above, products, below)

    def agreements(self, denominator: int) -> tuple[float, float]:
        """Return 1 - D_o and 1 - D_e, v_kl being over a denominator."""
        n, over = self.n_ratings, self.pairs * denominator
        over_e = n * (n - 1) * denominator
        return (n * over - self.above) / (n * over), (over_e - self.below) / over_e

    @property
    def alpha(self) -> float:
        """1 - D_o / D_e, in one division."""
        d_e = self.below * self.pairs
        return (d_e - (self.n_ratings - 1) * self.above) / d_e


def _estimate(counted: CountedRatings, v: Weights, population: int | None) -> Estimate:
    table = counted.items
    usable = [group for group in table.tally(v).groups if group.size > 1]
    found = _Sums.of(usable, v) if usable else None
    check_population(population, 0 if found is None else found.n_items)
    reason = None
    if found is None:
        reason = undefined("Krippendorff's alpha", NO_PAIR)
    elif v.reason is not None:
        reason = undefined("Krippendorff's alpha", v.reason)
    elif found.below == 0:
        reason = undefined("Krippendorff's alpha", NO_CHANCE)
    value = observed = chance = math.nan
    error: float | Callable[[], float] = math.nan
    if found is not None and v.reason is None:
        observed, chance = found.agreements(v.denominator)
        if reason is None:
            value = found.alpha
            error = partial(_error, table, v, found, population)
    return Estimate(
        coefficient="krippendorff_alpha",
        weights=v.name,
        value=value,
        standard_error=error,
        observed=observed,
        chance=chance,
        n_items=0 if found is None else found.n_items,
        n_raters=counted.n_raters,
        n_categories=table.n_categories,
        reason=reason,
    )


def _disagreement(
    counted: CountedRatings,
    weights: "WeightName | ArrayLike | None",
    metric: Metric | None,
) -> Weights:
    if metric is None:
        asked = "identity" if weights is None else weights
        return declared_weights(asked, counted.categories, declared=counted.declared)
    if weights is not None:
        raise ParameterError("weights, metric: needs one of them, got both")
    return metric_weights(metric, counted)


def _error(table: ItemTable, v: Weights, found: _Sums, population: int | None) -> float:
    # With Q = 1 - α = (n - 1) A / B, the influence of item i among m is
    #   -u_i = m Q [V_i / ((n_i - 1) A) + n_i / (n - 1) - 2 Σ_k h_k n_ik / B],
    # h_k = Σ_l v_kl n_l.
    m, n = found.n_items, found.n_ratings
    by_size = {
        size: (
            m * (n - 1) * (found.pairs // (size - 1)) * found.below,
            m * size * found.above * found.below,
            -2 * m * (n - 1) * found.above,
        )
        for size in table.sizes
        if size > 1
    }
    by_size[1] = (0, 0, 0)
    influence = Linear(
        by_size=by_size,
        slopes=found.products,
        denominator=found.pairs * found.below**2,
    )
    squares, over = table.square_sum(v, influence)
    return standard_error(squares, over, m, population)


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 1 + n_categories): V_i / (n_i - 1), and counts of items with a pair
    counts = item_counts(coded).astype(np.float64)
    counts[counts.sum(axis=1) < 2] = 0.0
    others = np.maximum(counts.sum(axis=1) - 1.0, 1.0)
    return np.column_stack([weighted_disagreement(counts, v) / others, counts])


def _value(sums: Floats, v: Floats) -> Floats:
    # sums (..., 1 + n_categories) -> (...)
    totals = sums[..., 1:]
    below = weighted_disagreement(totals, v)
    return 1.0 - divide((totals.sum(axis=-1) - 1.0) * sums[..., 0], below)


KRIPPENDORFF_KERNEL = Kernel(features=_features, value=_value)

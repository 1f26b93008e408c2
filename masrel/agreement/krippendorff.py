"""Krippendorff's alpha: disagreement of pairable ratings against what chance gives."""

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from operator import truediv
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement._count_tables import count_items
from masrel.agreement._counts import (
    CountedRatings,
    DistinctItems,
    SizeGroup,
    bilinear,
    count_ratings,
    item_counts,
)
from masrel.agreement._data import CodedRatings
from masrel.agreement._distances import Distances
from masrel.agreement._kernel import (
    Floats,
    Influence,
    Kernel,
    check_population,
    divide,
    weighted_disagreement,
)
from masrel.agreement._labels import Label
from masrel.agreement._many_grades import ItemsOfManyGrades, measurements
from masrel.agreement._metrics import Metric, metric_weights
from masrel.agreement._pooled import ratio_estimate
from masrel.agreement._weights import (
    MANY,
    ManyWeights,
    Weights,
    WeightsLike,
    declared_weights,
    named_weights,
)
from masrel.errors import ParameterError
from masrel.estimates import Estimate


def krippendorff_alpha(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = None,
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
    metric : {"nominal", "ordinal", "interval", "ratio", "jaccard", "masi"}, optional
        Krippendorff's own difference function instead of weights. His ordinal metric
        counts the ratings between two grades and is not the weights "ordinal". The last
        two are distances of sets: of ratings that are sets of labels, or text with
        semicolons between labels.
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
        If an option is invalid, both `weights` and `metric` are given, or they do not
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
    .. [3] Passonneau, R. (2006). Measuring agreement on set-valued items (MASI) for
       semantic and pragmatic annotation. LREC 2006.

    Examples
    --------
    Two raters agree on two items and differ on a third:

    >>> round(krippendorff_alpha([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.444
    """
    counted = None
    if type(ratings) is np.ndarray and ratings.size > _BLOCK:
        counted = measurements(ratings, categories, metric or weights)
    if counted is None:
        counted = count_ratings(ratings, categories)
    v = _disagreement(counted, weights, metric)
    return _estimate(counted, v, population)


def krippendorff_alpha_from_counts(
    counts: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = None,
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
    counted = count_items(counts, categories=categories)
    v = _disagreement(counted, weights, metric)
    return _estimate(counted, v, population)


_BLOCK = 1 << 14  # ratings from which on numbers that differ are taken as they are


class _Sums(NamedTuple):
    # whole numbers; floats by weights of many categories
    # α = 1 - (n - 1) A / B over the n ratings of items that have at least two
    n_items: int
    n_ratings: int
    multiple: int  # of every n_i - 1
    observed: Any  # A = Σ_i V_i / (n_i - 1), times `multiple`
    totals: Any  # ratings per category
    expected: Any  # B = Σ_kl v_kl n_k n_l


def _sums(usable: list[SizeGroup], v: Weights) -> _Sums:
    if len(usable) == 1:  # as a rule: everybody rated everything
        ((size, n_items, totals, observed),) = usable
        n_ratings, multiple = n_items * size, size - 1
    elif isinstance(v, ManyWeights):
        multiple = 1  # of floats
        observed = sum([group.disagreement / (group.size - 1) for group in usable])
        totals = sum([group.totals for group in usable], np.zeros(v.n_categories))
        n_items, n_ratings = sum(group.n_items for group in usable), int(totals.sum())
    else:
        multiple = math.lcm(*[group.size - 1 for group in usable])
        observed = sum(g.disagreement * (multiple // (g.size - 1)) for g in usable)
        totals = list(map(sum, zip(*[g.totals for g in usable], strict=True)))
        totals = totals or [0] * v.n_categories
        n_items, n_ratings = sum(group.n_items for group in usable), sum(totals)
    expected = bilinear(v, totals, totals)
    return _Sums(n_items, n_ratings, multiple, observed, totals, expected)


def _estimate(counted: CountedRatings, v: Weights, population: int | None) -> Estimate:
    usable = [group for group in counted.items.sums(v).groups if group.size > 1]
    sums = _sums(usable, v)
    n, w = sums.n_ratings, v.denominator
    if population is not None:
        check_population(population, sums.n_items)
    return ratio_estimate(
        "krippendorff_alpha",
        "Krippendorff's alpha",
        v,
        (sums.observed, n * sums.multiple * w),
        (sums.expected, n * (n - 1) * w),
        partial(_influence, counted.items, v, sums),
        population,
        sums.n_items,
        sums.n_items,
        counted.n_raters,
    )


def _influence(
    items: "DistinctItems | ItemsOfManyGrades", v: Weights, sums: _Sums, exact: bool
) -> Influence:
    # With Q = 1 - α = (n - 1) A / B, the influence of item i among m is
    #   u_i = m Q [2 Σ_k h_k n_ik / B - V_i / ((n_i - 1) A) - n_i / (n - 1)],
    # h_k = Σ_l v_kl n_l.
    exact = exact and isinstance(items, DistinctItems) and v.is_exact
    divide: Callable[[int, int], Any] = Fraction if exact else truediv
    m, n, w = sums.n_items, sums.n_ratings, v.denominator
    counts, freq, size, disagreement = items.arrays(v, exact)
    if not isinstance(size, float) and (single := size < 2).any():
        counts, freq, size = counts[~single], freq[~single], size[~single]
        disagreement = disagreement[~single]
    q = divide((n - 1) * sums.observed, sums.multiple * sums.expected)
    totals = np.array(sums.totals, dtype=object if exact else np.float64)
    if v.n_categories > MANY:
        between = v.dot(totals, exact=exact)
    else:
        between = (v.fractions if exact else v.floats).dot(totals)
    h = between * (2 * q * divide(w, sums.expected))
    terms = disagreement * (-m * divide((n - 1) * w, sums.expected) / (size - 1))
    u = counts.dot(m * h - m * q * divide(1, n - 1)) + terms
    return Influence(u, freq, terms)


def _disagreement(
    counted: CountedRatings,
    weights: "WeightsLike",
    metric: Metric | None,
) -> Weights:
    if metric is None:
        weights = "identity" if weights is None else weights
        # made once for a scale
        if isinstance(weights, str) and counted.items.n_categories <= MANY:
            return named_weights(weights, counted.categories, counted.declared)
        return declared_weights(weights, counted.categories, declared=counted.declared)
    if weights is not None:
        raise ParameterError("weights, metric: needs one of them, got both")
    return metric_weights(metric, counted)


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 1 + n_categories): V_i / (n_i - 1), and counts of items with a pair; of
    # many grades the number of ratings and sums of points in place of counts
    if isinstance(v, Distances):
        codes = coded.codes
        size = (codes >= 0).sum(axis=1)
        terms = v.of_items(codes) / np.maximum(size - 1, 1)
        features = np.column_stack([terms, size, v.moments(codes)]).astype(np.float64)
        features[size < 2] = 0.0
        return features
    counts = item_counts(coded).astype(np.float64)
    counts[counts.sum(axis=1) < 2] = 0.0
    others = np.maximum(counts.sum(axis=1) - 1.0, 1.0)
    return np.column_stack([weighted_disagreement(counts, v) / others, counts])


def _value(sums: Floats, v: Floats) -> Floats:
    # sums (..., 1 + n_categories) -> (...)
    if isinstance(v, Distances):
        n, moments = sums[..., 1], sums[..., 2:]
        expected = v.between_moments(moments, n)
        return 1.0 - divide((n - 1.0) * sums[..., 0], expected)
    totals = sums[..., 1:]
    expected = weighted_disagreement(totals, v)
    return 1.0 - divide((totals.sum(axis=-1) - 1.0) * sums[..., 0], expected)


_KERNEL = Kernel(features=_features, value=_value, takes_many=True)

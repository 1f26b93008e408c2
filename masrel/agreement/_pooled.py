"""Coefficients of unnamed raters: 1 - D_o / D_e, and the error and kernel of each.

D_o is the observed disagreement of two raters of an item, averaged over items, and D_e
what chance would give. Coefficients differ in D_e alone: it is `Chance`, in integers
for the value and in floats for errors and intervals.
"""

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from operator import truediv
from typing import Any, NamedTuple

import numpy as np

from masrel.agreement._counts import (
    DistinctItems,
    SufficientStatistics,
    bilinear,
    count_ratings,
    item_counts,
)
from masrel.agreement._data import CodedRatings
from masrel.agreement._distances import Distances
from masrel.agreement._kernel import (
    NO_PAIR,
    VARIANCES,
    CrossedSums,
    Floats,
    Influence,
    Integers,
    Kernel,
    RaterSums,
    Variance,
    check_population,
    check_variance,
    divide,
    standard_error,
    undefined,
    weighted_disagreement,
)
from masrel.agreement._labels import Codes, Label
from masrel.agreement._many_grades import ItemsOfManyGrades, measurements
from masrel.agreement._weights import (
    MANY,
    Weights,
    WeightsLike,
    declared_weights,
    identity_weights,
    named_weights,
)
from masrel.estimates import Estimate

_BLOCK = 1 << 14  # items whose categories are spread out at once


class Chance(NamedTuple):
    """Chance disagreement, D_e = (constant + factor · Σ_kl v_kl p_k p_l) / divisor."""

    constant: Any
    factor: Any
    divisor: Any


class PooledCoefficient(NamedTuple):
    """What tells coefficients of unnamed raters apart."""

    # name, title: in code and for a reader
    name: str
    title: str
    # the number of categories q, T = Σ_kl v_kl times the denominator w of the weights,
    # which many categories take long to add up, and w, to D_e: in integers, or in
    # floats with w = 1
    chance: Callable[[int, Callable[[], Any], Any], Chance]
    # whether chance counts any two categories as different, whatever the weights
    nominal: bool = False


def _nothing(_q: int, _total: Callable[[], Any], _w: Any) -> Chance:
    return Chance(1, 0, 1)  # 1 - D_o / 1: what is observed, as it is


def _shared_margins(_q: int, _total: Callable[[], Any], _w: Any) -> Chance:
    return Chance(0, 1, 1)  # Σ_kl v_kl p_k p_l, 1 - P̄_e of Fleiss (1971)


def _every_category_alike(q: int, total: Callable[[], Any], w: Any) -> Chance:
    return Chance(total(), 0, q * q * w)  # 1 - Σ_kl w_kl / q² = Σ_kl v_kl / q²


def _hard_items(q: int, total: Callable[[], Any], w: Any) -> Chance:
    # 1 - p_e with p_e = T_w / (q (q - 1)) Σ_k p_k (1 - p_k), T_w = Σ_kl w_kl
    if q == 1:
        return Chance(0, 0, 1)  # one category leaves no room for chance: 0/0
    divisor = q * (q - 1) * w
    return Chance(divisor, total() - q * q * w, divisor)


PERCENT = PooledCoefficient("percent_agreement", "percent agreement", _nothing)
FLEISS = PooledCoefficient("fleiss_kappa", "Fleiss' kappa", _shared_margins)
SCOTT = PooledCoefficient("scott_pi", "Scott's pi", _shared_margins)
BRENNAN_PREDIGER = PooledCoefficient(
    "brennan_prediger", "the Brennan-Prediger coefficient", _every_category_alike
)
GWET = PooledCoefficient("gwet_ac", "Gwet's AC", _hard_items, nominal=True)


def estimate_pooled(
    coefficient: PooledCoefficient,
    ratings: object,
    categories: Sequence[Label] | None,
    weights: "WeightsLike",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Check ratings and options, and estimate 1 - D_o / D_e with one division."""
    counted = None
    if type(ratings) is np.ndarray and ratings.size > _BLOCK:
        counted = measurements(ratings, categories, weights)
    if counted is None:
        counted = count_ratings(ratings, categories)
    # made once for a scale
    if isinstance(weights, str) and counted.items.n_categories <= MANY:
        v = named_weights(weights, counted.categories, counted.declared)
    else:
        v = declared_weights(weights, counted.categories, declared=counted.declared)
    sums = counted.items.sums(v)
    if variance not in VARIANCES or population is not None:
        check_variance(variance)
        check_population(population, sums.n_rated)
    p, total = sums.marginals, sums.total
    q = counted.items.n_categories
    d_e, factor, over_e = coefficient.chance(q, lambda: v.total, v.denominator)
    if factor:
        of_chance = identity_weights(q) if coefficient.nominal else v
        scale = total * total * of_chance.denominator
        d_e = d_e * scale + factor * bilinear(of_chance, p, p)
        over_e *= scale
    irrcac = variance == "irrcac"
    return ratio_estimate(
        coefficient.name,
        coefficient.title,
        v,
        (sums.observed, sums.denominator * v.denominator),
        (d_e, over_e),
        partial(_influence, coefficient, counted.items, sums, v, (d_e, over_e), irrcac),
        population,
        sums.n_rated,
        sums.n_usable,
        counted.n_raters,
    )


def ratio_estimate(
    name: str,
    title: str,
    v: Weights,
    observed: tuple[int, int],
    expected: tuple[int, int],
    influence: Callable[[bool], Influence],
    population: int | None,
    n_items: int,
    n_items_paired: int,
    n_raters: int,
    reason: str | None = None,
    n_sampled: int | None = None,
) -> Estimate:
    """Make 1 - D_o / D_e of two fractions, with one division, or say why not."""
    # observed, expected: D_o and D_e as numerator and denominator, 0/0 without a pair
    (d_o, over_o), (d_e, over_e) = observed, expected
    value = p_o = p_e = math.nan
    error: float | Callable[[], float] = math.nan
    if over_o == 0:
        reason = NO_PAIR
    elif v.reason is not None:
        reason = v.reason
    else:
        p_o, p_e = (over_o - d_o) / over_o, (over_e - d_e) / over_e
        if reason is None and d_e == 0:
            reason = v.no_chance
    if reason is not None:
        undefined(title, reason)
    else:
        value = (d_e * over_o - d_o * over_e) / (d_e * over_o)
        error = partial(standard_error, influence, n_sampled or n_items, population)
    return Estimate(
        coefficient=name,
        weights=v.name,
        value=value,
        standard_error=error,
        observed=p_o,
        chance=p_e,
        n_items=n_items,
        n_items_paired=n_items_paired,
        n_raters=n_raters,
        n_categories=v.n_categories,
        reason=reason,
    )


def _influence(
    coefficient: PooledCoefficient,
    items: "DistinctItems | ItemsOfManyGrades",
    sums: SufficientStatistics,
    v: Weights,
    expected: tuple[int, int],
    irrcac: bool,
    exact: bool,
) -> Influence:
    # With d_i an item's disagreement, s_i = 1 if it has a pair, x_ik its shares and
    # h_k = ∂D_e/∂p_k,
    #   D_e u_i = (D_o/D_e) Σ_k h_k (x_ik - p_k) - (n/n') (d_i - D_o s_i).
    d_e, over_e = expected
    exact = exact and isinstance(items, DistinctItems) and v.is_exact
    divide: Callable[[int, int], Any] = Fraction if exact else truediv
    counts, freq, size, disagreement = items.arrays(v, exact)
    rate, inverse = divide(sums.n_rated, sums.n_usable), divide(over_e, d_e)
    ratio = divide(sums.observed * over_e, d_e * sums.denominator * v.denominator)
    pairs = size * (size - 1)
    if sums.n_usable < sums.n_rated:  # a single rating has no disagreement
        pairs = np.maximum(pairs, 1)
    terms = disagreement * (-rate * inverse / pairs)
    u = terms
    if sums.n_usable < sums.n_rated:
        # irrCAC takes u_i + κ (s_i n/n' - 1): an item without a pair counts as one
        # with a κ of 0.
        u = u + (size > 1) * (rate * (1 if irrcac else ratio))
    q = len(sums.marginals)
    _, factor, divisor = coefficient.chance(q, lambda: v.total, v.denominator)
    if factor:
        if isinstance(sums.marginals, np.ndarray):
            p = sums.marginals / sums.total
        else:
            p = np.array([divide(part, sums.total) for part in sums.marginals])
        of_chance = identity_weights(q) if coefficient.nominal else v
        if q > MANY:
            others = of_chance.dot(p, exact=exact)
        elif exact and of_chance.numerators is None:
            others = p.sum() - p
        else:
            others = (of_chance.fractions if exact else of_chance.floats).dot(p)
        slopes = others * (2 * divide(factor, divisor) * ratio * inverse)
        u = u + (_sparse_dot(counts, slopes) if exact else counts.dot(slopes)) / size
    return Influence(u - freq.dot(u) / sums.n_rated, freq, terms)


def _sparse_dot(counts: Any, slopes: Any) -> Any:
    # the same as `dot`, for whole numbers most of which are 0, and fractions
    item, category = np.nonzero(counts)
    sums = np.zeros(len(counts), dtype=object)
    np.add.at(sums, item, counts[item, category] * slopes[category])
    return sums


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 3 + n_categories): disagreement of two ratings of an item, whether it
    # has two, whether it has one, shares of the categories
    if isinstance(v, Distances):
        return _features_of_many(coded, v)
    counts = item_counts(coded).astype(np.float64)
    n = counts.sum(axis=1)
    features = np.empty((len(counts), 3 + counts.shape[1]))
    # a single rating, or none, has no disagreement
    features[:, 0] = weighted_disagreement(counts, v) / np.maximum(n * (n - 1), 1.0)
    features[:, 1] = n > 1
    features[:, 2] = n > 0
    features[:, 3:] = counts / np.maximum(n, 1.0)[:, None]
    return features


def _features_of_many(coded: CodedRatings, v: Distances) -> Floats:
    # the same; means of points and of their squares in place of shares, where v is
    # made of points
    n = (coded.codes >= 0).sum(axis=1)
    disagreement = v.of_items(coded.codes) / np.maximum(n * (n - 1), 1)
    means = v.moments(coded.codes) / np.maximum(n, 1)[:, None]
    return np.column_stack([disagreement, n > 1, n > 0, means])


def pooled_kernel(coefficient: PooledCoefficient) -> Kernel:
    """Return a coefficient of unnamed raters as a function of sums over items."""

    def value(sums: Floats, v: Floats) -> Floats:
        if not len(v):  # nobody rated anything
            return np.full(sums.shape[:-1], np.nan)
        observed = divide(sums[..., 0], sums[..., 1])
        constant, factor, divisor = coefficient.chance(len(v), v.sum, 1.0)
        if factor == 0:
            return 1.0 - divide(observed, np.asarray(constant / divisor))
        # One category has a share of exactly 1, and so a disagreement of exactly 0.
        shares = divide(sums[..., 3:], sums[..., 2:3])
        if isinstance(v, Distances):
            between = v.between_moments(shares)
        elif coefficient.nominal:
            between = (shares * (1.0 - shares)).sum(axis=-1)
        else:
            between = weighted_disagreement(shares, v)
        expected = constant / divisor + factor / divisor * between
        return 1.0 - divide(observed, expected)

    return Kernel(
        features=_features,
        value=value,
        rater_sums=resampled_raters,
        crossed_sums=crossed_sums,
        takes_many=not coefficient.nominal,
    )


def complete_kernel(coefficient: PooledCoefficient) -> Kernel:
    """Return the kernel of a coefficient of the items that every rater rated."""
    kernel = pooled_kernel(coefficient)

    def features(coded: CodedRatings, v: Floats) -> Floats:
        every = kernel.features(coded, v)
        every[(coded.codes < 0).any(axis=1)] = 0.0
        return every

    return Kernel(features=features, value=kernel.value, takes_many=True)


def resampled_raters(coded: CodedRatings, freq: Integers, v: Floats) -> RaterSums:
    """Return sums of features as a function of how often each rater is taken."""
    # Items that the same raters rated are summed once, pair of raters by pair: Σ_i v of
    # their categories is a quadratic form in how often each rater is taken.
    patterns, kind = np.unique(coded.codes >= 0, axis=0, return_inverse=True)
    groups = [
        (rated.astype(np.float64), *_rater_pairs(coded.codes[same], freq[same], v))
        for rated, same in zip(
            patterns, kind.ravel() == np.arange(len(patterns))[:, None], strict=True
        )
    ]

    def sums(taken: Floats) -> Floats:
        # (..., n_raters) -> (..., 3 + n_categories)
        total = np.zeros((*taken.shape[:-1], 3 + len(v)), dtype=taken.dtype)
        for rated, n_items, disagreement, chosen in groups:
            of = taken * rated
            n = of.sum(axis=-1)
            # Pairs of a rater with its own copies always agree: they are left out.
            pairs = n * n - (of * of).sum(axis=-1)
            total[..., 0] += over((of @ disagreement * of).sum(axis=-1), pairs)
            total[..., 1] += n_items * (pairs != 0)
            total[..., 2] += n_items * (n != 0)  # raters who rated none add nothing
            total[..., 3:] += over(of @ chosen, n[..., None])
        return total

    return sums


def crossed_sums(coded: CodedRatings, v: Floats) -> CrossedSums:
    """Return the same as a function of how often each row and each rater is taken."""
    each = (coded.codes[:, :, None] == np.arange(len(v))).astype(np.float64)
    rated = (coded.codes >= 0).astype(np.float64)  # (n_rows, n_raters)

    def sums(rows: Floats, raters: Floats) -> Floats:
        # (n, n_rows), (n, n_raters) -> (n, 3 + n_categories)
        counts = np.tensordot(raters, each, axes=(1, 1))  # (n, n_rows, n_categories)
        n = counts.sum(axis=-1)
        # Copies of a rater agree, and disagree in nothing: only their number goes.
        pairs = n * n - raters**2 @ rated.T
        features = np.empty((*n.shape, 3 + len(v)))
        features[..., 0] = over(weighted_disagreement(counts, v), pairs)
        features[..., 1] = pairs != 0
        features[..., 2] = n != 0
        features[..., 3:] = over(counts, n[..., None])
        return np.asarray(np.einsum("np,npf->nf", rows, features))

    return sums


def _rater_pairs(codes: Codes, freq: Integers, v: Floats) -> tuple[int, Floats, Floats]:
    # how many items; Σ_i v of two raters' categories, (n_raters, n_raters); how often
    # each rater chose each category, (n_raters, n_categories)
    n_items, n_raters = codes.shape
    side = (n_raters, len(v))
    both = np.zeros(side * 2)
    chosen = np.zeros(side)
    for start in range(0, n_items, _BLOCK):
        block = slice(start, start + _BLOCK)
        each = (codes[block, :, None] == np.arange(len(v))).astype(np.float64)
        weighed = each * freq[block, None, None]
        flat = weighed.reshape(len(each), -1).T @ each.reshape(len(each), -1)
        both += flat.reshape(side * 2)
        chosen += weighed.sum(axis=0)
    return int(freq.sum()), np.einsum("rksl,kl->rs", both, v), chosen


def over(numerator: Floats, denominator: Floats) -> Floats:
    """Divide, with 0 where there is nothing to divide by."""
    empty = denominator == 0
    return np.where(empty, 0.0, numerator) / np.where(empty, 1.0, denominator)

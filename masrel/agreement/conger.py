"""Conger's kappa: Cohen's kappa for two or more raters, each with its own margins."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from masrel.agreement._counts import (
    DistinctItems,
    bilinear,
    count_ratings,
    distinct_rows,
    item_counts,
)
from masrel.agreement._data import CodedRatings, code_ratings, raters_who_rate
from masrel.agreement._kernel import (
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
    weighted_disagreement,
)
from masrel.agreement._labels import Label
from masrel.agreement._many_grades import ItemsOfManyGrades
from masrel.agreement._pooled import (
    crossed_sums,
    over,
    ratio_estimate,
    resampled_raters,
)
from masrel.agreement._weights import (
    ManyWeights,
    Weights,
    WeightsLike,
    declared_weights,
)
from masrel.estimates import Estimate


def conger_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate Conger's kappa from an item × rater table.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.
    variance : {"delta", "irrcac"}, optional
        Which standard error; irrCAC's is too large with single ratings.
    population : int, optional
        Items there are in all, for the finite-population correction.

    Returns
    -------
    Estimate
        The coefficient with its standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or all ratings are in one category; the
        value is then ``nan``.

    Notes
    -----
    Chance agreement is that of two different raters, averaged over all pairs, each
    with the shares of its own ratings. Of two raters with complete ratings it is
    Cohen's kappa. A rater without any rating has no shares, and is left out.

    References
    ----------
    .. [1] Conger, A. J. (1980). Integration and generalization of kappas for multiple
       raters. Psychological Bulletin, 88(2), 322-328.
       https://doi.org/10.1037/0033-2909.88.2.322
    .. [2] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 2.

    Examples
    --------
    >>> conger_kappa([["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]).value
    0.5
    """
    coded = raters_who_rate(code_ratings(ratings, categories))
    v = declared_weights(weights, coded.categories, declared=coded.declared)
    check_variance(variance)
    check_population(population, coded.n_items)
    items = count_ratings(coded).items
    sums = items.sums(v)
    margins = _Margins.of(coded, v)
    influence = partial(_influence, coded, items, v, margins)
    if sums.n_usable and margins.numerator:
        d_o, over_o = sums.observed, sums.denominator * v.denominator
        d_e, over_e = margins.numerator, margins.denominator
        ratio = Fraction(d_o * over_e) / Fraction(d_e * over_o)
        rate = Fraction(coded.n_items, sums.n_usable)
        influence = partial(influence, ratio, rate, variance == "irrcac")
    return ratio_estimate(
        "conger_kappa",
        "Conger's kappa",
        v,
        (sums.observed, sums.denominator * v.denominator),
        (margins.numerator, margins.denominator),
        influence,
        population,
        n_items=coded.n_items,
        n_items_paired=sums.n_usable,
        n_raters=coded.n_raters,
    )


@dataclass(frozen=True, slots=True)
class _Margins:
    # chance disagreement, D_e = Σ_{g≠h} Σ_kl v_kl p_gk p_hl / (r (r - 1)), in integers,
    # of the r raters who rated anything
    counts: list[list[int]]  # (n_raters, n_categories)
    n_ratings: list[int]  # how many each, n_g
    numerator: Any  # a float by weights of many categories
    denominator: int

    @classmethod
    def of(cls, coded: CodedRatings, v: Weights) -> "_Margins":
        q = coded.n_categories
        counts = [
            np.bincount(column[column >= 0], minlength=q).tolist()
            for column in coded.codes.T
        ]
        n_ratings = list(map(sum, counts))
        if isinstance(v, ManyWeights):
            return cls._of_many(counts, n_ratings, v)
        multiple = math.lcm(*filter(None, n_ratings))
        shares = [
            [n * (multiple // n_g) for n in row]
            for row, n_g in zip(counts, n_ratings, strict=True)
            if n_g
        ]
        total = list(map(sum, zip(*shares, strict=True))) or [0] * q
        # all pairs of raters, less each rater with itself
        numerator = bilinear(v, total, total) - sum(bilinear(v, p, p) for p in shares)
        r = len(shares)
        denominator = max(r * (r - 1), 1) * multiple**2 * v.denominator
        return cls(counts, n_ratings, numerator, denominator)

    @classmethod
    def _of_many(
        cls, counts: list[list[int]], n_ratings: list[int], v: Weights
    ) -> "_Margins":
        shares = [
            np.array(row) / n for row, n in zip(counts, n_ratings, strict=True) if n
        ]
        total: Any = sum(shares, np.zeros(v.n_categories))
        of_each = sum(bilinear(v, p, p) for p in shares)  # type: ignore[arg-type]
        r = len(shares)
        numerator = bilinear(v, total, total) - of_each
        return cls(counts, n_ratings, numerator, max(r * (r - 1), 1))


def _influence(
    coded: CodedRatings,
    items: "DistinctItems | ItemsOfManyGrades",
    v: Weights,
    margins: _Margins,
    ratio: Any,
    rate: Any,
    irrcac: bool,
    exact: bool,
) -> Influence:
    # With d_i an item's disagreement and s_i = 1 if it has a pair,
    #   D_e u_i = (D_o/D_e) Σ_g moves_g - (n/n') (d_i - D_o s_i).
    # A rating of k by rater g moves D_e by 2 (h_gk - Σ_l p_gl h_gl) / (r (r - 1) n_g),
    # h_gk = Σ_l v_kl Σ_{h≠g} p_hl.
    is_many = not isinstance(items, DistinctItems)
    exact = exact and not is_many
    number: Callable[[Fraction], Any] = Fraction if exact else float
    dtype = object if exact else np.float64
    inverse = number(margins.denominator / Fraction(margins.numerator))
    ratio, rate = number(ratio), number(rate)
    matrix: Any
    if is_many:
        rows, matrix = coded.codes[(coded.codes >= 0).any(axis=1)], v.operator
        _, freq, size, disagreement = items.arrays(v, False)
    else:
        rows, freq = distinct_rows(coded.codes, coded.n_categories)
        matrix, rated = v.fractions if exact else v.floats, (rows >= 0).any(axis=1)
        rows, freq = rows[rated], freq[rated].astype(dtype)
        counts = item_counts(replace(coded, codes=rows)).astype(dtype)
        size = counts.sum(axis=1)
        disagreement = ((counts @ matrix) * counts).sum(axis=1)
    terms = disagreement * (rate * inverse / np.maximum(size * (size - 1), 1))
    # irrCAC takes u_i + κ (s_i n/n' - 1)
    u = (size > 1) * (rate * (1 if irrcac else ratio)) - terms
    if irrcac:
        u = u + (ratio - 1)
    once = np.array([number(Fraction(1, n)) for n in margins.n_ratings])[:, None]
    p = np.array(margins.counts, dtype) * once
    h = (p.sum(axis=0) - p) @ matrix
    moves = (h - (p * h).sum(axis=1, keepdims=True)) * once
    r = len(p)
    moves = moves * (ratio * inverse * number(Fraction(2 * coded.n_items, r * (r - 1))))
    for column, of_g in zip(rows.T, moves, strict=True):
        u = u + np.append(of_g, 0)[column]  # missing, -1, is the last
    return Influence(u, freq, terms)


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 2 + n_raters (1 + n_categories)): disagreement, whether it has a pair,
    # then for each rater whether it rated and the category
    counts = item_counts(coded).astype(np.float64)
    size = counts.sum(axis=1)
    pairs = np.where(size > 1, size * (size - 1), 1.0)
    disagreement = np.where(size > 1, weighted_disagreement(counts, v), 0.0) / pairs
    parts = [disagreement, size > 1]
    for column in coded.codes.T:
        parts += [column >= 0, column[:, None] == np.arange(len(v))]
    return np.column_stack(parts).astype(np.float64)


def _value(sums: Floats, v: Floats) -> Floats:
    # sums (..., 2 + n_raters (1 + n_categories)) -> (...)
    observed = divide(sums[..., 0], sums[..., 1])
    of_raters = sums[..., 2:].reshape(*sums.shape[:-1], -1, 1 + len(v))
    chosen, n_ratings = of_raters[..., 1:], of_raters[..., 0]
    # A rater without any rating has no shares; where raters are resampled, one who is
    # taken c_g times has those of c_g, and c_g c_h pairs with each other rater.
    taken = over(chosen.sum(axis=-1), n_ratings)
    shares = over(chosen, n_ratings[..., None])
    total = shares.sum(axis=-2)
    others = total[..., None, :] - shares
    expected = ((others @ v) * shares).sum(axis=(-1, -2))
    n_pairs = taken.sum(axis=-1) ** 2 - (taken**2).sum(axis=-1)
    return 1.0 - divide(observed, divide(expected, n_pairs))


def _resampled_raters(coded: CodedRatings, freq: Integers, v: Floats) -> RaterSums:
    pooled, n_ratings, chosen = resampled_raters(coded, freq, v), *_marginals(coded, v)

    def sums(taken: Floats) -> Floats:
        # (..., n_raters) -> (..., 2 + n_raters (1 + n_categories))
        of_raters = taken[..., None] * (freq @ chosen).reshape(n_ratings.shape[1], -1)
        n = np.broadcast_to(freq @ n_ratings, taken.shape)
        return _joined(pooled(taken), n, of_raters)

    return sums


def _crossed_sums(coded: CodedRatings, v: Floats) -> CrossedSums:
    pooled, n_ratings, chosen = crossed_sums(coded, v), *_marginals(coded, v)

    def sums(rows: Floats, raters: Floats) -> Floats:
        # (n, n_rows), (n, n_raters) -> (n, 2 + n_raters (1 + n_categories))
        of_raters = raters[..., None] * (rows @ chosen).reshape(*raters.shape, -1)
        return _joined(pooled(rows, raters), rows @ n_ratings, of_raters)

    return sums


def _marginals(coded: CodedRatings, v: Floats) -> tuple[Floats, Floats]:
    # whether each rater rated, (n_rows, n_raters), and which category each chose,
    # (n_rows, n_raters n_categories)
    chosen = coded.codes[:, :, None] == np.arange(len(v))
    rated = coded.codes >= 0
    return rated.astype(np.float64), chosen.reshape(
        len(rated), rated.shape[1] * len(v)
    ).astype(np.float64)


def _joined(pooled: Floats, n_ratings: Floats, chosen: Floats) -> Floats:
    # Sums of `_features` from those of a coefficient that tells no raters apart. Takes
    # pooled (..., 3 + n_categories), n_ratings (..., n_raters), chosen of each rater
    of_raters = np.concatenate([n_ratings[..., None], chosen], axis=-1)
    flat = of_raters.reshape(*pooled.shape[:-1], -1)
    return np.concatenate((pooled[..., :2], flat), axis=-1)


_KERNEL = Kernel(
    features=_features,
    value=_value,
    rater_sums=_resampled_raters,
    crossed_sums=_crossed_sums,
)

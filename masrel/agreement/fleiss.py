"""Fleiss' kappa: agreement of two or more raters on nominal categories."""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import CodedRatings, Label, code_ratings
from masrel.agreement.counts import check_counts, distinct_rows, item_counts
from masrel.agreement.kernel import Floats, Kernel, divide
from masrel.agreement.percent import (
    item_agreement,
    observed_agreement,
    pairs_without_self,
)
from masrel.agreement.undefined import defined, kappa, ratio
from masrel.estimates import Estimate

__all__ = ["FLEISS_KERNEL", "fleiss_kappa", "fleiss_kappa_from_counts"]


def fleiss_kappa(
    ratings: object, *, categories: Sequence[Label] | None = None
) -> Estimate:
    """Estimate Fleiss' kappa from an item × rater table.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    Estimate
        The coefficient, with its delta-method standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or all ratings are in one category;
        the value is then ``nan``.

    Notes
    -----
    With missing ratings, agreement is averaged over items with at least two
    ratings, and a category's share is the mean over items with any rating of the
    share of the item's raters who chose it (Gwet's convention).

    References
    ----------
    .. [1] Fleiss, J. L. (1971). Measuring nominal scale agreement among many
       raters. Psychological Bulletin, 76(5), 378-382.
       https://doi.org/10.1037/h0031619
    .. [2] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed.

    Examples
    --------
    Two raters agree on two items and differ on a third:

    >>> round(fleiss_kappa([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    """
    coded = code_ratings(ratings, categories)
    return _estimate(item_counts(coded), coded.n_raters)


def fleiss_kappa_from_counts(counts: ArrayLike) -> Estimate:
    """Estimate Fleiss' kappa from how many raters chose each category.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.

    Returns
    -------
    Estimate
        As of `fleiss_kappa`; `n_raters` is the largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        As `fleiss_kappa`.

    Examples
    --------
    >>> round(fleiss_kappa_from_counts([[2, 0], [0, 2], [1, 1]]).value, 3)
    0.333
    """
    table = check_counts(counts)
    return _estimate(table, int(table.sum(axis=1).max()))


def _estimate(counts: NDArray[np.int64], n_raters: int) -> Estimate:
    # shape of counts: (n_items, n_categories)
    observed = observed_agreement(counts)  # P-bar in [1]
    shares = _category_shares(counts)
    chance = sum((p * p for p in shares), Fraction(0)) if shares else None
    value = kappa(observed, chance)
    return Estimate(
        coefficient="fleiss_kappa",
        weights="identity",
        value=ratio(value),
        standard_error=_standard_error(counts, shares, observed, value),
        observed=ratio(observed),
        chance=ratio(chance),
        n_items=int((counts.sum(axis=1) > 0).sum()),
        n_raters=n_raters,
        n_categories=counts.shape[1],
        reason=defined("Fleiss' kappa", observed, chance),
    )


def _category_shares(counts: NDArray[np.int64]) -> list[Fraction]:
    # p_j in [1]: mean over rated items of n_ij / n_i; empty without any rating
    chosen: dict[int, list[int]] = {}  # raters of an item -> ratings per category
    n_rated = 0
    for row, times in distinct_rows(counts):
        n = sum(row)
        if n > 0:
            totals = chosen.setdefault(n, [0] * len(row))
            for k, count in enumerate(row):
                totals[k] += times * count
            n_rated += times
    if n_rated == 0:
        return []
    return [
        sum((Fraction(totals[k], n) for n, totals in chosen.items()), Fraction(0))
        / n_rated
        for k in range(counts.shape[1])
    ]


def _standard_error(
    counts: NDArray[np.int64],
    shares: list[Fraction],
    observed: Fraction | None,
    value: Fraction | None,
) -> float:
    counts = counts[counts.sum(axis=1) > 0]
    n_items = counts.shape[0]
    if n_items < 2 or observed is None or value is None:
        return math.nan
    p = np.array([float(share) for share in shares])
    chance = sum((share * share for share in shares), Fraction(0))
    agreement, usable = item_agreement(counts)
    # Influence of an item on P-bar, a ratio of two means, and on P-bar_e.
    on_observed = usable * (agreement - float(observed)) / usable.mean()
    item_shares = counts / counts.sum(axis=1, keepdims=True)
    on_chance = 2 * (item_shares @ p - float(chance))
    # d kappa = (d P-bar - (1 - kappa) d P-bar_e) / (1 - P-bar_e)
    influence = on_observed - float(1 - value) * on_chance
    influence /= float(1 - chance)
    return float(np.sqrt((influence**2).sum() / (n_items * (n_items - 1))))


def _features(coded: CodedRatings) -> Floats:
    # (n_items, 3 + n_categories): agreement, usable, rated, shares of categories
    counts = item_counts(coded)
    agreement, usable = item_agreement(counts)
    n = counts.sum(axis=1)
    shares = np.where(n[:, None] > 0, counts / np.maximum(n, 1)[:, None], 0.0)
    return np.column_stack([agreement, usable, (n > 0).astype(np.float64), shares])


def _value(sums: Floats, n_categories: int) -> Floats:
    # sums (..., 3 + n_categories) -> (...)
    observed = divide(sums[..., 0], sums[..., 1])
    rated = sums[..., 2]
    shares = sums[..., 3 : 3 + n_categories]
    # 1 - P-bar_e over one denominator, so that one category gives exactly 0.
    disagreement = rated**2 - (shares**2).sum(axis=-1)
    chance = divide((shares**2).sum(axis=-1), rated**2)
    return divide(observed - chance, np.where(disagreement > 0, 1 - chance, 0.0))


def _rater_sums(coded: CodedRatings, times: Floats) -> Floats:
    # times (n_resamples, n_raters) -> (n_resamples, 3 + n_categories)
    agreement, usable, taken = pairs_without_self(coded, times)
    n = taken.sum(axis=-1)  # (n_resamples, n_items)
    shares = np.where(n[..., None] > 0, taken / np.maximum(n, 1)[..., None], 0.0)
    heads = [agreement.sum(axis=-1), usable.sum(axis=-1), (n > 0).sum(axis=-1)]
    return np.column_stack([*heads, shares.sum(axis=-2)]).astype(np.float64)


FLEISS_KERNEL = Kernel(features=_features, value=_value, rater_sums=_rater_sums)

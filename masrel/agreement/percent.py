"""Percent agreement: how often two raters of an item agree, not corrected."""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import CodedRatings, Label, code_ratings
from masrel.agreement.counts import check_counts, distinct_rows, item_counts
from masrel.agreement.kernel import Floats, Kernel, divide
from masrel.agreement.undefined import defined, ratio
from masrel.estimates import Estimate

__all__ = [
    "PERCENT_KERNEL",
    "item_agreement",
    "observed_agreement",
    "pairs_without_self",
    "percent_agreement",
    "percent_agreement_from_counts",
]


def percent_agreement(
    ratings: object, *, categories: Sequence[Label] | None = None
) -> Estimate:
    """Estimate how often two raters of the same item agree.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    Estimate
        The proportion, with its delta-method standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters; the value is then ``nan``.

    Notes
    -----
    Items with fewer than two ratings say nothing about agreement and are left out
    of the mean; they count in the standard error, where the number of usable items
    is itself random.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 2.

    Examples
    --------
    >>> percent_agreement([["a", "a"], ["a", "b"]]).value
    0.5
    """
    coded = code_ratings(ratings, categories)
    return _estimate(item_counts(coded), coded.n_raters)


def percent_agreement_from_counts(counts: ArrayLike) -> Estimate:
    """Estimate percent agreement from how many raters chose each category.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.

    Returns
    -------
    Estimate
        As of `percent_agreement`; `n_raters` is the largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters.

    Examples
    --------
    >>> percent_agreement_from_counts([[2, 0], [1, 1]]).value
    0.5
    """
    table = check_counts(counts)
    return _estimate(table, int(table.sum(axis=1).max()))


def _estimate(counts: NDArray[np.int64], n_raters: int) -> Estimate:
    # shape of counts: (n_items, n_categories)
    observed = observed_agreement(counts)
    reason = defined("percent agreement", observed, Fraction(0))
    return Estimate(
        coefficient="percent_agreement",
        weights="identity",
        value=ratio(observed),
        standard_error=_standard_error(counts, ratio(observed)),
        observed=ratio(observed),
        chance=0.0,
        n_items=int((counts.sum(axis=1) > 0).sum()),
        n_raters=n_raters,
        n_categories=counts.shape[1],
        reason=reason,
    )


def observed_agreement(counts: NDArray[np.int64]) -> Fraction | None:
    """Return the mean over items of the share of agreeing pairs of raters.

    Parameters
    ----------
    counts : ndarray of int64, shape (n_items, n_categories)
        Raters per item and category.

    Returns
    -------
    Fraction or None
        Exact; None if no item has ratings of two raters.
    """
    pairs: dict[int, int] = {}  # raters of an item -> agreeing ordered pairs
    n_usable = 0
    for row, times in distinct_rows(counts):
        n = sum(row)
        if n >= 2:
            agreeing = sum(c * (c - 1) for c in row)
            pairs[n] = pairs.get(n, 0) + times * agreeing
            n_usable += times
    if n_usable == 0:
        return None
    total = sum(Fraction(found, n * (n - 1)) for n, found in pairs.items())
    return Fraction(total) / n_usable


def item_agreement(counts: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Return each item's share of agreeing pairs, and whether it has a pair.

    Parameters
    ----------
    counts : ndarray of int64, shape (n_items, n_categories)
        Raters per item and category.

    Returns
    -------
    tuple of ndarray, shape (n_items,)
        The shares, 0 where there is no pair; and 1.0 or 0.0 for usable or not.
    """
    table = counts.astype(np.float64)
    n = table.sum(axis=1)
    shares = divide((table * (table - 1)).sum(axis=1), n * (n - 1))
    usable = (n >= 2).astype(np.float64)
    return np.where(n >= 2, shares, 0.0), usable


def _standard_error(counts: NDArray[np.int64], observed: float) -> float:
    counts = counts[counts.sum(axis=1) > 0]
    n_items = counts.shape[0]
    if n_items < 2 or math.isnan(observed):
        return math.nan
    shares, usable = item_agreement(counts)
    # Influence of an item on sum(shares) / sum(usable): a ratio of two means.
    influence = usable * (shares - observed) / usable.mean()
    return float(np.sqrt((influence**2).sum() / (n_items * (n_items - 1))))


def _features(coded: CodedRatings) -> Floats:
    # (n_items, 2): share of agreeing pairs, usable
    return np.stack(item_agreement(item_counts(coded)), axis=1)


def _value(sums: Floats, n_categories: int) -> Floats:  # noqa: ARG001 - a kernel
    return divide(sums[..., 0], sums[..., 1])


def pairs_without_self(
    coded: CodedRatings, times: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return agreement and categories when raters are taken several times.

    Parameters
    ----------
    coded : CodedRatings
        The ratings.
    times : ndarray, shape (n_resamples, n_raters)
        How often each rater is taken.

    Returns
    -------
    tuple of ndarray
        Share of agreeing pairs of different raters, 0 where there is no pair, and
        whether there is one, both (n_resamples, n_items); ratings per category,
        (n_resamples, n_items, n_categories).
    """
    chosen = coded.codes[:, :, None] == np.arange(coded.n_categories)
    taken = np.einsum("br,irk->bik", times, chosen, optimize=True)
    with_self = np.einsum("br,irk->bik", times**2, chosen, optimize=True)
    agreeing = (taken**2 - with_self).sum(axis=-1)
    pairs = taken.sum(axis=-1) ** 2 - with_self.sum(axis=-1)
    usable = pairs > 0
    shares = np.where(usable, divide(agreeing, pairs), 0.0)
    return shares, usable.astype(np.float64), taken


def _rater_sums(coded: CodedRatings, times: Floats) -> Floats:
    shares, usable, _ = pairs_without_self(coded, times)
    return np.stack([shares.sum(axis=-1), usable.sum(axis=-1)], axis=-1)


PERCENT_KERNEL = Kernel(features=_features, value=_value, rater_sums=_rater_sums)

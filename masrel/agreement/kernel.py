"""How a coefficient is computed from sums over items, many resamples at once.

Every coefficient here is a function of sums over items of a few features of each
item. A resample of items, or leaving one out, only changes the sums; so intervals
need no call per resample.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.coding import CodedRatings
from masrel.agreement.counting import item_counts

__all__ = ["Floats", "Kernel", "divide", "pooled_kernel", "weighted_disagreement"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """A coefficient as a function of sums of item features.

    `v` is the disagreement of two categories, shape (n_categories, n_categories).

    Attributes
    ----------
    features : callable
        CodedRatings and v to an array of shape (n_items, n_features).
    value : callable
        Sums of shape (..., n_features) and v to values of shape (...), ``nan``
        where undefined.
    rater_sums : callable or None
        CodedRatings, how often each rater is taken, shape (n_resamples, n_raters),
        and v, to sums of shape (n_resamples, n_features). A rater is never paired
        with a copy of itself. None where raters cannot be resampled.
    """

    features: Callable[[CodedRatings, Floats], Floats]
    value: Callable[[Floats, Floats], Floats]
    rater_sums: Callable[[CodedRatings, Floats, Floats], Floats] | None = None


def divide(numerator: Floats, denominator: Floats) -> Floats:
    """Divide, with ``nan`` and no noise where the denominator is 0.

    Parameters
    ----------
    numerator, denominator : ndarray, shape (...)
        What to divide.

    Returns
    -------
    ndarray, shape (...)
        The ratios.
    """
    return np.asarray(numerator / np.where(denominator == 0.0, np.nan, denominator))


def weighted_disagreement(counts: Floats, v: Floats) -> Floats:
    """Return Σ_kl v_kl n_k n_l of counts.

    Parameters
    ----------
    counts : ndarray, shape (..., n_categories)
        Raters per category.
    v : ndarray, shape (n_categories, n_categories)
        Disagreement of two categories.

    Returns
    -------
    ndarray, shape (...)
        Disagreeing ordered pairs of raters, weighted.
    """
    return np.asarray(((counts @ v) * counts).sum(axis=-1))


def pooled_kernel(expected: Callable[[Floats, Floats], Floats | float]) -> Kernel:
    """Return the kernel of a coefficient of unnamed raters, 1 - D_o / D_e.

    Parameters
    ----------
    expected : callable
        Shares (..., n_categories) and v to the disagreement by chance (...).

    Returns
    -------
    Kernel
        Features are an item's disagreement, whether it has a pair, whether it has a
        rating, and its shares of the categories.
    """

    def features(coded: CodedRatings, v: Floats) -> Floats:
        return _of_counts(item_counts(coded).astype(np.float64), v)

    def value(sums: Floats, v: Floats) -> Floats:
        observed = divide(sums[..., 0], sums[..., 1])
        # One category has a share of exactly 1, and so a disagreement of exactly 0.
        shares = divide(sums[..., 3:], sums[..., 2:3])
        return 1.0 - divide(observed, np.asarray(expected(shares, v)))

    def rater_sums(coded: CodedRatings, times: Floats, v: Floats) -> Floats:
        return _of_resampled_raters(coded, times, v)

    return Kernel(features=features, value=value, rater_sums=rater_sums)


def _of_counts(counts: Floats, v: Floats) -> Floats:
    # (n_items, n_categories) -> (n_items, 3 + n_categories)
    n = counts.sum(axis=1)
    features = np.empty((len(counts), 3 + counts.shape[1]))
    # a single rating, or none, has no disagreement
    features[:, 0] = weighted_disagreement(counts, v) / np.maximum(n * (n - 1), 1.0)
    features[:, 1] = n > 1
    features[:, 2] = n > 0
    features[:, 3:] = counts / np.maximum(n, 1.0)[:, None]
    return features


def _of_resampled_raters(coded: CodedRatings, times: Floats, v: Floats) -> Floats:
    # (n_resamples, n_raters) -> (n_resamples, 3 + n_categories)
    chosen = (coded.codes[:, :, None] == np.arange(len(v))).astype(np.float64)
    taken = np.einsum("br,irk->bik", times, chosen, optimize=True)
    itself = np.einsum("br,ir->bi", times**2, chosen.sum(axis=-1), optimize=True)
    n = taken.sum(axis=-1)
    # Pairs of a rater with its own copies always agree: they are left out.
    pairs = n * n - itself
    usable, rated = pairs > 0, n > 0
    disagreement = weighted_disagreement(taken, v) / np.where(usable, pairs, 1.0)
    shares = taken / np.where(rated, n, 1.0)[..., None]
    heads = [
        np.where(usable, disagreement, 0.0).sum(axis=-1),
        usable.sum(axis=-1),
        rated.sum(axis=-1),
    ]
    return np.column_stack([*heads, shares.sum(axis=-2)])

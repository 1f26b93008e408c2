"""A coefficient as a function of sums over items, many resamples at once.

Every coefficient here is a function of sums over items of a few features of each
item. A resample of items, or leaving one out, only changes the sums; so intervals
need no call per resample.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._counts import item_counts
from masrel.agreement._data import CodedRatings
from masrel.agreement._labels import Codes
from masrel.errors import ParameterError, UndefinedStatisticWarning

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
RaterSums = Callable[[Floats], Floats]

_BLOCK = 1 << 14  # items whose categories are spread out at once


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """A coefficient as a function of sums of item features."""

    # `v` is the disagreement of two categories, shape (n_categories, n_categories).

    # codedRatings and v to an array of shape (n_items, n_features)
    features: Callable[[CodedRatings, Floats], Floats]
    # sums of shape (..., n_features) and v to values of shape (...), ``nan`` where
    # undefined
    value: Callable[[Floats, Floats], Floats]
    # distinct rows of CodedRatings, how often each occurs, and v, to a callable: how
    # often each rater is taken, shape (..., n_raters), to sums of shape (...,
    # n_features). A rater is never paired with a copy of itself. None where raters
    # cannot be resampled.
    rater_sums: Callable[[CodedRatings, Integers, Floats], RaterSums] | None = None


def divide(numerator: Floats, denominator: Floats) -> Floats:
    """Divide, with ``nan`` and no noise where the denominator is 0."""
    # numerator, denominator (...) -> (...)
    if np.count_nonzero(denominator) == np.size(denominator):  # as a rule
        return np.asarray(numerator / denominator)
    return np.asarray(numerator / np.where(denominator == 0.0, np.nan, denominator))


def weighted_disagreement(counts: Floats, v: Floats) -> Floats:
    """Return Σ_kl v_kl n_k n_l of counts."""
    # counts (..., n_categories), v (n_categories, n_categories) -> (...)
    return np.asarray(np.einsum("...k,...k->...", counts @ v, counts))


def pooled_kernel(expected: Callable[[Floats, Floats], Floats | float]) -> Kernel:
    """Return the kernel of a coefficient of unnamed raters, 1 - D_o / D_e."""

    def features(coded: CodedRatings, v: Floats) -> Floats:
        return _of_counts(item_counts(coded).astype(np.float64), v)

    def value(sums: Floats, v: Floats) -> Floats:
        observed = divide(sums[..., 0], sums[..., 1])
        # One category has a share of exactly 1, and so a disagreement of exactly 0.
        shares = divide(sums[..., 3:], sums[..., 2:3])
        return 1.0 - divide(observed, np.asarray(expected(shares, v)))

    return Kernel(features=features, value=value, rater_sums=_of_resampled_raters)


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


def _of_resampled_raters(coded: CodedRatings, items: Integers, v: Floats) -> RaterSums:
    # Items that the same raters rated are summed once, pair of raters by pair: Σ_i v of
    # their categories is a quadratic form in how often each rater is taken.
    given, kind = np.unique(coded.codes >= 0, axis=0, return_inverse=True)
    groups = [
        (rated.astype(np.float64), *_pair_sums(coded.codes[of], items[of], v))
        for rated, of in zip(
            given, kind.ravel() == np.arange(len(given))[:, None], strict=True
        )
    ]

    def sums(taken: Floats) -> Floats:
        # (..., n_raters) -> (..., 3 + n_categories)
        found = np.zeros((*taken.shape[:-1], 3 + len(v)), dtype=taken.dtype)
        for rated, n_items, apart, chosen in groups:
            of = taken * rated
            n = of.sum(axis=-1)
            # Pairs of a rater with its own copies always agree: they are left out.
            pairs = n * n - (of * of).sum(axis=-1)
            found[..., 0] += _over((of @ apart * of).sum(axis=-1), pairs)
            found[..., 1] += n_items * (pairs != 0)
            found[..., 2] += n_items * (n != 0)
            found[..., 3:] += _over(of @ chosen, n[..., None])
        return found

    return sums


def _pair_sums(codes: Codes, items: Integers, v: Floats) -> tuple[int, Floats, Floats]:
    # how many items; Σ_i v of two raters' categories, (n_raters, n_raters); how often
    # each rater chose each category, (n_raters, n_categories)
    n_items, n_raters = codes.shape
    side = (n_raters, len(v))
    both = np.zeros(side * 2)
    chosen = np.zeros(side)
    for start in range(0, n_items, _BLOCK):
        block = slice(start, start + _BLOCK)
        each = (codes[block, :, None] == np.arange(len(v))).astype(np.float64)
        weighed = each * items[block, None, None]
        flat = weighed.reshape(len(each), -1).T @ each.reshape(len(each), -1)
        both += flat.reshape(side * 2)
        chosen += weighed.sum(axis=0)
    return int(items.sum()), np.einsum("rksl,kl->rs", both, v), chosen


def _over(numerator: Floats, denominator: Floats) -> Floats:
    # 0 where there is nothing to divide by
    empty = denominator == 0
    return np.where(empty, 0.0, numerator) / np.where(empty, 1.0, denominator)


Variance = Literal["delta", "irrcac"]
"""Which standard error: the delta method's, or the one irrCAC prints."""

_VARIANCES = get_args(Variance)


def standard_error(
    squares: float, over: float, n_items: int, population: int | None
) -> float:
    """Return the standard error of an estimate from how much each item moves it."""
    # squares, over: Σ_i u_i² is `squares` / `over`, u_i being n times what the estimate
    # changes by when item i counts a little more.
    # √[(1 - n/N) Σ_i u_i² / (n (n - 1))]; ``nan`` of a single item.
    if n_items < 2:
        return math.nan
    variance = squares / (over * n_items * (n_items - 1))
    if population is not None:
        variance *= (population - n_items) / population
    return math.sqrt(variance)


def check_variance(variance: str) -> None:
    """Check the name of a standard error."""
    if variance not in _VARIANCES:
        raise ParameterError(
            f"variance: needs one of {', '.join(_VARIANCES)}, got {variance!r}"
        )


def check_population(population: int | None, n_items: int) -> None:
    """Check the size of a finite population."""
    if population is None:
        return
    if not isinstance(population, int | np.integer) or population < max(n_items, 1):
        raise ParameterError(
            f"population: needs a whole number of at least the {n_items} items rated, "
            f"got {population!r}"
        )


NO_PAIR = "no item has ratings of two raters"
NO_CHANCE = "0/0: chance agreement is 1, all ratings are in one category"


def undefined(title: str, reason: str) -> str:
    """Warn that a statistic is undefined, and return why."""
    warnings.warn(
        f"{title} is undefined: {reason}", UndefinedStatisticWarning, stacklevel=4
    )
    return reason

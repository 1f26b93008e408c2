"""What every coefficient shares: sums for its intervals, its error, the rule for 0/0.

Every coefficient here is a function of sums over items of a few features of each
item. A resample of items, or leaving one out, only changes the sums; so intervals
need no call per resample.
"""

import math
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import CodedRatings
from masrel.agreement._labels import shown
from masrel.errors import ParameterError, UndefinedStatisticWarning

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Array = NDArray[Any]
RaterSums = Callable[[Floats], Floats]
CrossedSums = Callable[[Floats, Floats], Floats]

Variance = Literal["delta", "irrcac"]
"""Which standard error: the delta method's, or the one irrCAC prints."""

VARIANCES = get_args(Variance)

NO_PAIR = "no item has ratings of two raters"
ONE_PAIR = "one item with a pair of ratings has no standard error"
NO_SPREAD = (
    "the standard error is 0: no item moves the estimate, which does not mean that "
    "there is no uncertainty"
)

_CANCELLED = 1e-3  # of its terms: a sum in floats so small has lost three digits


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """A coefficient as a function of sums of item features."""

    # `v` is the disagreement of two categories, shape (n_categories, n_categories).

    # ratings and v to an array of shape (n_items, n_features)
    features: Callable[[CodedRatings, Floats], Floats]
    # sums of shape (..., n_features) and v to values of shape (...), ``nan`` where
    # undefined
    value: Callable[[Floats, Floats], Floats]
    # distinct rows of ratings, how often each occurs, and v, to a callable: how often
    # each rater is taken, shape (..., n_raters), to sums of shape (..., n_features). A
    # rater is never paired with a copy of itself. None where raters cannot be
    # resampled.
    rater_sums: Callable[[CodedRatings, Integers, Floats], RaterSums] | None = None
    # distinct rows and v to a callable: how often each row and each rater is taken,
    # shapes (n, n_rows) and (n, n_raters), to sums of shape (n, n_features); None where
    # rater_sums is
    crossed_sums: Callable[[CodedRatings, Floats], CrossedSums] | None = None
    # whether v may be `Distances` in place of a matrix
    takes_many: bool = False


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


class Influence(NamedTuple):
    """How much each distinct item moves an estimate, times the number of items."""

    # Floats, or whole numbers and fractions in arrays of objects.
    values: Array  # (n_distinct,)
    freq: Array  # (n_distinct,): how often each occurs
    terms: Array  # (n_distinct,): of the largest of those that a value is the sum of


def standard_error(
    influence: Callable[[bool], Influence], n_items: int, population: int | None
) -> float:
    """Return the standard error of an estimate whose items are a sample."""
    # √[(1 - n/N) Σ_i u_i² / (n (n - 1))]; `influence` takes whether to be exact
    if n_items < 2:
        return math.nan
    u, freq, terms = influence(False)
    squares = float(freq.dot(u * u))
    if squares < _CANCELLED**2 * float(freq.dot(terms * terms)):
        u, freq, _ = influence(True)
        squares = float(freq.dot(u * u))
    variance = squares / (n_items * (n_items - 1))
    if population is not None:
        variance *= (population - n_items) / population
    return math.sqrt(variance)


def check_variance(variance: str) -> None:
    """Check the name of a standard error."""
    if variance not in VARIANCES:
        raise ParameterError(
            f"variance: needs one of {', '.join(VARIANCES)}, got {variance!r}"
        )


def check_level(level: float) -> None:
    """Check the level of an interval, or the probability of a word."""
    is_number = isinstance(level, int | float | np.integer | np.floating)
    # a level so near to 1 that its upper quantile is that of 1 has no ends
    if not (is_number and 0.0 < level < 1.0 and 0.5 + 0.5 * level < 1.0):
        raise ParameterError(f"level: needs (0, 1), got {shown(level)}")


def check_population(population: int | None, n_items: int) -> None:
    """Check the size of a finite population."""
    if population is None:
        return
    if not isinstance(population, int | np.integer) or population < max(n_items, 1):
        raise ParameterError(
            f"population: needs a whole number of at least the {n_items} items rated, "
            f"got {population!r}"
        )


def undefined(title: str, reason: str) -> str:
    """Warn whoever called this package that a statistic is undefined; return why."""
    frame, level = sys._getframe(1), 2
    while frame.f_back and frame.f_globals.get("__package__") == __package__:
        frame, level = frame.f_back, level + 1
    message = f"{title} is undefined: {reason}"
    warnings.warn(message, UndefinedStatisticWarning, stacklevel=level)
    return reason

"""One engine for every kappa: sums of item features, the value and its error.

Every kappa is 1 - D_o/D_e, observed over expected disagreement, both functions of sums
over items of a few features of each item. A `Formula` says which: the features, D_o and
D_e of their sums, and the slope of the value in each sum. The value, its error, the
jackknife, the bootstrap and clusters follow from these three.
"""

import math
import sys
import warnings
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import refuse_measurements
from masrel.agreement._labels import Codes, Label, shown
from masrel.agreement._rows import CountedRatings, item_counts
from masrel.agreement._weights import (
    NO_PAIR,
    Weights,
    WeightsLike,
    declared_weights,
)
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Array = NDArray[Any]
RaterSums = Callable[[Floats], Floats]
CrossedSums = Callable[[Floats, Floats], Floats]
Why = Callable[[Weights, Floats, Floats], str | None]

ONE_PAIR = "one item with a pair of ratings has no standard error"
NO_SPREAD = (
    "the standard error is 0: no item moves the estimate, which does not mean that "
    "there is no uncertainty"
)

# 64 units in the last place of its parts: what moves an estimate less does not move it
_ROUNDING = 64 * np.finfo(np.float64).eps

WHOLE = math.lcm(*range(1, 23))
"""Parts of one: shares of up to 22 raters, or of their pairs, are whole numbers of
them, and their sums are not rounded."""


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Features of rows of ratings: m of every row, and n of which a row has few.

    The latter say how often a rater, or any rater, chose a category. Only those that
    are not 0 are kept, so that any number of categories costs the same.
    """

    dense: Floats  # (m, n_rows): features 0 to m - 1
    places: Integers  # (n_rows, k): which of the n others a row has
    values: Floats  # (n_rows, k): and what they are; 0 for none
    n: int

    def sums(self, freq: Integers) -> Floats:
        """Return the sums over rows that occur so often each, (m + n,)."""
        kinds, often, places = np.ones(1), self.values * freq[:, None], self.places
        if (often % 1.0).any():  # shares of more raters: those alike are counted first
            kinds, kind = np.unique(self.values, return_inverse=True)
            places = places + self.n * kind.reshape(places.shape)
            often = np.broadcast_to(freq[:, None].astype(np.float64), places.shape)
        size = len(kinds) * self.n
        counts = np.bincount(places.ravel(), often.ravel(), minlength=size)[:size]
        others = kinds @ counts.reshape(len(kinds), self.n)
        return np.concatenate([(self.dense * freq).sum(axis=1), others])

    def dot(self, slope: Floats) -> Floats:
        """Return Σ_f slope_f x_f of each row, (n_rows,); rounding is 0."""
        of_dense, of_others = slope[: len(self.dense)], slope[len(self.dense) :]
        parts = np.empty((len(self.values), len(self.dense) + self.places.shape[1]))
        parts[:, : len(self.dense)] = of_dense * self.dense.T
        parts[:, len(self.dense) :] = of_others[self.places] * self.values
        moves = parts.sum(axis=1)
        moves[abs(moves) <= _ROUNDING * abs(parts).max(axis=1, initial=0.0)] = 0.0
        return np.asarray(moves)

    def rows(self) -> Floats:
        """Return the features as a table, (n_rows, m + n)."""
        n_rows, size = len(self.places), self.n * len(self.places)
        flat = (self.places + self.n * np.arange(n_rows)[:, None]).ravel()
        others = np.bincount(flat, self.values.ravel(), minlength=size)[:size]
        return np.hstack([self.dense.T, others.reshape(n_rows, self.n)])

    @property
    def matters(self) -> NDArray[np.bool_]:
        """Whether any feature of a row is not 0, (n_rows,)."""
        return np.asarray(
            (self.dense != 0).any(axis=0) | (self.values != 0).any(axis=1)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Formula:
    """A kappa as a function of sums of item features."""

    name: str
    title: str  # as a sentence has it
    # codes (n_rows, n_raters), the disagreement v of every two categories, a matrix or
    # an operator, and `repeats`, how often each code is there, to features
    features: Callable[..., Features]
    # sums (..., m + n) and v to D_o and D_e, each (..., n_tables). The value is the
    # mean of 1 - D_o/D_e over tables, of which all but Light's kappa have one.
    disagreements: Callable[[Floats, Any], tuple[Floats, Floats]]
    # the same to the derivative of the value in each sum, (..., m + n), of any kind
    # where the value is undefined
    slope: Callable[[Floats, Any], Floats]
    # rows of codes, how often each occurs, and v, to a callable: how often each rater
    # is taken, (..., n_raters), to sums (..., m + n). A rater is never paired with a
    # copy of itself. None where raters cannot be resampled.
    rater_sums: Callable[[Codes, Integers, Any], RaterSums] | None = None
    # rows and v to a callable: how often each row and each rater is taken, (b, n_rows)
    # and (b, n_raters), to sums (b, m + n); None where rater_sums is
    crossed_sums: Callable[[Codes, Any], CrossedSums] | None = None
    # whether chance looks at each category by itself, not at sums of v of pairs alone
    needs_categories: bool = False

    def value(self, sums: Floats, v: Any) -> Floats:
        """Return the coefficient, (...); ``nan`` where undefined."""
        return np.asarray((1.0 - divide(*self.disagreements(sums, v))).mean(axis=-1))


def estimate(
    formula: Formula,
    counted: CountedRatings,
    weights: WeightsLike,
    *,
    n_raters: int | None = None,
    population: int | None = None,
    why: Why | None = None,
) -> Estimate:
    """Estimate a kappa with its standard error, or say why there is none.

    `why` takes weights, D_o and D_e, and returns the reason why they make no value.
    """
    made = declared_weights(weights, counted.categories, declared=counted.declared)
    if made.counts_misses:
        refuse_measurements(counted)
    v, freq, size = made.v, counted.freq, counted.size
    n_items = int(freq @ (size > 0))
    if population is not None:
        check_population(population, n_items)
    features = formula.features(counted.codes, v, counted.repeats)
    matters = features.matters
    n_paired = int(freq @ (matters & (size > 1)))
    sums = features.sums(freq)
    d_o, d_e = formula.disagreements(sums, v)
    reason = NO_PAIR if not n_paired and why is None else (why or _why)(made, d_o, d_e)
    value = error = math.nan
    if reason is not None:
        undefined(formula.title, reason)
        if made.reason is not None or np.isnan(d_o).any():
            d_o = d_e = np.array([math.nan])
    else:
        value = _mean(1.0 - d_o / d_e)
        moves = features.dot(formula.slope(sums, v))
        error = standard_error(moves, freq * matters, population)
    return Estimate(
        coefficient=formula.name,
        weights=made.name,
        value=value,
        standard_error=error,
        observed=1.0 - _mean(d_o),
        chance=1.0 - _mean(d_e),
        n_items=n_items,
        n_items_paired=n_paired,
        n_raters=counted.n_raters if n_raters is None else n_raters,
        n_categories=made.n_categories,
        reason=reason,
    )


def _mean(of_tables: Floats) -> float:
    return float(of_tables.sum()) / len(of_tables)


def _why(weights: Weights, d_o: Floats, d_e: Floats) -> str | None:
    """Return why D_o and D_e make no value, if so."""
    if weights.reason is not None:
        return weights.reason
    if np.isnan(d_o).any():
        return NO_PAIR
    return None if d_e.all() else weights.no_chance


def standard_error(moves: Floats, freq: Integers, population: int | None) -> float:
    """Return the standard error of an estimate whose items are a sample."""
    # √[(1 - n/N) n/(n - 1) Σ_i u_i²], u_i what one more of item i moves the estimate by
    n = int(freq.sum())
    if n < 2:
        return math.nan
    u = moves - freq @ moves / n
    # the mean of n moves is 0, or rounding of them
    u[abs(u) <= _ROUNDING * abs(moves).max(initial=0.0)] = 0.0
    share = 1.0 if population is None else (population - n) / population
    return math.sqrt(share * n / (n - 1) * float(freq @ (u * u)))


# -- what formulas have in common ----------------------------------------------------


def divide(numerator: Floats, denominator: Floats) -> Floats:
    """Divide, with ``nan`` and no noise where the denominator is 0."""
    # numerator, denominator (...) -> (...)
    if denominator.all():  # as a rule
        return np.asarray(numerator / denominator)
    return np.asarray(numerator / np.where(denominator == 0.0, np.nan, denominator))


def over(numerator: Floats, denominator: Floats) -> Floats:
    """Divide, with 0 where there is nothing to divide by."""
    if denominator.all():
        return np.asarray(numerator / denominator)
    empty = denominator == 0.0
    return np.where(empty, 0.0, numerator) / np.where(empty, 1.0, denominator)


def bilinear(x: Floats, v: Any, y: Floats) -> Floats:
    """Return Σ_kl v_kl x_k y_l."""
    # x, y (..., n_categories) -> (...)
    return np.asarray(((x @ v) * y).sum(axis=-1))


def disagreement_within(codes: Codes, v: Any, repeats: Integers | None) -> Floats:
    """Return Σ_kl v_kl n_ik n_il of each row of codes, n_ik raters who chose k."""
    # codes (n_rows, n_raters) -> (n_rows,)
    if len(v) <= 4 * codes.shape[1] or repeats is not None:
        counts = item_counts(codes, len(v), repeats).astype(np.float64)
        return np.asarray(((counts @ v) * counts).sum(axis=-1))
    total: Any = np.zeros(len(codes))
    for g, first in enumerate(codes.T):  # no table of items by categories is made
        for second in codes.T[:g]:
            is_pair = (first >= 0) & (second >= 0)
            total = total + np.where(is_pair, v[first, second], 0.0)
    return np.asarray(2.0 * total)


# -- checks --------------------------------------------------------------------------


def check_level(level: float) -> None:
    """Check the level of an interval, or the probability of a word."""
    is_number = isinstance(level, int | float | np.integer | np.floating)
    # a level so near to 1 that its upper quantile is that of 1 has no ends
    if not (is_number and 0.0 < level < 1.0 and 0.5 + 0.5 * level < 1.0):
        raise ParameterError(f"level: needs (0, 1), got {shown(level)}")


def check_option(name: str, value: object, options: Collection[object]) -> None:
    """Check that an argument is one of its options."""
    if value not in options:
        known = ", ".join(map(str, options))
        raise ParameterError(f"{name}: needs one of {known}, got {value!r}")


def check_population(population: int, n_items: int) -> None:
    """Check the size of a finite population."""
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


def measured(
    name: str,
    values: Floats,
    categories: Sequence[Label] | None,
    value: float,
    *,
    weights: str = "identity",
    standard_error: float = math.nan,
    interval: Interval | None = None,
    reason: str | None = None,
) -> Estimate:
    """Return an estimate made of numbers, (n_items, n_raters), not of categories."""
    rated = ~np.isnan(values)
    return Estimate(
        coefficient=name,
        weights=weights,
        value=value,
        standard_error=standard_error,
        interval=interval,
        observed=math.nan,
        chance=math.nan,
        n_items=values.shape[0],
        n_items_paired=int((rated.sum(axis=1) > 1).sum()),
        n_raters=values.shape[1],
        n_categories=len(
            np.unique(values[rated]) if categories is None else categories
        ),
        reason=reason,
    )


def deviations(values: Floats) -> tuple[Floats, float]:
    """Return ratings less the first, over a power of two, and that power."""
    # whole ratings stay exact, a common offset costs no digits, and squares are floats
    exponent = int(np.frexp(np.nanmax(np.abs(values)))[1]) - 1
    scaled = np.ldexp(values, -exponent)
    return scaled - scaled[~np.isnan(scaled)][0], math.ldexp(1.0, exponent)

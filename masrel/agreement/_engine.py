"""One engine for every kappa: sums of item features, the value and its error.

Every kappa is 1 - D_o/D_e, observed over expected disagreement, both functions of sums
over items of a few features of each item. A `Formula` says which: the features, and of
their sums D_o, D_e and the slope of the value in each sum. The value, its error, the
jackknife, the bootstrap and clusters follow from these two.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel._input import refuse, shown, warn_caller
from masrel.agreement._codes import CountedRatings, count_ratings, refuse_measurements
from masrel.agreement._labels import Label
from masrel.agreement._weights import (
    NO_PAIR,
    Weights,
    WeightsLike,
    declared_weights,
)
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate, Interval, Significance

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Array = NDArray[Any]
Resampled = Callable[[Floats, Floats], Floats]
Why = Callable[[Weights, Floats, Floats], str | None]

ONE_PAIR = "one item with a pair of ratings gives no standard error"
NO_SPREAD = (
    "the standard error is 0 because no item changes the estimate; this does not mean "
    "that there is no uncertainty"
)

_MANY_GRADES = 128  # up to which numbers are grades, however few are alike

# 64 units in the last place of its parts: what moves an estimate less does not move it
_ROUNDING = 64 * np.finfo(np.float64).eps

_MOST_PARTS = 64  # of rows, that are summed by themselves

WHOLE = math.lcm(*range(1, 23))
"""Parts of one: shares of up to 22 raters, or of their pairs, are whole numbers of
them, and their sums are not rounded."""


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Features of rows of ratings: m that every row has, and n that few rows have.

    The latter say how often a rater, or any rater, chose a category. Only those that
    are not 0 are kept, so that any number of categories costs the same.
    """

    dense: Floats  # (m, n_rows): features 0 to m - 1
    places: Integers  # (n_rows, k): which of the n others a row has
    values: Floats  # (n_rows, k): and what they are; 0 for none
    n: int

    def rows(self) -> Floats:
        """Return the features as a table, (n_rows, m + n)."""
        n_rows, size = len(self.places), self.n * len(self.places)
        flat = (self.places + self.n * np.arange(n_rows)[:, None]).ravel()
        others = np.bincount(flat, self.values.ravel(), minlength=size)[:size]
        return np.hstack([self.dense.T, others.reshape(n_rows, self.n)])

    def summed(self, freq: Integers) -> tuple[Floats, Integers]:
        """Return sums over rows that occur so often each, and how often rows matter.

        A row whose features are all 0 does not: to the coefficient it is not an item.
        """
        # -> (m + n,), (n_rows,)
        # a sum of thousands of shares would be rounded as often: in parts of the rows,
        # no more than a category has shares
        parts = min(max(self.places.size // max(self.n, 1), 1), _MOST_PARTS)
        part = self.n * (np.arange(len(self.places)) % parts)
        at, often = self.places + part[:, None], self.values * freq[:, None]
        sums = np.bincount(at.ravel(), often.ravel(), parts * self.n)
        others = sums[: parts * self.n].reshape(parts, self.n).sum(axis=0)
        matters = self.dense.any(axis=0) | self.values.any(axis=1)
        return np.concatenate([self.dense @ freq, others]), freq * matters

    def error(
        self,
        slope: Floats,
        freq: Integers,
        population: int | None = None,
        more: Floats | float = 0.0,
    ) -> float:
        """Return the standard error of an estimate whose items are a sample.

        Rows that matter occur so often each; `more` is what a row moves the estimate by
        beside its features.
        """
        # √[(1 - n/N) n/(n - 1) Σ_i u_i²], u_i what one more of item i moves the
        # estimate by, and 0 where that is rounding
        m, n = len(self.dense), int(freq.sum())
        if n < 2:
            return math.nan
        others = slope[m:][self.places] * self.values
        parts = np.concatenate([slope[:m] * self.dense.T, others], axis=1)
        moves = parts.sum(axis=1)
        moves[abs(moves) <= _ROUNDING * abs(parts).max(axis=1)] = 0.0
        moves += more
        u = moves - freq @ moves / n
        u[abs(u) <= _ROUNDING * max(abs(parts).max(), abs(moves).max())] = 0.0
        share = 1.0 if population is None else (population - n) / population
        return math.sqrt(share * n / (n - 1) * float(freq @ (u * u)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Formula:
    """A kappa as a function of sums of item features."""

    name: str
    title: str  # as a sentence has it
    # from ratings and categories to those that count: of two raters, say
    count: Callable[..., CountedRatings] = count_ratings
    # codes (n_rows, n_raters), the disagreement v of every two categories, a matrix or
    # an operator, and `repeats`, how often each code is there, to features
    features: Callable[..., Features]
    # sums (..., m + n) and v to D_o and D_e, each (..., n_tables), and the slope of the
    # value in each sum, (..., m + n). The value is the mean of 1 - D_o/D_e over tables,
    # of which all but Light's kappa have one; where it is undefined they may divide by
    # 0, and the slope is anything.
    disagreements: Callable[[Floats, Any], tuple[Floats, Floats, Floats]]
    # rows of codes, v, and `freq` where rows are always taken that often, to a call:
    # how often each row and each rater is taken, (b, n_rows) and (b, n_raters),
    # to sums (b, m + n). A rater is never paired with a copy of itself. None where
    # raters cannot be resampled.
    resampled: Callable[..., Resampled] | None = None
    # whether chance looks at each category by itself, not at sums of v of pairs alone
    needs_categories: bool = False

    def value(self, sums: Floats, v: Any) -> Floats:
        """Return the coefficient, (...); ``nan`` where undefined."""
        with np.errstate(divide="ignore", invalid="ignore"):
            d_o, d_e, _ = self.disagreements(sums, v)
            return np.asarray((1.0 - divide(d_o, d_e)).mean(axis=-1))

    def slope(self, sums: Floats, v: Any) -> Floats:
        """Return the derivative of the value in each sum; ``nan`` where undefined."""
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = self.disagreements(sums, v)[2]
        return np.where(np.isfinite(slope), slope, math.nan)


def estimate(
    formula: Formula,
    ratings: object,
    categories: Sequence[Label] | None,
    weights: WeightsLike,
    *,
    n_raters: int | None = None,
    population: int | None = None,
    why: Why | None = None,
) -> Estimate:
    """Estimate a kappa with its standard error, or the reason if it has none.

    `why` takes weights, D_o and D_e, and returns the reason why they make no value.
    """
    counted = formula.count(ratings, categories)
    made = declared_weights(weights, counted.categories, declared=counted.declared)
    v, codes, freq, repeats = made.v, counted.codes, counted.freq, counted.repeats
    size = (codes >= 0 if repeats is None else repeats).sum(axis=1)
    are_many = len(counted.categories) > _MANY_GRADES and not counted.declared
    if are_many and made.counts_misses:
        refuse_measurements(counted)
    n_items = int(freq @ (size > 0))
    is_whole = isinstance(population, int | np.integer)
    refuse(
        (
            not (population is None or (is_whole and population >= max(n_items, 1))),
            f"population: needs a whole number of at least the {n_items} items rated, "
            f"got {population!r}",
        )
    )
    features = formula.features(codes, v, repeats)
    sums, freq = features.summed(freq)
    n_paired = int(freq @ (size > 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        d_o, d_e, slope = formula.disagreements(sums, v)
    n_tables = d_o.size
    if why is not None:
        reason = why(made, d_o, d_e)
    elif not n_paired:
        reason = NO_PAIR
    else:
        reason = made.reason or (None if d_e.all() else made.no_chance)
    value = error = math.nan
    if reason is None:
        value = float((1.0 - d_o / d_e).sum()) / n_tables
        error = features.error(slope, freq, population)
    else:
        undefined(formula.title, reason)
        if made.reason is not None or np.isnan(d_o).any():
            d_o = d_e = np.full(n_tables, math.nan)
    return Estimate(
        coefficient=formula.name,
        weights=made.name,
        value=value,
        standard_error=error,
        observed=1.0 - float(d_o.sum()) / n_tables,
        chance=1.0 - float(d_e.sum()) / n_tables,
        n_items=n_items,
        n_items_paired=n_paired,
        n_raters=counted.n_raters if n_raters is None else n_raters,
        n_categories=made.n_categories,
        reason=reason,
    )


# -- what formulas have in common ----------------------------------------------------


def divide(numerator: Floats, denominator: Floats, none: float = math.nan) -> Floats:
    """Divide, with `none` and no noise where the denominator is 0."""
    # numerator, denominator (...) -> (...)
    empty = denominator == 0.0
    return np.where(empty, none, numerator / np.where(empty, 1.0, denominator))


# -- checks --------------------------------------------------------------------------


def check_level(level: float, name: str = "level") -> None:
    """Check the level of an interval, or another share above 0 and below 1."""
    is_number = isinstance(level, int | float | np.integer | np.floating)
    # a level so near to 1 that its upper quantile is that of 1 has no ends
    is_level = is_number and 0.0 < level < 1.0 and 0.5 + 0.5 * level < 1.0
    refuse((not is_level, f"{name}: needs a number in (0, 1), got {shown(level)}"))


def recorded_generator(
    rng: np.random.Generator | int | None,
) -> tuple[np.random.Generator, int | None]:
    """Return a generator and the seed that repeats it."""
    if isinstance(rng, np.random.Generator):
        return rng, None  # its owner knows where it began
    if rng is None:
        rng = int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)
    is_seed = isinstance(rng, int | np.integer) and not isinstance(rng, bool)
    needed = "needs a numpy Generator or an integer of at least 0"
    refuse((not is_seed or rng < 0, f"rng: {needed}, got {rng!r}"))
    return np.random.default_rng(int(rng)), int(rng)


# -- intervals -----------------------------------------------------------------------


def student_t(level: float, df: float) -> float:
    """Return the two-sided quantile of Student's t; that of the normal for inf."""
    from scipy.special import ndtri, stdtrit  # loaded only when an interval needs it

    upper = 0.5 + 0.5 * level
    return float(ndtri(upper) if math.isinf(df) else stdtrit(df, upper))


def logit_ends(value: float, half: float, lowest: float = 0.0) -> tuple[float, float]:
    """Return ends about a value that are symmetric on the logit above `lowest`."""
    # of its place between that and 1; half: of the width at the value itself, which is
    # divided by the slope of the logit there
    from scipy.special import expit, logit  # loaded only for an interval

    room = 1.0 - lowest
    share = (value - lowest) / room
    of_logit = half / (room * share * (1.0 - share))
    low, high = expit([logit(share) - of_logit, logit(share) + of_logit]).tolist()
    return lowest + room * low, lowest + room * high


def undefined(title: str, reason: str) -> str:
    """Warn whoever called this package that a statistic is undefined; return why."""
    warn_caller(f"{title} is undefined: {reason}", UndefinedStatisticWarning)
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


def tested(
    name: str,
    hypothesis: str,
    distribution: str,
    df: tuple[float, ...],
    n_items: int,
    statistic: float,
    reason: str | None,
) -> Significance:
    """Return a test of a statistic, with its p-value unless there is a reason."""
    from scipy.special import chdtrc, fdtrc, ndtr, stdtr  # loaded only for a p-value

    p_of: dict[str, Callable[..., float]] = {
        "normal": lambda z: 2.0 * ndtr(-abs(z)),
        "t": lambda df, t: min(1.0, 2.0 * stdtr(df, -abs(t))),
        "F": fdtrc,
        "chi-squared": chdtrc,
    }
    return Significance(
        name=name,
        hypothesis=hypothesis,
        statistic=statistic,
        distribution=distribution,
        df=df,
        p_value=math.nan if reason else float(p_of[distribution](*df, statistic)),
        n_items=n_items,
        reason=reason,
    )


def deviations(values: Floats) -> tuple[Floats, float]:
    """Return ratings less the first, over a power of two, and that power."""
    # whole ratings stay exact, a common offset costs no digits, and squares are floats
    exponent = int(np.frexp(np.nanmax(np.abs(values)))[1]) - 1
    scaled = np.ldexp(values, -exponent)
    return scaled - scaled[~np.isnan(scaled)][0], math.ldexp(1.0, exponent)

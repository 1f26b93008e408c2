"""Coefficients of unnamed raters: 1 - D_o / D_e, exact, with its delta-method error.

D_o is the observed disagreement of two raters of an item, averaged over items, and D_e
what chance would give. Coefficients differ in D_e alone.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from numpy.typing import ArrayLike

from masrel.agreement._counts import ItemTable, count_ratings, take_counts
from masrel.agreement._kernel import (
    NO_CHANCE,
    NO_PAIR,
    Variance,
    check_population,
    check_variance,
    standard_error,
    undefined,
)
from masrel.agreement._labels import Label
from masrel.agreement.influence import (
    Expected,
    Slopes,
    as_irrcac,
    pooled_influence,
    rounded_influence,
)
from masrel.agreement.tally import Observed, Shares, Tally
from masrel.agreement.weights import WeightName, Weights, declared_weights
from masrel.estimates import Estimate

_LONG = 500  # bits of a multiple of all numbers of ratings that integers are slow with


class PooledCoefficient(NamedTuple):
    """What tells coefficients of unnamed raters apart."""

    # name, title: in code and for a reader
    name: str
    title: str
    # shares and weights to the disagreement by chance
    expected: Callable[[Shares, Weights], Expected]
    # shares and weights to its slopes in the shares; None where no share matters
    slopes: Callable[[Shares, Weights], Slopes] | None = None


class Options(NamedTuple):
    """The options of a public function, as they were given."""

    categories: Sequence[Label] | None = None
    weights: "WeightName | ArrayLike" = "identity"
    variance: Variance = "delta"
    population: int | None = None


def estimate_ratings(
    coefficient: PooledCoefficient, ratings: object, options: Options
) -> Estimate:
    """Check ratings and options, and estimate the coefficient."""
    # Takes ratings (n_items, n_raters)
    counted = count_ratings(ratings, options.categories)
    weights = declared_weights(
        options.weights, counted.categories, declared=counted.declared
    )
    return pooled_estimate(
        coefficient, counted.items, counted.n_raters, weights, options
    )


def estimate_counts(
    coefficient: PooledCoefficient, counts: ArrayLike, options: Options
) -> Estimate:
    """Check counts and options, and estimate the coefficient."""
    # Takes counts (n_items, n_categories)
    counted = take_counts(counts, options.categories)
    return estimate_ratings(coefficient, counted, options._replace(categories=None))


def pooled_estimate(
    coefficient: PooledCoefficient,
    items: ItemTable,
    n_raters: int,
    weights: Weights,
    options: Options,
) -> Estimate:
    """Estimate 1 - D_o / D_e with one division of integers."""
    check_variance(options.variance)
    tally = items.tally(weights)
    check_population(options.population, tally.n_rated)
    observed, reason = tally.observed, None
    value = p_o = p_e = math.nan
    error: float | Callable[[], float] = math.nan
    if observed is None:
        reason = undefined(coefficient.title, NO_PAIR)
    elif weights.reason is not None:
        reason = undefined(coefficient.title, weights.reason)
    else:
        chance = coefficient.expected(tally.shares, weights)
        p_o, p_e = _agreements(observed, chance)
        if chance.numerator == 0:
            reason = undefined(coefficient.title, NO_CHANCE)
        else:
            value = _value(observed, chance)
            scene = _Scene(coefficient, items, weights, tally, observed, chance)
            error = partial(_error, scene, options)
    return Estimate(
        coefficient=coefficient.name,
        weights=weights.name,
        value=value,
        standard_error=error,
        observed=p_o,
        chance=p_e,
        n_items=tally.n_rated,
        n_raters=n_raters,
        n_categories=items.n_categories,
        reason=reason,
    )


def _agreements(observed: Observed, chance: Expected) -> tuple[float, float]:
    # 1 - D_o and 1 - D_e
    d_o, over_o = observed.numerator, observed.denominator
    d_e, over_e = chance.numerator, chance.denominator
    return (over_o - d_o) / over_o, (over_e - d_e) / over_e


def _value(observed: Observed, chance: Expected) -> float:
    # 1 - D_o / D_e, in one division
    apart = observed.numerator * chance.denominator
    by_chance = chance.numerator * observed.denominator
    return (by_chance - apart) / by_chance


class _Scene(NamedTuple):
    # what a standard error is computed from
    coefficient: PooledCoefficient
    items: ItemTable
    weights: Weights
    tally: Tally
    observed: Observed
    chance: Expected


def _error(scene: _Scene, options: Options) -> float:
    coefficient, items, weights, tally, observed, chance = scene
    if tally.n_rated < 2:
        return math.nan
    slopes = Slopes()
    if coefficient.slopes is not None:
        slopes = coefficient.slopes(tally.shares, weights)
    theirs, n = options.variance == "irrcac", tally.n_rated
    if observed.multiple.bit_length() > _LONG:
        nearly = rounded_influence(tally, observed, chance, slopes, theirs)
        rounded = items.rounded_square_sum(weights, nearly)
        if rounded is not None:
            return standard_error(rounded, 1, n, options.population)
    influence = pooled_influence(tally, observed, chance, slopes)
    if theirs:
        influence = as_irrcac(influence, tally, observed, chance)
    squares, over = items.square_sum(weights, influence)
    return standard_error(squares, over, n, options.population)

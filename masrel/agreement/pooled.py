"""Coefficients of unnamed raters: 1 - D_o / D_e, exact, with its delta-method error.

D_o is the observed disagreement of two raters of an item, averaged over items, and D_e
what chance would give. Coefficients differ in D_e alone.
"""

import math
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple, get_args

from numpy.typing import ArrayLike

from masrel.agreement.coding import Label
from masrel.agreement.counts import (
    check_counts,
    column_categories,
    count_ratings,
    counted_items,
)
from masrel.agreement.items import ItemTable, Linear, SizeGroup
from masrel.agreement.undefined import NO_CHANCE, NO_PAIR, undefined
from masrel.agreement.weights import WeightName, Weights, declared_weights
from masrel.errors import ParameterError
from masrel.estimates import Estimate

__all__ = [
    "Asked",
    "Chance",
    "Expected",
    "Observed",
    "Options",
    "Shares",
    "Variance",
    "check_population",
    "check_variance",
    "estimate_counts",
    "estimate_ratings",
    "pooled_estimate",
]

Variance = Literal["delta", "irrcac"]
"""Which standard error: the delta method's, or the one irrCAC prints."""

_VARIANCES = get_args(Variance)


class Shares(NamedTuple):
    """Shares of the categories, p_k = numerators_k / total.

    A share is the mean over rated items of the part of an item's raters who chose it.
    """

    numerators: list[int]
    total: int


class Expected(NamedTuple):
    """Disagreement by chance, numerator / denominator, and its slope in each share.

    ∂D_e / ∂p_k is slopes_k / slope_denominator.
    """

    numerator: int
    denominator: int
    slopes: Sequence[int] = ()
    slope_denominator: int = 1


class Options(NamedTuple):
    """Who asks, and which standard error: its kind, and the population's size."""

    name: str
    title: str
    variance: Variance = "delta"
    population: int | None = None


def pooled_estimate(
    table: ItemTable,
    n_raters: int,
    weights: Weights,
    expected: Callable[[Shares, Weights], Expected],
    options: Options,
) -> Estimate:
    """Estimate 1 - D_o / D_e with one division of integers.

    Parameters
    ----------
    table : FewItems or ManyItems
        The items.
    n_raters : int
        Raters with at least one rating.
    weights : Weights
        Disagreement of two categories.
    expected : callable
        Shares and weights to the disagreement by chance.
    options : Options
        Name and standard error.

    Returns
    -------
    Estimate
        The coefficient; undefined without a pair of ratings or where D_e is 0.

    Warns
    -----
    UndefinedStatisticWarning
        If it is undefined.
    """
    groups = table.groups(weights)
    n_rated = sum([group.n_items for group in groups])
    check_population(options.population, n_rated)
    observed = Observed.of(groups, weights)
    reason = None
    value = error = p_o = p_e = math.nan
    if observed is None:
        reason = undefined(options.title, NO_PAIR)
    else:
        shares = _shares(groups, n_rated)
        chance = expected(shares, weights)
        d_o, over_o = observed.numerator, observed.denominator
        d_e, over_e = chance.numerator, chance.denominator
        p_o, p_e = (over_o - d_o) / over_o, (over_e - d_e) / over_e
        if weights.reason is not None:
            reason = undefined(options.title, weights.reason)
        elif d_e == 0:
            reason = undefined(options.title, NO_CHANCE)
        else:
            value = (d_e * over_o - d_o * over_e) / (d_e * over_o)
            scene = _Scene(table, weights, groups, n_rated, observed, shares, chance)
            error = _standard_error(scene, options)
    return Estimate(
        coefficient=options.name,
        weights=weights.name,
        value=value,
        standard_error=error,
        observed=p_o,
        chance=p_e,
        n_items=n_rated,
        n_raters=n_raters,
        n_categories=table.n_categories,
        reason=reason,
    )


class Observed(NamedTuple):
    """Disagreement observed, D_o = numerator / denominator, and what it is made of.

    Attributes
    ----------
    n_usable : int
        Items with at least two ratings.
    multiple : int
        A multiple of n (n - 1) for every number of ratings n.
    numerator, denominator : int
        The mean over usable items of Σ_kl v_kl n_ik n_il / (n_i (n_i - 1)).
    """

    n_usable: int
    multiple: int
    numerator: int
    denominator: int

    @classmethod
    def of(cls, groups: list[SizeGroup], weights: Weights) -> "Observed | None":
        """Sum groups of items; None if no item has two ratings.

        Parameters
        ----------
        groups : list of SizeGroup
            Items by their number of ratings.
        weights : Weights
            Disagreement of two categories.

        Returns
        -------
        Observed or None
            The disagreement.
        """
        usable = [group for group in groups if group.size > 1]
        if not usable:
            return None
        n_usable = sum([group.n_items for group in usable])
        multiple = math.lcm(*[group.size * (group.size - 1) for group in usable])
        numerator = sum(
            [g.disagreement * (multiple // (g.size * (g.size - 1))) for g in usable]
        )
        denominator = n_usable * multiple * weights.denominator
        return cls(n_usable, multiple, numerator, denominator)


def _shares(groups: list[SizeGroup], n_rated: int) -> Shares:
    if len(groups) == 1:
        return Shares(groups[0].totals, n_rated * groups[0].size)
    common = math.lcm(*[group.size for group in groups])
    weighed = [[t * (common // g.size) for t in g.totals] for g in groups]
    numerators = [sum(parts) for parts in zip(*weighed, strict=True)]
    return Shares(numerators, n_rated * common)


class _Scene(NamedTuple):
    # what the standard error is computed from
    table: ItemTable
    weights: Weights
    groups: list[SizeGroup]
    n_rated: int
    observed: Observed
    shares: Shares
    chance: Expected


def _standard_error(scene: _Scene, options: Options) -> float:
    n = scene.n_rated
    if n < 2:
        return math.nan
    influence = _influence(scene)
    if options.variance == "irrcac":
        influence = _as_irrcac(influence, scene)
    squares, over = scene.table.square_sum(scene.weights, influence)
    variance = squares / (over * n * (n - 1))
    if options.population is not None:
        variance *= (options.population - n) / options.population
    return math.sqrt(variance)


def _influence(scene: _Scene) -> Linear:
    # -u_i of item i, whose squares make the variance. With d_i its disagreement,
    # s_i = 1 if it has a pair, x_ik its shares and h_k = ∂D_e/∂p_k,
    #   -D_e u_i = (n/n') (d_i - D_o s_i) - (D_o/D_e) Σ_k h_k (x_ik - p_k).
    observed, chance, shares = scene.observed, scene.chance, scene.shares
    n, n_usable, slopes = scene.n_rated, observed.n_usable, chance.slopes
    over_h = chance.slope_denominator * shares.total if slopes else 1
    mean_h = sum([h * p for h, p in zip(slopes, shares.numerators, strict=False)])
    # All of it times n' · D_o's denominator · over_h · D_e's numerator is whole.
    scale = over_h * chance.numerator
    over_e = chance.denominator
    by_size = {}
    for group in scene.groups:
        size = group.size
        a, e = 0, 0
        b = observed.numerator * n_usable * over_e * mean_h
        if size > 1:
            a = n * n_usable * scale * (observed.multiple // (size * (size - 1)))
            b -= n * observed.numerator * scale
        if slopes:  # x_ik = n_ik / size, and the shares' total divides by every size
            e = -observed.numerator * n_usable * over_e * (shares.total // size)
        by_size[size] = (a, b, e)
    denominator = n_usable * observed.denominator * scale * chance.numerator
    return _reduced(by_size, slopes, over_e, denominator)


def _reduced(
    by_size: dict[int, tuple[int, int, int]],
    slopes: Sequence[int],
    numerator: int,
    denominator: int,
) -> Linear:
    # a, b and e times numerator / denominator, in the smallest integers
    common = math.gcd(*[part for parts in by_size.values() for part in parts])
    numerator *= common
    less = math.gcd(numerator, denominator)
    factor, common = numerator // less, common or 1
    return Linear(
        {
            size: (a // common * factor, b // common * factor, e // common * factor)
            for size, (a, b, e) in by_size.items()
        },
        slopes,
        denominator // less,
    )


def _as_irrcac(influence: Linear, scene: _Scene) -> Linear:
    # irrCAC takes u_i + κ (s_i n/n' - 1): items without a pair stay as they are
    observed, chance = scene.observed, scene.chance
    n_usable = observed.n_usable
    kappa = chance.numerator * observed.denominator
    below = kappa * n_usable
    kappa -= observed.numerator * chance.denominator
    by_size = {}
    for size, (a, b, e) in influence.by_size.items():
        moved = (scene.n_rated if size > 1 else 0) - n_usable
        moved *= kappa * influence.denominator
        by_size[size] = (a * below, b * below - moved, e * below)
    return Linear(
        by_size=by_size,
        slopes=influence.slopes,
        denominator=influence.denominator * below,
    )


class Asked(NamedTuple):
    """The options of a public function, as they were given."""

    categories: Sequence[Label] | None
    weights: "WeightName | ArrayLike"
    variance: Variance
    population: int | None


Chance = Callable[[Shares, Weights], Expected]
"""Shares and weights to the disagreement by chance."""


def estimate_ratings(
    name: str, title: str, ratings: object, asked: Asked, expected: Chance
) -> Estimate:
    """Check ratings and options, and estimate the coefficient.

    Parameters
    ----------
    name, title : str
        The coefficient, in code and for a reader.
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels.
    asked : Asked
        Options.
    expected : callable
        The disagreement by chance.

    Returns
    -------
    Estimate
        The coefficient.
    """
    counted = count_ratings(ratings, asked.categories)
    weights = declared_weights(asked.weights, counted.categories)
    options = _options(name, title, asked)
    return pooled_estimate(counted.items, counted.n_raters, weights, expected, options)


def estimate_counts(
    name: str, title: str, counts: ArrayLike, asked: Asked, expected: Chance
) -> Estimate:
    """Check counts and options, and estimate the coefficient.

    Parameters
    ----------
    name, title : str
        The coefficient, in code and for a reader.
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category.
    asked : Asked
        Options.
    expected : callable
        The disagreement by chance.

    Returns
    -------
    Estimate
        The coefficient.
    """
    table = check_counts(counts)
    categories = column_categories(asked.categories, table.shape[1])
    weights = declared_weights(asked.weights, categories)
    n_raters = int(table.sum(axis=1).max())
    options = _options(name, title, asked)
    return pooled_estimate(counted_items(table), n_raters, weights, expected, options)


def _options(name: str, title: str, asked: Asked) -> Options:
    check_variance(asked.variance)
    return Options(name, title, asked.variance, asked.population)


def check_variance(variance: str) -> None:
    """Check the name of a standard error.

    Parameters
    ----------
    variance : str
        A name.

    Raises
    ------
    ParameterError
        If there is none of that name.
    """
    if variance not in _VARIANCES:
        raise ParameterError(
            f"variance: needs one of {', '.join(_VARIANCES)}, got {variance!r}"
        )


def check_population(population: int | None, n_items: int) -> None:
    """Check the size of a finite population.

    Parameters
    ----------
    population : int or None
        Items there are in all.
    n_items : int
        Items that were rated.

    Raises
    ------
    ParameterError
        If there are fewer items than were rated.
    """
    if population is not None and population < max(n_items, 1):
        raise ParameterError(
            f"population: needs at least the {n_items} items rated, got {population}"
        )

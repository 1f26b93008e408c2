"""Light's kappa: the mean of Cohen's kappa over all pairs of raters."""

import itertools
import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from typing import Any, Literal, get_args

import numpy as np

from masrel.agreement._counts import distinct_rows
from masrel.agreement._data import CodedRatings, code_ratings, complete, raters_who_rate
from masrel.agreement._kernel import (
    Array,
    Influence,
    Integers,
    check_population,
    standard_error,
    undefined,
)
from masrel.agreement._labels import Label
from masrel.agreement._pairs import (
    PairSlopes,
    PairSums,
    SparsePairs,
    of_pairs,
    pairs_of,
)
from masrel.agreement._weights import (
    MANY,
    NO_CHANCE,
    Weights,
    WeightsLike,
    declared_weights,
)
from masrel.errors import ParameterError, RatingsError
from masrel.estimates import Estimate

Deletion = Literal["listwise", "pairwise"]
"""Which items count when ratings are missing."""


def light_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    deletion: Deletion = "listwise",
    population: int | None = None,
) -> Estimate:
    """Estimate Light's kappa: the mean of Cohen's kappa over pairs of raters.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.
    deletion : {"listwise", "pairwise"}, optional
        Use the items that every rater rated, or for each pair of raters those that
        both rated.
    population : int, optional
        Items there are in all, for the finite-population correction.

    Returns
    -------
    Estimate
        The coefficient with its standard error over items; `observed` and `chance`
        are means over pairs of raters.

    Raises
    ------
    RatingsError
        If the ratings are not such a table or of fewer than two raters.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If kappa is undefined for any pair of raters: no item has both ratings, or
        both used one and the same category throughout. The value is then ``nan``.

    References
    ----------
    .. [1] Light, R. J. (1971). Measures of response agreement for qualitative data.
       Psychological Bulletin, 76(5), 365-377. https://doi.org/10.1037/h0031643

    Examples
    --------
    >>> light_kappa([["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]).value
    0.5
    """
    everybody = code_ratings(ratings, categories)
    coded = raters_who_rate(everybody)
    if deletion not in get_args(Deletion):
        raise ParameterError(
            f"deletion: needs one of {', '.join(get_args(Deletion))}, got {deletion!r}"
        )
    if deletion == "listwise":
        coded = complete(coded)
    v = declared_weights(weights, coded.categories, declared=coded.declared)
    check_population(population, coded.n_items)
    n_raters = coded.codes.shape[1]
    if n_raters < 2:
        raise RatingsError(f"Light's kappa needs at least two raters, got {n_raters}")
    pairs = list(itertools.combinations(range(n_raters), 2))
    tables = [pairs_of(coded, pair, v) for pair in pairs]
    sums = [PairSums.of(table, v) for table in tables]
    reason = _reason(everybody, pairs, sums, v)
    error: float | Callable[[], float] = math.nan
    if reason is None:
        error = partial(
            standard_error,
            partial(_influence, coded, v, dict(zip(pairs, tables, strict=True))),
            coded.n_items_paired,
            population,
        )
    return _estimate(coded, v, sums, reason, error)


def _estimate(
    coded: CodedRatings,
    v: Weights,
    sums: list[PairSums],
    reason: str | None,
    error: float | Callable[[], float],
) -> Estimate:
    value = observed = chance = math.nan
    if v.reason is None and all(s.n for s in sums):
        w = v.denominator
        observed = _mean([1 - Fraction(s.observed) / (s.n * w) for s in sums])
        chance = _mean([1 - Fraction(s.expected) / (s.n * s.n * w) for s in sums])
    if reason is None:
        value = _mean(
            [1 - Fraction(s.n * s.observed) / Fraction(s.expected) for s in sums]
        )
    return Estimate(
        coefficient="light_kappa",
        weights=v.name,
        value=value,
        standard_error=error,
        observed=observed,
        chance=chance,
        n_items=coded.n_items,
        n_items_paired=coded.n_items_paired,
        n_raters=coded.n_raters,
        n_categories=coded.n_categories,
        reason=reason,
    )


def _mean(values: list[Fraction]) -> float:
    return float(sum(values, Fraction(0)) / len(values))


def _reason(
    everybody: CodedRatings,
    pairs: list[tuple[int, int]],
    sums: list[PairSums],
    v: Weights,
) -> str | None:
    if v.reason is not None:
        return undefined("Light's kappa", v.reason)
    rate = np.flatnonzero((everybody.codes >= 0).any(axis=0))
    for pair, of_two in zip(pairs, sums, strict=True):
        # of raters who rate, unless hardly anybody does
        first, second = rate[list(pair)] if len(rate) > 1 else pair
        of_pair = f"of the raters in columns {first} and {second}"
        if of_two.n == 0:
            return undefined("Light's kappa", f"no item has both ratings {of_pair}")
        if of_two.expected == 0:
            if v.no_chance != NO_CHANCE:
                return undefined("Light's kappa", v.no_chance)
            return undefined("Light's kappa", f"0/0: one category is all {of_pair}")
    return None


def _influence(
    coded: CodedRatings,
    v: Weights,
    tables: dict[tuple[int, int], Integers | SparsePairs],
    exact: bool,
) -> Influence:
    # An item moves the mean of the pairs' kappas by its influence on each, n / n_pair
    # times as often as one of the n_pair items that both rated, n items with a pair.
    is_many = v.n_categories > MANY and not v.has_matrix
    exact = exact and v.is_exact and not is_many
    if is_many:
        rows, freq = coded.codes, np.ones(len(coded.codes), dtype=np.int64)
    else:
        rows, freq = distinct_rows(coded.codes, coded.n_categories)
    freq = freq.astype(object if exact else np.float64)
    u: Array = np.zeros(len(rows), dtype=freq.dtype)
    terms = u.copy()
    for (g, h), table in tables.items():
        slopes, pairs = PairSlopes.of(table, v, exact), rows[:, [g, h]]
        n = len(table.codes) if isinstance(table, SparsePairs) else int(table.sum())
        often = Fraction(coded.n_items_paired, n * len(tables))
        rate: Any = often if exact else float(often)
        moved, parts = slopes.influence() * rate, abs(slopes.observed)
        parts = parts * abs(rate / slopes.d_e)
        if isinstance(table, SparsePairs):
            u[table.is_whole] += moved
            terms[table.is_whole] += parts
        else:
            u += of_pairs(moved, pairs)
            terms += of_pairs(parts, pairs)
    return Influence(u, freq, terms)

"""Agreement of raters with themselves: pairs of ratings, rater by rater."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement._counts import distinct_rows
from masrel.agreement._data import CodedRatings, code_pairs, pairs_of_raters
from masrel.agreement._kernel import (
    NO_CHANCE,
    NO_PAIR,
    Floats,
    Kernel,
    divide,
    standard_error,
    undefined,
)
from masrel.agreement._labels import Label
from masrel.agreement._pairs import PairSums, kappa_of_sums, pair_table
from masrel.agreement.cohen import COHEN_KERNEL
from masrel.agreement.weights import WeightName, Weights, declared_weights
from masrel.estimates import Estimate


def stratified_kappa(
    pairs: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
) -> Estimate:
    """Estimate one kappa over raters who each rated the same items twice.

    Each rater is a stratum with margins of its own. The estimate is
    Σ(p_o - p_e) / Σ(1 - p_e) over strata, so it stays defined when the kappa of one
    rater is not.

    Parameters
    ----------
    pairs : nested sequence or array_like, shape (n_raters, n_items, 2)
        Per rater, the grades of both sessions, items in the same order for every
        rater; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.

    Returns
    -------
    Estimate
        The coefficient; `observed` and `chance` are means over the raters used. The
        standard error takes items as the sample, each with all its raters.

    Raises
    ------
    RatingsError
        If the pairs are not such a table.
    ParameterError
        If the weights are none, or do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no rater has a pair, or every rater used one category throughout.

    Notes
    -----
    A rater without any pair of grades is left out. Pooling the pairs of all raters
    into one Cohen's kappa is another estimand: `pooled_kappa`.

    References
    ----------
    .. [1] Barlow, W., Lai, M.-Y., Azen, S. P. (1991). A comparison of methods for
       calculating a stratified kappa. Statistics in Medicine, 10(9), 1465-1472.
       https://doi.org/10.1002/sim.4780100913

    Examples
    --------
    >>> first = [["a", "a"], ["b", "b"], ["a", "b"]]
    >>> second = [["a", "a"], ["a", "a"], ["a", "a"]]  # kappa alone would be 0/0
    >>> round(stratified_kappa([first, second]).value, 3)
    0.4
    """
    coded = code_pairs(pairs, categories)
    v = declared_weights(weights, coded.categories, declared=coded.declared)
    strata = _strata(coded, v)
    apart = sum([Fraction(s.above, s.n * v.denominator) for s in strata], Fraction(0))
    by_chance = sum(
        [Fraction(s.below, s.n * s.n * v.denominator) for s in strata], Fraction(0)
    )
    reason = _reason(strata, by_chance, v)
    value = observed = chance = math.nan
    error: float | Callable[[], float] = math.nan
    if strata and v.reason is None:
        observed = float(1 - apart / len(strata))
        chance = float(1 - by_chance / len(strata))
    if reason is None:
        value = float(1 - apart / by_chance)
        error = partial(_error, coded, v, apart, by_chance)
    return Estimate(
        coefficient="stratified_kappa",
        weights=v.name,
        value=value,
        standard_error=error,
        observed=observed,
        chance=chance,
        n_items=coded.n_items,
        n_raters=len(strata),
        n_categories=coded.n_categories,
        reason=reason,
    )


def _strata(coded: CodedRatings, v: Weights) -> list[PairSums]:
    # of each rater with a pair
    tables = (pair_table(codes, coded.n_categories) for codes in pairs_of_raters(coded))
    return [found for table in tables if (found := PairSums.of(table, v)).n]


def _reason(strata: list[PairSums], by_chance: Fraction, v: Weights) -> str | None:
    if not strata:
        return undefined("stratified kappa", NO_PAIR)
    if v.reason is not None:
        return undefined("stratified kappa", v.reason)
    if by_chance == 0:
        return undefined("stratified kappa", NO_CHANCE)
    return None


def _error(
    coded: CodedRatings, v: Weights, apart: Fraction, by_chance: Fraction
) -> float:
    n_items = coded.n_items
    # Σ_r D_o,r / Σ_r D_e,r: an item pulls at both sums in every stratum it is in
    ratio = float(apart / by_chance)
    weights = v.as_floats()
    influence = np.zeros(coded.codes.shape[0])
    for codes in pairs_of_raters(coded):
        features = COHEN_KERNEL.features(
            CodedRatings(codes=codes, categories=coded.categories), weights
        )
        n = features[:, 1].sum()
        if n == 0:
            continue
        q = coded.n_categories
        means = features.sum(axis=0) / n
        first, second = features[:, 2 : 2 + q], features[:, 2 + q :]
        to_second, to_first = weights @ means[2 + q :], weights @ means[2 : 2 + q]
        expected = means[2 : 2 + q] @ to_second
        on_chance = (
            first @ to_second + second @ to_first - 2 * expected * features[:, 1]
        )
        on_observed = features[:, 0] - means[0] * features[:, 1]
        influence += (ratio * on_chance - on_observed) * n_items / n
    influence /= float(by_chance)
    return standard_error(float((influence**2).sum()), 1.0, n_items, None)


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, n_raters (2 + 2 n_categories)): each rater's pair features in turn
    return np.hstack(
        [
            COHEN_KERNEL.features(
                CodedRatings(codes=codes, categories=coded.categories), v
            )
            for codes in pairs_of_raters(coded)
        ]
    )


def _value(sums: Floats, v: Floats) -> Floats:
    # sums (..., n_raters (2 + 2 n_categories)) -> (...)
    q = len(v)
    parts = sums.reshape(*sums.shape[:-1], -1, 2 + 2 * q)
    n = np.where(parts[..., 1] > 0, parts[..., 1], 1.0)  # no pair adds 0 to both
    first, second = parts[..., 2 : 2 + q], parts[..., 2 + q :]
    expected = ((first @ v) * second).sum(axis=-1) / (n * n)
    return 1.0 - divide((parts[..., 0] / n).sum(axis=-1), expected.sum(axis=-1))


STRATIFIED_KERNEL = Kernel(features=_features, value=_value)


def pooled_kappa(
    pairs: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
) -> Estimate:
    """Estimate Cohen's kappa of the pairs of all raters together.

    Parameters
    ----------
    pairs : nested sequence or array_like, shape (n_raters, n_items, 2)
        Per rater, the grades of both sessions, items in the same order for every
        rater; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.

    Returns
    -------
    Estimate
        The coefficient. The standard error takes items as the sample, each with the
        pairs of all its raters: pairs of one item are not independent.

    Raises
    ------
    RatingsError
        If the pairs are not such a table.
    ParameterError
        If the weights are none, or do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If there is no pair, or every grade is the same.

    Notes
    -----
    Raters who differ in their margins look as if they agreed with themselves beyond
    chance: `stratified_kappa` takes each rater's own margins, and is the one to use
    unless a reader asks for this.

    References
    ----------
    .. [1] Barlow, W., Lai, M.-Y., Azen, S. P. (1991). A comparison of methods for
       calculating a stratified kappa. Statistics in Medicine, 10(9), 1465-1472.
       https://doi.org/10.1002/sim.4780100913

    Examples
    --------
    >>> first = [["a", "a"], ["b", "b"], ["a", "b"]]
    >>> second = [["a", "a"], ["a", "a"], ["a", "a"]]
    >>> round(pooled_kappa([first, second]).value, 3)
    0.571
    """
    coded = code_pairs(pairs, categories)
    v = declared_weights(weights, coded.categories, declared=coded.declared)
    q = coded.n_categories
    tables = [pair_table(codes, q) for codes in pairs_of_raters(coded)]
    found = PairSums.of(np.asarray(sum(tables[1:], tables[0])), v)
    return kappa_of_sums(
        found,
        v,
        "pooled_kappa",
        "pooled kappa",
        partial(_pooled_error, coded, found, v),
        n_items=coded.n_items,
        n_raters=sum(1 for table in tables if table.any()),
    )


def _pooled_error(coded: CodedRatings, found: PairSums, v: Weights) -> float:
    # An item moves kappa by the sum of what its pairs do; items are the sample.
    n_items, squares = coded.n_items, 0
    rows, times = distinct_rows(coded.codes, coded.n_categories)
    for row, often in zip(rows.tolist(), times.tolist(), strict=True):
        cells = Counter(zip(row[::2], row[1::2], strict=True))
        moved = sum(
            t * found.influence(k, l, v)
            for (k, l), t in cells.items()  # noqa: E741 - k, l as in the formula
            if k >= 0 and l >= 0
        )
        squares += often * moved**2
    return standard_error(squares * n_items**2, found.below**4, n_items, None)


def _pooled_features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 2 + 2 n_categories): sums of an item's pairs, as for Cohen's kappa
    parts = [
        COHEN_KERNEL.features(CodedRatings(codes=codes, categories=coded.categories), v)
        for codes in pairs_of_raters(coded)
    ]
    return np.asarray(np.sum(parts, axis=0))


POOLED_PAIRS_KERNEL = Kernel(features=_pooled_features, value=COHEN_KERNEL.value)

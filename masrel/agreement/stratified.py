"""Stratified kappa: agreement of raters with themselves, over several raters."""

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement.coding import CodedRatings, Label
from masrel.agreement.cohen import COHEN_KERNEL
from masrel.agreement.kernel import Floats, Kernel, divide
from masrel.agreement.pair_sums import PairSums, pair_table
from masrel.agreement.pairs import code_strata, strata_of
from masrel.agreement.standard_error import standard_error
from masrel.agreement.undefined import NO_CHANCE, NO_PAIR, undefined
from masrel.agreement.weights import WeightName, Weights, declared_weights
from masrel.estimates import Estimate

__all__ = ["STRATIFIED_KERNEL", "stratified_kappa"]


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
    coded = code_strata(pairs, categories)
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
    tables = (pair_table(codes, coded.n_categories) for codes in strata_of(coded))
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
    for codes in strata_of(coded):
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
            for codes in strata_of(coded)
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

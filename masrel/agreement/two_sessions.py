"""Agreement of raters with themselves: pairs of ratings, rater by rater."""

from collections.abc import Sequence
from fractions import Fraction
from functools import partial

import numpy as np

from masrel.agreement._counts import distinct_rows
from masrel.agreement._data import CodedRatings, code_pairs, pairs_of_raters
from masrel.agreement._kernel import (
    Influence,
    Integers,
)
from masrel.agreement._labels import Label
from masrel.agreement._pairs import (
    PairSlopes,
    PairSums,
    of_pairs,
    pair_table,
)
from masrel.agreement._pooled import ratio_estimate
from masrel.agreement._weights import Weights, WeightsLike, declared_weights
from masrel.estimates import Estimate


def stratified_kappa(
    pairs: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
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
        If the weights are unknown, or do not fit the categories.

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
    tables = _tables(coded)
    used = [sums for table in tables if (sums := PairSums.of(table, v)).n]
    d_o = sum([Fraction(s.observed, s.n * v.denominator) for s in used], Fraction(0))
    d_e = sum(
        [Fraction(s.expected, s.n * s.n * v.denominator) for s in used], Fraction(0)
    )
    n_used = max(len(used), 1)
    mean_o, mean_e = d_o / n_used, d_e / n_used
    return ratio_estimate(
        "stratified_kappa",
        "stratified kappa",
        v,
        (mean_o.numerator, mean_o.denominator if used else 0),
        (mean_e.numerator, mean_e.denominator),
        partial(_stratified_influence, coded, tables, v),
        None,
        n_items=coded.n_items,
        n_items_paired=_n_paired(coded),
        n_sampled=_n_paired(coded),
        n_raters=len(used),
    )


def _tables(coded: CodedRatings) -> list[Integers]:
    # of each rater's pairs
    return [pair_table(codes, coded.n_categories) for codes in pairs_of_raters(coded)]


def _n_paired(coded: CodedRatings) -> int:
    # items with both ratings of any rater
    both = [(pairs >= 0).all(axis=1) for pairs in pairs_of_raters(coded)]
    return int(np.any(both, axis=0).sum())


def _stratified_influence(
    coded: CodedRatings, tables: list[Integers], v: Weights, exact: bool
) -> Influence:
    # An item moves Σ_r D_o,r and Σ_r D_e,r in every stratum that it has a pair in,
    # n / n_r times as often as one of the n_r items of the stratum; n have a pair.
    slopes = {r: PairSlopes.of(t, v, exact) for r, t in enumerate(tables) if t.any()}
    n, d_e = _n_paired(coded), sum(of.d_e for of in slopes.values())
    ratio = sum(of.d_o for of in slopes.values()) / d_e
    rows, freq = distinct_rows(coded.codes, coded.n_categories)
    freq = freq.astype(object if exact else np.float64)
    u, terms = np.zeros((2, len(rows)), dtype=freq.dtype)
    for r, of in slopes.items():
        pairs = rows[:, 2 * r : 2 * r + 2]
        often = Fraction(n, int(tables[r].sum()))
        rate = (often if exact else float(often)) / d_e
        u += of_pairs((ratio * of.expected - of.observed) * rate, pairs)
        terms += of_pairs(abs(of.observed * rate), pairs)
    return Influence(u, freq, terms)


def pooled_kappa(
    pairs: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
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
        If the weights are unknown, or do not fit the categories.

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
    tables = _tables(coded)
    table = np.asarray(sum(tables[1:], tables[0]))
    return ratio_estimate(
        "pooled_kappa",
        "pooled kappa",
        v,
        *PairSums.of(table, v).ratios(),
        partial(_pooled_influence, coded, table, v),
        None,
        n_items=coded.n_items,
        n_items_paired=_n_paired(coded),
        n_sampled=_n_paired(coded),
        n_raters=sum(1 for of_rater in tables if of_rater.any()),
    )


def _pooled_influence(
    coded: CodedRatings, table: Integers, v: Weights, exact: bool
) -> Influence:
    # An item moves kappa by the sum of what its pairs do; items with one are sampled.
    slopes = PairSlopes.of(table, v, exact)
    often = Fraction(_n_paired(coded), int(table.sum()))
    rate = often if exact else float(often)
    rows, freq = distinct_rows(coded.codes, coded.n_categories)
    strata = [rows[:, at : at + 2] for at in range(0, rows.shape[1], 2)]
    moved, observed = slopes.influence() * rate, abs(slopes.observed * rate)
    u = sum(of_pairs(moved, pairs) for pairs in strata)
    terms = sum(of_pairs(observed / slopes.d_e, pairs) for pairs in strata)
    u, terms = np.asarray(u), np.asarray(terms)
    return Influence(u, freq.astype(u.dtype), terms)

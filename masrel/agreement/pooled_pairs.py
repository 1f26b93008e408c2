"""Pooled kappa: pairs of all raters in one table, as if one rater had made them."""

from collections import Counter
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement.coding import CodedRatings, Label
from masrel.agreement.cohen import COHEN_KERNEL
from masrel.agreement.kernel import Floats, Kernel
from masrel.agreement.pair_sums import PairSums, kappa_of_sums, pair_table
from masrel.agreement.pairs import code_strata, strata_of
from masrel.agreement.patterns import distinct_patterns
from masrel.agreement.standard_error import standard_error
from masrel.agreement.weights import WeightName, Weights, declared_weights
from masrel.estimates import Estimate

__all__ = ["POOLED_PAIRS_KERNEL", "pooled_kappa"]


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
    coded = code_strata(pairs, categories)
    v = declared_weights(weights, coded.categories, declared=coded.declared)
    q = coded.n_categories
    tables = [pair_table(codes, q) for codes in strata_of(coded)]
    found = PairSums.of(np.asarray(sum(tables[1:], tables[0])), v)
    return kappa_of_sums(
        found,
        v,
        "pooled_kappa",
        "pooled kappa",
        partial(_error, coded, found, v),
        n_items=coded.n_items,
        n_raters=sum(1 for table in tables if table.any()),
    )


def _error(coded: CodedRatings, found: PairSums, v: Weights) -> float:
    # An item moves kappa by the sum of what its pairs do; items are the sample.
    n_items, squares = coded.n_items, 0
    rows, times = distinct_patterns(coded.codes, coded.n_categories)
    for row, often in zip(rows.tolist(), times.tolist(), strict=True):
        cells = Counter(zip(row[::2], row[1::2], strict=True))
        moved = sum(
            t * found.influence(k, l, v)
            for (k, l), t in cells.items()  # noqa: E741 - k, l as in the formula
            if k >= 0 and l >= 0
        )
        squares += often * moved**2
    return standard_error(squares * n_items**2, found.below**4, n_items, None)


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 2 + 2 n_categories): sums of an item's pairs, as for Cohen's kappa
    parts = [
        COHEN_KERNEL.features(CodedRatings(codes=codes, categories=coded.categories), v)
        for codes in strata_of(coded)
    ]
    return np.asarray(np.sum(parts, axis=0))


POOLED_PAIRS_KERNEL = Kernel(features=_features, value=COHEN_KERNEL.value)

"""Cohen's kappa: agreement of two raters, each with margins of their own."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement._count_tables import check_table, column_categories
from masrel.agreement._data import code_ratings
from masrel.agreement._kernel import (
    Influence,
    Integers,
    check_population,
)
from masrel.agreement._labels import Label
from masrel.agreement._pairs import (
    PairSlopes,
    PairSums,
    SparsePairs,
    pairs_of,
    two_raters,
)
from masrel.agreement._pooled import ratio_estimate
from masrel.agreement._weights import Weights, WeightsLike, declared_weights
from masrel.estimates import Estimate


def cohen_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Cohen's kappa of two raters, or weighted kappa.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, 2)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.
    population : int, optional
        Items there are in all, for the finite-population correction.

    Returns
    -------
    Estimate
        The coefficient with its standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table or not of two raters.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has both ratings, or all ratings are in one category; the value
        is then ``nan``.

    Notes
    -----
    Only items with both ratings are used, for agreement and for the margins. The
    standard error is that of Fleiss, Cohen and Everitt [2]_, over n - 1.

    References
    ----------
    .. [1] Cohen, J. (1960). A coefficient of agreement for nominal scales.
       Educational and Psychological Measurement, 20(1), 37-46.
       https://doi.org/10.1177/001316446002000104
    .. [2] Fleiss, J. L., Cohen, J., Everitt, B. S. (1969). Large sample standard
       errors of kappa and weighted kappa. Psychological Bulletin, 72(5), 323-327.
       https://doi.org/10.1037/h0028106

    Examples
    --------
    >>> cohen_kappa([["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]).value
    0.5
    """
    coded = two_raters(code_ratings(ratings, categories), "Cohen's kappa")
    v = declared_weights(weights, coded.categories, declared=coded.declared)
    return _estimate(pairs_of(coded, (0, 1), v), v, population)


def cohen_kappa_from_table(
    table: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Cohen's kappa from a contingency table.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rater (columns).
    categories, weights, population : optional
        As of `cohen_kappa`; categories are 1 to n_categories unless given.

    Returns
    -------
    Estimate
        As of `cohen_kappa`.

    Raises
    ------
    CountsError
        If it is not a square table of counts.
    ParameterError
        As `cohen_kappa`.

    Warns
    -----
    UndefinedStatisticWarning
        As `cohen_kappa`.

    Examples
    --------
    >>> cohen_kappa_from_table([[1, 1], [0, 2]]).value
    0.5
    """
    checked = check_table(table)
    labels = column_categories(categories, len(checked))
    return _estimate(checked, declared_weights(weights, labels), population)


def _estimate(
    table: Integers | SparsePairs, v: Weights, population: int | None
) -> Estimate:
    # shape of table: (n_categories, n_categories)
    sums = PairSums.of(table, v)
    check_population(population, sums.n)
    return ratio_estimate(
        "cohen_kappa",
        "Cohen's kappa",
        v,
        *sums.ratios(),
        partial(_influence, table, v),
        population,
        n_items=sums.n,
        n_items_paired=sums.n,
        n_raters=2 if sums.n else 0,
    )


def _influence(table: Integers | SparsePairs, v: Weights, exact: bool) -> Influence:
    # of the cells of the table
    slopes = PairSlopes.of(table, v, exact)
    u, terms = slopes.influence(), slopes.observed / slopes.d_e
    if isinstance(table, SparsePairs):
        return Influence(u, np.ones(len(u)), terms)
    freq = table.astype(u.dtype)
    return Influence(u.ravel(), freq.ravel(), terms.ravel())

"""Gwet's AC1 and, weighted, AC2: chance agreement among hard items only."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from masrel.agreement._count_tables import count_items
from masrel.agreement._kernel import Variance
from masrel.agreement._labels import Label
from masrel.agreement._pooled import GWET, estimate_pooled
from masrel.agreement._weights import WeightsLike
from masrel.estimates import Estimate


def gwet_ac(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate Gwet's AC1, or AC2 with weights.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.
    variance : {"delta", "irrcac"}, optional
        Which standard error; irrCAC's is too large with single ratings.
    population : int, optional
        Items there are in all, for the finite-population correction.

    Returns
    -------
    Estimate
        The coefficient with its standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or one category is declared; the value
        is then ``nan``.

    Notes
    -----
    Chance agreement is Σ_kl w_kl / (q (q - 1)) · Σ_k p_k (1 - p_k): the declared
    categories count, used or not. It is small when nearly all ratings are in one
    category, where kappa falls towards 0. Missing ratings as in `fleiss_kappa`.

    References
    ----------
    .. [1] Gwet, K. L. (2008). Computing inter-rater reliability and its variance in
       the presence of high agreement. British Journal of Mathematical and
       Statistical Psychology, 61(1), 29-48. https://doi.org/10.1348/000711006X126600

    Examples
    --------
    >>> round(gwet_ac([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    """
    return estimate_pooled(GWET, ratings, categories, weights, variance, population)


def gwet_ac_from_counts(
    counts: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate Gwet's AC from how many raters chose each category.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.
    categories, weights, variance, population : optional
        As of `gwet_ac`; categories are 1 to n_categories unless given.

    Returns
    -------
    Estimate
        As of `gwet_ac`; `n_raters` is the largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.
    ParameterError
        As `gwet_ac`.

    Warns
    -----
    UndefinedStatisticWarning
        As `gwet_ac`.

    Examples
    --------
    >>> round(gwet_ac_from_counts([[2, 0], [2, 0], [1, 1]]).value, 3)
    0.538
    """
    counted = count_items(counts, categories=categories)
    return estimate_pooled(GWET, counted, None, weights, variance, population)

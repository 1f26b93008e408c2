"""Percent agreement: how often two raters of an item agree, not corrected."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from masrel.agreement._count_tables import count_items
from masrel.agreement._kernel import Variance
from masrel.agreement._labels import Label
from masrel.agreement._pooled import PERCENT, estimate_pooled
from masrel.agreement._weights import WeightsLike
from masrel.estimates import Estimate


def percent_agreement(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate how often two raters of the same item agree.

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
        The proportion with its standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters; the value is then ``nan``.

    Notes
    -----
    Items with fewer than two ratings say nothing about agreement and are left out
    of the mean; they count in the standard error, where the number of usable items
    is itself random.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 2.

    Examples
    --------
    >>> percent_agreement([["a", "a"], ["a", "b"]]).value
    0.5
    """
    return estimate_pooled(PERCENT, ratings, categories, weights, variance, population)


def percent_agreement_from_counts(
    counts: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate percent agreement from how many raters chose each category.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.
    categories, weights, variance, population : optional
        As of `percent_agreement`; categories are 1 to n_categories unless given.

    Returns
    -------
    Estimate
        As of `percent_agreement`; `n_raters` is the largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.
    ParameterError
        As `percent_agreement`.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters.

    Examples
    --------
    >>> percent_agreement_from_counts([[2, 0], [1, 1]]).value
    0.5
    """
    counted = count_items(counts, categories=categories)
    return estimate_pooled(PERCENT, counted, None, weights, variance, population)

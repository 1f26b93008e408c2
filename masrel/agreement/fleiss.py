"""Fleiss' kappa: agreement of two or more raters who are not told apart."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from masrel.agreement._count_tables import count_items
from masrel.agreement._kernel import Variance
from masrel.agreement._labels import Label
from masrel.agreement._pooled import FLEISS, estimate_pooled
from masrel.agreement._weights import WeightsLike
from masrel.estimates import Estimate


def fleiss_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate Fleiss' kappa from an item × rater table.

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
        If no item has ratings of two raters, or all ratings are in one category;
        the value is then ``nan``.

    Notes
    -----
    With missing ratings, agreement is averaged over items with at least two
    ratings, and a category's share is the mean over items with any rating of the
    share of the item's raters who chose it (Gwet's convention).

    References
    ----------
    .. [1] Fleiss, J. L. (1971). Measuring nominal scale agreement among many
       raters. Psychological Bulletin, 76(5), 378-382.
       https://doi.org/10.1037/h0031619
    .. [2] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed.

    Examples
    --------
    Two raters agree on two items and differ on a third:

    >>> round(fleiss_kappa([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    """
    return estimate_pooled(FLEISS, ratings, categories, weights, variance, population)


def fleiss_kappa_from_counts(
    counts: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate Fleiss' kappa from how many raters chose each category.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.
    categories, weights, variance, population : optional
        As of `fleiss_kappa`; categories are 1 to n_categories unless given.

    Returns
    -------
    Estimate
        As of `fleiss_kappa`; `n_raters` is the largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.
    ParameterError
        As `fleiss_kappa`.

    Warns
    -----
    UndefinedStatisticWarning
        As `fleiss_kappa`.

    Examples
    --------
    >>> round(fleiss_kappa_from_counts([[2, 0], [0, 2], [1, 1]]).value, 3)
    0.333
    """
    counted = count_items(counts, categories=categories)
    return estimate_pooled(FLEISS, counted, None, weights, variance, population)

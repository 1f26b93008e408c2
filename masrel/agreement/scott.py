"""Scott's pi: agreement of two raters who share their margins."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from masrel.agreement._count_tables import count_table
from masrel.agreement._data import code_ratings, complete
from masrel.agreement._labels import Label
from masrel.agreement._pairs import two_raters
from masrel.agreement._pooled import SCOTT, estimate_pooled
from masrel.agreement._weights import WeightsLike
from masrel.estimates import Estimate


def scott_pi(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Scott's pi of two raters.

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
    Only items with both ratings are used; on these it is Fleiss' kappa.

    References
    ----------
    .. [1] Scott, W. A. (1955). Reliability of content analysis: the case of nominal
       scale coding. Public Opinion Quarterly, 19(3), 321-325.
       https://doi.org/10.1086/266577

    Examples
    --------
    >>> round(scott_pi([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    """
    coded = complete(two_raters(code_ratings(ratings, categories), "Scott's pi"))
    return estimate_pooled(SCOTT, coded, None, weights, population=population)


def scott_pi_from_table(
    table: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Scott's pi from a contingency table.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rater (columns).
    categories, weights, population : optional
        As of `scott_pi`; categories are 1 to n_categories unless given.

    Returns
    -------
    Estimate
        As of `scott_pi`.

    Raises
    ------
    CountsError
        If it is not a square table of counts.
    ParameterError
        As `scott_pi`.

    Warns
    -----
    UndefinedStatisticWarning
        As `scott_pi`.

    Examples
    --------
    >>> round(scott_pi_from_table([[1, 1], [0, 1]]).value, 3)
    0.333
    """
    counted = count_table(table, categories=categories)
    return estimate_pooled(SCOTT, counted, None, weights, population=population)

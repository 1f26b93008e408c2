"""Brennan and Prediger's coefficient: chance picks every category alike."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from masrel.agreement._count_tables import count_items
from masrel.agreement._kernel import Variance
from masrel.agreement._labels import Label
from masrel.agreement._pooled import BRENNAN_PREDIGER, estimate_pooled
from masrel.agreement._weights import WeightsLike
from masrel.estimates import Estimate


def brennan_prediger(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate Brennan and Prediger's coefficient, of two categories PABAK.

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
    Chance agreement is Σ_kl w_kl / q², with q the declared categories, used or not.
    With two categories it is the prevalence-adjusted bias-adjusted kappa, PABAK.
    Missing ratings as in `fleiss_kappa`.

    References
    ----------
    .. [1] Brennan, R. L., Prediger, D. J. (1981). Coefficient kappa: some uses,
       misuses, and alternatives. Educational and Psychological Measurement, 41(3),
       687-699. https://doi.org/10.1177/001316448104100307

    Examples
    --------
    >>> round(brennan_prediger([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    """
    return estimate_pooled(
        BRENNAN_PREDIGER, ratings, categories, weights, variance, population
    )


def brennan_prediger_from_counts(
    counts: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    variance: Variance = "delta",
    population: int | None = None,
) -> Estimate:
    """Estimate the coefficient from how many raters chose each category.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.
    categories, weights, variance, population : optional
        As of `brennan_prediger`; categories are 1 to n_categories unless given.

    Returns
    -------
    Estimate
        As of `brennan_prediger`; `n_raters` is the largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.
    ParameterError
        As `brennan_prediger`.

    Warns
    -----
    UndefinedStatisticWarning
        As `brennan_prediger`.

    Examples
    --------
    >>> round(brennan_prediger_from_counts([[2, 0], [2, 0], [1, 1]]).value, 3)
    0.333
    """
    counted = count_items(counts, categories=categories)
    return estimate_pooled(
        BRENNAN_PREDIGER, counted, None, weights, variance, population
    )

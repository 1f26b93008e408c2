"""Fleiss' kappa: agreement of two or more raters who are not told apart."""

from collections.abc import Sequence
from operator import mul

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement._kernel import Floats, Variance, pooled_kernel
from masrel.agreement._labels import Label
from masrel.agreement._pooled import (
    Options,
    PooledCoefficient,
    estimate_counts,
    estimate_ratings,
)
from masrel.agreement.influence import Expected, Slopes
from masrel.agreement.tally import Shares
from masrel.agreement.weights import WeightName, Weights
from masrel.estimates import Estimate

__all__ = [
    "FLEISS_KERNEL",
    "expected_disagreement",
    "expected_slopes",
    "fleiss_kappa",
    "fleiss_kappa_from_counts",
]


def fleiss_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
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
        If an option is none, or the weights do not fit the categories.

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
    options = Options(categories, weights, variance, population)
    return estimate_ratings(_COEFFICIENT, ratings, options)


def fleiss_kappa_from_counts(
    counts: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
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
    options = Options(categories, weights, variance, population)
    return estimate_counts(_COEFFICIENT, counts, options)


def expected_disagreement(shares: Shares, weights: Weights) -> Expected:
    """Return Σ_kl v_kl p_k p_l, 1 - P̄_e of [1] in `fleiss_kappa`."""
    products = weights.products(shares.numerators)
    return Expected(
        sum(map(mul, shares.numerators, products)),
        shares.total * shares.total * weights.denominator,
    )


def expected_slopes(shares: Shares, weights: Weights) -> Slopes:
    """Return 2 Σ_l v_kl p_l, the slope of `expected_disagreement` in p_k."""
    return Slopes(
        [2 * vp for vp in weights.products(shares.numerators)],
        shares.total * weights.denominator,
    )


_COEFFICIENT = PooledCoefficient(
    "fleiss_kappa", "Fleiss' kappa", expected_disagreement, expected_slopes
)


def _in_floats(shares: Floats, v: Floats) -> Floats:
    # shares (..., n_categories) -> (...)
    return np.asarray(np.einsum("...k,...k->...", shares @ v, shares))


FLEISS_KERNEL = pooled_kernel(_in_floats)

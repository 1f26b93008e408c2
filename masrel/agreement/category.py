"""Fleiss' kappa of each category against the others, and the test of no agreement."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._codes import (
    complete_rows,
    count_items,
    count_ratings,
    item_counts,
    raters_told_apart,
)
from masrel.agreement._engine import undefined
from masrel.agreement._labels import Label, shown
from masrel.agreement.kappas import fleiss_kappa
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Significance


def category_kappa(
    ratings: object,
    category: Label,
    *,
    categories: Sequence[Label] | None = None,
) -> Estimate:
    """Estimate Fleiss' kappa of one category against all others.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing. Counted ratings will do.
    category : str, int or float
        One of the categories.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    Estimate
        How well raters tell this category from the rest; `weights` names it, and
        `n_categories` is 2.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If there is no such category.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has two ratings, or nobody, or everybody, used the category.

    Notes
    -----
    Fleiss' kappa is the mean of these over categories, weighed by p_k (1 - p_k).

    References
    ----------
    .. [1] Fleiss, J. L. (1971). Measuring nominal scale agreement among many raters.
       Psychological Bulletin, 76(5), 378-382. https://doi.org/10.1037/h0031619

    Examples
    --------
    >>> ratings = [["a", "a"], ["b", "b"], ["c", "c"], ["a", "b"]]
    >>> category_kappa(ratings, "c").value
    1.0
    """
    counted = count_ratings(ratings, categories)
    place, codes = _place(category, counted.categories), counted.codes
    of_two = replace(
        counted,
        codes=np.where(codes < 0, codes, codes != place),
        categories=(True, False),
        source=None,
    )
    return replace(
        fleiss_kappa(of_two), coefficient="category_kappa", weights=str(category)
    )


def _place(category: Label, scale: Sequence[Label]) -> int:
    # of a category in the scale
    if category not in scale:
        raise ParameterError(
            f"category: needs one of {', '.join(map(repr, scale))}, got "
            f"{shown(category)}"
        )
    return scale.index(category)


def fleiss_null(
    ratings: object,
    *,
    category: Label | None = None,
    categories: Sequence[Label] | None = None,
) -> Significance:
    """Test whether Fleiss' kappa is 0, by its standard error when it is.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; items with a missing rating are left out, and so are raters
        without any.
    category : str, int or float, optional
        Test the kappa of this category against the others instead.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    Significance
        The statistic z with its two-sided p-value from the normal. The standard error
        under the hypothesis belongs to this test: it makes no interval.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If there is no such category.

    Warns
    -----
    UndefinedStatisticWarning
        If no item is complete, there is one rater, or kappa is undefined.

    References
    ----------
    .. [1] Fleiss, J. L., Nee, J. C. M., Landis, J. R. (1979). Large sample variance of
       kappa in the case of different sets of raters. Psychological Bulletin, 86(5),
       974-977. https://doi.org/10.1037/0033-2909.86.5.974

    Examples
    --------
    >>> print(fleiss_null([["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"]]))
    fleiss_null: 0.9333, normal, p = 0.351
    """
    counted = complete_rows(raters_told_apart(ratings, categories))
    counts = item_counts(counted.codes, counted.n_categories)
    counts, n_raters = counts.repeat(counted.freq, axis=0), counted.codes.shape[1]
    if category is not None:
        chosen = counts[:, _place(category, counted.categories)]
        counts = np.column_stack([chosen, n_raters - chosen])
    statistic = p = math.nan
    reason = None
    if n_raters < 2:
        reason = undefined("fleiss_null", "fewer than two raters")
    elif len(counts) == 0:
        reason = undefined("fleiss_null", "no item is rated by every rater")
    elif (counts.sum(axis=0) > 0).sum() < 2:
        reason = undefined("fleiss_null", "0/0: all ratings are in one category")
    else:
        from scipy.special import ndtr

        value = fleiss_kappa(count_items(counts)).value
        statistic = value / _null_error(counts, n_raters)
        p = 2.0 * float(ndtr(-abs(statistic)))
    return Significance(
        name="fleiss_null",
        hypothesis="Fleiss' kappa is 0",
        statistic=statistic,
        distribution="normal",
        df=(),
        p_value=p,
        n_items=len(counts),
        reason=reason,
    )


def _null_error(counts: NDArray[np.int64], n_raters: int) -> float:
    """Return the standard error of Fleiss' kappa where kappa is 0."""
    # (12) of [1]: with p the shares and q = 1 - p,
    #   SE0 = √2 / (Σpq √(N n (n - 1))) · √((Σpq)² - Σ pq (q - p))
    total = counts.sum()
    p = counts.sum(axis=0) / total
    q = (total - counts.sum(axis=0)) / total
    pq = (p * q).sum()
    difference = pq**2 - (p * q * (q - p)).sum()
    return math.sqrt(2.0 * difference / (total * (n_raters - 1))) / float(pq)

"""Robinson's A: the share of variance between items, levels of raters set aside."""

import math
from collections.abc import Sequence

import numpy as np

from masrel.agreement._data import complete_values
from masrel.agreement._kernel import undefined
from masrel.agreement._labels import Label
from masrel.estimates import Estimate

__all__ = ["robinson_a"]


def robinson_a(
    ratings: object, *, categories: Sequence[Label] | None = None
) -> Estimate:
    """Estimate Robinson's A.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; needed for text.

    Returns
    -------
    Estimate
        A within [0, 1]. It has no delta-method error, observed or chance agreement.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two complete items or raters, or no variance; the
        value is then ``nan``.

    Notes
    -----
    Items with a missing rating are left out. A = SS_items / (SS_items + SS_residual):
    a rater who is always one grade higher loses nothing.

    References
    ----------
    .. [1] Robinson, W. S. (1957). The statistical measurement of agreement. American
       Sociological Review, 22(1), 17-25. https://doi.org/10.2307/2088760

    Examples
    --------
    >>> robinson_a([[1, 2], [2, 3], [3, 4]]).value
    1.0
    """
    values = complete_values(ratings, categories)
    n, k = values.shape
    reason, value = None, math.nan
    if n < 2 or k < 2:
        why = "fewer than two items or raters in the items that every rater rated"
        reason = undefined("Robinson's A", why)
    else:
        # Deviations times n k: whole, and so exact, for whole ratings.
        x = values - values[0, 0]
        of_items, of_raters = x.sum(axis=1, keepdims=True), x.sum(axis=0)
        rows = n * of_items - x.sum()
        residual = n * (k * x - of_items) - (k * of_raters - x.sum())
        between, rest = float(k * (rows**2).sum()), float((residual**2).sum())
        if between + rest == 0.0:
            reason = undefined("Robinson's A", "0/0: no variance but between raters")
        else:
            value = between / (between + rest)
    return Estimate(
        coefficient="robinson_a",
        weights="quadratic",
        value=value,
        standard_error=math.nan,
        observed=math.nan,
        chance=math.nan,
        n_items=n,
        n_raters=k,
        n_categories=len(np.unique(values)) if categories is None else len(categories),
        reason=reason,
    )

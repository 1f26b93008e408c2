"""Kendall's coefficient of concordance W, with ties."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._codes import complete_values
from masrel.agreement._engine import measured, undefined
from masrel.agreement._labels import Label
from masrel.estimates import Estimate, Significance


def kendall_w(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    ties: bool = True,
) -> Estimate:
    """Estimate how far raters put the items into the same order.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; needed for text.
    ties : bool, optional
        Whether to correct for ties; without it W cannot reach 1 when there are any.

    Returns
    -------
    Estimate
        W within [0, 1]. It has no delta-method error, observed or chance agreement.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two complete items or two raters, or every rater ties
        all items; the value is then ``nan``.

    Notes
    -----
    Items with a missing rating are left out.

    References
    ----------
    .. [1] Kendall, M. G., Babington Smith, B. (1939). The problem of m rankings.
       Annals of Mathematical Statistics, 10(3), 275-287.
       https://doi.org/10.1214/aoms/1177732186
    .. [2] Kendall, M. G. (1948). Rank Correlation Methods, ch. 6.

    Examples
    --------
    >>> kendall_w([[1, 1, 2], [2, 3, 1], [3, 2, 3]]).value
    0.4444444444444444
    """
    values = complete_values(ratings, categories)
    value, reason = _w(values, ties=ties)
    weights = "tie-corrected" if ties else "uncorrected"
    return measured(
        "kendall_w", values, categories, value, weights=weights, reason=reason
    )


def kendall_w_test(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    ties: bool = True,
) -> Significance:
    """Test whether the raters' orders are unrelated, by Friedman's chi-squared.

    Parameters
    ----------
    ratings, categories, ties : optional
        As of `kendall_w`.

    Returns
    -------
    Significance
        Friedman's m (n - 1) W with n - 1 degrees of freedom; approximate below some
        8 items.

    Raises
    ------
    RatingsError
        As `kendall_w`.

    Warns
    -----
    UndefinedStatisticWarning
        As `kendall_w`.

    Examples
    --------
    >>> print(kendall_w_test([[1, 1, 2], [2, 3, 1], [3, 2, 3]]))
    kendall_w_test: 2.667, chi-squared(2), p = 0.264
    """
    values = complete_values(ratings, categories)
    n, m = values.shape
    w, reason = _w(values, ties=ties)
    statistic = p = math.nan
    if reason is None:
        from scipy.special import chdtrc

        statistic = m * (n - 1) * w
        p = float(chdtrc(n - 1, statistic))
    return Significance(
        name="kendall_w_test",
        hypothesis="the raters' orders are unrelated",
        statistic=statistic,
        distribution="chi-squared",
        df=(float(max(n - 1, 0)),),
        p_value=p,
        n_items=n,
        reason=reason,
    )


def _w(values: NDArray[np.float64], *, ties: bool) -> tuple[float, str | None]:
    """Return W, or why there is none."""
    n, m = values.shape
    if n < 2:
        why = "fewer than two items are rated by every rater"
        return math.nan, undefined("Kendall's W", why)
    if m < 2:
        return math.nan, undefined("Kendall's W", "fewer than two raters")
    # ranks are doubled, so that those of ties are whole, and S four times as large
    sums, tied = np.zeros(n, dtype=np.int64), 0
    for column in values.T:
        _, place, freq = np.unique(column, return_inverse=True, return_counts=True)
        # the mean rank of a tie, doubled: those below twice, then t + 1
        sums += (2 * (np.cumsum(freq) - freq) + freq + 1)[place]
        tied += sum(t**3 - t for t in freq.tolist())
    # 12 S / (m² (n³ - n) - m ΣT), as in [2], in whole numbers of any size
    numerator = 3 * sum((s - m * (n + 1)) ** 2 for s in sums.tolist())
    whole = m**2 * (n**3 - n)
    denominator = whole - m * tied if ties else whole
    if denominator == 0:
        why = "0/0: every rater gives all items one rating"
        return math.nan, undefined("Kendall's W", why)
    return numerator / denominator, None

"""Kendall's coefficient of concordance W, with ties."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import complete_values
from masrel.agreement._engine import undefined
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
    ranks = _Ranks.of(values)
    reason = _reason(values, ranks, ties=ties)
    value = math.nan if reason else ranks.numerator / ranks.denominator(ties=ties)
    return Estimate(
        coefficient="kendall_w",
        weights="tie-corrected" if ties else "uncorrected",
        value=value,
        standard_error=math.nan,
        observed=math.nan,
        chance=math.nan,
        n_items=ranks.n,
        n_items_paired=ranks.n if ranks.m > 1 else 0,
        n_raters=ranks.m,
        n_categories=len(np.unique(values)) if categories is None else len(categories),
        reason=reason,
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
    ranks = _Ranks.of(values)
    reason = _reason(values, ranks, ties=ties)
    statistic = p = math.nan
    if reason is None:
        from scipy.special import chdtrc

        statistic = (
            ranks.m * (ranks.n - 1) * ranks.numerator / ranks.denominator(ties=ties)
        )
        p = float(chdtrc(ranks.n - 1, statistic))
    return Significance(
        name="kendall_w_test",
        hypothesis="the raters' orders are unrelated",
        statistic=statistic,
        distribution="chi-squared",
        df=(float(max(ranks.n - 1, 0)),),
        p_value=p,
        n_items=ranks.n,
        reason=reason,
    )


def _reason(values: NDArray[np.float64], ranks: "_Ranks", *, ties: bool) -> str | None:
    if values.shape[0] < 2:
        why = "fewer than two items are rated by every rater"
        return undefined("Kendall's W", why)
    if values.shape[1] < 2:
        return undefined("Kendall's W", "fewer than two raters")
    if ranks.denominator(ties=ties) == 0:
        return undefined("Kendall's W", "0/0: every rater gives all items one rating")
    return None


@dataclass(frozen=True, slots=True)
class _Ranks:
    # Doubled ranks, so that those of ties are whole; W = numerator / denominator, as in
    # [2].
    n: int
    m: int
    numerator: int
    ties: int  # Σ (t³ - t) over the ties of all raters

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> "_Ranks":
        n, m = values.shape
        sums, ties = np.zeros(n, dtype=np.int64), 0
        for column in values.T:
            _, place, freq = np.unique(column, return_inverse=True, return_counts=True)
            # the mean rank of a tie, doubled: those below twice, then t + 1
            doubled = 2 * (np.cumsum(freq) - freq) + freq + 1
            sums += doubled[place]
            ties += sum(t**3 - t for t in freq.tolist())
        mean = m * (n + 1)  # of doubled rank sums
        return cls(n, m, 3 * sum((s - mean) ** 2 for s in sums.tolist()), ties)

    def denominator(self, *, ties: bool) -> int:
        # 12 S / (m² (n³ - n) - m ΣT); S of doubled ranks is four times as large
        whole = self.m**2 * (self.n**3 - self.n)
        return whole - self.m * self.ties if ties else whole

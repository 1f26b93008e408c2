"""Two ratings of the same items: whether both choose each category alike often."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.counts import check_table
from masrel.agreement.significance import Significance, chi_squared

__all__ = ["bhapkar", "stuart_maxwell"]


def stuart_maxwell(table: ArrayLike) -> Significance:
    """Test whether two ratings have the same margins.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rating (columns).

    Returns
    -------
    Significance
        Chi-squared. Categories between which items changed, directly or by way of
        others, form groups; a group adds its categories less one to the degrees of
        freedom. A category whose margins are equal stays in.

    Raises
    ------
    CountsError
        If it is not a square table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        If no item changed: 0/0.

    References
    ----------
    .. [1] Stuart, A. (1955). A test for homogeneity of the marginal distributions in
       a two-way classification. Biometrika, 42(3/4), 412-416.
       https://doi.org/10.2307/2333387
    .. [2] Maxwell, A. E. (1970). Comparing the classification of subjects by two
       independent judges. British Journal of Psychiatry, 116(535), 651-655.
       https://doi.org/10.1192/bjp.116.535.651

    Examples
    --------
    >>> print(stuart_maxwell([[10, 5], [1, 10]]))
    stuart_maxwell: 2.667, chi-squared(1), p = 0.102
    """
    cells = check_table(table)
    statistic, df = _margin_statistic(cells)
    return chi_squared(
        "stuart_maxwell",
        "both ratings have the same margins",
        statistic,
        1 if df else 0,
        df,
        int(cells.sum()),
    )


def bhapkar(table: ArrayLike) -> Significance:
    """Test whether two ratings have the same margins, by a Wald statistic.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rating (columns).

    Returns
    -------
    Significance
        Chi-squared, X / (1 - X/n) with X that of `stuart_maxwell` and the same
        degrees of freedom; infinite where X = n, all items having changed one way.

    Raises
    ------
    CountsError
        If it is not a square table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        If no item changed: 0/0.

    References
    ----------
    .. [1] Bhapkar, V. P. (1966). A note on the equivalence of two test criteria for
       hypotheses in categorical data. Journal of the American Statistical
       Association, 61(313), 228-235. https://doi.org/10.1080/01621459.1966.10502021
    .. [2] Keefe, T. J. (1982). On the relationship between two tests for homogeneity
       of the marginal distributions. Biometrika, 69(3), 683-684.
       https://doi.org/10.1093/biomet/69.3.683

    Examples
    --------
    >>> print(bhapkar([[10, 5], [1, 10]]))
    bhapkar: 2.971, chi-squared(1), p = 0.0847
    """
    cells = check_table(table)
    n = int(cells.sum())
    statistic, df = _margin_statistic(cells)
    if df and statistic < n:
        statistic = statistic / (1.0 - statistic / n)
    elif df:
        statistic = math.inf
    return chi_squared(
        "bhapkar",
        "both ratings have the same margins",
        statistic,
        1 if df else 0,
        df,
        n,
    )


def _margin_statistic(cells: NDArray[np.int64]) -> tuple[float, int]:
    # d' V⁻¹ d, d = t_k. - t_.k, V_kk = t_k. + t_.k - 2 t_kk and V_kl = -t_kl - t_lk.
    # V is the Laplacian of the graph of changes: it is singular once per group of
    # categories that changes connect, and each group can do without one of its own.
    changes = cells + cells.T
    np.fill_diagonal(changes, 0)
    laplacian = np.diag(changes.sum(axis=1)) - changes
    shift = cells.sum(axis=1) - cells.sum(axis=0)
    statistic, df = 0.0, 0
    for group in _groups(changes):
        kept = group[1:]
        if kept:
            part = laplacian[np.ix_(kept, kept)].astype(np.float64)
            d = shift[kept].astype(np.float64)
            statistic += float(d @ np.linalg.solve(part, d))
            df += len(kept)
    return statistic, df


def _groups(changes: NDArray[np.int64]) -> list[list[int]]:
    # categories connected by changes, directly or by way of others
    left, groups = set(range(len(changes))), []
    while left:
        group, fresh = set(), {min(left)}
        while fresh:
            group |= fresh
            met = np.flatnonzero(changes[sorted(fresh)].any(axis=0)).tolist()
            fresh = set(met) - group
        left -= group
        groups.append(sorted(group))
    return groups

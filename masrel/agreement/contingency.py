"""Two ratings of the same items as a table, and tests of change between them."""

import math
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement._engine import undefined
from masrel.agreement._labels import Label
from masrel.agreement._rows import (
    check_table,
    pair_table,
    two_raters,
)
from masrel.errors import CountsError, ParameterError
from masrel.estimates import Significance

_MAX_SUMMED = 1_000  # changes up to which binomial probabilities are summed

McnemarKind = Literal["exact", "uncorrected", "corrected"]
"""The binomial distribution, or chi-squared without or with continuity correction."""


def contingency_table(
    ratings: object, *, categories: Sequence[Label] | None = None
) -> NDArray[np.int64]:
    """Count the pairs of ratings of two raters.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, 2)
        Labels or numbers; items with a missing rating are left out.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    ndarray of int64, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rater (columns).

    Raises
    ------
    RatingsError
        If the ratings are not such a table or not of two raters.

    Examples
    --------
    >>> contingency_table([["a", "a"], ["a", "b"], ["b", "b"]]).tolist()
    [[1, 1], [0, 1]]
    """
    counted = two_raters(ratings, categories, "a contingency table")
    return pair_table(counted.codes, counted.n_categories, counted.freq)


def mcnemar(table: ArrayLike, *, kind: McnemarKind = "exact") -> Significance:
    """Test whether two ratings choose the second of two categories alike often.

    Parameters
    ----------
    table : array_like of int, shape (2, 2)
        Items per category of the first (rows) and second rating (columns).
    kind : {"exact", "uncorrected", "corrected"}, optional
        The binomial distribution of the items that changed; or chi-squared.

    Returns
    -------
    Significance
        The smaller count of changes with its binomial distribution, or chi-squared.

    Raises
    ------
    CountsError
        If it is not a 2 × 2 table of counts.
    ParameterError
        If the kind is unknown.

    Warns
    -----
    UndefinedStatisticWarning
        If no item changed and the kind is not exact: 0/0. The exact p-value is 1.

    References
    ----------
    .. [1] McNemar, Q. (1947). Note on the sampling error of the difference between
       correlated proportions. Psychometrika, 12(2), 153-157.
       https://doi.org/10.1007/BF02295996

    Examples
    --------
    One of six changes goes the other way: p = 2 (1 + 6)/2⁶.

    >>> mcnemar([[10, 5], [1, 10]]).p_value
    0.21875
    """
    cells = check_table(table)
    if cells.shape != (2, 2):
        raise CountsError(
            f"table: mcnemar needs 2 × 2, got {len(cells)} × {len(cells)}"
        )
    if kind not in get_args(McnemarKind):
        raise ParameterError(
            f"kind: needs one of {', '.join(get_args(McnemarKind))}, got {kind!r}"
        )
    b, c = int(cells[0, 1]), int(cells[1, 0])
    n_items = int(cells.sum())
    hypothesis = "changes go both ways alike often"
    if kind == "exact":
        return Significance(
            name="mcnemar",
            hypothesis=hypothesis,
            statistic=float(min(b, c)),
            distribution="binomial",
            df=(float(b + c),),
            p_value=_both_tails(min(b, c), b + c),
            n_items=n_items,
        )
    shift = max(abs(b - c) - 1, 0) if kind == "corrected" else abs(b - c)
    return _chi_squared("mcnemar", hypothesis, shift * shift, b + c, 1, n_items)


def _both_tails(fewer: int, n: int) -> float:
    # 2 P(X ≤ fewer), X ~ Binomial(n, 1/2), at most 1
    if n <= _MAX_SUMMED:
        tail = sum(math.comb(n, k) for k in range(fewer + 1))
        return min(1.0, float(2 * tail / 2**n))
    from scipy.special import bdtr

    return min(1.0, 2.0 * float(bdtr(fewer, n, 0.5)))


def bowker(table: ArrayLike) -> Significance:
    """Test whether changes between every two categories go both ways alike often.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rating (columns).

    Returns
    -------
    Significance
        Chi-squared; a pair of categories between which no item changed adds neither
        to it nor to its degrees of freedom.

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
    .. [1] Bowker, A. H. (1948). A test for symmetry in contingency tables. Journal of
       the American Statistical Association, 43(244), 572-574.
       https://doi.org/10.1080/01621459.1948.10483284

    Examples
    --------
    >>> print(bowker([[10, 5, 0], [1, 10, 2], [0, 4, 8]]))
    bowker: 3.333, chi-squared(2), p = 0.189
    """
    cells: list[list[int]] = check_table(table).tolist()
    pairs = [
        (cells[k][other], cells[other][k])
        for k in range(len(cells))
        for other in range(k)
        if cells[k][other] + cells[other][k]
    ]
    common = math.lcm(*[b + c for b, c in pairs])
    numerator = sum((b - c) ** 2 * (common // (b + c)) for b, c in pairs)
    return _chi_squared(
        "bowker",
        "the table is symmetric",
        numerator,
        common if pairs else 0,
        len(pairs),
        sum(map(sum, cells)),
    )


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
    return _chi_squared(
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
    return _chi_squared(
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
        rest = group[1:]
        if rest:
            part = laplacian[np.ix_(rest, rest)].astype(np.float64)
            d = shift[rest].astype(np.float64)
            statistic += float(d @ np.linalg.solve(part, d))
            df += len(rest)
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


def _chi_squared(
    name: str,
    hypothesis: str,
    numerator: float,
    denominator: int,
    df: int,
    n_items: int,
) -> Significance:
    """Refer a ratio of two ratings' changes to chi-squared."""
    from scipy.special import chdtrc

    if denominator == 0:  # an empty sum is 0; of no degrees of freedom it says nothing
        statistic, p = 0.0 if df == 0 else math.nan, math.nan
        reason = undefined(name, "0/0: no item changed")
    else:
        statistic, reason = numerator / denominator, None
        p = float(chdtrc(df, statistic))
    return Significance(
        name=name,
        hypothesis=hypothesis,
        statistic=statistic,
        distribution="chi-squared",
        df=(float(df),),
        p_value=p,
        n_items=n_items,
        reason=reason,
    )

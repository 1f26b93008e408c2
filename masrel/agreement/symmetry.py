"""Two ratings of the same items: whether changes go both ways alike often."""

import math
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import Label, code_ratings
from masrel.agreement.cohen import two_raters
from masrel.agreement.counts import check_table
from masrel.agreement.pair_sums import pair_table
from masrel.agreement.significance import Significance, chi_squared
from masrel.errors import CountsError, ParameterError

__all__ = [
    "McnemarKind",
    "bowker",
    "contingency_table",
    "mcnemar",
]

_COUNTED = 1_000  # changes up to which the binomial law is summed in integers

McnemarKind = Literal["exact", "uncorrected", "corrected"]
"""The binomial law, or chi-squared without or with the continuity correction."""


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
    coded = two_raters(code_ratings(ratings, categories), "a contingency table")
    return pair_table(coded.codes, coded.n_categories)


def mcnemar(table: ArrayLike, *, kind: McnemarKind = "exact") -> Significance:
    """Test whether two ratings choose the second of two categories alike often.

    Parameters
    ----------
    table : array_like of int, shape (2, 2)
        Items per category of the first (rows) and second rating (columns).
    kind : {"exact", "uncorrected", "corrected"}, optional
        The binomial law of the items that changed; or chi-squared.

    Returns
    -------
    Significance
        The smaller count of changes with its binomial law, or chi-squared.

    Raises
    ------
    CountsError
        If it is not a 2 × 2 table of counts.
    ParameterError
        If the kind is none.

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
    apart = max(abs(b - c) - 1, 0) if kind == "corrected" else abs(b - c)
    return chi_squared("mcnemar", hypothesis, apart * apart, b + c, 1, n_items)


def _both_tails(fewer: int, n: int) -> float:
    # 2 P(X ≤ fewer), X ~ Binomial(n, 1/2), at most 1
    if n <= _COUNTED:
        ways = sum(math.comb(n, k) for k in range(fewer + 1))
        return min(1.0, float(2 * ways / 2**n))
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
    above = sum((b - c) ** 2 * (common // (b + c)) for b, c in pairs)
    return chi_squared(
        "bowker",
        "the table is symmetric",
        above,
        common if pairs else 0,
        len(pairs),
        sum(map(sum, cells)),
    )

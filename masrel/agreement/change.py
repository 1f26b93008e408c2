"""Two ratings of the same items: tests of change, and effects of the margins."""

import math
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel._input import check_option
from masrel.agreement._codes import (
    check_table,
    check_two_by_two,
    pair_table,
    side_by_side,
    two_raters,
)
from masrel.agreement._engine import tested, undefined
from masrel.agreement._labels import Label
from masrel.agreement._weights import NO_CHANCE, NO_PAIR
from masrel.estimates import Significance

McnemarKind = Literal["exact", "uncorrected", "corrected"]
"""The binomial distribution, or chi-squared without or with continuity correction."""

_SAME_MARGINS = "both raters have the same margins"


def contingency_table(
    ratings: object,
    other: object = None,
    *,
    categories: Sequence[Label] | None = None,
) -> NDArray[np.int64]:
    """Count the pairs of ratings of two raters.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, 2)
        Labels or numbers; items with a missing rating are left out.
    other : sequence of str, int or float, shape (n_items,), optional
        The labels of the second rater, where `ratings` are those of the first: item by
        item in the same order, of Series by the same index.
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
    counted = two_raters(
        side_by_side(ratings, other), categories, "a contingency table"
    )
    return pair_table(counted.codes, counted.n_categories, counted.freq)


def mcnemar(table: ArrayLike, *, kind: McnemarKind = "exact") -> Significance:
    """Test whether two ratings choose the second of two categories equally often.

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

    >>> round(mcnemar([[10, 5], [1, 10]]).p_value, 5)
    0.21875
    """
    (a, b), (c, d) = check_two_by_two(table)
    check_option("kind", kind, get_args(McnemarKind))
    hypothesis, n_items = (
        "changes in both directions are equally frequent",
        a + b + c + d,
    )
    if kind != "exact":
        shift = max(abs(b - c) - 1, 0) if kind == "corrected" else abs(b - c)
        statistic = shift**2 / (b + c) if b + c else math.nan
        return _chi_squared("mcnemar", hypothesis, statistic, 1, n_items)
    from scipy.special import bdtr

    # 2 P(X ≤ the smaller), X ~ Binomial(b + c, 1/2), at most 1
    return Significance(
        name="mcnemar",
        hypothesis=hypothesis,
        statistic=float(min(b, c)),
        distribution="binomial",
        df=(float(b + c),),
        p_value=min(1.0, 2.0 * float(bdtr(min(b, c), b + c, 0.5))),
        n_items=n_items,
    )


def bowker(table: ArrayLike) -> Significance:
    """Test whether changes in both directions are equally frequent (symmetry).

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
    cells = check_table(table)
    pairs = np.triu_indices(len(cells), 1)
    b, c = cells[pairs], cells.T[pairs]
    changed = b + c > 0
    b, c = b[changed], c[changed]
    statistic = float(((b - c) ** 2 / (b + c)).sum())
    n = int(cells.sum())
    return _chi_squared("bowker", "the table is symmetric", statistic, len(b), n)


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
    return _chi_squared("stuart_maxwell", _SAME_MARGINS, *_margins(table))


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
    statistic, df, n = _margins(table)
    # all items changed one way, but for rounding
    is_infinite = df > 0 and statistic >= n * (1.0 - 1e-12)
    statistic = math.inf if is_infinite else statistic / (1.0 - statistic / max(n, 1))
    return _chi_squared("bhapkar", _SAME_MARGINS, statistic, df, n)


def _margins(table: ArrayLike) -> tuple[float, int, int]:
    # Statistic, degrees of freedom and items: d' V⁻ d, d = t_k. - t_.k,
    # V_kk = t_k. + t_.k - 2 t_kk and V_kl = -t_kl - t_lk.
    # V is the Laplacian of the graph of changes: it is singular once per group of
    # categories that changes connect, and d adds up to 0 in each.
    cells = check_table(table)
    changes = cells + cells.T
    np.fill_diagonal(changes, 0)
    laplacian = np.diag(changes.sum(axis=1)) - changes
    d = cells.sum(axis=1) - cells.sum(axis=0)
    solution, _, df, _ = np.linalg.lstsq(laplacian, d, rcond=1e-12)
    return float(d @ solution), int(df), int(cells.sum())


def _chi_squared(
    name: str, hypothesis: str, statistic: float, df: int, n_items: int
) -> Significance:
    """Refer a statistic of two ratings' changes to chi-squared."""
    has_none = df == 0 or math.isnan(statistic)
    reason = undefined(name, "0/0: no item changed") if has_none else None
    return tested(
        name, hypothesis, "chi-squared", (float(df),), n_items, statistic, reason
    )


def prevalence_index(table: ArrayLike) -> float:
    r"""Return how unequal the frequencies of agreement on two categories are.

    Parameters
    ----------
    table : array_like of int, shape (2, 2)
        Items per category of the first (rows) and second rater (columns).

    Returns
    -------
    float
        \|a - d\| / n with a and d on the diagonal, within [0, 1]; the larger, the
        smaller kappa at the same agreement. ``nan`` without items.

    Raises
    ------
    CountsError
        If it is not a 2 × 2 table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        If there is no item.

    References
    ----------
    .. [1] Byrt, T., Bishop, J., Carlin, J. B. (1993). Bias, prevalence and kappa.
       Journal of Clinical Epidemiology, 46(5), 423-429.
       https://doi.org/10.1016/0895-4356(93)90018-V

    Examples
    --------
    >>> prevalence_index([[20, 5], [5, 10]])
    0.25
    """
    (a, b), (c, d) = check_two_by_two(table)
    n = a + b + c + d
    return abs(a - d) / n if n else _no_number("the prevalence index")


def bias_index(table: ArrayLike) -> float:
    r"""Return how much more often one rater chooses a category than the other.

    Parameters
    ----------
    table : array_like of int, shape (2, 2)
        Items per category of the first (rows) and second rater (columns).

    Returns
    -------
    float
        \|b - c\| / n with b and c off the diagonal, within [0, 1]; ``nan`` without
        items.

    Raises
    ------
    CountsError
        If it is not a 2 × 2 table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        If there is no item.

    References
    ----------
    .. [1] Byrt, T., Bishop, J., Carlin, J. B. (1993); see `prevalence_index`.

    Examples
    --------
    >>> bias_index([[20, 6], [4, 10]])
    0.05
    """
    (a, b), (c, d) = check_two_by_two(table)
    n = a + b + c + d
    return abs(b - c) / n if n else _no_number("the bias index")


def kappa_max(table: ArrayLike) -> float:
    """Return the largest Cohen's kappa that the margins of two raters allow.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rater (columns).

    Returns
    -------
    float
        1 only if both raters have the same margins; ``nan`` where kappa is undefined.

    Raises
    ------
    CountsError
        If it is not a square table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        If there is no item, or both raters used one and the same category.

    References
    ----------
    .. [1] Cohen, J. (1960), eq. (5); see `cohen_kappa`.

    Examples
    --------
    >>> kappa_max([[20, 5], [10, 15]])
    0.8
    """
    cells = check_table(table)
    # whole numbers of Python, of which products have all their digits
    first, second = cells.sum(axis=1).tolist(), cells.sum(axis=0).tolist()
    n, agreeing = sum(first), sum(map(min, first, second))
    by_chance = sum(r * c for r, c in zip(first, second, strict=True))
    if by_chance == n * n:
        return _no_number("the largest kappa", NO_CHANCE if n else NO_PAIR)
    return float((n * agreeing - by_chance) / (n * n - by_chance))


def specific_agreement(table: ArrayLike) -> tuple[float, ...]:
    """Return how often one rater chose a category when the other did.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rater (columns).

    Returns
    -------
    tuple of float, length n_categories
        ``2 t_kk / (t_k. + t_.k)``, within [0, 1]; ``nan`` for a category that nobody
        used.
        Of two categories, negative and positive agreement.

    Raises
    ------
    CountsError
        If it is not a square table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        If nobody used a category.

    References
    ----------
    .. [1] Cicchetti, D. V., Feinstein, A. R. (1990). High agreement but low kappa: II.
       Resolving the paradoxes. Journal of Clinical Epidemiology, 43(6), 551-558.
       https://doi.org/10.1016/0895-4356(90)90159-M

    Examples
    --------
    >>> specific_agreement([[20, 5], [5, 10]])
    (0.8, 0.6666666666666666)
    """
    cells = check_table(table)
    used = (cells.sum(axis=0) + cells.sum(axis=1)).tolist()
    if not all(used):
        unused = used.index(0) + 1
        undefined(f"specific agreement on category {unused}", "0/0: no rater used it")
    twice = (2 * cells.diagonal()).tolist()
    return tuple(t / n if n else math.nan for t, n in zip(twice, used, strict=True))


def _no_number(title: str, reason: str = NO_PAIR) -> float:
    undefined(title, reason)
    return math.nan

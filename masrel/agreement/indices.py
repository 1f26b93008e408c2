"""What the margins of a contingency table do: prevalence, bias, the largest kappa."""

import math

from numpy.typing import ArrayLike

from masrel.agreement._engine import undefined
from masrel.agreement._rows import check_table, check_two_by_two
from masrel.agreement._weights import NO_CHANCE, NO_PAIR


def prevalence_index(table: ArrayLike) -> float:
    r"""Return how unequally often both raters choose the same of two categories.

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
    return abs(a - d) / n if n else _no_item("the prevalence index")


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
    return abs(b - c) / n if n else _no_item("the bias index")


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
    cells: list[list[int]] = check_table(table).tolist()
    first = [sum(row) for row in cells]
    second = [sum(column) for column in zip(*cells, strict=True)]
    n = sum(first)
    if n == 0:
        return _no_item("the largest kappa")
    agreeing = sum(min(r, c) for r, c in zip(first, second, strict=True))
    by_chance = sum(r * c for r, c in zip(first, second, strict=True))
    if by_chance == n * n:
        undefined("the largest kappa", NO_CHANCE)
        return math.nan
    return float((n * agreeing - by_chance) / (n * n - by_chance))


def specific_agreement(table: ArrayLike) -> tuple[float, ...]:
    """Return for each category how often a rating of it meets the same of the other.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rater (columns).

    Returns
    -------
    tuple of float, length n_categories
        2 t_kk / (t_k. + t_.k), within [0, 1]; ``nan`` for a category that nobody used.
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
    cells: list[list[int]] = check_table(table).tolist()
    columns = zip(*cells, strict=True)
    used = [sum(row) + sum(column) for row, column in zip(cells, columns, strict=True)]
    if not all(used):
        unused = used.index(0) + 1
        undefined(f"specific agreement on category {unused}", "0/0: nobody used it")
    return tuple(2 * cells[k][k] / n if n else math.nan for k, n in enumerate(used))


def _no_item(title: str) -> float:
    undefined(title, NO_PAIR)
    return math.nan

"""What the margins of two raters do to kappa: prevalence, bias, the largest value."""

import math

from numpy.typing import ArrayLike

from masrel.agreement.counts import check_table
from masrel.agreement.undefined import NO_CHANCE, NO_PAIR, undefined
from masrel.errors import CountsError

__all__ = ["bias_index", "kappa_max", "prevalence_index"]


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
    (a, b), (c, d) = _two_by_two(table)
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
    (a, b), (c, d) = _two_by_two(table)
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
    most = sum(min(r, c) for r, c in zip(first, second, strict=True))
    by_chance = sum(r * c for r, c in zip(first, second, strict=True))
    if by_chance == n * n:
        undefined("the largest kappa", NO_CHANCE)
        return math.nan
    return float((n * most - by_chance) / (n * n - by_chance))


def _two_by_two(table: ArrayLike) -> list[list[int]]:
    cells = check_table(table)
    if cells.shape != (2, 2):
        raise CountsError(f"table: needs 2 × 2, got {len(cells)} × {len(cells)}")
    found: list[list[int]] = cells.tolist()
    return found


def _no_item(title: str) -> float:
    undefined(title, NO_PAIR)
    return math.nan

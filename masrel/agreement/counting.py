"""From ratings to distinct items, each with how often it occurs."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import (
    CodedRatings,
    check_scale,
    code_ratings,
    label_rows,
)
from masrel.agreement.counts import check_counts, check_table, column_categories
from masrel.agreement.distinct import FEW, coded_items, item_counts, rows_alike
from masrel.agreement.items import FewItems, ItemTable
from masrel.agreement.labels import Label

__all__ = [
    "CountedRatings",
    "coded_items",
    "count_ratings",
    "count_table",
    "item_counts",
    "take_counts",
]

Integers = NDArray[np.int64]


class CountedRatings:
    """Ratings with their distinct items counted, for several coefficients at once.

    Parameters
    ----------
    categories : tuple of str, int or float
        Declared categories in order.
    items : FewItems or ManyItems
        Distinct items with how often each occurs.
    n_raters : int
        Raters with at least one rating.
    coded : CodedRatings, callable or None
        The ratings, or a call that gives them; None where only counts are known, and
        not who rated what.
    declared : bool, optional
        False if nobody declared the categories, and they are the labels met.

    Attributes
    ----------
    categories, items, n_raters, declared
        As given.
    """

    __slots__ = ("_coded", "categories", "declared", "items", "n_raters")

    def __init__(
        self,
        categories: tuple[Label, ...],
        items: ItemTable,
        n_raters: int,
        coded: CodedRatings | Callable[[], CodedRatings] | None,
        declared: bool = True,
    ) -> None:
        self.categories = categories
        self.items = items
        self.n_raters = n_raters
        self.declared = declared
        self._coded = coded

    @property
    def coded(self) -> CodedRatings | None:
        """The ratings; None where only counts are known, and not who rated what."""
        if callable(self._coded):
            self._coded = self._coded()
        return self._coded


def count_ratings(
    ratings: object, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Check ratings once, and count distinct items once, for several coefficients.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    CountedRatings
        What every coefficient takes in place of ratings.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa, gwet_ac
    >>> counted = count_ratings([["a", "a"], ["b", "b"], ["a", "b"]])
    >>> fleiss_kappa(counted).value == gwet_ac(counted).value
    True
    """
    if isinstance(ratings, CountedRatings):
        if categories is not None:
            check_scale(ratings.categories, categories)
        return ratings
    few = ratings
    if type(ratings) is np.ndarray and ratings.ndim == 2 and ratings.size <= FEW:
        few = ratings.tolist()
    if isinstance(few, list) and len(few) <= FEW:
        rows, declared = label_rows(few, categories)
        items = _count_complete(rows, declared)
        if items is not None:
            return CountedRatings(
                categories=declared,
                declared=categories is not None,
                items=items,
                n_raters=len(rows[0]),
                coded=partial(code_ratings, rows, categories),
            )
    coded = code_ratings(ratings, categories)
    return CountedRatings(
        categories=coded.categories,
        declared=coded.declared,
        items=coded_items(coded),
        n_raters=coded.n_raters,
        coded=coded,
    )


def count_table(
    table: ArrayLike, *, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Take a contingency table of two raters as counted ratings.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and of the second rater (columns).
    categories : sequence of str, int or float, optional
        The declared scale in order; 1 to n_categories unless given.

    Returns
    -------
    CountedRatings
        What coefficients of unnamed raters take in place of ratings. For Cohen's
        kappa and Scott's pi see `cohen_kappa_from_table` and `scott_pi_from_table`.

    Raises
    ------
    CountsError
        If it is not a square table of counts.
    ParameterError
        If there are not as many categories as columns.

    Examples
    --------
    >>> from masrel.agreement import gwet_ac
    >>> gwet_ac(count_table([[20, 5], [10, 15]])).value
    0.40594059405940597
    """
    cells: list[list[int]] = check_table(table).tolist()
    q = len(cells)
    found: dict[tuple[int, ...], int] = {}
    for first in range(q):
        for second in range(q):
            if cells[first][second]:
                row = [0] * q
                row[first] += 1
                row[second] += 1
                item = tuple(row)
                found[item] = found.get(item, 0) + cells[first][second]
    return CountedRatings(
        categories=tuple(column_categories(categories, q)),
        items=FewItems(list(found), list(found.values()), q),
        n_raters=2 if found else 0,
        coded=None,
    )


def _count_complete(
    rows: list[list[object]], declared: tuple[Label, ...]
) -> FewItems | None:
    # few labels of a scale of few, without codes; None if one is missing or no label
    n_raters, q = len(rows[0]), len(declared)
    if len(rows) * n_raters > FEW or q > n_raters:
        return None
    try:
        counts = [tuple(map(row.count, declared)) for row in rows]
    except (TypeError, ValueError):  # something that is neither equal nor unequal
        return None
    times: dict[tuple[int, ...], int] = {}
    for item in counts:
        times[item] = times.get(item, 0) + 1
    items = FewItems(list(times), list(times.values()), q)
    return items if items.sizes == [n_raters] else None


def take_counts(
    counts: ArrayLike, categories: Sequence[Label] | None
) -> CountedRatings:
    """Take a table of counts as counted ratings, equal rows together."""
    # Takes counts (n_items, n_categories)
    table = check_counts(counts)
    return CountedRatings(
        categories=tuple(column_categories(categories, table.shape[1])),
        items=rows_alike(table),
        n_raters=_largest_sum(table),
        coded=None,
    )


def _largest_sum(table: Integers) -> int:
    # in Python's integers where a row may sum to more than 64 bits hold
    if int(table.max()) * table.shape[1] < 2**62:
        return int(table.sum(axis=1).max())
    return max(map(sum, table.tolist()))

"""Tables of counts: how many raters put each item into each category."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import CodedRatings, Codes, code_ratings
from masrel.agreement.items import FewItems, ItemTable, item_table
from masrel.agreement.labels import Label, check_categories
from masrel.errors import CountsError, ParameterError

__all__ = [
    "CountedRatings",
    "check_counts",
    "check_table",
    "coded_items",
    "column_categories",
    "count_ratings",
    "count_table",
    "counted_items",
    "item_counts",
]

Integers = NDArray[np.int64]

_FEW = 200  # ratings that Python counts about as fast as numpy
_MOST_KEYS = 1 << 22  # patterns that are counted in a table rather than sorted
_MOST_SORTED = 20_000  # items that are sorted to find those alike
_BLOCK = 1 << 16  # items counted at once, so that they stay in the cache


@dataclass(frozen=True, slots=True, kw_only=True)
class CountedRatings:
    """Ratings with their distinct items counted, for several coefficients at once.

    Attributes
    ----------
    categories : tuple of str, int or float
        Declared categories in order.
    items : FewItems or ManyItems
        Distinct items with how often each occurs.
    n_raters : int
        Raters with at least one rating.
    coded : CodedRatings or None
        The ratings; None where only counts are known, and not who rated what.
    """

    categories: tuple[Label, ...]
    items: ItemTable = field(compare=False, repr=False)
    n_raters: int
    coded: CodedRatings | None


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
        return ratings
    coded = code_ratings(ratings, categories)
    items = coded_items(coded)
    # An item with all ratings there could be shows that every rater has one.
    full = isinstance(items, FewItems) and max(map(sum, items.rows))
    n_raters = full if full == coded.codes.shape[1] else coded.n_raters
    return CountedRatings(
        categories=coded.categories, items=items, n_raters=n_raters, coded=coded
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


def item_counts(coded: CodedRatings) -> Integers:
    """Count the raters of each category, item by item.

    Parameters
    ----------
    coded : CodedRatings
        The ratings; missing ones are not counted.

    Returns
    -------
    ndarray of int64, shape (n_items, n_categories)
        Raters per item and category.
    """
    n_items, n_raters = coded.codes.shape
    if coded.n_categories <= n_raters:
        parts = [(coded.codes == k).sum(axis=1) for k in range(coded.n_categories)]
        return np.column_stack(parts)
    counts = np.zeros((n_items, coded.n_categories), dtype=np.int64)
    every = np.arange(n_items)
    for column in coded.codes.T:
        given = column >= 0
        counts[every[given], column[given]] += 1  # an item once a column
    return counts


def coded_items(coded: CodedRatings) -> ItemTable:
    """Count the raters of each category, equal items together.

    Parameters
    ----------
    coded : CodedRatings
        The ratings; missing ones are not counted.

    Returns
    -------
    FewItems or ManyItems
        Distinct items with how often each occurs.
    """
    n_items, n_raters = coded.codes.shape
    if coded.codes.size <= _FEW:
        return _few(coded)
    # An item is one number: Σ over its raters of (n_raters + 1) to the power code.
    base, q = n_raters + 1, coded.n_categories
    n_keys = base**q
    if n_keys <= min(_MOST_KEYS, 16 * n_items):
        times = np.zeros(n_keys, dtype=np.int64)
        for start in range(0, n_items, _BLOCK):
            keys = _keys(coded.codes[start : start + _BLOCK], base, q)
            times += np.bincount(keys, minlength=n_keys)
        met = np.flatnonzero(times)
        times = times[met]
    elif n_keys < 2**62 and n_items <= _MOST_SORTED:
        met, times = np.unique(_keys(coded.codes, base, q), return_counts=True)
    else:
        return item_table(item_counts(coded))
    powers = base ** np.arange(q, dtype=np.int64)
    return item_table(met[:, None] // powers % base, times)


def _keys(codes: Codes, base: int, n_categories: int) -> Integers:
    powers = base ** np.arange(n_categories + 1, dtype=np.int64)
    powers[-1] = 0  # code -1 is the last entry
    if base**n_categories < 2**31:
        powers = powers.astype(np.int32)
    keys = powers[codes[:, 0]]
    for column in codes.T[1:]:
        keys += powers[column]
    return keys


def _few(coded: CodedRatings) -> FewItems:
    found: dict[tuple[int, ...], int] = {}
    width = coded.n_categories + 1
    for codes in coded.codes.tolist():
        row = [0] * width
        for code in codes:
            row[code] += 1  # code -1 is the last entry
        item = tuple(row[:-1])
        found[item] = found.get(item, 0) + 1
    return FewItems(list(found), list(found.values()), coded.n_categories)


def counted_items(counts: Integers) -> ItemTable:
    """Put equal rows of a table of counts together.

    Parameters
    ----------
    counts : ndarray of int64, shape (n_items, n_categories)
        Raters per item and category.

    Returns
    -------
    FewItems or ManyItems
        Distinct items with how often each occurs.
    """
    base = int(counts.max()) + 1
    if counts.size > _FEW and base ** counts.shape[1] <= _MOST_KEYS:
        powers = base ** np.arange(counts.shape[1], dtype=np.int64)
        times = np.bincount(counts @ powers)
        met = np.flatnonzero(times)
        return item_table(met[:, None] // powers % base, times[met])
    return item_table(counts)


def check_counts(counts: ArrayLike) -> Integers:
    """Check a table of counts.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.

    Returns
    -------
    ndarray of int64, shape (n_items, n_categories)
        The same table.

    Raises
    ------
    CountsError
        If it is not a table of whole numbers of at least 0 and below 2^53.
    """
    table = np.asarray(counts)
    if table.ndim != 2 or 0 in table.shape:
        raise CountsError(
            "counts: needs a table (items, categories) of at least one of each, "
            f"got shape {table.shape}"
        )
    if table.dtype.kind not in "iuf":
        raise CountsError(f"counts: needs whole numbers, got {table.dtype}")
    wrong = ~((table >= 0) & (table == np.floor(table)) & (table < 2**53))
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        raise CountsError(
            f"counts: row {row}, column {column}: needs a whole number of at least 0 "
            f"and below 2^53, got {table[row, column]}"
        )
    return table.astype(np.int64)


def column_categories(
    categories: Sequence[Label] | None, n_columns: int
) -> Sequence[Label]:
    """Return the declared scale of a table of counts, 1 to n_columns unless given.

    Parameters
    ----------
    categories : sequence of str, int or float, or None
        The scale in order.
    n_columns : int
        Columns of the counts.

    Returns
    -------
    sequence of str, int or float
        One category a column.

    Raises
    ------
    ParameterError
        If there are not as many categories as columns.
    RatingsError
        If the categories are no scale.
    """
    if categories is None:
        return range(1, n_columns + 1)
    declared = check_categories(categories)
    if len(declared) != n_columns:
        raise ParameterError(
            f"categories: needs {n_columns}, one per column of counts, got "
            f"{len(declared)}"
        )
    return declared


def check_table(table: ArrayLike) -> Integers:
    """Check a contingency table of two raters.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first and of the second rater.

    Returns
    -------
    ndarray of int64, shape (n_categories, n_categories)
        The same table.

    Raises
    ------
    CountsError
        If it is not a square table of whole numbers of at least 0.
    """
    checked = check_counts(table)
    if checked.shape[0] != checked.shape[1]:
        raise CountsError(
            f"table: needs as many rows as columns, got shape {checked.shape}"
        )
    return checked

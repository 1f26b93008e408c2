"""Distinct items and distinct rows of ratings, each with how often it occurs."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement._data import (
    CodedRatings,
    check_scale,
    code_ratings,
    label_rows,
)
from masrel.agreement._labels import Codes, Label, check_categories
from masrel.agreement.few_items import FewItems
from masrel.agreement.many_items import ManyItems
from masrel.errors import CountsError, ParameterError

Integers = NDArray[np.int64]

_FEW_COUNTS = 4_000  # counts that Python sums about as fast as numpy

ItemTable = FewItems | ManyItems
"""Distinct items with how often each occurs."""


def item_table(counts: Integers, times: Integers | None = None) -> ItemTable:
    """Choose how distinct items are kept."""
    # Takes counts (n_rows, n_categories), times (n_rows,)
    if counts.size <= _FEW_COUNTS:
        how_often = [1] * len(counts) if times is None else times.tolist()
        return FewItems(counts.tolist(), how_often, counts.shape[1])
    if times is None:
        times = np.ones(len(counts), dtype=np.int64)
    return ManyItems(counts, times)


def check_counts(counts: ArrayLike) -> Integers:
    """Check a table of counts."""
    # counts (n_items, n_categories) -> (n_items, n_categories)
    try:
        table = np.asarray(counts)
    except ValueError as error:
        raise CountsError("counts: needs rows of the same length") from error
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
    """Return the declared scale of a table of counts, 1 to n_columns unless given."""
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
    """Check a contingency table of two raters."""
    # table (n_categories, n_categories) -> (n_categories, n_categories)
    checked = check_counts(table)
    if checked.shape[0] != checked.shape[1]:
        raise CountsError(
            f"table: needs as many rows as columns, got shape {checked.shape}"
        )
    return checked


FEW = 200
"""Ratings that Python counts about as fast as numpy."""

_FEW_PLACES = 1 << 15  # ratings times categories that are counted one by one
_MOST_KEYS = 1 << 22  # patterns that are counted in a table rather than sorted
_MOST_SORTED = 20_000  # items that are sorted to find those alike
_BLOCK = 1 << 16  # items counted at once, so that they stay in the cache


def item_counts(coded: CodedRatings) -> Integers:
    """Count the raters of each category, item by item."""
    # -> (n_items, n_categories)
    n_items, n_raters = coded.codes.shape
    if coded.codes.size * coded.n_categories <= _FEW_PLACES:
        width = coded.n_categories + 1  # code -1 is the first
        places = coded.codes + (width * np.arange(n_items)[:, None] + 1)
        found = np.bincount(places.ravel(), minlength=width * n_items)
        return np.asarray(found.reshape(n_items, width)[:, 1:], dtype=np.int64)
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
    """Count the raters of each category, equal items together."""
    n_items, n_raters = coded.codes.shape
    if coded.codes.size <= FEW:
        return _few(coded.codes.tolist(), coded.n_categories)
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


def _few(codes: list[list[int]], n_categories: int) -> FewItems:
    found: dict[tuple[int, ...], int] = {}
    for row in codes:
        counts = [0] * (n_categories + 1)
        for code in row:
            counts[code] += 1  # code -1 is the last entry
        item = tuple(counts[:n_categories])
        found[item] = found.get(item, 0) + 1
    return FewItems(list(found), list(found.values()), n_categories)


def rows_alike(counts: Integers) -> ItemTable:
    """Count equal rows of a table of counts together."""
    # Takes counts (n_items, n_categories)
    base = int(counts.max()) + 1
    if counts.size > FEW and base ** counts.shape[1] <= _MOST_KEYS:
        powers = base ** np.arange(counts.shape[1], dtype=np.int64)
        times = np.bincount(counts @ powers)
        met = np.flatnonzero(times)
        return item_table(met[:, None] // powers % base, times[met])
    return item_table(counts)


_FEW_ROWS = 1 << 10  # items for which one call costs less than a few for each rater


def distinct_rows(codes: Codes, n_categories: int) -> tuple[Integers, Integers]:
    """Put equal rows of codes together."""
    # Takes codes (n_items, n_raters)
    n_items, n_raters = codes.shape
    base = n_categories + 1
    n_keys = base**n_raters  # a row is one number with n_raters digits
    if n_keys > 2**62:
        rows, times = np.unique(codes, axis=0, return_counts=True)
        return rows.astype(np.int64), times.astype(np.int64)
    if n_items <= _FEW_ROWS:
        return _sorted(codes, _row_keys(codes, base))
    if n_keys > min(_MOST_KEYS, 16 * n_items):
        met, times = np.unique(_row_keys(codes, base), return_counts=True)
    else:
        counted = np.zeros(n_keys, dtype=np.int64)
        for start in range(0, n_items, _BLOCK):
            keys = _row_keys(codes[start : start + _BLOCK], base)
            counted += np.bincount(keys, minlength=n_keys)
        met = np.flatnonzero(counted)
        times = counted[met]
    digits = base ** np.arange(n_raters, dtype=np.int64)
    return met[:, None] // digits % base - 1, times.astype(np.int64)


def _sorted(codes: Codes, keys: Integers) -> tuple[Integers, Integers]:
    # distinct rows in the order of their keys, by the last of those that are equal
    order = keys.argsort()
    ascending = keys[order]
    is_last = np.ones(keys.size, dtype=bool)
    np.not_equal(ascending[1:], ascending[:-1], out=is_last[:-1])
    (last,) = is_last.nonzero()
    times = last + 1
    times[1:] -= times[:-1]  # numpy sees that they overlap
    return codes[order[last]].astype(np.int64), times


def _row_keys(codes: Codes, base: int) -> Integers:
    # Σ_r (code_r + 1) base^r, of many items by Horner's rule
    if len(codes) <= _FEW_ROWS:
        digits = base ** np.arange(codes.shape[1], dtype=np.int64)
        return np.asarray((codes.astype(np.int64) + 1) @ digits, dtype=np.int64)
    keys = codes[:, -1].astype(np.int64) + 1
    for column in codes.T[-2::-1]:
        keys *= base
        keys += column
        keys += 1
    return keys


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

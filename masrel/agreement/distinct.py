"""Distinct items of coded ratings or of counts, each with how often it occurs."""

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.coding import CodedRatings, Codes
from masrel.agreement.items import FewItems, ItemTable, item_table

__all__ = ["FEW", "coded_items", "item_counts", "rows_alike"]

Integers = NDArray[np.int64]

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

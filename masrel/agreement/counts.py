"""Tables of counts: how many raters put each item into each category."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import CodedRatings
from masrel.errors import CountsError

__all__ = ["check_counts", "check_table", "distinct_rows", "item_counts"]


def item_counts(coded: CodedRatings) -> NDArray[np.int64]:
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
    n_items = coded.codes.shape[0]
    counts = np.zeros((n_items, coded.n_categories), dtype=np.int64)
    given = coded.codes >= 0
    items = np.nonzero(given)[0]
    np.add.at(counts, (items, coded.codes[given]), 1)
    return counts


def check_counts(counts: ArrayLike) -> NDArray[np.int64]:
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
        If it is not a table of whole numbers of at least 0.
    """
    table = np.asarray(counts)
    if table.ndim != 2 or 0 in table.shape:
        raise CountsError(
            "counts: needs a table (items, categories) of at least one of each, "
            f"got shape {table.shape}"
        )
    if table.dtype.kind not in "iuf":
        raise CountsError(f"counts: needs whole numbers, got {table.dtype}")
    wrong = ~((table >= 0) & (table == np.floor(table)) & (table < 2**62))
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        raise CountsError(
            f"counts: row {row}, column {column}: needs a whole number of at least 0, "
            f"got {table[row, column]}"
        )
    return table.astype(np.int64)


def check_table(table: ArrayLike) -> NDArray[np.int64]:
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


def distinct_rows(
    counts: NDArray[np.int64],
) -> Iterator[tuple[tuple[int, ...], int]]:
    """Yield every distinct row as Python integers, with how often it occurs.

    Parameters
    ----------
    counts : ndarray of int64, shape (n_items, n_columns)
        Any table of integers.

    Yields
    ------
    tuple of int, int
        The row and its number of occurrences.
    """
    rows, times = np.unique(counts, axis=0, return_counts=True)
    yield from zip(map(tuple, rows.tolist()), times.tolist(), strict=True)

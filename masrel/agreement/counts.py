"""Checks of tables of counts: raters per category, and pairs of two raters."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.labels import Label, check_categories
from masrel.errors import CountsError, ParameterError

__all__ = ["check_counts", "check_table", "column_categories"]

Integers = NDArray[np.int64]


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

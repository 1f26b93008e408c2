"""Tables of counts and contingency tables, checked, as counted ratings."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement._counts import CountedRatings, DistinctItems, Integers
from masrel.agreement._labels import Label, check_categories
from masrel.errors import CountsError, ParameterError


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
    freq: dict[tuple[int, ...], int] = {}
    for first, row in enumerate(cells):
        for second, n in enumerate(row):
            if n:
                item = tuple((k == first) + (k == second) for k in range(q))
                freq[item] = freq.get(item, 0) + n
    return CountedRatings(
        categories=tuple(column_categories(categories, q)),
        items=DistinctItems(list(freq), list(freq.values()), q),
        n_raters=2 if freq else 0,
        source=None,
    )


def take_counts(
    counts: ArrayLike, categories: Sequence[Label] | None
) -> CountedRatings:
    """Take a table of counts as counted ratings, equal rows together."""
    # Takes counts (n_items, n_categories)
    table = check_counts(counts)
    n_columns = table.shape[1]
    small = int(table.max()) * n_columns < 2**62  # else Python's integers
    return CountedRatings(
        categories=tuple(column_categories(categories, n_columns)),
        items=DistinctItems.of_counts(table),
        n_raters=int((table if small else table.astype(object)).sum(axis=1).max()),
        source=None,
    )


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


def check_table(table: ArrayLike) -> Integers:
    """Check a contingency table of two raters."""
    # table (n_categories, n_categories) -> (n_categories, n_categories)
    checked = check_counts(table)
    if checked.shape[0] != checked.shape[1]:
        raise CountsError(
            f"table: needs as many rows as columns, got shape {checked.shape}"
        )
    return checked


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


def check_two_by_two(table: ArrayLike) -> list[list[int]]:
    """Check a contingency table of two categories."""
    cells = check_table(table)
    if cells.shape != (2, 2):
        raise CountsError(f"table: needs 2 × 2, got {len(cells)} × {len(cells)}")
    return [[int(n) for n in row] for row in cells]

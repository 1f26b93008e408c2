"""Tables of counts and contingency tables, checked, as counted ratings."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement._counts import CountedRatings, DistinctItems, Integers
from masrel.agreement._data import MISSING, CodedRatings
from masrel.agreement._labels import Label, check_categories, code_type
from masrel.errors import CountsError, ParameterError

_MAX_PLACES = 100_000_000  # that are made of counts, where ratings are gone through


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
        What every coefficient of two raters and more, and every interval, takes in
        place of ratings. Those that tell raters apart spread the items out, up to
        10^8; `cohen_kappa_from_table` and `scott_pi_from_table` take any number.

    Raises
    ------
    CountsError
        If it is not a square table of counts.
    ParameterError
        If there are not as many categories as columns.

    Examples
    --------
    >>> from masrel.agreement import cohen_kappa, gwet_ac
    >>> counted = count_table([[20, 5], [10, 15]])
    >>> cohen_kappa(counted).value
    0.4
    >>> gwet_ac(counted).value
    0.40594059405940597
    """
    checked = check_table(table)
    cells: list[list[int]] = checked.tolist()
    q = len(cells)
    labels = tuple(column_categories(categories, q))
    freq: dict[tuple[int, ...], int] = {}
    for first, row in enumerate(cells):
        for second, n in enumerate(row):
            if n:
                item = tuple((k == first) + (k == second) for k in range(q))
                freq[item] = freq.get(item, 0) + n
    return CountedRatings(
        categories=labels,
        items=DistinctItems(list(freq), list(freq.values()), q),
        n_raters=2 if freq else 0,
        source=partial(_spread_table, checked, labels),
    )


def _spread_table(table: Integers, categories: tuple[Label, ...]) -> CodedRatings:
    # table (n_categories, n_categories) -> codes (n_items, 2)
    _check_places("table", sum(map(sum, table.tolist())))
    cells = np.indices(table.shape).reshape(2, -1).T
    codes = cells.astype(code_type(len(categories))).repeat(table.ravel(), axis=0)
    codes.setflags(write=False)
    return CodedRatings(codes=codes, categories=categories)


def count_items(
    counts: ArrayLike, *, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Take how many raters chose each category, item by item, as counted ratings.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.
    categories : sequence of str, int or float, optional
        The declared scale in order; 1 to n_categories unless given.

    Returns
    -------
    CountedRatings
        What coefficients that do not tell raters apart take in place of ratings:
        percent agreement, Fleiss' kappa, Brennan-Prediger's, Gwet's AC and
        Krippendorff's alpha; so do their intervals for other items. `n_raters` is the
        largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.
    ParameterError
        If there are not as many categories as columns.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa
    >>> counted = count_items([[3, 0], [2, 1], [0, 3], [0, 2]])
    >>> round(fleiss_kappa(counted).value, 3)
    0.657
    """
    table = check_counts(counts)
    n_columns = table.shape[1]
    small = int(table.max()) * n_columns < 2**62  # else Python's integers
    return CountedRatings(
        categories=tuple(column_categories(categories, n_columns)),
        items=DistinctItems.of_counts(table),
        n_raters=int((table if small else table.astype(object)).sum(axis=1).max()),
        source=None,
    )


def places_of(counted: CountedRatings) -> CodedRatings:
    """Return counts as codes whose columns are places, and no raters."""
    # -> codes (n_items, most ratings of an item), equal items together
    freq = [int(n) for n in counted.items.freq]
    _check_places("counts", sum(freq) * max(counted.n_raters, 1))
    rows = np.array(counted.items.rows, dtype=np.int64)  # (n_distinct, n_categories)
    rows = rows.reshape(len(freq), counted.items.n_categories)
    sizes = rows.sum(axis=1)
    codes = np.full((len(rows), max(counted.n_raters, 2)), MISSING, dtype=np.int64)
    places = np.arange(codes.shape[1]) < sizes[:, None]
    codes[places] = np.tile(np.arange(rows.shape[1]), len(rows)).repeat(rows.ravel())
    codes = codes.astype(code_type(rows.shape[1])).repeat(freq, axis=0)
    if not freq:  # nobody rated anything
        codes = np.full((1, 2), MISSING)
    return CodedRatings(
        codes=codes, categories=counted.categories, declared=counted.declared
    )


def _check_places(name: str, n_places: int) -> None:
    # ratings that are taken one by one
    if n_places > _MAX_PLACES:
        raise CountsError(
            f"{name}: needs at most {_MAX_PLACES:.0e} ratings to be spread out, got "
            f"{n_places}"
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
    if table.dtype.kind == "f":  # a half has no 2^53
        table = table.astype(np.float64)
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

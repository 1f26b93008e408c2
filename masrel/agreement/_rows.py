"""Rows of ratings with how often each occurs: what every kappa takes.

In: ratings, counts of items, or a table of two raters. Out: `CountedRatings`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement._data import MISSING, CodedRatings, check_scale, code_ratings
from masrel.agreement._labels import Codes, Label, check_categories, code_type
from masrel.errors import CountsError, ParameterError, RatingsError

Integers = NDArray[np.int64]

_FEW_ROWS = 1 << 10  # rows for which one call costs less than a few for each rater
_MAX_KEYS = 1 << 22  # keys that are counted in a table rather than sorted
_BLOCK = 1 << 16  # items counted at once, so that they stay in the cache
_MAX_SMALL = 1 << 16  # keys that are counted by products of floats; < 2^24, so exact
# Ratings that are multiplied at once: they stay in the cache, and BLAS, which may take
# from 460 800 on, starts no threads, which wait for each other where cores are shared.
_SMALL_BLOCK = 1 << 17
_MAX_PLACES = 100_000_000  # that are made of counts, where ratings are gone through
_MAX_SIDE = 4000  # categories of a table of pairs


@dataclass(slots=True, kw_only=True, eq=False)
class CountedRatings:
    """Rows of ratings with how often each occurs, for several coefficients at once.

    Attributes
    ----------
    codes : ndarray of signed integers, shape (n_rows, n_raters)
        Position of each rating in `categories`; -1 where there is none.
    freq : ndarray of int, shape (n_rows,)
        How often each row occurs.
    categories : tuple of str, int or float
        Declared categories in order.
    declared : bool
        False if nobody declared the categories, and they are the labels met.
    tells_raters_apart : bool
        False if columns are places of ratings and not raters: only counts are known.
    repeats : ndarray of int, shape (n_rows, n_raters), or None
        How often each code is there; None for once.
    n_known : int or None
        Raters with at least one rating; None to count them when they are asked for.
    source : CodedRatings, callable or None
        The ratings item by item, or a call that gives them; None to lay the rows out.
    """

    codes: Codes
    freq: Integers
    categories: tuple[Label, ...]
    declared: bool = True
    tells_raters_apart: bool = True
    repeats: Integers | None = None
    n_known: int | None = None
    source: CodedRatings | Callable[[], CodedRatings] | None = None

    @property
    def n_raters(self) -> int:
        """Raters with at least one rating; of counts, the most ratings of an item."""
        if self.n_known is None:
            self.n_known = int((self.codes >= 0).any(axis=0).sum())
        return self.n_known

    @property
    def n_categories(self) -> int:
        """Declared categories."""
        return len(self.categories)

    @property
    def size(self) -> Integers:
        """Ratings of each row, (n_rows,)."""
        there = self.codes >= 0 if self.repeats is None else self.repeats
        return np.asarray(there.sum(axis=1))

    @property
    def knows_raters(self) -> bool:
        """Whether it is known who rated what."""
        return self.tells_raters_apart or self.source is not None

    @property
    def coded(self) -> CodedRatings:
        """The ratings item by item; of counts, equal items together."""
        if self.source is None:
            codes = self._laid_out()
            return CodedRatings(
                codes=codes, categories=self.categories, declared=self.declared
            )
        if callable(self.source):
            self.source = self.source()
        return self.source

    def _laid_out(self) -> Codes:
        # codes whose columns are raters, or places of ratings
        sizes, codes = self.size.tolist(), self.codes
        width = codes.shape[1] if self.repeats is None else max([*sizes, 2])
        n_items = sum(self.freq.tolist())
        if n_items * width > _MAX_PLACES:
            raise CountsError(
                f"ratings: needs at most {_MAX_PLACES:.0e} to be laid out item by "
                f"item, got {n_items} items of up to {width}"
            )
        if self.repeats is not None:
            codes = np.full((len(sizes), width), MISSING, dtype=codes.dtype)
            places = np.arange(width) < self.size[:, None]
            codes[places] = self.codes.ravel().repeat(self.repeats.ravel())
        codes = np.repeat(codes, self.freq, axis=0)
        codes.setflags(write=False)
        return codes

    def chosen(
        self, raters: NDArray[np.bool_] | None = None, rows: Any = slice(None)
    ) -> "CountedRatings":
        """Keep some raters, or some rows."""
        codes = self.codes if raters is None else self.codes[:, raters]
        repeats = self.repeats if self.repeats is None else self.repeats[rows]
        return replace(
            self,
            codes=codes[rows],
            freq=self.freq[rows],
            repeats=repeats,
            source=None,
            n_known=None,
        )


def count_ratings(
    ratings: object, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Check ratings once, and count distinct rows once, for several coefficients.

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

    Warns
    -----
    RatingsWarning
        As `code_ratings`.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa, gwet_ac
    >>> counted = count_ratings([["a", "a"], ["b", "b"], ["a", "b"]])
    >>> fleiss_kappa(counted).value == gwet_ac(counted).value
    True
    """
    if isinstance(ratings, CountedRatings):
        if categories is not None and categories is not ratings.categories:
            check_scale(ratings.categories, categories)
        return ratings
    coded = code_ratings(ratings, categories)
    codes, (n_items, n_raters) = coded.codes, coded.codes.shape
    n_keys = (len(coded.categories) + 1) ** n_raters
    if n_items > _FEW_ROWS and n_keys <= _max_keys(n_items):
        codes, freq = distinct_rows(codes, len(coded.categories))
    else:
        freq = np.ones(n_items, dtype=np.int64)
    return CountedRatings(
        codes=codes,
        freq=freq,
        categories=coded.categories,
        declared=coded.declared,
        source=coded,
    )


def raters_told_apart(
    ratings: object, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Count ratings of raters who are told apart; those without any are left out."""
    counted = count_ratings(ratings, categories)
    if not counted.tells_raters_apart:
        counted = count_ratings(code_ratings(counted))  # or an error
    rates = np.asarray((counted.codes >= 0).any(axis=0))
    if rates.sum() in (0, 1, len(rates)):  # unless two others are left
        return counted
    return counted.chosen(raters=rates)


def two_raters(
    ratings: object, categories: Sequence[Label] | None, title: str
) -> CountedRatings:
    """Count the items that both of two raters rated."""
    counted = raters_told_apart(ratings, categories)
    n_columns = counted.codes.shape[1]
    if n_columns != 2:
        raise RatingsError(f"{title} needs the ratings of two raters, got {n_columns}")
    return complete_rows(counted)


def complete_rows(ratings: CountedRatings) -> CountedRatings:
    """Keep the rows that every rater rated."""
    whole = (ratings.codes >= 0).all(axis=1)
    return ratings if whole.all() else ratings.chosen(rows=whole)


def pair_table(
    codes: Codes, n_categories: int, freq: Integers | None = None
) -> Integers:
    """Count the pairs of two columns of codes."""
    # codes (n_items, 2) -> (n_categories, n_categories)
    if n_categories > _MAX_SIDE:
        raise ParameterError(
            f"ratings: {n_categories} different grades are too many for a table of "
            "their pairs, which this statistic needs"
        )
    side = n_categories + 1
    # Missing, -1, becomes the last row and column, which is cut off.
    flat = codes[:, 0].astype(np.int32) * side + codes[:, 1] + side + 1
    table = np.bincount(flat, freq, minlength=side * side).reshape(side, side)
    return table[1:, 1:].astype(np.int64)


def item_counts(
    codes: Codes, n_categories: int, repeats: Integers | None = None
) -> Integers:
    """Count the raters of each category, row by row."""
    # -> (n_rows, n_categories)
    n_rows, width = len(codes), n_categories + 1  # code -1 is the first
    places = codes + np.arange(1, width * n_rows + 1, width)[:, None]
    often = None if repeats is None else repeats.ravel()
    counted = np.bincount(places.ravel(), often, minlength=width * n_rows)
    return counted.reshape(n_rows, width)[:, 1:].astype(np.int64, copy=False)


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
        place of ratings.

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
    cells, freq = np.indices(checked.shape).reshape(2, -1).T, checked.ravel()
    return CountedRatings(
        codes=cells[freq > 0],
        freq=freq[freq > 0],
        categories=tuple(column_categories(categories, len(checked))),
    )


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
    n_columns, largest = table.shape[1], int(table.max())
    freq = np.ones(len(table), dtype=np.int64)
    if (largest + 1) ** n_columns <= _MAX_KEYS:
        table, freq = distinct_rows(table - 1, largest)
        table += 1
    codes = np.arange(n_columns, dtype=code_type(n_columns))
    return CountedRatings(
        codes=np.where(table > 0, codes, codes.dtype.type(MISSING)),
        freq=freq,
        categories=tuple(column_categories(categories, n_columns)),
        tells_raters_apart=False,
        repeats=table,
        n_known=max(sum(table.T.astype(object))),
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


def distinct_rows(codes: Codes, n_categories: int) -> tuple[Integers, Integers]:
    """Put equal rows of codes together: the rows, and how often each occurs."""
    # codes (n_items, n_raters) -> (n_distinct, n_raters), (n_distinct,)
    n_items, n_raters = codes.shape
    base = n_categories + 1
    n_keys = base**n_raters  # a row is one number with n_raters digits
    if n_keys > 2**62:
        rows, freq = np.unique(codes, axis=0, return_counts=True)
        return rows.astype(np.int64), freq.astype(np.int64)
    if n_items <= _FEW_ROWS:
        powers = base ** np.arange(n_raters, dtype=np.int64)
        keys = (codes.astype(np.int64) + 1) @ powers
        order = keys.argsort()
        ascending = keys[order]
        is_last = np.ones(n_items, dtype=bool)  # of those with the same key
        np.not_equal(ascending[1:], ascending[:-1], out=is_last[:-1])
        (last,) = is_last.nonzero()
        freq = last + 1
        freq[1:] -= freq[:-1]  # numpy sees that they overlap
        return codes[order[last]].astype(np.int64), freq
    most = min(_MAX_SMALL, n_items // 2)
    if n_categories**n_raters <= most:
        small = _small_rows(codes, n_categories, most)
        if small is not None:
            return small
    keys, freq = _count_keys(n_items, lambda at: _row_keys(codes[at], base), n_keys)
    return digits(keys, base, n_raters) - 1, freq


def _small_rows(
    codes: Codes, n_categories: int, most: int
) -> tuple[Integers, Integers] | None:
    # distinct rows and how often each occurs, by their keys; None if those are many
    n_raters = codes.shape[1]
    lowest = -1 if codes.min() < 0 else 0  # a missing rating is a digit of its own
    base = n_categories - lowest
    n_keys = base**n_raters
    if n_keys > most:
        return None
    keys, freq = _count_keys(
        len(codes), lambda at: _small_keys(codes[at], lowest, base), n_keys
    )
    return digits(keys, base, n_raters) + lowest, freq


def _small_keys(codes: Codes, lowest: int, base: int) -> Integers:
    # Σ_r (code_r - lowest) base^r as a product of floats, each sum of which is a whole
    # number below 2^24
    n_items, n_raters = codes.shape
    powers = (base ** np.arange(n_raters, dtype=np.int64)).astype(np.float32)
    offset = -lowest * powers.sum()
    keys = np.empty(n_items, dtype=np.int64)
    block = max(1, min(1 << 14, _SMALL_BLOCK // n_raters))
    for start in range(0, n_items, block):
        rows = slice(start, start + block)
        keys[rows] = codes[rows].astype(np.float32) @ powers + offset
    return keys


def _count_keys(
    n_items: int, keys_of: Callable[[slice], Integers], n_keys: int
) -> tuple[Integers, Integers]:
    # distinct keys, which are less than n_keys, and how often each occurs
    if n_keys > _max_keys(n_items):
        keys, freq = np.unique(keys_of(slice(None)), return_counts=True)
        return keys, freq.astype(np.int64)
    table = np.zeros(n_keys, dtype=np.int64)
    for at in range(0, n_items, _BLOCK):
        table += np.bincount(keys_of(slice(at, at + _BLOCK)), minlength=n_keys)
    present = np.flatnonzero(table)
    return present, table[present]


def _max_keys(n_items: int) -> int:
    # that are counted in a table rather than sorted
    return min(_MAX_KEYS, 16 * n_items)


def digits(keys: Integers, base: int, n_digits: int) -> Integers:
    """Return the digits of keys, (n_keys, n_digits), the last most significant."""
    return keys[:, None] // base ** np.arange(n_digits, dtype=np.int64) % base


def _row_keys(codes: Codes, base: int) -> Integers:
    # Σ_r (code_r + 1) base^r, by Horner's rule
    keys = codes[:, -1].astype(np.int64) + 1
    for column in codes.T[-2::-1]:
        keys *= base
        keys += column
        keys += 1
    return keys

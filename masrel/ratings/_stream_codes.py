"""Texts of cells as numbers, and distinct rows of them, added up batch by batch."""

from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._rows import digits, distinct_rows
from masrel.ratings._grade_texts import coded_texts
from masrel.ratings._large_files import (
    NoStreamError,
    cell_texts,
    is_whole,
    numbers_of,
)

StreamCodes = NDArray[np.signedinteger[Any]]

_MAX_BYTE = 120  # texts whose numbers have a byte each
_MAX_KEYS = 1 << 16  # rows that there can be, where they are counted in a table
_MAX_PENDING = 1 << 18  # distinct rows before those alike are put together
_MAX_KEPT = 100_000_000  # codes of distinct rows
_SPAN = 1 << 16  # of whole numbers that are looked up in a table


class TextCodes:
    """Texts of cells as numbers in the order in which they are met.

    `by_value` those that a column is the first to have are in their own order, in which
    most grades differ from their numbers by the same.
    """

    def __init__(self, most: int, what: str, *, by_value: bool = False) -> None:
        self.texts: list[str] = []
        self.places: list[tuple[int, int]] = []
        self._code: dict[str, int] = {}
        self._whole: set[int] = set()  # whole numbers that are texts
        self._dtype = np.int8 if most <= _MAX_BYTE else np.int16
        self._most, self._what, self._by_value = most, what, by_value

    def codes(self, column: Any, row: int, place: int) -> StreamCodes:
        """Return the number of every cell; the first is that of a row and a column."""
        if is_whole(column) and not column.null_count and len(column):
            values = numbers_of(column)
            span = range(int(values.min()), int(values.max()) + 1)
            if len(span) <= _SPAN:
                return self._of_whole(values, span, (row, place))
        if not hasattr(column, "dictionary"):
            column = column.dictionary_encode()
        n = len(column.dictionary)
        if n > 1000 * self._most:
            self._refuse()
        texts = [*cell_texts(column.dictionary), ""]  # a missing cell is the last
        table = np.array([self._code.get(text, -1) for text in texts], self._dtype)
        indices = column.indices
        # to fill them would load pandas
        index = numbers_of(indices.fill_null(n) if indices.null_count else indices)
        return self._looked_up(index, table, texts.__getitem__, (row, place))

    def _of_whole(
        self, values: NDArray[Any], span: range, where: tuple[int, int]
    ) -> StreamCodes:
        # of whole numbers, all in a span: the difference fits without its sign
        above = values - values.dtype.type(span[0])
        first = self._code.get(str(span[0]), len(self.texts))
        if first + len(span) <= len(self.texts):
            if self.texts[first : first + len(span)] == list(map(str, span)):
                codes: StreamCodes = above.astype(self._dtype, copy=False)
                return np.asarray(codes + self._dtype(first)) if first else codes
        table = np.full(len(span), -1, dtype=self._dtype)
        for number in self._whole:
            if number in span:
                table[number - span[0]] = self._code[str(number)]

        def named(k: int) -> str:
            self._whole.add(span[k])
            return str(span[k])

        index = above.view(f"u{values.itemsize}")
        return self._looked_up(index, table, named, where)

    def _looked_up(
        self,
        index: NDArray[Any],
        table: NDArray[Any],
        text: Callable[[int], str],
        where: tuple[int, int],
    ) -> StreamCodes:
        codes = _taken(table, index)
        if not len(codes) or codes.min() >= 0:
            return codes
        rows = np.flatnonzero(codes < 0)
        new, first = np.unique(index[rows], return_index=True)
        order = np.arange(len(new)) if self._by_value else np.argsort(first)
        for k in order.tolist():
            at = (where[0] + int(rows[first[k]]), where[1])
            table[new[k]] = self._number(text(int(new[k])), at)
        return _taken(table, index)

    def _number(self, text: str, where: tuple[int, int]) -> int:
        (plain,) = coded_texts(np.array([text], dtype=object))[1]
        code = self._code.setdefault(plain, len(self.texts))
        self._code.setdefault(text, code)
        if code == len(self.texts):
            self.texts.append(plain)
            self.places.append(where)
            if code >= self._most:
                self._refuse()
        return code

    def _refuse(self) -> NoReturn:
        raise NoStreamError(
            f"more than {self._most} different {self._what}, more than a stream counts"
        )


def _taken(table: NDArray[Any], index: NDArray[Any]) -> StreamCodes:
    # table[index]; of bytes by bytes in a third of the time
    if table.itemsize == 1 and index.itemsize == 1:
        every = table.tobytes().ljust(256)
        return np.frombuffer(index.tobytes().translate(every), dtype=table.dtype)
    codes: StreamCodes = table[index]
    return codes


class DistinctRows:
    """Distinct rows of codes, added up batch by batch."""

    def __init__(self) -> None:
        self._rows: list[NDArray[np.int8]] = []
        self._freq: list[NDArray[np.int64]] = []
        self._n_pending = 0
        self._shape = 1, 0  # codes, with that of no rating, and raters of the table
        self._table = np.zeros(1, dtype=np.int64)

    def add(self, codes: StreamCodes, n_codes: int) -> None:
        """Count rows (n, n_raters) of codes from -1 to n_codes - 1."""
        shape = n_codes + 1, codes.shape[1]
        n_keys = shape[0] ** shape[1]
        if n_keys > _MAX_KEYS:
            if len(codes):
                self.add_counted(*distinct_rows(codes, n_codes))
            return
        if shape != self._shape:
            self._empty_table()
            self._shape, self._table = shape, np.zeros(n_keys, dtype=np.int64)
        self._table += np.bincount(_row_keys(codes, shape[0]), minlength=n_keys)

    def _empty_table(self) -> None:
        (keys,) = self._table.nonzero()
        freq, self._table = self._table[keys], np.zeros_like(self._table)
        if len(keys):
            self.add_counted(digits(keys, *self._shape) - 1, freq)

    def add_counted(self, rows: NDArray[Any], freq: NDArray[np.int64]) -> None:
        """Add rows that are counted."""
        self._rows.append(rows.astype(np.int8))
        self._freq.append(freq)
        self._n_pending += len(rows)
        if self._n_pending > _MAX_PENDING:
            merged = self.merged()
            self._rows, self._freq = [merged[0]], [merged[1]]
            self._n_pending = 0

    def merged(self) -> tuple[NDArray[np.int8], NDArray[np.int64]]:
        """Return every distinct row once, and how often it occurs."""
        self._empty_table()
        width = max((part.shape[1] for part in self._rows), default=1)
        rows = np.concatenate(
            [np.empty((0, width), np.int8), *(widened(p, width) for p in self._rows)]
        )
        freq = np.concatenate([np.empty(0, np.int64), *self._freq])
        rows, freq = merged_rows(rows, freq)
        if rows.size > _MAX_KEPT:
            raise NoStreamError(
                f"{len(rows)} items that differ, more than a stream counts"
            )
        return rows, freq


def _row_keys(codes: StreamCodes, base: int) -> NDArray[np.uint16]:
    # (n, n_raters) codes from -1 on, column by column -> (n,): a digit of each rater
    keys = (codes[:, -1] + 1).astype(np.uint16)
    for column in codes.T[-2::-1]:
        keys *= base
        keys += (column + 1).view(np.uint8)
    return keys


def widened(rows: NDArray[np.int8], width: int) -> NDArray[np.int8]:
    """Add columns of raters who are met later, and have rated nothing before."""
    if rows.shape[1] == width:
        return rows
    wide = np.full((len(rows), width), -1, dtype=np.int8)
    wide[:, : rows.shape[1]] = rows
    return wide


def merged_rows(
    rows: NDArray[np.int8], freq: NDArray[np.int64]
) -> tuple[NDArray[np.int8], NDArray[np.int64]]:
    """Put equal rows together: each once, the last rater's codes first in order."""
    # takes rows (n, n_raters) and freq (n,)
    if not len(rows):
        return rows, freq
    # as bytes, by which they are sorted, from the last rater on; -1 comes first
    keys = np.ascontiguousarray((rows[:, ::-1] + 1).view(np.uint8))
    _, first, at = np.unique(
        keys.view(f"V{keys.shape[1]}").ravel(), return_index=True, return_inverse=True
    )
    total = np.zeros(len(first), dtype=np.int64)
    np.add.at(total, at, freq)
    return rows[first], total

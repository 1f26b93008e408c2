"""Columns that name items: whether one is there twice, batch by batch."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.ratings._grade_texts import USUAL_MISSING
from masrel.ratings._large_files import (
    STRINGS,
    LargeFile,
    cell_texts,
    is_whole,
    numbers_of,
)
from masrel.ratings._text_cells import library

MAX_HASHED = 40_000_000
"""Items whose names are told apart by their hashes."""


class UnorderedError(Exception):
    """Items do not follow each other."""


def item_columns(large: LargeFile, columns: Sequence[Any]) -> list[Any]:
    """Return columns that name items, as whole numbers or as text without blanks."""
    lib = library(large.sheet.name, "pyarrow")
    items = []
    for column in columns:
        if is_whole(column):
            items.append(column)
            continue
        if str(column.type) in STRINGS:
            texts = column.cast(lib.large_string())
        else:
            if not hasattr(column, "dictionary"):
                column = column.dictionary_encode()
            texts = lib.array(cell_texts(column.dictionary), lib.large_string())
            texts = texts.take(column.indices)
        letters = np.frombuffer(texts.buffers()[2] or b"", dtype=np.uint8)
        if letters.size and (letters.min() <= 0x20 or letters.max() >= 0x7F):
            compute = library(large.sheet.name, "pyarrow.compute")
            texts = compute.utf8_normalize(compute.utf8_trim_whitespace(texts), "NFC")
        items.append(texts)
    return items


def unnamed_rows(large: LargeFile, items: list[Any]) -> NDArray[np.bool_] | None:
    """Return which rows have no name of the item; None if all have one."""
    unnamed = None
    for item in items:
        blank = item.is_null() if item.null_count else None
        if not is_whole(item):
            blank = _blank_texts(large, item, blank)
        if blank is not None:
            mask = numbers_of(blank).astype(bool)
            unnamed = mask if unnamed is None else unnamed | mask
    return unnamed if unnamed is not None and unnamed.any() else None


def _blank_texts(large: LargeFile, item: Any, blank: Any) -> Any:
    # which texts are those of a missing name; `blank` if none is as short as these
    compute = library(large.sheet.name, "pyarrow.compute")
    shortest = compute.min(compute.binary_length(item)).as_py()
    if shortest is None or shortest > max(map(len, USUAL_MISSING)):
        return blank
    lib = library(large.sheet.name, "pyarrow")
    usual = lib.array([*USUAL_MISSING, None], item.type)
    return compute.is_in(item, value_set=usual)


class Ascending:
    """Items that ascend, so that none is there twice."""

    is_known = True

    def __init__(self, name: str) -> None:
        self._name = name
        self._last: Any = None
        # names ascend by their letters, or by their length first, as p9 and p10 do
        self._by_letters = self._by_length = True

    def add(self, items: list[Any]) -> None:
        """Take items, or raise where they do not ascend."""
        if len(items) != 1:
            raise UnorderedError
        (item,) = items
        if len(item) and is_whole(item):
            values = numbers_of(item)
            is_ascending = bool((values[1:] > values[:-1]).all())
            is_ascending &= self._last is None or self._last < int(values[0])
            self._last = int(values[-1])
        elif len(item):
            is_ascending = self._texts_ascend(item)
            self._last = item[len(item) - 1].as_py()
        else:
            return
        if not is_ascending:
            raise UnorderedError

    def _texts_ascend(self, item: Any) -> bool:
        compute = library(self._name, "pyarrow.compute")
        one, other = item.slice(0, len(item) - 1), item.slice(1)
        above = compute.less(one, other)
        first = item[0].as_py()
        last = first if self._last is None else self._last
        self._by_letters &= bool(compute.all(above, min_count=0).as_py())
        self._by_letters &= self._last is None or last.encode() < first.encode()
        if self._by_length:
            n_one, n_other = compute.binary_length(one), compute.binary_length(other)
            above = compute.or_(
                compute.less(n_one, n_other),
                compute.and_(compute.equal(n_one, n_other), above),
            )
            self._by_length &= bool(compute.all(above, min_count=0).as_py())
            sizes = [(len(text.encode()), text.encode()) for text in (last, first)]
            self._by_length &= self._last is None or sizes[0] < sizes[1]
        return self._by_letters or self._by_length

    def repeated(self) -> None:
        """Return None: no item is there twice."""


class Hashed:
    """Items that are told apart by their hashes."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._keys: list[NDArray[np.uint64]] = []
        self._n_keys = 0
        self.is_known = True

    def add(self, items: list[Any]) -> None:
        """Take items."""
        self._n_keys += len(items[0])
        if self._n_keys > MAX_HASHED:
            self.is_known, self._keys = False, []
        else:
            self._keys.append(hashes(items))

    def repeated(self) -> NDArray[np.uint64] | None:
        """Return hashes that are there twice."""
        if not self.is_known or not self._keys:
            return None
        keys = np.concatenate(self._keys)
        keys.sort()
        twice = np.unique(keys[1:][keys[1:] == keys[:-1]])
        return twice if len(twice) else None


def hashes(items: list[Any]) -> NDArray[np.uint64]:
    """Return a number of 64 bits for every item, (n,)."""
    from pandas.util import hash_array

    total = np.zeros(len(items[0]), dtype=np.uint64)
    for item in items:
        if is_whole(item):
            values: NDArray[Any] = numbers_of(item).astype(np.int64)
        else:
            values = np.array(item.to_pylist(), dtype=object)
        total = total * np.uint64(0x9E3779B97F4A7C15) + hash_array(
            values, categorize=False
        )
    return total

"""Ratings of a file larger than memory: distinct rows of texts, and how often each is.

In: a `LargeFile` and its layout. Out: `Streamed`. Rows of a wide table are counted as
they come. Those of a long one are put together item by item: as they come where items
ascend, in a table of a byte a rating where items are whole numbers, and else by DuckDB.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError
from masrel.ratings._grade_texts import USUAL_MISSING
from masrel.ratings._large_files import LargeFile, NoStreamError, numbers_of
from masrel.ratings._layout import Layout
from masrel.ratings._stream_codes import (
    DistinctRows,
    StreamCodes,
    TextCodes,
    widened,
)
from masrel.ratings._stream_items import (
    MAX_HASHED,
    Ascending,
    Hashed,
    UnorderedError,
    hashes,
    item_columns,
    unnamed_rows,
)
from masrel.ratings._text_cells import library

Progress = Callable[[int, int], None]
"""Takes how many bytes of how many are behind."""


_MAX_GRADES = 120  # different texts of grades; a code has a byte
_MAX_RATERS = 62  # whose patterns are counted
_MAX_TABLE = 400_000_000  # ratings, a byte each, that are put into a table
_BITS = 62  # of a key in which the grades of an item are put together


@dataclass(frozen=True, slots=True, kw_only=True)
class Streamed:
    """Distinct rows of ratings of a stream."""

    # (n_distinct, n_raters): places in the texts, -1 where there is no rating
    rows: NDArray[np.int8]
    freq: NDArray[np.int64]  # (n_distinct,)
    first: NDArray[np.int8]  # (n_raters,): the first row of a wide table
    texts: list[str]
    places: list[tuple[int, int]]  # row and column where each is met first
    raters: list[str]
    n_items: int
    n_blank: int
    doubts: list[str]
    is_simulated: bool


def stream_wide(large: LargeFile, layout: Layout, progress: Progress) -> Streamed:
    """Count the distinct rows of a wide table."""
    try:
        table = _Wide(large=large, layout=layout, order=Ascending(large.sheet.name))
        table.read(progress)
    except UnorderedError:
        table = _Wide(large=large, layout=layout, order=Hashed(large.sheet.name))
        table.read(progress)
    _refuse_header(large, layout.raters, table.texts)
    if (twice := table.order.repeated()) is not None:
        _refuse_twice(large, layout, twice)
    rows, freq = table.rows.merged()
    order = sorted(range(len(table.texts.texts)), key=table.texts.places.__getitem__)
    number = np.empty(len(order) + 1, dtype=np.int8)
    number[[*order, -1]] = [*range(len(order)), -1]
    doubts = []
    if not table.order.is_known:
        doubts.append(
            f"more than {MAX_HASHED} items whose names are not in order: whether one "
            "is there twice is not checked"
        )
    return Streamed(
        rows=number[rows],
        freq=freq,
        first=number[table.first] if table.first is not None else number[:0],
        texts=[table.texts.texts[k] for k in order],
        places=[table.texts.places[k] for k in order],
        raters=[large.sheet.header[place] for place in layout.raters],
        n_items=table.n_rows - table.n_blank,
        n_blank=table.n_blank,
        doubts=doubts,
        is_simulated=table.is_simulated,
    )


@dataclass(slots=True, kw_only=True)
class _Wide:
    """Rows of a wide table as they come."""

    large: LargeFile
    layout: Layout
    order: Ascending | Hashed
    texts: TextCodes = field(
        default_factory=lambda: TextCodes(_MAX_GRADES, "grades", by_value=True)
    )
    rows: DistinctRows = field(default_factory=DistinctRows)
    first: StreamCodes | None = None  # (n_raters,): the first row
    n_rows: int = 0
    n_blank: int = 0
    is_simulated: bool = False

    def read(self, progress: Progress) -> None:
        """Count every row."""
        layout, n_item = self.layout, len(self.layout.item)
        source = _source(self.large, layout)
        places = [*layout.item, *layout.raters, *source]
        for columns, n_done in self.large.batches(places, n_item):
            items = item_columns(self.large, columns[:n_item])
            codes = self._codes(columns[n_item : n_item + len(layout.raters)])
            keep = self._named_rows(items, codes.T)
            self.n_rows += codes.shape[1]
            if keep is not None:
                self.n_blank += int((~keep).sum())
                mask = library(self.large.sheet.name, "pyarrow").array(keep)
                items, codes = [item.filter(mask) for item in items], codes[:, keep]
            if self.first is None and codes.shape[1]:
                self.first = codes[:, 0].copy()
            if items:
                self.order.add(items)
            self.rows.add(codes.T, len(self.texts.texts))
            self.is_simulated |= _says_simulated(columns, source)
            progress(n_done, self.large.n_bytes)

    def _codes(self, cells: Sequence[Any]) -> NDArray[np.int8]:
        # (n_raters, n_rows), so that each column is written at once
        codes = np.empty((len(cells), len(cells[0])), dtype=np.int8)
        n_known = len(self.texts.texts)
        for j, cell in enumerate(cells):
            codes[j] = self.texts.codes(cell, self.n_rows, self.layout.raters[j])
        for code in range(n_known, len(self.texts.texts)):  # first by rows
            row, j = divmod(int((codes.T.ravel() == code).argmax()), len(cells))
            place = (self.n_rows + row, self.layout.raters[j])
            self.texts.places[code] = place
        return codes

    def _named_rows(
        self, items: list[Any], codes: StreamCodes
    ) -> NDArray[np.bool_] | None:
        # which rows have an item and are no blank lines; None if all
        texts = self.texts.texts
        blank = texts.index("") if "" in texts else None
        unnamed = unnamed_rows(self.large, items)
        if unnamed is None and (self.layout.item or blank is None):
            return None
        empty = np.zeros(len(codes), dtype=bool)
        if blank is not None:
            empty = (codes == blank).all(axis=1)
        if unnamed is None:
            return ~empty if empty.any() else None
        if (unnamed & ~empty).any():
            at = int((unnamed & ~empty).argmax())
            _refuse_unnamed(self.large, self.layout, items, at, self.n_rows)
        return ~unnamed


def _source(large: LargeFile, layout: Layout) -> list[int]:
    # the column that labels ratings simulated
    header = large.sheet.header
    if "source" not in header or header.index("source") in layout.raters:
        return []
    return [header.index("source")]


def _says_simulated(columns: Sequence[Any], source: list[int]) -> bool:
    if not source:
        return False
    values = columns[-1]
    kinds = values.dictionary if hasattr(values, "dictionary") else values.unique()
    return "simulated" in kinds.to_pylist()


def _refuse_unnamed(
    large: LargeFile, layout: Layout, items: list[Any], at: int, row: int
) -> NoReturn:
    names = ["" if not item[at].is_valid else item[at].as_py() for item in items]
    k = next(k for k, name in enumerate(names) if name in USUAL_MISSING)
    column = large.sheet.header[layout.item[k]]
    raise large.sheet.error(
        f"{large.where(row + at)}, column {column!r}: needed the item, got {names[k]!r}"
    )


def _refuse_header(large: LargeFile, places: Sequence[int], texts: TextCodes) -> None:
    # files put one below the other: a row that has the names of the columns again
    names = [large.sheet.header[place] for place in places]
    if not (
        large.is_text and large.sheet.has_header and set(names) <= set(texts.texts)
    ):
        return
    rows = {texts.places[texts.texts.index(name)] for name in names}
    if len({row for row, _ in rows}) == 1 and {p for _, p in rows} == set(places):
        raise large.sheet.error(
            f"{large.where(next(iter(rows))[0])}: holds the names of the columns "
            "once more: delete it; --no-header if the first line is a row like the "
            "others"
        )


def _refuse_twice(large: LargeFile, layout: Layout, twice: NDArray[np.uint64]) -> None:
    # the rows of an item that is there twice; none if only its hash is
    met: dict[tuple[Any, ...], int] = {}
    n_rows = 0
    for columns, _ in large.batches(list(layout.item), len(layout.item)):
        items = item_columns(large, columns)
        (places,) = np.isin(hashes(items), twice).nonzero()
        names = [item.take(places).to_pylist() for item in items]
        for place, name in zip(places.tolist(), zip(*names, strict=True), strict=True):
            if name in met and "" not in name:
                rows = [large.where(row) for row in (met[name], n_rows + place)]
                raise repeated_error(large, layout, rows, name, "every rater")
            met[name] = n_rows + place
        n_rows += len(items[0])


def repeated_error(
    large: LargeFile,
    layout: Layout,
    rows: Sequence[str],
    item: Sequence[Any],
    rater: str,
) -> RatingsError:
    """Return the error of a rating that is there twice."""
    guess = ""
    if layout.kind == "wide":
        guess = ", --rater and --grade name the columns of one row a rating"
        guess += ", --no-item says that no column names items" * layout.is_item_guessed
    return large.sheet.error(
        f"{' and '.join(rows)}: {rater!r} graded {' '.join(map(str, item))!r} more "
        "than once: --by or --session names a column that tells such ratings apart, "
        f"--repeated first, last or mean keeps one, with --no-stream{guess}"
    )


@dataclass(slots=True, kw_only=True)
class _Long:
    """Columns of a long table as they come."""

    large: LargeFile
    layout: Layout
    progress: Progress
    grades: TextCodes
    raters: TextCodes
    n_rows: int = 0
    is_simulated: bool = False

    def batches(self) -> Iterator[tuple[list[Any], StreamCodes, NDArray[np.int64]]]:
        """Yield items, codes of grades, and codes of raters."""
        layout, n_item = self.layout, len(self.layout.item)
        source = _source(self.large, layout)
        rater_at, grade_at = int(layout.rater or 0), int(layout.grade or 0)
        self.n_rows = 0
        places = [*layout.item, rater_at, grade_at, *source]
        for columns, n_done in self.large.batches(places, n_item):
            items = item_columns(self.large, columns[:n_item])
            rater = self.raters.codes(columns[n_item], self.n_rows, rater_at)
            grade = self.grades.codes(columns[n_item + 1], self.n_rows, grade_at)
            unnamed = unnamed_rows(self.large, items)
            if unnamed is not None:
                _refuse_unnamed(
                    self.large, layout, items, int(unnamed.argmax()), self.n_rows
                )
            self.is_simulated |= _says_simulated(columns, source)
            self.n_rows += len(rater)
            yield items, grade, rater.astype(np.int64)
            self.progress(n_done, self.large.n_bytes)

    @property
    def n_raters(self) -> int:
        """How many raters are met."""
        return len(self.raters.texts)


def stream_long(large: LargeFile, layout: Layout, progress: Progress) -> Streamed:
    """Put the ratings of a long table together, and count the items that differ."""
    long = _Long(
        large=large,
        layout=layout,
        progress=progress,
        grades=TextCodes(_MAX_GRADES, "grades"),
        raters=TextCodes(_MAX_RATERS, "raters"),
    )
    rows = DistinctRows()
    try:
        n_items = _of_runs(long, rows, Ascending(large.sheet.name))
    except UnorderedError:
        rows = DistinctRows()
        n_items = _unordered(long, rows)
    _refuse_header(large, [int(layout.rater or 0)], long.raters)
    _refuse_unnamed_raters(large, long.raters)
    distinct, freq = rows.merged()
    distinct = widened(distinct, long.n_raters)
    doubts = []
    if n_items == long.n_rows > 2:
        names = ", ".join(repr(large.sheet.header[place]) for place in layout.item)
        doubts.append(
            f"no item was rated twice: {names} may number the rows, --item names the "
            "column of the items"
        )
    return Streamed(
        rows=distinct,
        freq=freq,
        first=distinct[:1].ravel(),
        texts=long.grades.texts,
        places=long.grades.places,
        raters=long.raters.texts,
        n_items=n_items,
        n_blank=0,
        doubts=doubts,
        is_simulated=long.is_simulated,
    )


def _refuse_unnamed_raters(large: LargeFile, raters: TextCodes) -> None:
    for name, (row, place) in zip(raters.texts, raters.places, strict=True):
        if name in USUAL_MISSING:
            column = large.sheet.header[place]
            raise large.sheet.error(
                f"{large.where(row)}, column {column!r}: needed the rater, got {name!r}"
            )


def _unordered(long: _Long, rows: DistinctRows) -> int:
    # how many items there are; their rows are counted
    if len(long.layout.item) == 1:
        span = long.large.span(long.layout.item[0])
        if span is not None:
            lowest, n_places = span[0], span[1] - span[0] + 1
            n_columns = long.n_raters + 1
            if n_places * n_columns <= _MAX_TABLE:
                return _of_table(long, rows, lowest, n_places, n_columns)
    return _of_engine(long, rows)


def _of_runs(long: _Long, rows: DistinctRows, order: Ascending) -> int:
    # of items whose rows follow each other: how many there are
    lib = library(long.large.sheet.name, "pyarrow")
    n_items = 0
    rest: tuple[list[Any], StreamCodes, NDArray[np.int64]] | None = None
    for items, grade, rater in long.batches():
        if rest is not None:  # the last item of the batch before was left open
            pairs = zip(rest[0], items, strict=True)
            items = [lib.concat_arrays(pair) for pair in pairs]
            grade = np.concatenate([rest[1], grade])
            rater = np.concatenate([rest[2], rater])
        if not len(grade):
            continue
        starts = _starts(long, items)
        closed = int(starts[-1])
        parts = [column.slice(0, closed) for column in items]
        n_items += _count_runs(
            long, rows, order, starts, parts, grade[:closed], rater[:closed]
        )
        open_items = [column.slice(closed) for column in items]
        rest = open_items, grade[closed:], rater[closed:]
    if rest is not None:
        starts = np.array([0, len(rest[1])])
        n_items += _count_runs(long, rows, order, starts, *rest)
    return n_items


def _count_runs(
    long: _Long,
    rows: DistinctRows,
    order: Ascending,
    starts: NDArray[np.int64],
    items: list[Any],
    grade: StreamCodes,
    rater: NDArray[np.int64],
) -> int:
    # lay ratings out item by rater, and count the rows of that; starts: of each item,
    # and where the last one ends
    n_items, n_raters = len(starts) - 1, long.n_raters
    if not n_items:
        return 0
    order.add([column.take(_array(long, starts[:-1])) for column in items])
    keys = np.repeat(np.arange(n_items) * n_raters, np.diff(starts))
    keys += rater
    table = np.zeros(n_items * n_raters, dtype=np.int8)
    table[keys] = grade + np.int8(1)
    if np.count_nonzero(table) < len(keys):
        twice = int(np.argmax(np.bincount(keys)[keys] > 1))
        name = [column[twice].as_py() for column in items]
        _refuse_rating(long, name)
    table -= 1
    rows.add(table.reshape(n_items, n_raters), len(long.grades.texts))
    return n_items


def _array(long: _Long, numbers: NDArray[np.int64]) -> Any:
    # as an array of pyarrow, without its way from numpy, which loads pandas
    lib = library(long.large.sheet.name, "pyarrow")
    data = lib.py_buffer(np.ascontiguousarray(numbers))
    return lib.Array.from_buffers(lib.int64(), len(numbers), [None, data])


def _starts(long: _Long, items: list[Any]) -> NDArray[np.int64]:
    # where another item begins, 0 first
    n = len(items[0])
    changes = np.zeros(n, dtype=bool)
    changes[0] = True
    compute = library(long.large.sheet.name, "pyarrow.compute")
    for item in items:
        other = compute.not_equal(item.slice(1), item.slice(0, n - 1))
        changes[1:] |= numbers_of(other).astype(bool)
    return np.flatnonzero(changes)


def _refuse_rating(long: _Long, name: Sequence[Any]) -> NoReturn:
    # where the ratings are that an item has by one rater
    lib = library(long.large.sheet.name, "pyarrow")
    compute = library(long.large.sheet.name, "pyarrow.compute")
    met: dict[int, int] = {}
    for items, _, raters in long.batches():
        n, start = len(raters), long.n_rows - len(raters)
        same = np.ones(n, dtype=bool)
        for item, part in zip(items, name, strict=True):
            equal = compute.equal(item, lib.scalar(part, item.type))
            same &= numbers_of(equal).astype(bool)
        for k in np.flatnonzero(same).tolist():
            rater = int(raters[k])
            if rater in met:
                rows = [long.large.where(row) for row in (met[rater], start + k)]
                who = long.raters.texts[rater]
                raise repeated_error(long.large, long.layout, rows, name, who)
            met[rater] = start + k
    raise long.large.sheet.error("changed while it was read")


def _of_table(
    long: _Long, rows: DistinctRows, lowest: int, n_places: int, n_columns: int
) -> int:
    # of items that are whole numbers, a byte for each rating there may be
    table = np.zeros(n_places * n_columns, dtype=np.int8)
    for items, grade, rater in long.batches():
        if long.n_raters > n_columns:
            if n_places * 2 * long.n_raters > _MAX_TABLE:
                return _of_engine(long, rows)
            return _of_table(long, rows, lowest, n_places, 2 * long.n_raters)
        table[_table_places(items[0], rater, lowest, n_columns)] = grade + np.int8(1)
    if int(np.count_nonzero(table)) < long.n_rows:
        _refuse_of_table(long, lowest, n_columns, len(table))
    n_items = 0
    block = max(1, (1 << 22) // n_columns)
    for start in range(0, n_places, block):
        part = table[start * n_columns : (start + block) * n_columns] - np.int8(1)
        part = part.reshape(-1, n_columns)
        is_item = (part >= 0).any(axis=1)
        n_items += int(is_item.sum())
        part = part if is_item.all() else part[is_item]
        rows.add(part[:, : long.n_raters], len(long.grades.texts))
    return n_items


def _table_places(
    item: Any, rater: NDArray[np.int64], lowest: int, n_columns: int
) -> NDArray[np.int64]:
    # without signs, so that the difference is right whatever the type
    above = numbers_of(item).astype(np.uint64) - np.uint64(lowest % 2**64)
    places = above.view(np.int64)
    places *= n_columns
    places += rater
    return places


def _refuse_of_table(long: _Long, lowest: int, n_columns: int, size: int) -> NoReturn:
    seen = np.zeros(size, dtype=bool)
    for items, _, rater in long.batches():
        keys = _table_places(items[0], rater, lowest, n_columns)
        keys, freq = np.unique(keys, return_counts=True)
        twice = keys[seen[keys] | (freq > 1)]
        if len(twice):
            _refuse_rating(long, [lowest + int(twice[0]) // n_columns])
        seen[keys] = True
    raise long.large.sheet.error("changed while it was read")


def _of_engine(long: _Long, rows: DistinctRows) -> int:
    # of items in any order: DuckDB puts the ratings of each into a few whole numbers
    from masrel.ratings._spilling import packed_items

    if find_spec("duckdb") is None:
        raise NoStreamError(
            "items in no order, which a stream puts together by DuckDB: pip install "
            "'masrel[big]'"
        )
    while True:
        # A grade has some bits, and above them one that is set, so that an item has as
        # many of these as ratings unless two are in one place.
        n_bits = (len(long.grades.texts) + 2).bit_length() + 1
        n_in_key = _BITS // n_bits
        n_keys = -(-long.n_raters // n_in_key)
        marks = sum(1 << (n_bits * (k + 1) - 1) for k in range(n_in_key))
        try:
            packed = packed_items(
                long.large.sheet.name,
                partial(_keys, long, n_bits, n_in_key, n_keys),
                marks,
            )
            break
        except UnorderedError:  # of more grades or raters than there is place for
            continue
    if packed.twice is not None:
        _refuse_rating(long, packed.twice)
    shifts = np.arange(n_in_key) * n_bits
    mark = 1 << (n_bits - 1)
    digits = (packed.keys[:, :, None] >> shifts) & (2 * mark - 1)
    codes = np.where(digits >= mark, digits - mark, -1)
    codes = codes.reshape(len(codes), -1)[:, : long.n_raters]
    rows.add_counted(codes.astype(np.int8), packed.freq)
    return int(packed.freq.sum())


def _keys(
    long: _Long, n_bits: int, n_in_key: int, n_keys: int
) -> Iterator[tuple[list[Any], list[NDArray[np.int64]]]]:
    # items, and the numbers to which each rating adds its grade
    mark = 1 << (n_bits - 1)
    for items, grade, rater in long.batches():
        if len(long.grades.texts) > mark or long.n_raters > n_in_key * n_keys:
            raise UnorderedError
        which, at = np.divmod(np.arange(long.n_raters), n_in_key)
        value = (grade.astype(np.int64) | mark) << (at * n_bits)[rater]
        if n_keys == 1:
            yield items, [value]
        else:
            of = which[rater]
            yield items, [np.where(of == k, value, 0) for k in range(n_keys)]

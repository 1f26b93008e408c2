"""Files larger than memory: DuckDB groups them to the rows of ratings that differ.

In: a path and what the caller says of the file. Out: its first rows as a sheet, and the
same `Contents` as of a file that is read as a whole.
"""

import atexit
import gc
import hashlib
import json
import os
import re
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np

from masrel.errors import RatingsError
from masrel.ratings._findings import (
    USUAL_MISSING,
    Finding,
    ReadingOptions,
    library,
    refusal,
)
from masrel.ratings._layout import Layout, doubt_columns, doubt_names, numbered
from masrel.ratings._parts import (
    Contents,
    graded,
    joined,
    named,
    patterns_part,
    repeated_rating,
    unrated,
)
from masrel.ratings._sheet import (
    DELIMITERS,
    TEXT_FORMATS,
    Codes,
    Column,
    Sheet,
    decoded,
    finished,
    long_cells,
    plain,
    read_text,
    records,
    value_text,
)

_LARGE_TEXT = 256 << 20  # bytes of text from which a file is read so
_LARGE_TABLE = 20_000_000  # cells of a Parquet file from which it is
_HEAD_BYTES = 1 << 20
_HEAD_ROWS = 10_000  # rows that show which column is what
_LONGEST = 1 << 24  # letters of a cell
_MEMORY = "700MB"
_MAX_GRADES, _MAX_RATERS = 120, 62
_MAX_ROWS = 1_000_000  # rows of ratings that differ
_BITS = 62  # of a number in which the grades of an item are put together
_UNPLAIN = "^[^!-~]|[^!-~]$|[^ -~]"  # blanks around, or letters that have two forms
_BLANKS = "".join(chr(k) for k in range(0x3001) if chr(k).isspace())


class NoStreamError(RatingsError):
    """What a stream cannot count, and a file that is read as a whole can."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """A file that DuckDB reads, as often as need be."""

    path: Path
    rows: str  # what selects columns "0", "1" … and n, the number of the row
    kinds: Sequence[str] = ()  # types of its columns
    n_before: int | None = None  # lines above the rows of a text
    delimiter: str = ","
    progress: Callable[[int, int], None] = lambda *_: None

    def items(self, layout: Layout) -> str:
        """Return what tells items apart: numbers, or 128 bits of the hash of a text."""
        if not any(self.kinds[place] == "VARCHAR" for place in layout.item):
            return _columns(layout.item)
        names = f"concat_ws(chr(31), {_columns(layout.item)})"
        return f"hash({names}), hash({names} || '~')"

    def unnamed(self, layout: Layout) -> str:
        """Return whether a row does not name its item."""
        usual = ", ".join(map(_quoted, USUAL_MISSING))
        tests = [
            f"coalesce(\"{place}\", '') IN ({usual})"
            if self.kinds[place] == "VARCHAR"
            else f'"{place}" IS NULL'
            for place in layout.item
        ]
        return f"({' OR '.join(tests) or 'false'})"

    def answer(self, query: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        """Return the rows of a query, or say what in the file it cannot read."""
        duckdb = library(str(self.path), "duckdb", "big")
        try:
            return _answer(self.path, query, values, self.progress)
        except duckdb.OutOfMemoryException as error:
            raise MemoryError(str(error).splitlines()[0]) from error
        except duckdb.Error as error:
            if self.n_before is not None:
                self._refuse_record()
                what = "records that only a whole file can have"
                raise NoStreamError(what) from error
            line = str(error).splitlines()[0][:200].rstrip(". ")
            raise refusal(
                str(self.path), "damaged", suffix=".parquet", error=line
            ) from error

    def where(self, row: int) -> str:
        """Return where a row stands, looked up only for a message."""
        if self.n_before is None:
            return f"row {row + 2}"  # the names are the first
        line, _ = next(islice(self._records(), row, None), (None, ()))
        return "the end" if line is None else f"line {line}"

    def _records(self) -> Iterator[tuple[int, list[str]]]:
        with self.path.open(encoding="utf-8", newline="") as file, long_cells():
            for _ in range(self.n_before or 0):
                file.readline()
            yield from records(file, self.delimiter, self.n_before or 0)

    def _refuse_record(self) -> None:
        # the first record that is none of the table
        name, width = str(self.path), len(self.kinds)
        try:
            for line, record in self._records():
                if len(record) != width:
                    facts = {"n": len(record), "cells": ", ".join(record)[:60]}
                    where = f"line {line}"
                    raise refusal(name, "width", where=where, width=width, **facts)
        except UnicodeDecodeError:
            with self.path.open("rb") as file:
                for number, data in enumerate(file):
                    decoded(name, data, None, number)


def _quoted(text: str) -> str:
    return "'{}'".format(text.replace("'", "''"))


def _columns(places: Sequence[int]) -> str:
    return ", ".join(f'"{place}"' for place in places)


def _compared(column: str, kind: str) -> str:
    # a column as its cells are compared: texts without blanks, in one Unicode form
    if kind == "FLOAT":  # by its own digits
        return f"CAST(CAST({column} AS VARCHAR) AS DOUBLE)"
    if kind != "VARCHAR":
        return column
    column = f"CAST({column} AS VARCHAR)"
    plain = f"nfc_normalize(trim({column}, '{_BLANKS}'))"
    is_plain = f"NOT regexp_matches({column}, '{_UNPLAIN}')"
    return f"CASE WHEN {is_plain} THEN {column} ELSE {plain} END"


def _answer(
    path: Path,
    query: str,
    values: Sequence[Any],
    progress: Callable[[int, int], None],
) -> list[tuple[Any, ...]]:
    # DuckDB works in a thread, so that Ctrl-C is heard and progress is shown
    duckdb, size = library(str(path), "duckdb", "big"), path.stat().st_size
    atexit.unregister(gc.freeze)  # which DuckDB would take for a leak
    answers: list[list[tuple[Any, ...]]] = []
    errors: list[Exception] = []
    with ExitStack() as stack:  # what spills is removed whatever happens
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="masrel-"))
        database = stack.enter_context(duckdb.connect(":memory:"))
        database.execute("SET enable_progress_bar_print = false")
        database.execute(f"SET memory_limit = '{_MEMORY}'")
        database.execute(f"SET temp_directory = {_quoted(folder)}")
        database.execute(f"SET threads = {min(4, os.cpu_count() or 1)}")

        def work() -> None:
            try:
                answers.append(database.execute(query, values).fetchall())
            except (duckdb.Error, RuntimeError, MemoryError) as error:
                errors.append(error)

        thread = Thread(target=work, daemon=True)
        try:
            thread.start()
            while thread.is_alive():
                thread.join(0.05)
                share = database.query_progress() / 100.0
                if share > 0.0 or not thread.is_alive():
                    progress(int(share * size) if thread.is_alive() else size, size)
        finally:
            if thread.is_alive():
                database.interrupt()
                thread.join()
    if errors:
        raise errors[0]
    return answers[0]


def large_file(path: Path | str, options: ReadingOptions) -> tuple[Sheet, Scan] | None:
    """Open a file as a stream; None if it is to be read as a whole."""
    file, name, stream = Path(path), str(path), options.stream
    kind, opened = file.suffix.lower(), None
    is_other = options.transpose or options.source or options.sheet
    if stream is False:
        return None
    if name != "-" and file.is_file() and not is_other:
        if kind == ".parquet" and options.encoding is None and not options.no_header:
            if stream or (_n_cells(file) >= _LARGE_TABLE and find_spec("duckdb")):
                opened = _parquet(file, options)
        elif kind in TEXT_FORMATS and (options.encoding or "utf-8") == "utf-8":
            is_large = file.stat().st_size >= _LARGE_TEXT and find_spec("duckdb")
            if stream or is_large:
                opened = _text(file, options)
    if opened is None and stream:
        is_absent = name != "-" and not file.exists()
        raise refusal(name, "absent" if is_absent else "no stream")
    return opened


def _n_cells(path: Path) -> int:
    parquet = library(str(path), "pyarrow.parquet")
    try:
        about = parquet.read_metadata(path)
    except (OSError, ValueError):  # said where it is read
        return 0
    return int(about.num_rows) * int(about.num_columns)


def _text(path: Path, options: ReadingOptions) -> tuple[Sheet, Scan] | None:
    name, kind = str(path), TEXT_FORMATS[path.suffix.lower()]
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    end = next((mark for mark in (b"\r\n", b"\n", b"\r") if mark in head), b"\n")
    if len(head) == _HEAD_BYTES:
        head = _whole_lines(head, end)
    if not head or head.startswith((b"\0", b"\xff\xfe", b"\xfe\xff")):
        return None
    text = decoded(name, head, options.encoding)
    sha256 = partial(_sha256_of, path)  # which reads it once more
    sheet = read_text(name, sha256, text, kind, options)
    marks = {title: mark for mark, title in DELIMITERS.items()}
    delimiter = marks.get(sheet.facts["delimiter"], sheet.facts["delimiter"])
    if delimiter == " ":
        return None
    n_before = int(sheet.line_of(0).split()[-1]) - int(options.no_header)
    places = range(len(sheet.columns))
    types = ", ".join(f"'{place}': 'VARCHAR'" for place in places)
    cells = [f'{_compared(_columns([p]), "VARCHAR")} AS "{p}"' for p in places]
    scan = Scan(
        path=path,
        rows=f"SELECT {', '.join(cells)}, row_number() OVER () - 1 AS n FROM read_csv("
        f"{_quoted(name)}, auto_detect = false, header = false, skip = {n_before}, "
        f"""delim = {_quoted(delimiter)}, quote = '"', escape = '"', """
        f"new_line = '{repr(end.decode())[1:-1]}', max_line_size = {_LONGEST}, "
        f"columns = {{{types}}})",
        kinds=["VARCHAR"] * len(places),
        n_before=n_before,
        delimiter=delimiter,
    )
    return finished(sheet, options), scan


def _whole_lines(head: bytes, end: bytes) -> bytes:
    # the records at the beginning: no quote that is opened there is closed behind
    cut = head.rfind(end)
    while cut > 0 and head.count(b'"', 0, cut) % 2:
        cut = head.rfind(end, 0, cut)
    return head[: cut + len(end)] if cut > 0 else b""


def _sha256_of(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _parquet(path: Path, options: ReadingOptions) -> tuple[Sheet, Scan] | None:
    file = _quoted(str(path))
    scan = Scan(
        path=path, rows=f"SELECT * FROM read_parquet({file}, file_row_number = true)"
    )
    kinds = {row[0]: row[1] for row in scan.answer(f"DESCRIBE {scan.rows}")}
    kinds = {c: re.sub(r"^ENUM.*", "VARCHAR", str(k)) for c, k in kinds.items()}
    del kinds["file_row_number"]
    # names of rows that pandas keeps come first
    about = f"SELECT value FROM parquet_kv_metadata({file}) WHERE key = 'pandas'"
    index = [c for (m,) in scan.answer(about) for c in json.loads(m)["index_columns"]]
    stored = list(dict.fromkeys([c for c in index if c in kinds] + list(kinds)))
    cells = [
        f"""{_compared('"{}"'.format(c.replace('"', '""')), kinds[c])} AS "{place}\""""
        for place, c in enumerate(stored)
    ]
    rows = f"SELECT {', '.join(cells)}, file_row_number AS n FROM ({scan.rows})"
    texts = {k: "VARCHAR" for k in kinds.values() if k.startswith("ENUM")}
    scan = replace(
        scan, rows=rows, kinds=[texts.get(kinds[c], kinds[c]) for c in stored]
    )
    shown = _columns(range(len(stored)))
    first = scan.answer(f"SELECT {shown} FROM ({rows}) LIMIT {_HEAD_ROWS}")
    if not first:
        return None  # refused like any other
    columns = zip(*first, strict=True)
    sheet = Sheet(
        name=str(path),
        sha256=partial(_sha256_of, path),
        header=tuple("" if c.startswith("__index_level_") else c for c in stored),
        columns=tuple(
            Column.of_cells(_cell_text(path, value) for value in column)
            for column in columns
        ),
        facts={"format": "parquet"},
        line_of=lambda number: f"row {number + 1}",
    )
    return finished(sheet, options), scan


def _cell_text(path: Path, value: Any) -> str:
    # what a cell says
    if isinstance(value, list | dict):
        kind = type(value).__name__
        raise refusal(str(path), "nested cell", where="", kind=kind)
    return "" if value is None or value != value else plain(value_text(value))


def large_contents(
    sheet: Sheet,
    scan: Scan,
    layout: Layout,
    options: ReadingOptions,
    progress: Callable[[int, int], None],
) -> Contents:
    """Count the rows of ratings that differ, and read their grades."""
    scan = replace(scan, progress=progress)
    is_long = layout.kind == "long"
    places = (layout.rater, layout.grade) if is_long else layout.raters
    groups, freq, stored = _groups(sheet, scan, layout, places)
    cells = joined(groups, places[-1:] if is_long else places)
    _refuse_many(cells.texts, _MAX_GRADES, "different grades")
    grades = graded(groups, cells, places[-1:] if is_long else places, options, freq)
    of_text = np.bincount(cells.codes, np.repeat(freq, len(cells.codes) // len(freq)))
    n_missing = int(of_text[grades.codes < 0].sum())
    if is_long:
        raters = named(groups, "rater", (layout.rater,))
        _refuse_many(raters.texts, _MAX_RATERS, "different raters")
        names, n_rows = raters.texts, int(freq.sum())
        rows, freq = _patterns(sheet, scan, layout, stored, raters.codes, cells.codes)
        rows = np.append(grades.codes, -1)[rows]
        findings = [numbered(sheet, layout)] * bool(freq.sum() == n_rows > 2)
    else:
        _refuse_repeated(sheet, scan, layout)
        names = [sheet.header[place] for place in places]
        rows = grades.codes[cells.codes].reshape(len(freq), -1)
        findings = doubt_columns(sheet, layout, rows, grades.scale, freq)
        findings += unrated(names, rows)
    # each row once, in the order of the last rater's grades
    rows, at = np.unique(rows[:, ::-1].astype(np.int8), axis=0, return_inverse=True)
    of_grade = np.zeros(len(grades.scale.grades) + 1)
    np.add.at(of_grade, grades.codes, of_text)  # those of -1 are the last
    freq = np.bincount(at.ravel(), freq, len(rows)).astype(np.int64)
    blank = groups.dropped.get("blank", 0)
    return Contents(
        parts=[patterns_part(rows[:, ::-1], freq, names, grades.scale)],
        grades=grades,
        scale=grades.scale,
        freq=of_grade[:-1].astype(np.int64),
        raters=names,
        n_items=int(freq.sum()),
        n_raters=len(names),
        n_missing=n_missing,
        findings=[*findings, *doubt_names("raters", names), Finding("stream")],
        facts={"dropped": {"blank": blank} if blank else {}},
        is_simulated=groups.is_simulated,
    )


def _refuse_many(values: Sequence[object], most: int, what: str) -> None:
    if len(values) > most:
        raise NoStreamError(f"more than {most} {what}, more than a stream counts")


def _groups(
    sheet: Sheet, scan: Scan, layout: Layout, places: Sequence[int]
) -> tuple[Sheet, Codes, list[tuple[Any, ...]]]:
    # rows whose cells in some columns differ, each as the first that has them, how many
    # are like it, and the cells as they are stored; the first of a wide table is apart
    simulated = "false"
    if "source" in sheet.header and sheet.header.index("source") not in layout.raters:
        source = _columns([sheet.header.index("source")])
        simulated = f"CAST({source} AS VARCHAR) = 'simulated'"
    is_first = "false" if layout.kind == "long" else "n = 0"
    answer = scan.answer(
        f"SELECT {_columns(places)}, {scan.unnamed(layout)}, {is_first}, min(n), "
        f"count(*), bool_or({simulated}) FROM ({scan.rows}) GROUP BY ALL "
        f"LIMIT {_MAX_ROWS + 1}"
    )
    _refuse_many(answer, _MAX_ROWS, "rows that differ")
    answer.sort(key=lambda row: row[-3])
    *columns, unnamed, _, first, n_rows, is_simulated = zip(*answer, strict=True)
    nothing = Column(np.zeros(len(answer), dtype=np.int64), [""])
    texts = dict.fromkeys(range(len(sheet.header)), nothing)
    for place, cells in zip(places, columns, strict=True):
        texts[place] = Column.of_cells(_cell_text(scan.path, cell) for cell in cells)
    groups = replace(
        sheet,
        columns=tuple(texts.values()),
        numbers=np.array(first),
        line_of=scan.where,
        is_simulated=any(is_simulated),
    )
    blank = np.array(unnamed) | (not layout.item)
    again = np.full(len(answer), sheet.has_header and scan.n_before is not None)
    for place in places:
        blank &= texts[place].is_text("")
        again &= texts[place].is_text(sheet.header[place])
    if again.any():
        raise groups.refuse("names again", groups.where(int(np.argmax(again))))
    if (wrong := np.array(unnamed) & ~blank).any():
        row = first[int(np.argmax(wrong))]
        query = f"SELECT {_columns(layout.item)} FROM ({scan.rows}) WHERE n = {row}"
        items = [_cell_text(scan.path, cell) for cell in scan.answer(query)[0]]
        k = next(k for k, text in enumerate(items) if text in USUAL_MISSING)
        facts = {"role": "item", "got": items[k]}
        raise sheet.refuse("unnamed", scan.where(row), layout.item[k], **facts)
    freq, stored = np.array(n_rows), list(zip(*columns, strict=True))
    rated = groups.without(blank, "blank")
    if blank.any():
        rated = replace(rated, dropped={"blank": int(freq[blank].sum())})
    return rated, freq[~blank], [stored[k] for k in np.flatnonzero(~blank)]


def _patterns(
    sheet: Sheet,
    scan: Scan,
    layout: Layout,
    stored: list[tuple[Any, ...]],
    rater: Codes,
    grade: Codes,
) -> tuple[Codes, Codes]:
    # the texts' numbers of every item by its raters, -1 where there is no rating, and
    # how often each such row is there: a rating has some bits of a whole number, which
    # are put together item by item
    n_bits, n_raters = int(grade.max() + 1).bit_length(), int(rater.max()) + 1
    n_in_key = _BITS // n_bits
    keys = range(-(-n_raters // n_in_key))
    bits = (grade + 1) << (rater % n_in_key * n_bits)
    cells, values = [], []
    for pair, which, value in zip(stored, rater // n_in_key, bits, strict=True):
        values += [*pair, *(int(value) if which == k else 0 for k in keys)]
        cells.append(f"(?, ?{', ?::BIGINT' * len(keys)})")
    columns = ", ".join(f"key{k}" for k in keys)
    is_cell = (
        f'"{layout.rater}" IS NOT DISTINCT FROM rater AND '
        f'"{layout.grade}" IS NOT DISTINCT FROM grade'
    )
    of_items = (
        f"SELECT {', '.join(f'bit_or(key{k}) AS key{k}' for k in keys)}, "
        f"count(*) AS n_rows FROM ({scan.rows}) JOIN (VALUES {', '.join(cells)}) "
        f"AS cells(rater, grade, {columns}) ON {is_cell} "
        f"WHERE NOT {scan.unnamed(layout)} GROUP BY {scan.items(layout)}"
    )
    answer = scan.answer(
        f"SELECT {columns}, n_rows, count(*) FROM ({of_items}) GROUP BY ALL "
        f"LIMIT {_MAX_ROWS + 1}",
        values,
    )
    _refuse_many(answer, _MAX_ROWS, "items that differ")
    table = np.array(answer, dtype=np.int64)
    shifts = np.arange(n_in_key) * n_bits
    digits = (table[:, :-2, None] >> shifts) & ((1 << n_bits) - 1)
    rows = digits.reshape(len(table), -1)[:, :n_raters] - 1
    if ((rows >= 0).sum(axis=1) != table[:, -2]).any():
        _refuse_repeated(sheet, scan, layout)
    return rows, table[:, -1]


def _refuse_repeated(sheet: Sheet, scan: Scan, layout: Layout) -> None:
    # an item that is there twice, or twice by the same rater
    if not layout.item:
        return
    raters = [layout.rater] if layout.kind == "long" else []
    group = ", ".join([scan.items(layout), *(f'"{place}"' for place in raters)])
    named = f"FROM ({scan.rows}) WHERE NOT {scan.unnamed(layout)}"
    twice = scan.answer(
        f"SELECT {group}, min(n) AS first {named} GROUP BY ALL HAVING count(*) > 1 "
        "ORDER BY first LIMIT 1"
    )
    if not twice:
        return
    names = _columns([*layout.item, *raters])
    (*key, _) = twice[0]
    rows = scan.answer(
        f"SELECT n, {names} {named} AND ({group}) = ({', '.join('?' * len(key))}) "
        "ORDER BY n LIMIT 2",
        key,
    )
    texts = [_cell_text(scan.path, value) for value in rows[0][1:]]
    rater = texts.pop() if raters else "every rater"
    raise repeated_rating(
        sheet,
        layout,
        rows=[scan.where(row[0]) for row in rows],
        rater=rater,
        item=" ".join(texts),
        hint=" with --no-stream",
    )

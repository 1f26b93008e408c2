"""Large files: DuckDB groups them to the rows of ratings that differ.

In: a path and what the caller says of the file. Out: its first rows as a sheet, then a
sheet of the cells that differ with how often each is there, and the grades of items
that differ, for which names and ratings are numbered within DuckDB. What all of them
mean is decided by the rules of files that are read as a whole, and what is refused is
read again where it stands.
"""

import hashlib
import io
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from itertools import chain, islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError
from masrel.ratings._doubts import doubt_item_names
from masrel.ratings._findings import (
    USUAL_MISSING,
    Finding,
    Reading,
    library,
)
from masrel.ratings._layout import Layout, rated_twice
from masrel.ratings._sheet import (
    DELIMITERS,
    TAIL,
    TEXT_FORMATS,
    Codes,
    Column,
    Sheet,
    checked_records,
    decoded,
    finished,
    line_of,
    read_foreign,
    read_text,
    reader_of,
    without_notes,
)

_LARGE_TABLE = 20_000_000  # cells of a Parquet file from which it is read so
_HEAD_BYTES = 1 << 20
_HEAD_ROWS = 10_000  # rows that show which column is what
_LONGEST = 1 << 24  # letters of a cell
_MEMORY = "600MB"
_MAX_GRADES, _MAX_RATERS = 120, 62
_MAX_ROWS = 1_000_000  # rows of ratings that differ
_MAX_NAMED = 10_000_000  # rows the names of whose items are kept until all are there
_MAX_NAMES = 1_000_000  # names of items that are looked through one by one
_WORD = 62  # bits of a whole number that hold grades
_BLANKS = "".join(chr(k) for k in range(0x3001) if chr(k).isspace())
_ITEM = "hash(item), hash(item || '~')"  # 128 bits that tell items apart
# Whether a name may have blanks around, or letters of two forms; and the name without.
_UNPLAIN = "(strlen({0}) <> length({0}) OR {0} < '!' OR {0}[-1] < '!')"
_NAME = (
    f"CASE WHEN {_UNPLAIN} THEN nfc_normalize(trim({{0}}, '{_BLANKS}')) ELSE {{0}} END"
)
# Names none of which a reader takes for another, or for a sum of others: without
# capitals and blanks; or as long as they differ without these.
_ARE_USUAL = (
    "bool_and(regexp_full_match(name, '[a-z][!-@[-~]*[0-9]|[1-9][0-9]*|0'))",
    "bool_and(regexp_full_match(name, '[A-Za-z][ -~]*[0-9]|[1-9][0-9]*|0')) AND "
    "count(DISTINCT hash(lower(replace(name, ' ', '')))) = count(*)",
)

# a query, and its parameters, to the columns of its answer
Answer = Callable[..., dict[str, NDArray[Any]]]


class NoStreamError(RatingsError):
    """What a stream cannot count, and a file that is read as a whole can."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A file that DuckDB reads, as often as need be."""

    head: Sheet  # its first rows
    rows: str  # SQL that selects columns "0", "1" … and n, the number of a row
    column_of: Callable[[str, NDArray[Any]], Column]  # of a name and cells
    recheck: Callable[[], object]  # refuses the first record that is none of the table


def source_of(path: Path, options: Reading) -> Source:
    """Open a file for DuckDB."""
    is_other = options.transpose or options.source or options.sheet
    kind = path.suffix.lower()
    if path.is_file() and (options.stream or find_spec("duckdb")) and not is_other:
        has_names = not (options.no_header or options.names_at)
        if kind == ".parquet" and options.encoding is None and has_names:
            return _parquet(path, options)
        if kind in TEXT_FORMATS and options.encoding in (None, "utf-8"):
            return _text(path, options)
    raise NoStreamError(Finding("no stream"))


def _parquet(path: Path, options: Reading) -> Source:
    import pandas as pd

    from masrel.ratings._exports import column_of, sheet_of, table_frame

    name = str(path)
    parquet = library(name, "pyarrow.parquet")
    file = read_foreign(name, ".parquet", lambda: parquet.ParquetFile(path))
    about = file.metadata
    if not options.stream and about.num_rows * about.num_columns < _LARGE_TABLE:
        raise NoStreamError("it fits in memory")
    first = islice(file.iter_batches(_HEAD_ROWS), 1)
    table = library(name, "pyarrow").Table
    read = partial(table.from_batches, first, file.schema_arrow)
    head = read_foreign(name, ".parquet", read)
    facts = {"format": "parquet"}
    sheet = sheet_of(name, partial(_sha256, path), table_frame(head), facts)
    # names of rows that pandas keeps come first
    index = (file.schema_arrow.pandas_metadata or {}).get("index_columns", ())
    stored = dict.fromkeys(
        c for c in (*index, *head.column_names) if isinstance(c, str)
    )
    columns = [
        '"{}" AS "{}"'.format(column.replace('"', '""'), place)
        for place, column in enumerate(stored)
    ]
    return Source(
        head=finished(sheet, options),
        rows=f"SELECT {', '.join(columns)}, file_row_number AS n "
        f"FROM read_parquet({_quoted(name)}, file_row_number = true)",
        column_of=lambda title, values: column_of(name, title, pd.Series(values)),
        recheck=lambda: None,
    )


def _text(path: Path, options: Reading) -> Source:
    name, kind = str(path), TEXT_FORMATS[path.suffix.lower()]
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
        file.seek(max(path.stat().st_size - TAIL, 0))
        tail = file.read().decode("utf-8", "replace")
    if len(head) == _HEAD_BYTES:  # no quote that is opened in it is closed behind
        head = head[: head.rfind(b"\n") + 1]
        while head.count(b'"') % 2:
            head = head[: head.rfind(b"\n", 0, -1) + 1]
    if b"\n" not in head or head.startswith((b"\0", b"\xff\xfe", b"\xfe\xff")):
        raise NoStreamError(Finding("no stream"))
    text = decoded(name, head, options.encoding)
    sheet = read_text(name, partial(_sha256, path), text, kind, options)
    marks = {title: mark for mark, title in DELIMITERS.items()}
    delimiter = marks.get(sheet.facts["delimiter"], sheet.facts["delimiter"])
    if delimiter == " ":
        raise NoStreamError(Finding("no stream"))
    width, first = len(sheet.columns), int(not options.no_header)
    n_above, n_before = sheet.line_of(0) - 1, sheet.line_of(first) - 1
    sheet = replace(
        sheet,
        line_of=partial(line_of, partial(_lines, path, n_above), delimiter, n_above),
        findings=sheet.findings + without_notes(tail, delimiter, 0)[1],
    )
    types = ", ".join(f"'{place}': 'VARCHAR'" for place in range(width))
    return Source(
        head=finished(sheet, options),
        rows=f"SELECT *, row_number() OVER () - 1 AS n FROM read_csv({_quoted(name)}, "
        f"auto_detect = false, header = false, skip = {n_before}, "
        f"""delim = {_quoted(delimiter)}, quote = '"', escape = '"', """
        f"max_line_size = {_LONGEST}, columns = {{{types}}})",
        column_of=lambda _, cells: Column.of(
            np.arange(len(cells)), np.ma.filled(cells, "").tolist()
        ),
        recheck=lambda: deque(
            checked_records(
                sheet,
                reader_of(chain(_lines(path, n_before), "\0"), delimiter),
                width,
                first,
            ),
            maxlen=0,
        ),
    )


def _lines(path: Path, n_before: int) -> Iterator[str]:
    with path.open("rb") as file:
        for number, line in islice(enumerate(file), n_before, None):
            # at a carriage return, too, as where a file is read as a whole
            text = decoded(str(path), line, None, number)
            yield from io.StringIO(text, newline="")


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _quoted(text: str) -> str:
    return "'{}'".format(text.replace("'", "''"))


@contextmanager
def database_of(
    source: Source, layout: Layout, progress: Callable[[int, int], None]
) -> Iterator[Answer]:
    """Have DuckDB answer queries about frames and `cells`, the rows of the file."""
    name = source.head.name
    duckdb, size = library(name, "duckdb", "big"), Path(name).stat().st_size
    with (
        TemporaryDirectory(prefix="masrel-") as folder,
        duckdb.connect(
            config={
                "memory_limit": _MEMORY,
                "temp_directory": folder,
                "threads": min(4, os.cpu_count() or 1),
            }
        ) as database,
        ThreadPoolExecutor(1) as thread,  # so that Ctrl-C is heard, and progress shown
    ):
        database.execute("SET enable_progress_bar_print = false")

        def answer(query: str, *values: Any) -> dict[str, NDArray[Any]]:
            work = thread.submit(lambda: database.execute(query, values).fetchnumpy())
            try:
                while not wait([work], 0.05).done:
                    share = max(database.query_progress(), 0.0) / 100.0
                    progress(int(share * size), size)
                progress(size, size)
                return dict(work.result())
            except duckdb.OutOfMemoryException as error:
                raise MemoryError(str(error).splitlines()[0]) from error
            except duckdb.Error as error:
                source.recheck()
                what = "has records that cannot be read in batches"
                raise NoStreamError(what) from error
            finally:
                if not work.done():
                    database.interrupt()

        _make_view(answer, source, layout)
        yield answer


def _refuse_many(n: int, most: int, what: str) -> None:
    if n > most:
        raise NoStreamError(f"has more than {most} {what}, too many to read in batches")


def _make_view(answer: Answer, source: Source, layout: Layout) -> None:
    # the rows, with the names of item and rater as they are compared
    usual = ", ".join(map(_quoted, USUAL_MISSING))
    cells = [*map(_cell, layout.item)]
    names = [*map(_NAME.format, cells)]
    unnamed = (f"coalesce({name}, '') IN ({usual})" for name in names)
    header, simulated = source.head.header, "false"
    if "source" in header and header.index("source") not in layout.raters:
        place = header.index("source")
        simulated = f"coalesce(CAST(\"{place}\" AS VARCHAR) = 'simulated', false)"
    answer(
        "CREATE VIEW cells AS SELECT *, concat_ws(chr(31), "
        f"{', '.join(names) or 'CAST(n AS VARCHAR)'}) AS item, "
        f"{_NAME.format(_cell(layout.raters[0]))} AS rater, "
        f"{' OR '.join(unnamed) or 'true'} AS is_unnamed, "
        f"{' OR '.join(map(_UNPLAIN.format, cells)) or 'false'} AS is_unplain, "
        f"{simulated} AS is_simulated FROM ({source.rows})"
    )


def _cell(place: int) -> str:
    return f'CAST("{place}" AS VARCHAR)'


def groups_of(answer: Answer, source: Source, layout: Layout) -> Sheet:
    """Return the first of all rows whose grades, or raters and grades, are the same."""
    # the first row of a wide table is apart
    sheet, places = source.head, list(dict.fromkeys((*layout.raters, *layout.grades)))
    is_first = "false" if layout.kind == "long" else "n = 0"
    columns = ", ".join(f'"{place}"' for place in places)
    answer(
        f"CREATE TABLE cells_met AS SELECT {columns}, is_unnamed, {is_first} AS "
        "is_first, min(n) AS first, count(*) AS freq, bool_or(is_simulated) AS "
        "is_simulated, bool_or(is_unplain) AS is_unplain FROM cells GROUP BY ALL "
        f"ORDER BY first LIMIT {_MAX_ROWS + 1}"
    )
    met = answer("SELECT * FROM cells_met ORDER BY first")
    n_rows = len(met["first"])
    _refuse_many(n_rows, _MAX_ROWS, "rows that differ")
    cells = [Column(np.zeros(n_rows, dtype=np.int64), [""])] * len(sheet.header)
    for place in places:
        cells[place] = source.column_of(sheet.header[place], met[str(place)])
    groups = replace(
        sheet,
        columns=tuple(cells),
        numbers=np.asarray(met["first"], np.int64) + sheet.has_header,
        freq=np.asarray(met["freq"], np.int64),
        is_simulated=sheet.is_simulated or bool(met["is_simulated"].any()),
    )
    if sheet.unit == "line" and sheet.has_header:
        _refuse_names(answer, groups, places)
    texts = {text for place in layout.grades for text in groups.columns[place].texts}
    _refuse_many(len(texts), _MAX_GRADES, "different grades")
    is_unnamed = np.asarray(met["is_unnamed"], bool)
    is_blank = is_unnamed & groups.hold([""] * len(sheet.header))
    for row in np.flatnonzero(is_unnamed & ~is_blank)[: len(layout.item)]:
        named = answer(f"SELECT item FROM cells WHERE n = {met['first'][row]}")
        got = named["item"][0].replace(chr(31), " ")
        only = layout.item[0] if len(layout.item) == 1 else None
        raise groups.refuse("unnamed", groups.where(row), only, role="item", got=got)
    # where no name has blanks around, they need not be looked for again
    is_plain = len(layout.item) == 1 and not np.any(met["is_unplain"])
    item = f'"{layout.item[0]}" AS item' if is_plain else "item"
    chosen = " WHERE NOT is_unnamed" if is_unnamed.any() else ""
    answer(f"CREATE VIEW rated AS SELECT {columns}, {item} FROM cells{chosen}")
    return groups.without(is_blank, "blank")


def _refuse_names(answer: Answer, groups: Sheet, places: list[int]) -> None:
    # a row like the first, of which these places are known
    again = [groups.columns[place].is_text(groups.header[place]) for place in places]
    if np.all(again, axis=0).any():
        is_name = " AND ".join(
            f"{_NAME.format(_cell(place))} = {_quoted(name)}"
            for place, name in enumerate(groups.header)
        )
        first = answer(f"SELECT min(n) AS n FROM cells WHERE {is_name}")["n"]
        if not np.ma.is_masked(first):
            raise groups.refuse("names again", groups.at(int(first[0]) + 1))


def patterns(
    answer: Answer, groups: Sheet, layout: Layout, rater: Column, grade: Codes
) -> tuple[Codes, Codes]:
    """Return what grades items have by the raters, and how often each such row is."""
    _refuse_many(len(rater.texts), _MAX_RATERS, "different raters")
    # The ratings of an item are fields of whole numbers, as many raters' as fit into
    # each: 0 for no rating, 1 for a missing one, and more for a grade.
    n_bits = int(grade.max() + 2).bit_length()
    word, place = np.divmod(np.arange(len(rater.texts)), _WORD // n_bits)
    field, words = (grade + 2) << (n_bits * place)[rater.codes], range(word[-1] + 1)
    answer(
        "CREATE TABLE codes AS SELECT unnest(?) AS first"
        + "".join(f", unnest(?) AS w{k}" for k in words),
        (groups.numbers - groups.has_header).tolist(),
        *(np.where(word[rater.codes] == k, field, 0).tolist() for k in words),
    )
    is_cell = [
        f'rated."{place}" IS NOT DISTINCT FROM coded."{place}"'
        for place in (*layout.raters, *layout.grades)
    ]
    _group_items(
        *(answer, groups),
        "rated JOIN (SELECT * FROM cells_met JOIN codes USING (first) "
        f"WHERE NOT is_unnamed) AS coded ON {' AND '.join(is_cell)}",
        "".join(f"bit_or(w{k}) AS w{k}, " for k in words),
    )
    met = answer(
        "SELECT * EXCLUDE (name), count(*) AS freq FROM items GROUP BY ALL "
        f"LIMIT {_MAX_ROWS + 1}"
    )
    _refuse_many(len(met["freq"]), _MAX_ROWS, "items that differ")
    packed = np.column_stack([met[f"w{k}"] for k in words])[:, word]
    rows = (packed >> (n_bits * place) & (1 << n_bits) - 1) - 2
    if ((rows > -2).sum(axis=1) != met["n_rows"]).any():
        refuse_repeated(answer, groups, layout)
    return np.maximum(rows, -1), np.asarray(met["freq"], np.int64)


def _group_items(answer: Answer, groups: Sheet, rows: str, ratings: str = "") -> None:
    # their names are kept if they are few
    are_few = groups.freq.sum() <= _MAX_NAMED
    kind, key, name = ("TABLE", *["item"] * 2) if are_few else ("VIEW", _ITEM, "NULL")
    answer(
        f"CREATE {kind} items AS SELECT {ratings}count(*) AS n_rows, "
        f"CAST({name} AS VARCHAR) AS name FROM {rows} GROUP BY {key}"
    )


def refuse_repeated_items(answer: Answer, groups: Sheet, layout: Layout) -> None:
    """Refuse an item that is in two rows of a wide table."""
    if layout.item:
        _group_items(answer, groups, "rated")
        if answer("SELECT max(n_rows) > 1 AS is_there FROM items")["is_there"][0]:
            refuse_repeated(answer, groups, layout)


def refuse_repeated(answer: Answer, sheet: Sheet, layout: Layout) -> None:
    """Refuse an item that is there twice, or twice by the same rater."""
    by_rater = ", rater" if layout.kind == "long" else ""
    twice = answer(
        "SELECT min(n) AS one, min(n, 2)[2] AS other, min(item) AS item, min(rater) "
        f"AS rater FROM cells WHERE NOT is_unnamed GROUP BY {_ITEM}{by_rater} "
        "HAVING count(*) > 1 ORDER BY one LIMIT 1"
    )
    for one, other, item, rater in zip(*twice.values(), strict=True):
        two = replace(sheet, numbers=np.array([one, other]) + sheet.has_header)
        name = rater if by_rater else sheet.header[layout.raters[0]]
        raise rated_twice(two, layout, np.arange(2), item.replace(chr(31), " "), name)


def doubt_names_met(answer: Answer, groups: Sheet, layout: Layout) -> list[Finding]:
    """Refuse or warn of names of items as of a file that is read as a whole."""
    # or say that it is not done, of too many
    if layout.item and groups.freq.sum() <= _MAX_NAMED:
        queries = (f"SELECT {usual} AS are_usual FROM items" for usual in _ARE_USUAL)
        if any(answer(query)["are_usual"][0] for query in queries):
            return []
        met = answer(
            "SELECT replace(min(item), chr(31), ' ') AS name, min(n) AS first FROM "
            "cells WHERE NOT is_unnamed AND (SELECT count(*) FROM items) <= "
            f"{_MAX_NAMES} GROUP BY {_ITEM} ORDER BY first"
        )
        if n_items := len(met["first"]):
            sheet = replace(groups, numbers=met["first"] + groups.has_header)
            names = Column(np.arange(n_items), met["name"].tolist())
            return doubt_item_names(sheet, names)
    return [Finding("stream")] if layout.item else []

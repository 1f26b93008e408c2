"""Files larger than memory: DuckDB groups them to the rows of ratings that differ.

In: a path and what the caller says of the file. Out: its first rows as a sheet, then a
sheet of the cells that differ with how often each is there, and the grades of items
that differ. What all of them mean is decided by the rules of files that are read as a
whole, and what is refused is read again where it stands.
"""

import atexit
import gc
import hashlib
import os
from collections.abc import Callable, Iterator, Sized
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from itertools import chain, islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from masrel.errors import RatingsError
from masrel.ratings._exports import column_of, sheet_of, table_frame
from masrel.ratings._findings import (
    USUAL_MISSING,
    Finding,
    Reading,
    library,
)
from masrel.ratings._layout import Layout, rated_twice
from masrel.ratings._sheet import (
    DELIMITERS,
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
)

_LARGE_TABLE = 20_000_000  # cells of a Parquet file from which it is read so
_HEAD_BYTES = 1 << 20
_HEAD_ROWS = 10_000  # rows that show which column is what
_LONGEST = 1 << 24  # letters of a cell
_MEMORY = "700MB"
_MAX_GRADES, _MAX_RATERS = 120, 62
_MAX_ROWS = 1_000_000  # rows of ratings that differ
_UNPLAIN = "^[^!-~]|[^!-~]$|[^ -~]"  # blanks around, or letters that have two forms
_BLANKS = "".join(chr(k) for k in range(0x3001) if chr(k).isspace())
_ITEM = "hash(item), hash(item || '~')"  # 128 bits that tell items apart

Answer = Callable[..., pd.DataFrame]  # a query, and frames that it names, to its rows


class NoStreamError(RatingsError):
    """What a stream cannot count, and a file that is read as a whole can."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A file that DuckDB reads, as often as need be."""

    head: Sheet  # its first rows
    rows: str  # SQL that selects columns "0", "1" … and n, the number of a row
    recheck: Callable[[], None]  # refuses the first record that is none of the table


def source_of(path: Path, options: Reading) -> Source:
    """Open a file for DuckDB."""
    is_other = options.transpose or options.source or options.sheet
    kind = path.suffix.lower()
    has_duckdb = options.stream or find_spec("duckdb")
    if path.is_file() and has_duckdb and not is_other:
        if kind == ".parquet" and options.encoding is None and not options.no_header:
            return _parquet(path, options)
        if kind in TEXT_FORMATS and options.encoding in (None, "utf-8"):
            return _text(path, options)
    raise NoStreamError(Finding("no stream"))


def _parquet(path: Path, options: Reading) -> Source:
    name = str(path)
    parquet = library(name, "pyarrow.parquet")
    file = read_foreign(name, ".parquet", lambda: parquet.ParquetFile(path))
    about = file.metadata
    if not options.stream and about.num_rows * about.num_columns < _LARGE_TABLE:
        raise NoStreamError("it fits the memory")
    first = islice(file.iter_batches(_HEAD_ROWS), 1)
    head = library(name, "pyarrow").Table.from_batches(first, file.schema_arrow)
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
        recheck=lambda: None,
    )


def _text(path: Path, options: Reading) -> Source:
    name, kind = str(path), TEXT_FORMATS[path.suffix.lower()]
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
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
    lines = partial(_lines, path, n_above)
    sheet = replace(sheet, line_of=partial(line_of, lines, delimiter, n_above))
    types = ", ".join(f"'{place}': 'VARCHAR'" for place in range(width))

    def recheck() -> None:
        reader = reader_of(chain(_lines(path, n_before), "\0"), delimiter)
        for _ in checked_records(sheet, reader, width, first):
            pass

    return Source(
        head=finished(sheet, options),
        rows=f"SELECT *, row_number() OVER () - 1 AS n FROM read_csv({_quoted(name)}, "
        f"auto_detect = false, header = false, skip = {n_before}, "
        f"""delim = {_quoted(delimiter)}, quote = '"', escape = '"', """
        f"max_line_size = {_LONGEST}, columns = {{{types}}})",
        recheck=recheck,
    )


def _lines(path: Path, n_before: int) -> Iterator[str]:
    with path.open("rb") as file:
        for number, line in enumerate(file):
            if number >= n_before:
                yield decoded(str(path), line, None, number)


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
    atexit.unregister(gc.freeze)  # which DuckDB would take for a leak
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

        def answer(query: str, **frames: pd.DataFrame) -> pd.DataFrame:
            for title, frame in frames.items():
                database.register(title, frame)
            work = thread.submit(lambda: database.execute(query).df())
            try:
                while not wait([work], 0.05).done:
                    share = max(database.query_progress(), 0.0) / 100.0
                    progress(int(share * size), size)
                progress(size, size)
                answered: pd.DataFrame = work.result()
                return answered
            except duckdb.OutOfMemoryException as error:
                raise MemoryError(str(error).splitlines()[0]) from error
            except duckdb.Error as error:
                source.recheck()
                what = "records that only a whole file can have"
                raise NoStreamError(what) from error
            finally:
                if not work.done():
                    database.interrupt()

        _make_view(answer, source, layout)
        yield answer


def _refuse_many(values: Sized, most: int, what: str) -> None:
    if len(values) > most:
        raise NoStreamError(f"more than {most} {what}, more than a stream counts")


def _make_view(answer: Answer, source: Source, layout: Layout) -> None:
    # the rows, with the names of item and rater as they are compared
    items = ", ".join(map(_name, layout.item)) or "CAST(n AS VARCHAR)"
    usual = ", ".join(map(_quoted, USUAL_MISSING))
    unnamed = [f"coalesce({_name(place)}, '') IN ({usual})" for place in layout.item]
    header, simulated = source.head.header, "false"
    if "source" in header and header.index("source") not in layout.raters:
        place = header.index("source")
        simulated = f"coalesce(CAST(\"{place}\" AS VARCHAR) = 'simulated', false)"
    answer(
        f"CREATE VIEW cells AS SELECT *, concat_ws(chr(31), {items}) AS item, "
        f"{_name(layout.raters[0])} AS rater, {' OR '.join(unnamed) or 'true'} AS "
        f"is_unnamed, {simulated} AS is_simulated FROM ({source.rows})"
    )


def _name(place: int) -> str:
    # a name without blanks around, in one Unicode form
    text = f'CAST("{place}" AS VARCHAR)'
    plain = f"nfc_normalize(trim({text}, '{_BLANKS}'))"
    return (
        f"CASE WHEN regexp_matches({text}, '{_UNPLAIN}') THEN {plain} ELSE {text} END"
    )


def groups_of(answer: Answer, sheet: Sheet, layout: Layout) -> Sheet:
    """Return the first of all rows whose grades, or raters and grades, are the same."""
    # the first row of a wide table is apart
    places = list(dict.fromkeys((*layout.raters, *layout.grades)))
    is_first = "false" if layout.kind == "long" else "n = 0"
    columns = ", ".join(f'"{place}"' for place in places)
    answer(
        f"CREATE TABLE cells_met AS SELECT {columns}, is_unnamed, {is_first} AS "
        "is_first, min(n) AS first, count(*) AS freq, bool_or(is_simulated) AS "
        f"is_simulated FROM cells GROUP BY ALL ORDER BY first LIMIT {_MAX_ROWS + 1}"
    )
    frame = answer("SELECT * FROM cells_met ORDER BY first")
    _refuse_many(frame, _MAX_ROWS, "rows that differ")
    nothing = Column(np.zeros(len(frame), dtype=np.int64), [""])
    cells = [nothing] * len(sheet.header)
    for place in places:
        cells[place] = column_of(sheet.name, sheet.header[place], frame[str(place)])
    groups = replace(
        sheet,
        columns=tuple(cells),
        numbers=frame["first"].to_numpy(np.int64) + sheet.has_header,
        freq=frame["freq"].to_numpy(np.int64),
        is_simulated=sheet.is_simulated or bool(frame["is_simulated"].any()),
    )
    again = [groups.columns[k].is_text(sheet.header[k]) for k in places]
    if sheet.unit == "line" and sheet.has_header and np.all(again, axis=0).any():
        row = int(np.argmax(np.all(again, axis=0)))
        raise groups.refuse("names again", groups.where(row))
    texts = {text for place in layout.grades for text in groups.columns[place].texts}
    _refuse_many(texts, _MAX_GRADES, "different grades")
    is_unnamed = frame["is_unnamed"].to_numpy(bool)
    is_blank = is_unnamed & groups.hold([""] * len(sheet.header))
    if layout.item and (is_unnamed & ~is_blank).any():
        row = int(np.argmax(is_unnamed & ~is_blank))
        item = answer(f"SELECT item FROM cells WHERE n = {frame['first'][row]}")
        got = " ".join(item["item"][0].split(chr(31)))
        only = layout.item[0] if len(layout.item) == 1 else None
        raise groups.refuse("unnamed", groups.where(row), only, role="item", got=got)
    return groups.without(is_blank, "blank")


def patterns(
    answer: Answer,
    groups: Sheet,
    layout: Layout,
    rater: Column,
    grade: Codes,
) -> tuple[Codes, Codes]:
    """Return what grades items have by the raters, and how often each such row is."""
    first = groups.numbers - groups.has_header
    codes = pd.DataFrame({"first": first, "rater_code": rater.codes, "grade": grade})
    _refuse_many(rater.texts, _MAX_RATERS, "different raters")
    places = range(len(rater.texts))
    # of an item: its grades, -1 missing ones, and -2 where there is no rating
    grades = [
        f"coalesce(max(grade) FILTER (rater_code = {k}), -2) AS r{k}" for k in places
    ]
    is_cell = [
        f'cells."{place}" IS NOT DISTINCT FROM cells_met."{place}"'
        for place in (*layout.raters, *layout.grades)
    ]
    table = answer(
        f"SELECT *, count(*) AS freq FROM (SELECT {', '.join(grades)}, count(*) AS "
        f"n_rows FROM cells JOIN cells_met ON {' AND '.join(is_cell)} JOIN codes "
        "USING (first) "
        "WHERE NOT cells.is_unnamed AND NOT cells_met.is_unnamed "
        f"GROUP BY {_ITEM}) GROUP BY ALL LIMIT {_MAX_ROWS + 1}",
        codes=codes,
    ).to_numpy(np.int64)
    _refuse_many(table, _MAX_ROWS, "items that differ")
    rows, n_rows, freq = table[:, :-2], table[:, -2], table[:, -1]
    if ((rows > -2).sum(axis=1) != n_rows).any():
        refuse_repeated(answer, groups, layout)
    return np.maximum(rows, -1), freq


def refuse_repeated(answer: Answer, sheet: Sheet, layout: Layout) -> None:
    """Refuse an item that is there twice, or twice by the same rater."""
    if not layout.item:
        return
    by_rater = ", rater" if layout.kind == "long" else ""
    twice = answer(
        "SELECT min(n) AS one, max(n) AS other, min(item) AS item, min(rater) AS rater "
        "FROM cells WHERE NOT is_unnamed "
        f"GROUP BY {_ITEM}{by_rater} HAVING count(*) > 1 ORDER BY one LIMIT 1"
    )
    for one, other, item, rater in twice.to_numpy().tolist():
        two = replace(sheet, numbers=np.array([one, other]) + sheet.has_header)
        name = rater if by_rater else sheet.header[layout.raters[0]]
        item = " ".join(item.split(chr(31)))
        raise rated_twice(two, layout, np.arange(2), item, name)

"""Files larger than memory: their first rows as a sheet, the rest batch by batch.

In: a path and what the caller says of its format. Out: a `LargeFile`, or None where the
file is small or has a form that is read as a whole.
"""

import csv
import hashlib
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError
from masrel.ratings._file_bytes import decoded
from masrel.ratings._text_cells import (
    TEXT_FORMATS,
    Sheet,
    SheetOptions,
    library,
    named_sheet,
    value_text,
)
from masrel.ratings._text_records import DELIMITERS, text_records

_LARGE_TEXT = 256 << 20  # bytes of text from which a file is read as a stream
_LARGE_TABLE = 20_000_000  # cells of a Parquet file from which it is
_HEAD_ROWS = 10_000  # rows that show which column is what
_HEAD_BYTES = 1 << 20
_BATCH = 1 << 20  # cells of a batch
_BUFFER = 1 << 20  # bytes of a column that are read at once
_BLOCK = 1 << 24  # bytes of text in a batch, and of a file that is hashed

STRINGS = ("string", "large_string", "string_view")
"""Types of text."""

_WHOLE = {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)}
_NESTED = ("list", "large_list", "fixed_size_list", "struct", "map")

Batch = tuple[list[Any], int]
"""Columns of a batch, as arrays of pyarrow, and how many bytes are behind it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LargeFile:
    """A file that is read batch by batch, as often as need be."""

    sheet: Sheet  # of its first rows
    n_bytes: int
    is_text: bool
    where: Callable[[int], str]  # number of a row, from 0, to where it stands
    # of columns by position, the first few of them not kept as numbers of texts
    batches: Callable[[Sequence[int], int], Iterator[Batch]]
    # least and greatest number of a column of whole ones, if that is known
    span: Callable[[int], tuple[int, int] | None]


def large_file(
    path: Path | str, options: SheetOptions, stream: bool | None
) -> LargeFile | None:
    """Open a file as a stream; None if it is to be read as a whole."""
    if stream is False:
        return None
    path = Path(path)
    kind = path.suffix.lower()
    is_plain = not (options.transpose or options.source or options.sheet)
    if str(path) != "-" and path.is_file() and is_plain:
        if kind == ".parquet" and options.encoding is None and not options.no_header:
            if (large := _parquet(path, stream)) is not None:
                return large
        elif kind in TEXT_FORMATS and (stream or path.stat().st_size >= _LARGE_TEXT):
            if (large := _text(path, options)) is not None:
                return large
    if stream:
        raise RatingsError(
            f"{path}: --stream: needed a Parquet file, or text in UTF-8 with a "
            "separator that is no blank, as it stands and not packed, without "
            "--transpose, --sheet and --from"
        )
    return None


def arrow(name: str, module: str) -> Any:
    """Import a module of pyarrow, or say how to get it."""
    return library(name, module)


def is_whole(array: Any) -> bool:
    """Return whether an array is of whole numbers."""
    return str(array.type) in _WHOLE


def numbers_of(array: Any) -> NDArray[Any]:
    """Return an array of whole numbers, none missing, or of booleans."""
    # Its own way to numpy would load pandas.
    if str(array.type) == "bool":
        array = array.cast("uint8")
    dtype = np.dtype(str(array.type))
    if not len(array):
        return np.empty(0, dtype)
    _, data = array.buffers()
    return np.frombuffer(data, dtype, len(array), array.offset * dtype.itemsize)


def cell_texts(values: Any) -> list[str]:
    """Return what each value of an array of pyarrow says, "" for a missing one."""
    kind = str(values.type)
    if kind in STRINGS:
        return [text or "" for text in values.to_pylist()]
    if kind in ("halffloat", "float", "double"):  # numpy's know their precision
        numbers = values.to_numpy(zero_copy_only=False)
        return ["" if x != x else value_text(x) for x in numbers]
    if kind.partition("<")[0] in _NESTED:
        raise RatingsError(f"needed text or numbers, got a {kind.partition('<')[0]}")
    return ["" if value is None else value_text(value) for value in values.to_pylist()]


@contextmanager
def _damage(name: str, suffix: str) -> Iterator[None]:
    # errors of pyarrow in one sentence
    lib = arrow(name, "pyarrow")
    try:
        yield
    except (lib.ArrowException, OSError) as error:
        line = (str(error).strip().splitlines() or ["damaged"])[0][:200].rstrip(". ")
        raise RatingsError(
            f"{name}: is damaged, or no {suffix} file ({line})"
        ) from error


def _parquet(path: Path, stream: bool | None) -> LargeFile | None:
    name, parquet = str(path), arrow(str(path), "pyarrow.parquet")

    def opened(**options: Any) -> Any:
        # a buffer, so that no column of a row group is in memory as a whole
        return parquet.ParquetFile(
            path, buffer_size=_BUFFER, pre_buffer=False, **options
        )

    with _damage(name, ".parquet"), opened() as file:
        about, schema = file.metadata, file.schema_arrow
        fields = _shown_fields(schema)
        if not stream and about.num_rows * len(fields) < _LARGE_TABLE:
            return None
        first = next(file.iter_batches(_HEAD_ROWS), None)
        if first is None or len({*schema.names}) < len(schema.names):
            return None  # refused like any other
    n_bytes = path.stat().st_size

    def batches(places: Sequence[int], n_plain: int) -> Iterator[Batch]:
        columns = [fields[place] for place in places]
        texts = [c for c in columns[n_plain:] if str(schema.field(c).type) in STRINGS]
        with _damage(name, ".parquet"), opened(read_dictionary=texts) as file:
            n_done = 0
            size = max(1, _BATCH // len(columns))
            for batch in file.iter_batches(size, columns=columns):
                n_done += len(batch)
                yield (
                    [batch.column(column) for column in columns],
                    n_bytes * n_done // about.num_rows,
                )

    def span(place: int) -> tuple[int, int] | None:
        if not str(schema.field(fields[place]).type).startswith(("int", "uint")):
            return None
        column = next(
            k
            for k in range(about.num_columns)
            if about.schema.column(k).path == fields[place]
        )
        groups = [about.row_group(k) for k in range(about.num_row_groups)]
        limits = [group.column(column).statistics for group in groups]
        if not all(limit is not None and limit.has_min_max for limit in limits):
            return None
        return min(x.min for x in limits), max(x.max for x in limits)

    header = [name if name in schema.names else "" for name in fields]
    header = ["" if re.fullmatch(r"__index_level_\d+__", n) else n for n in header]
    records = np.empty((len(first) + 1, len(fields)), dtype=object)
    records[0] = header
    for place, field in enumerate(fields):
        with _where(name, header[place]):
            records[1:, place] = _column_texts(first.column(field))
    return LargeFile(
        sheet=named_sheet(
            name,
            sha256_of(path),
            records,
            {"format": "parquet"},
            SheetOptions(),
            lambda number: f"row {number + 1}",
        ),
        n_bytes=n_bytes,
        is_text=False,
        where=lambda row: f"row {row + 2}",  # the names are the first
        batches=batches,
        span=span,
    )


def _column_texts(column: Any) -> list[str]:
    if str(column.type).partition("<")[0] in _NESTED:
        return cell_texts(column)
    if not hasattr(column, "dictionary"):
        column = column.dictionary_encode()
    texts = [*cell_texts(column.dictionary), ""]
    return [texts[-1 if k is None else k] for k in column.indices.to_pylist()]


@contextmanager
def _where(name: str, column: str) -> Iterator[None]:
    try:
        yield
    except RatingsError as error:
        raise RatingsError(f"{name}: column {column!r}: {error}") from None


def _shown_fields(schema: Any) -> list[str]:
    # names of the columns as they are stored, those of pandas' index first
    about = schema.pandas_metadata or {}
    index = [c for c in about.get("index_columns", []) if isinstance(c, str)]
    return [*index, *(name for name in schema.names if name not in index)]


def _text(path: Path, options: SheetOptions) -> LargeFile | None:
    name, size = str(path), path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if len(head) == size:
        text = decoded(name, head, options.encoding) if head else ""
    else:
        text = _whole_lines(name, head, options)
    kind = TEXT_FORMATS[path.suffix.lower()]
    if not text or text.startswith("\0") or b"\0" in head[:4]:
        return None
    records, facts, line_of, simulated = text_records(name, text, kind, options)
    delimiter = {title: mark for mark, title in DELIMITERS.items()}.get(
        facts["delimiter"], facts["delimiter"]
    )
    # pyarrow takes blanks before a quote for the beginning of an unquoted cell
    if delimiter == " " or re.search(rf'{re.escape(delimiter)} +"', text):
        return None
    first = int(line_of(0).split()[-1]) - int(options.no_header)  # lines before rows
    batches = partial(
        _text_batches, path, delimiter, facts["encoding"], first, records.shape[1]
    )
    sheet = named_sheet(name, sha256_of(path), records, facts, options, line_of)
    return LargeFile(
        sheet=replace(sheet, is_simulated=simulated),
        n_bytes=size,
        is_text=True,
        where=partial(_line_of, path, delimiter, facts["encoding"], first),
        batches=batches,
        span=lambda _: None,
    )


def _whole_lines(name: str, head: bytes, options: SheetOptions) -> str:
    # the records at the beginning: no quote that is opened there is closed behind
    end = len(head)
    while (end := head.rfind(b"\n", 0, end)) >= 0:
        if head.count(b'"', 0, end) % 2 == 0:
            return decoded(name, head[: end + 1], options.encoding)
    return ""


def _line_of(
    path: Path, delimiter: str, encoding: str, n_skipped: int, row: int
) -> str:
    # the line where a record begins, looked up only for a message
    with path.open(encoding=encoding, newline="") as file:
        for _ in range(n_skipped):
            file.readline()
        begins = 1
        reader = csv.reader(file, delimiter=delimiter)
        for record in reader:
            if record and row == 0:
                return f"line {n_skipped + begins}"
            row -= bool(record)
            begins = reader.line_num + 1
    return "the end"


def _text_batches(
    path: Path,
    delimiter: str,
    encoding: str,
    n_skipped: int,
    width: int,
    places: Sequence[int],
    n_plain: int,
) -> Iterator[Batch]:
    lib, text = arrow(str(path), "pyarrow"), arrow(str(path), "pyarrow.csv")
    names = [str(place) for place in range(width)]
    # cells as they are written; of few different ones each is kept once
    types = {
        names[place]: lib.dictionary(lib.int32(), lib.string()) for place in places
    }
    types |= {names[place]: lib.string() for place in places[:n_plain]}
    with _damage(str(path), "text"), path.open("rb") as file:
        reader = text.open_csv(
            file,
            text.ReadOptions(
                block_size=_BLOCK,
                skip_rows=n_skipped,
                column_names=names,
                encoding=encoding,
            ),
            text.ParseOptions(
                delimiter=delimiter, newlines_in_values=True, ignore_empty_lines=True
            ),
            text.ConvertOptions(
                column_types=types,
                include_columns=[names[place] for place in places],
                strings_can_be_null=False,
            ),
        )
        for batch in reader:
            yield [batch.column(names[place]) for place in places], file.tell()


def sha256_of(path: Path) -> str:
    """Return the hash of a file's bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()

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
from itertools import islice
from pathlib import Path
from typing import Any, NoReturn

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
from masrel.ratings._text_records import (
    DELIMITERS,
    long_cells,
    numbered_records,
    text_records,
    width_error,
)

_LARGE_TEXT = 256 << 20  # bytes of text from which a file is read as a stream
_LARGE_TABLE = 20_000_000  # cells of a Parquet file from which it is
_HEAD_ROWS = 10_000  # rows that show which column is what
_HEAD_BYTES = 1 << 20
_BATCH = 1 << 19  # cells of a batch, for which there is room near the processor
_BUFFER = 1 << 20  # bytes of a column that are read at once
_BLOCK = 1 << 24  # bytes of text in a batch

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


class NoStreamError(RatingsError):
    """What a stream cannot count, and a file that is read as a whole can."""


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
            return _parquet(path, stream)
        elif kind in TEXT_FORMATS and (stream or path.stat().st_size >= _LARGE_TEXT):
            if (large := _text(path, options)) is not None:
                return large
    if stream:
        if str(path) != "-" and not path.exists():
            raise RatingsError(f"{path}: no such file")
        raise RatingsError(
            f"{path}: --stream: needed a Parquet file, or text in UTF-8 with a "
            "separator that is no blank, as it stands and not packed, without "
            "--transpose, --sheet and --from"
        )
    return None


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
    if kind in _WHOLE:
        return ["" if number is None else str(number) for number in values.to_pylist()]
    if kind in ("halffloat", "float", "double"):  # numpy's know their precision
        numbers = values.to_numpy(zero_copy_only=False)
        return ["" if x != x else value_text(x) for x in numbers]
    if kind.partition("<")[0] in _NESTED:
        raise RatingsError(f"needed text or numbers, got a {kind.partition('<')[0]}")
    return ["" if value is None else value_text(value) for value in values.to_pylist()]


@contextmanager
def _damage(name: str, suffix: str) -> Iterator[None]:
    # errors of pyarrow in one sentence
    lib = library(name, "pyarrow")
    try:
        yield
    except MemoryError:  # pyarrow's is also one of its own
        raise
    except (lib.ArrowException, OSError) as error:
        line = (str(error).strip().splitlines() or ["damaged"])[0][:200].rstrip(". ")
        raise RatingsError(
            f"{name}: is damaged, or no {suffix} file ({line})"
        ) from error


def _parquet(path: Path, stream: bool | None) -> LargeFile | None:
    name = str(path)
    with _damage(name, ".parquet"), _opened(path) as file:
        about, schema = file.metadata, file.schema_arrow
        fields = _shown_fields(schema)
        if not stream and about.num_rows * len(fields) < _LARGE_TABLE:
            return None
        first = next(file.iter_batches(_HEAD_ROWS), None)
        if first is None or len({*schema.names}) < len(schema.names):
            return None  # refused like any other
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
            partial(_sha256_of, path),  # which reads it once more
            records,
            {"format": "parquet"},
            SheetOptions(),
            lambda number: f"row {number + 1}",
        ),
        n_bytes=path.stat().st_size,
        is_text=False,
        where=lambda row: f"row {row + 2}",  # the names are the first
        batches=partial(_parquet_batches, path, fields),
        span=lambda place: (
            _span(about, fields[place]) if is_whole(first[fields[place]]) else None
        ),
    )


def _opened(path: Path, **options: Any) -> Any:
    # by a buffer, so that no column of a row group is in memory as a whole
    parquet = library(str(path), "pyarrow.parquet")
    return parquet.ParquetFile(path, buffer_size=_BUFFER, pre_buffer=False, **options)


def _parquet_batches(
    path: Path, fields: Sequence[str], places: Sequence[int], n_plain: int
) -> Iterator[Batch]:
    columns, n_bytes, n_done = [fields[p] for p in places], path.stat().st_size, 0
    size = max(1, _BATCH // len(columns))
    with _damage(str(path), ".parquet"):
        with _opened(path) as file:
            types = {c: str(file.schema_arrow.field(c).type) for c in columns}
        texts = [column for column in columns[n_plain:] if types[column] in STRINGS]
        with _opened(path, read_dictionary=texts) as file:
            n_rows = file.metadata.num_rows
            # threads wait for each other more than they read
            for batch in file.iter_batches(size, columns=columns, use_threads=False):
                n_done += len(batch)
                yield [batch.column(c) for c in columns], n_bytes * n_done // n_rows


def _span(about: Any, field: str) -> tuple[int, int] | None:
    # least and greatest of a column of whole numbers, by the metadata of its groups
    paths = [about.schema.column(k).path for k in range(about.num_columns)]
    column = paths.index(field)
    groups = [about.row_group(k) for k in range(about.num_row_groups)]
    limits = [group.column(column).statistics for group in groups]
    if not all(limit is not None and limit.has_min_max for limit in limits):
        return None
    return min(x.min for x in limits), max(x.max for x in limits)


def _column_texts(column: Any) -> list[str]:
    # to look for different values would load pyarrow.compute
    if is_whole(column) or str(column.type).partition("<")[0] in _NESTED:
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
    if delimiter == " ":
        return None
    first = int(line_of(0).split()[-1]) - int(options.no_header)  # lines before rows
    lines = _TextLines(path, delimiter, facts["encoding"], first, records.shape[1])
    sha256 = partial(_sha256_of, path)
    sheet = named_sheet(name, sha256, records, facts, options, line_of)
    return LargeFile(
        sheet=replace(sheet, is_simulated=simulated),
        n_bytes=size,
        is_text=True,
        where=lines.where,
        batches=lines.batches,
        span=lambda _: None,
    )


def _whole_lines(name: str, head: bytes, options: SheetOptions) -> str:
    # the records at the beginning: no quote that is opened there is closed behind
    end, mark = len(head), b"\n" if b"\n" in head else b"\r"
    while (end := head.rfind(mark, 0, end)) >= 0:
        if head.count(b'"', 0, end) % 2 == 0:
            return decoded(name, head[: end + 1], options.encoding)
    return ""


@dataclass(frozen=True, slots=True)
class _TextLines:
    """Records of a text, from the line after `n_skipped` on."""

    path: Path
    delimiter: str
    encoding: str
    n_skipped: int
    width: int

    def batches(self, places: Sequence[int], n_plain: int) -> Iterator[Batch]:
        """Yield columns as `LargeFile.batches`."""
        lib = library(str(self.path), "pyarrow")
        try:
            with self.path.open("rb") as file:
                for batch in self._reader(file, places, n_plain):
                    columns = [batch.column(str(place)) for place in places]
                    self._refuse_late_quotes(columns)
                    yield columns, file.tell()
        except MemoryError:
            raise
        except lib.ArrowException:
            self._refuse()

    def _reader(self, file: Any, places: Sequence[int], n_plain: int) -> Any:
        lib = library(str(self.path), "pyarrow")
        text = library(str(self.path), "pyarrow.csv")
        # cells as they are written; of few different ones each is kept once
        kinds = [lib.string(), lib.dictionary(lib.int32(), lib.string())]
        types = {str(p): kinds[k >= n_plain] for k, p in enumerate(places)}
        return text.open_csv(
            file,
            text.ReadOptions(
                block_size=_BLOCK,
                skip_rows=self.n_skipped,
                column_names=list(map(str, range(self.width))),
                encoding=self.encoding,
            ),
            text.ParseOptions(
                delimiter=self.delimiter,
                newlines_in_values=True,
                ignore_empty_lines=True,
            ),
            text.ConvertOptions(
                column_types=types,
                include_columns=list(types),
                strings_can_be_null=False,
            ),
        )

    def _refuse_late_quotes(self, columns: Sequence[Any]) -> None:
        # pyarrow takes blanks before a quote for the beginning of an unquoted cell
        compute = library(str(self.path), "pyarrow.compute")
        for column in columns if self.delimiter != "\t" else ():
            texts = getattr(column, "dictionary", column)
            if compute.any(compute.starts_with(texts, " ")).as_py():
                if compute.any(compute.match_substring_regex(texts, '^ +"')).as_py():
                    raise NoStreamError("blanks before quotes")

    def _records(self) -> Iterator[tuple[int, list[str]]]:
        # looked up only for a message; pyarrow reads no cell longer than a block
        with (
            self.path.open(encoding=self.encoding, newline="") as file,
            long_cells(_BLOCK),
        ):
            for _ in range(self.n_skipped):
                file.readline()
            yield from numbered_records(file, self.delimiter, self.n_skipped)

    def where(self, row: int) -> str:
        """Return the line of a row."""
        line, _ = next(islice(self._records(), row, None), (None, ()))
        return "the end" if line is None else f"line {line}"

    def _refuse(self) -> NoReturn:
        # the first record that is none of the table
        name, line = str(self.path), self.n_skipped
        try:
            for line, record in self._records():
                if len(record) != self.width:
                    raise width_error(name, line, self.width, record)
        except csv.Error as error:
            raise RatingsError(
                f"{name}: below line {line}: a quote that is opened is not closed "
                f"({error})"
            ) from error
        except UnicodeDecodeError:
            with self.path.open("rb") as file:
                for number, data in enumerate(file):
                    decoded(name, data, self.encoding, number)
        raise NoStreamError("records that only a whole file can have")


def _sha256_of(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

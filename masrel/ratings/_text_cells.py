"""A file of any format as columns of text: what its cells say, not what they mean.

In: a path, "-" or a pipe, and what the caller says of its format. Out: a `Sheet`.
"""

import codecs
import csv
import gzip
import hashlib
import io
import lzma
import re
import sys
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import ParameterError, RatingsError

_SNIFFED = 1 << 16  # letters that the separator is found in
_MANY_COLUMNS = 1000
_LARGE = 1 << 22  # letters of a text that pandas reads
_RECORDS = 20  # records that the separator is found in
_BLANKS = " "  # any number of blanks or tabs, as R's write.table writes
_DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blanks"}
_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)

_PACKED = {b"\x1f\x8b": ".gz", b"\xfd7zXZ\0": ".xz"}
"""How packed files begin."""

_MARKS = {
    b"PK\x03\x04": ".xlsx, .ods or .zip",
    b"\xd0\xcf\x11\xe0": ".xls",
    b"PAR1": ".parquet",
    b"ARROW1": ".feather",
    b"$FL": ".sav or .zsav",
    b"<stata_dta>": ".dta",
    b"BZh": ".bz2, which is not read",
    b"(\xb5/\xfd": ".zst, which is not read",
    b"%PDF": ".pdf, which is not read",
}
"""How files begin that are no text, and what their names end in."""

Cells = NDArray[np.object_]

TEXT_FORMATS = {".csv": "CSV", ".tsv": "TSV", ".txt": "text", ".dat": "text"}
_TYPED_FORMATS = (
    *(".xlsx", ".xlsm", ".xls", ".ods", ".parquet", ".feather", ".json", ".jsonl"),
    *(".sav", ".zsav", ".por", ".dta", ".sas7bdat", ".xpt"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetOptions:
    """What a caller says of a file's format; None is for the file to tell."""

    delimiter: str | None = None
    encoding: str | None = None
    sheet: str | None = None  # of a workbook
    no_header: bool = False  # whether the first line is a row like the others
    transpose: bool = False  # whether raters are rows
    source: str | None = None  # program whose export it is
    grade: str | None = None  # of such an export: the field that is the grade


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """A file as text, row by row and column by column."""

    name: str  # the file, as the caller calls it
    sha256: str  # of its bytes
    header: tuple[str, ...]  # names of the columns, all different
    cells: Cells = field(repr=False)  # (n_rows, n_columns), as text
    # (n_rows,): number of the record of every row in the file, from 0
    numbers: NDArray[np.int64] = field(repr=False)
    # format; delimiter, encoding or sheet; what codes are called
    facts: dict[str, Any]
    dropped: dict[str, int]  # why rows are left out, and how many
    has_header: bool = True
    is_transposed: bool = False  # whether rows and columns are exchanged
    is_simulated: bool = False  # whether a comment at its head says so
    line_of: Callable[[int], str]  # number of a record to where it stands

    def where(self, row: int) -> str:
        """Return where a row of `cells`, from 0, stands in the file."""
        return self.line_of(int(self.numbers[row]))

    def column(self, position: int) -> NDArray[np.object_]:
        """Return the cells of a column."""
        return self.cells[:, position]

    def error(self, message: str) -> RatingsError:
        """Return the error of this file with a message."""
        return RatingsError(f"{self.name}: {message}")


def read_sheet(path: Path | str, options: SheetOptions) -> Sheet:
    """Read a file of any format as text."""
    name, data = str(path), _bytes_of(path)
    if not data:
        raise RatingsError(f"{name}: needed a header and rows, the file is empty")
    sha256 = hashlib.sha256(data).hexdigest()
    inner, data = _unpacked(name, data, is_export=options.source is not None)
    suffix = Path(inner).suffix.lower()
    left_out: dict[str, int] = {}
    if options.source is not None or suffix in _TYPED_FORMATS:
        from masrel.ratings._typed_files import read_typed

        frame, facts, left_out = read_typed(name, suffix, data, options)
        line_of: Callable[[int], str] = partial(_row_number, int(frame.index[0]))
        records, simulated = frame.to_numpy(dtype=object), False
    else:
        text = _decoded(name, data, options.encoding)
        kind = TEXT_FORMATS.get(suffix, "text")
        records, facts, line_of, simulated = _text_records(name, text, kind, options)
    if options.transpose:
        records, line_of = records.T, _column_number
    sheet = _with_header(name, sha256, records, facts, options, line_of)
    return replace(
        sheet,
        is_simulated=simulated,
        is_transposed=options.transpose,
        dropped={**left_out, **sheet.dropped},
    )


def _bytes_of(path: Path | str) -> bytes:
    if str(path) == "-":
        return sys.stdin.buffer.read()
    path = Path(path)
    if path.is_dir():
        raise RatingsError(f"{path}: needed a file, got a folder")
    if not path.exists():
        raise RatingsError(f"{path}: no such file")
    return path.read_bytes()


def _unpacked(name: str, data: bytes, *, is_export: bool) -> tuple[str, bytes]:
    # what is in a packed file, by its suffix: the name without it, and the bytes
    stem, suffix = name.removesuffix(Path(name).suffix), Path(name).suffix.lower()
    packed = next((e for mark, e in _PACKED.items() if data.startswith(mark)), None)
    suffix = packed or suffix  # a pipe has no suffix
    stem = stem if name.lower().endswith(suffix) else name
    try:
        if suffix == ".gz":
            return stem, gzip.decompress(data)
        if suffix == ".xz":
            return stem, lzma.decompress(data)
        if suffix == ".zip":
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                members = [m for m in archive.namelist() if not m.endswith("/")]
                if len(members) > 1 and is_export:  # such as a file of each annotator
                    return f"{stem}.zip", data
                if len(members) != 1:
                    raise RatingsError(
                        f"{name}: needed one file in it, got {len(members)}: "
                        f"{', '.join(members[:5])}"
                    )
                return members[0], archive.read(members[0])
    except (
        *(OSError, EOFError, zlib.error, lzma.LZMAError, zipfile.BadZipFile),
        *(RuntimeError, NotImplementedError),  # encrypted, packed in another way
    ) as error:
        raise RatingsError(
            f"{name}: is damaged, or no {suffix} file ({error})"
        ) from error
    return name, data


def _decoded(name: str, data: bytes, encoding: str | None) -> str:
    marked = next((e for bom, e in _BOMS if data.startswith(bom)), None)
    encoding = encoding or marked or "utf-8"
    for mark, suffix in _MARKS.items():
        if data.startswith(mark):
            raise RatingsError(f"{name}: needed text, got a file of the kind {suffix}")
    try:
        text = data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        likely = "utf-16" if 0 in data[:100] else "cp1252 or latin-1"
        raise RatingsError(
            f"{name}: line {line}: needed {encoding} text, got the byte "
            f"0x{data[error.start]:02x}; --encoding {likely} may be right"
        ) from error
    except (LookupError, ValueError) as error:
        raise ParameterError(
            f"--encoding: there is none called {encoding!r}"
        ) from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        hint = "; --encoding utf-16 may be right" if 0 in data[:4] else ""
        raise RatingsError(f"{name}: line {line}: needed text, got a zero byte{hint}")
    text = text.removeprefix("\ufeff")
    return text if "\n" in text else text.replace("\r", "\n")  # of an old Mac


def _text_records(
    name: str, text: str, kind: str, options: SheetOptions
) -> tuple[Cells, dict[str, Any], Callable[[int], str], bool]:
    # -> records with the header as the first, what the format is, where records are,
    # whether a comment labels them simulated
    declared = re.match(r'"?sep=(.)"?(\r\n|\n|\r)', text, re.IGNORECASE)
    start = declared.end() if declared else 0
    delimiter = options.delimiter or (declared.group(1) if declared else None)
    comments, start = _comments(name, text, start, delimiter)
    body = text[start:]
    if not body.strip():
        raise RatingsError(f"{name}: needed a header and rows, the file has none")
    delimiter = delimiter or _delimiter_of(name, body)
    n_before = text.count("\n", 0, start)
    lines = _Lines(name, body, delimiter, n_before)
    if lines.width < 2:
        first = body.splitlines()[0]
        raise RatingsError(
            f"{name}: line {n_before + 1}: needed cells with the separator "
            f"{_DELIMITERS.get(delimiter, repr(delimiter))}, got {first.strip()[:60]!r}"
        )
    if not options.no_header:
        lines.refuse_second_header()
    records = lines.cells()
    facts: dict[str, Any] = {
        "format": kind,
        "delimiter": _DELIMITERS.get(delimiter, delimiter),
        "encoding": options.encoding or "utf-8",
    }
    simulated = any("SIMULATED" in comment for comment in comments)
    return records, facts, lines.line_of, simulated


def _comments(
    name: str, text: str, start: int, delimiter: str | None
) -> tuple[list[str], int]:
    # Lines at the head that begin with "#" are comments; one with as many cells as
    # the line below it may be the header.
    comments: list[str] = []
    starts: list[int] = []
    while text.startswith("#", start) or (comments and _is_blank(text, start)):
        end = text.find("\n", start)
        line = text[start:] if end < 0 else text[start:end]
        if line.strip():
            comments.append(line.rstrip("\r"))
            starts.append(start)
        if end < 0:
            start = len(text)
            break
        start = end + 1
    if not comments or start >= len(text):
        return comments, start
    below = text[start:].split("\n", 1)[0].rstrip("\r")
    for candidate in [delimiter] if delimiter else [",", ";", "\t", "|"]:
        n_cells = _n_cells(comments[-1], candidate)
        if candidate == _BLANKS and comments[-1].startswith("# "):
            continue
        if 1 < n_cells == _n_cells(below, candidate):
            if re.match(r"#\s+[^\s,;|]", comments[-1]) and candidate != "\t":
                raise RatingsError(
                    f"{name}: line {text.count(chr(10), 0, starts[-1]) + 1}: begins "
                    "with # and has as many cells as the line below: take the # away "
                    "if it is the header, or the line if it is a comment"
                )
            return comments[:-1], starts[-1]
    return comments, start


def _is_blank(text: str, start: int) -> bool:
    end = text.find("\n", start)
    return end >= 0 and not text[start:end].strip()


def _n_cells(line: str, delimiter: str) -> int:
    return len(next(_rows(line, delimiter), []))


def _rows(text: str, delimiter: str) -> Iterator[list[str]]:
    # records as lists of cells, blank ones too
    if delimiter == _BLANKS:
        for line in re.split(r"\r\n|\n|\r", text):
            yield re.findall(r'"(?:[^"]|"")*"|[^ \t]+', line)
    else:
        lines = io.StringIO(text, newline="")
        blanks = delimiter != "\t"
        with _long_cells(text):
            yield from csv.reader(lines, delimiter=delimiter, skipinitialspace=blanks)


@contextmanager
def _long_cells(text: str) -> Iterator[None]:
    # cells as long as the text, while it is read: the limit is one for all readers
    limit = csv.field_size_limit()
    csv.field_size_limit(max(limit, len(text)))
    try:
        yield
    finally:
        csv.field_size_limit(limit)


def _delimiter_of(name: str, body: str) -> str:
    head = _head(body)
    n_fields = {}
    for delimiter in _DELIMITERS:
        records = _first_records(head, delimiter)
        n_fields[delimiter] = [len(record) for record in records]
    consistent = [d for d, n in n_fields.items() if _is_table(n)]
    marked = [d for d in consistent if d != _BLANKS] or consistent
    if "," in marked and not re.search(r"(?<!\d),|,(?!\d)", head):  # decimal commas?
        if len(marked) > 1:
            marked.remove(",")
        elif _BLANKS in consistent and n_fields[_BLANKS][0] > n_fields[","][0]:
            marked.append(_BLANKS)
    if len(marked) > 1:
        names = " and ".join(_DELIMITERS[d] for d in marked)
        raise RatingsError(
            f"{name}: line 1: needed one separator, {names} both make columns; "
            "--delimiter chooses"
        )
    if marked:
        return marked[0]
    several = [d for d, n in n_fields.items() if n and n[0] > 1 and d != _BLANKS]
    if not several:
        first = next(iter(_first_records(head, ",")), [""])
        raise RatingsError(
            f"{name}: line 1: needed columns, got one, {first[0].strip()!r}; "
            "--delimiter names the separator"
        )
    return max(several, key=lambda d: n_fields[d][0])


def _head(body: str) -> str:
    # whole lines, three at least, from which the separator can be seen
    if len(body) <= _SNIFFED:
        return body
    end = body.rfind("\n", 0, _SNIFFED)
    if body.count("\n", 0, max(end, 0)) < 3:
        end = -1
        for _ in range(3):
            end = body.find("\n", end + 1)
            if end < 0:
                return body
    return body[: end + 1]


def _first_records(head: str, delimiter: str) -> list[list[str]]:
    records = []
    try:
        for record in _rows(head, delimiter):
            if any(cell.strip() for cell in record):
                records.append(record)
            if len(records) == _RECORDS:
                break
    except csv.Error:
        return []
    return records


def _is_table(n_fields: Sequence[int]) -> bool:
    # as many cells in every record, or one more below a header without row names
    if not n_fields or len(set(n_fields[1:])) > 1:
        return False
    # a decimal comma is in the rows alone
    below = n_fields[1] if len(n_fields) > 1 else n_fields[0]
    return n_fields[0] > 1 and below - n_fields[0] in (0, 1)


class _Lines:
    """Where the records of a text are, looked up only for a message."""

    def __init__(self, name: str, body: str, delimiter: str, n_before: int) -> None:
        self._name, self._body, self._delimiter = name, body, delimiter
        self._n_before = n_before
        first = [len(r) for r in _first_records(_head(body), delimiter)] or [0]
        # R's write.table has no name above its row names
        self.has_row_names = len(first) > 1 and set(first[1:]) == {first[0] + 1}
        self.width = first[0] + self.has_row_names

    def _reader(self, *, is_strict: bool = False) -> Any:
        # the csv module's reader of the text
        return csv.reader(
            io.StringIO(self._body, newline=""),
            delimiter=self._delimiter,
            skipinitialspace=self._delimiter != "\t",
            strict=is_strict,
        )

    def _records(self) -> Iterator[tuple[int, list[str]]]:
        # -> line where it begins, cells; records of blank lines are left out
        if self._delimiter == _BLANKS:
            for number, record in enumerate(_rows(self._body, _BLANKS), start=1):
                if record:
                    yield number + self._n_before, record
            return
        reader, begins = self._reader(), 1
        with _long_cells(self._body):
            for record in reader:
                if record and (len(record) > 1 or record[0].strip(" \t")):
                    yield begins + self._n_before, record
                begins = reader.line_num + 1

    def line_of(self, number: int) -> str:
        """Return the line of a record."""
        for place, (line, _) in enumerate(self._records()):
            if place == number:
                return f"line {line}"
        return "the end"

    def refuse_second_header(self) -> None:
        """Refuse files put one below the other, names and all."""
        header = re.search(r"[^\r\n]*\S[^\r\n]*", self._body)
        first = header.group() if header else ""
        place = self._body.find(f"\n{first}", len(first)) + 1
        end = place + len(first)
        if place and self._body[end : end + 1] in ("", "\r", "\n"):
            line = self._n_before + self._body.count("\n", 0, place) + 1
            raise RatingsError(
                f"{self._name}: line {line}: holds the names of the columns once more: "
                "delete it; --no-header if the first line is a row like the others"
            )

    def cells(self) -> Cells:
        """Return the records as cells of text, that of the names first."""
        # pandas takes its time to load, and for every column
        is_small = len(self._body) < _LARGE and self._delimiter != _BLANKS
        if is_small or self.width > _MANY_COLUMNS:
            rows = self._checked_records()
            if self.has_row_names:
                rows[0] = [*rows[0], ""]
            return self._named(np.array(rows, dtype=object))
        return self._named(self._parsed())

    def _checked_records(self) -> list[list[str]]:
        # by the csv module, a quote that is not closed refused
        rows: list[list[str]] = []
        try:
            with _long_cells(self._body):
                rows = list(self._reader(is_strict=True))
        except csv.Error as error:
            if "unexpected end" in str(error):
                raise self._unclosed(error) from error
        if {*map(len, rows[self.has_row_names :])} != {self.width}:
            self._check_widths()
            rows = [record for _, record in self._records()]
        return rows

    def _unclosed(self, error: Exception) -> RatingsError:
        *_, (line, _) = self._records()  # the last, which begins with that quote
        return RatingsError(
            f"{self._name}: line {line}: a quote that is opened is not closed ({error})"
        )

    def _parsed(self) -> Cells:
        # by pandas
        import pandas as pd

        try:
            frame = pd.read_csv(
                io.BytesIO(self._body.encode()),
                header=None,
                names=range(self.width),
                sep=r"\s+" if self._delimiter == _BLANKS else self._delimiter,
                dtype=object,
                na_filter=False,
                skipinitialspace=self._delimiter != "\t",
                low_memory=False,
            )
        except pd.errors.ParserError as error:
            self._check_widths()
            raise self._unclosed(error) from error
        cells = frame.to_numpy(dtype=object)
        # pandas fills a short record up in silence, so that its last cell is empty
        may_be_short = (cells[int(self.has_row_names) :, -1] == "").any()
        if may_be_short and not self._is_plainly_full(len(cells)):
            self._check_widths()
        return cells

    def _is_plainly_full(self, n_records: int) -> bool:
        # whether counting separators shows that no record is short, as none is long
        n_separators = n_records * (self.width - 1) - self.has_row_names
        return (
            self._delimiter != _BLANKS
            and '"' not in self._body
            and self._body.count(self._delimiter) == n_separators
        )

    def _named(self, cells: Cells) -> Cells:
        # the names above their columns: that of the row names is empty, and first
        if self.has_row_names and not (cells[1:, -1] == "").all():
            cells[0] = ["", *cells[0, :-1]]
        return cells

    def _check_widths(self) -> None:
        # refuse the first record that has another number of cells
        for place, (line, record) in enumerate(self._records()):
            if len(record) != self.width and (place or not self.has_row_names):
                shown = ", ".join(record)[:60]
                raise RatingsError(
                    f"{self._name}: line {line}: needed {self.width} cells, as the "
                    f"first line has, got {len(record)}: {shown!r}"
                )


def _row_number(first: int, number: int) -> str:
    return f"row {first + number + 1}"


def _column_number(number: int) -> str:
    return f"column {number + 1}"


def _with_header(
    name: str,
    sha256: str,
    records: Cells,
    facts: dict[str, Any],
    options: SheetOptions,
    line_of: Callable[[int], str],
) -> Sheet:
    if options.no_header:
        header = tuple(str(n) for n in range(1, records.shape[1] + 1))
    else:
        header = tuple(str(cell).strip() for cell in records[0].tolist())
    numbers = np.arange(int(not options.no_header), len(records))
    records = records[numbers[0] :] if len(numbers) else records[:0]
    blank = _blank_rows(records)
    dropped = {"blank": int(blank.sum())} if blank.any() else {}
    if blank.any():
        records, numbers = records[~blank], numbers[~blank]
    # a separator at the end of every line makes a column without name and cells
    if header and not header[-1] and (records[:, -1] == "").all():
        header, records = header[:-1], records[:, :-1]
    _check_names(name, header, line_of)
    return Sheet(
        name=name,
        sha256=sha256,
        header=header,
        cells=records,
        numbers=numbers,
        facts=facts,
        dropped=dropped,
        has_header=not options.no_header,
        line_of=line_of,
    )


def _check_names(
    name: str, header: tuple[str, ...], line_of: Callable[[int], str]
) -> None:
    seen: set[str] = set()
    for position, cell in enumerate(header):
        if not cell and position:  # the first may be R's or pandas' row names
            raise RatingsError(
                f"{name}: {line_of(0)}: needed a name for column {position + 1}, got "
                "none; --no-header if this line is a row like the others"
            )
        if cell in seen:
            raise RatingsError(
                f"{name}: {line_of(0)}: needed different names of columns, "
                f"{cell!r} is there twice; --no-header if this line is a row like "
                "the others"
            )
        seen.add(cell)


def _blank_rows(records: Cells) -> NDArray[np.bool_]:
    # rows of nothing but blanks
    blank = np.zeros(len(records), dtype=bool)
    if not len(records):
        return blank
    places = np.flatnonzero(records[:, -1] == "")
    places = places[[not cell.strip() for cell in records[places, 0]]]
    blank[places] = [not any(cell.strip() for cell in row) for row in records[places]]
    return blank

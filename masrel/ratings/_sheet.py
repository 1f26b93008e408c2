"""Files as columns of text: bytes, unpacked and decoded, and text taken apart.

In: a path, "-" or a pipe, and what the caller says of it. Out: a `Sheet`.
"""

import codecs
import csv
import gzip
import io
import lzma
import math
import re
import struct
import sys
import unicodedata
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import date, datetime
from decimal import Decimal
from functools import partial
from importlib.util import find_spec
from itertools import chain, count, islice, takewhile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel._interpreter import collector_off
from masrel.errors import ParameterError, RatingsError
from masrel.ratings._findings import Finding, Reading, library, refusal

Codes = NDArray[np.int64]

TEXT_FORMATS = {".csv": "CSV", ".tsv": "TSV", ".txt": "text", ".dat": "text"}
WORKBOOKS = (".xlsx", ".xlsm", ".xls", ".ods")
TYPED_FORMATS = (
    *(*WORKBOOKS, ".parquet", ".feather", ".json", ".jsonl", ".eval"),
    *(".sav", ".zsav", ".por", ".dta", ".sas7bdat", ".xpt"),
)
DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blanks"}
"""Separators, and what they are called."""

MAX_UNPACKED = 256_000_000
_IN_BATCHES = "unpack it, so that it can be read in batches"
# what readers of other formats raise for bytes that are not theirs
_ANY: tuple[type[Exception], ...] = (
    *(ValueError, TypeError, KeyError, OSError, RuntimeError, EOFError),
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError),
)
_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_ZSTD = 93  # how a member of an archive is packed
_PACKED = {b"\x1f\x8b": ".gz", b"\xfd7zXZ\0": ".xz"}  # how packed files begin
_OPENED: dict[str, Callable[..., Any]] = {".gz": gzip.open, ".xz": lzma.open}
_MARKS = {  # how files begin that are no text, and what their names end in
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
_HTML = re.compile(
    rb"\s*<(!doctype\s+html|html|head|meta|body|div|style|table)\b", re.IGNORECASE
)
# Encodings of one byte a letter, and letters beyond ASCII that are frequent in them.
_WESTERN, _CYRILLIC = "àáâãäåæçèéêëìíîïñòóôõöøùúûüßœ", "оеаинтсрвл"
_LETTERS = {
    "cp1252": _WESTERN,
    "cp1250": "áéíóúýäöüßąćčďęěłńňőřśšťůűźżž",
    "cp1254": "âçğıîöşü",
    "cp1251": _CYRILLIC,
    "koi8-r": _CYRILLIC,
    "cp866": _CYRILLIC,
    "cp1253": "αάοόιίεέτσςνηήυρ",
    "cp1255": "יולאמהרבתנ",
    "mac-roman": _WESTERN,
    "cp850": _WESTERN,
}
_WORD = re.compile(r"[^\W\d_]*[^\W\d_\0-\x7f][^\W\d_]*")  # with a letter beyond ASCII
_INNER = re.compile(r"ς\w")  # which only ends a word, so that it is another letter
_UNPLAIN = re.compile(r"[^\x21-\x7e]")  # blanks, and letters that may have two forms
_LINE_END = re.compile(r"\r\n|\n|\r")
SNIFFED = 20
"""Records that the separator and the names are found in."""
TAIL, _MOST_NOTES = 4096, 3  # letters at the end that notes are in, and lines of them
_NUMBER = re.compile(r"[+-]?\d+\.?\d*")
_CHUNK = 1 << 14  # records that are taken apart at once
_END = "\0"  # a record behind the last, which a quote that stays open swallows


# ---- columns and sheets ----


@dataclass(frozen=True, slots=True)
class Column:
    """The cells of a column: the texts that differ, and where each is."""

    codes: Codes  # (n_rows,): places in the texts
    texts: list[str]  # in the order first met, without blanks around

    @classmethod
    def of(cls, codes: Codes, cells: Iterable[str]) -> "Column":
        """Take cells that may differ by blanks or Unicode forms alone."""
        number: dict[str, int] = {}
        if _UNPLAIN.search("".join(cells)):  # names and grades have none, as a rule
            cells = map(plain, cells)
        places = [number.setdefault(cell, len(number)) for cell in cells]
        return cls(np.array(places, dtype=np.int64)[codes], list(number))

    def rows(self, chosen: Any) -> "Column":
        """Return some of the rows, with the texts of these alone."""
        codes = self.codes[chosen]
        first = np.full(len(self.texts), len(codes))  # where each text is met first
        first[codes[::-1]] = np.arange(len(codes) - 1, -1, -1)
        met = np.argsort(first, kind="stable")[: int((first < len(codes)).sum())]
        rank = np.zeros(len(first), dtype=np.int64)
        rank[met] = np.arange(len(met))
        return Column(rank[codes], [self.texts[k] for k in met.tolist()])

    def is_text(self, text: str) -> NDArray[np.bool_]:
        """Return which rows hold a text."""
        code = self.texts.index(text) if text in self.texts else -1
        return np.equal(self.codes, code)

    def cells(self) -> list[str]:
        """Return the text of every row."""
        return [self.texts[code] for code in self.codes.tolist()]


def plain(text: str) -> str:
    """Return a text without blanks around, in the one of two equal Unicode forms."""
    text = text.strip()
    return text if text.isascii() else unicodedata.normalize("NFC", text).strip()


def value_text(value: Any) -> str:
    """Return what a cell with a type says."""
    # 1.0 of a column of numbers is the grade 1; other floats have their shortest digits
    if isinstance(value, bool | np.bool_):
        return str(value).lower()
    if isinstance(value, float | np.floating | Decimal):
        is_whole = math.isfinite(value) and value == int(value)
        return str(int(value)) if is_whole and abs(int(value)) < 2**53 else str(value)
    if isinstance(value, datetime) and value.timetz() != datetime.min.timetz():
        return value.isoformat()
    if isinstance(value, date):
        return date(value.year, value.month, value.day).isoformat()
    if isinstance(value, bytes):
        return value.decode("utf-8", "backslashreplace")
    return str(value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """A file as text, column by column."""

    name: str  # the file, as the caller calls it
    sha256: Callable[[], str]  # of its bytes
    header: tuple[str, ...]  # names of the columns
    columns: tuple[Column, ...] = field(repr=False)
    # (n_rows,): number of the record of every row in the file; the names are 0
    numbers: Codes = field(default_factory=lambda: np.arange(0), repr=False)
    # (n_rows,): how many rows of the file each stands for
    freq: Codes = field(default_factory=lambda: np.arange(0), repr=False)
    # format; delimiter, encoding or sheet; what codes are called
    facts: dict[str, Any] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)  # why rows are left out
    has_header: bool = True
    is_transposed: bool = False  # whether rows and columns are exchanged
    is_simulated: bool = False  # whether a comment at its head says so
    findings: tuple[Finding, ...] = ()  # of what is left out of it
    advice: str = ""  # the option that takes its names from where they seem to be
    unit: str = "line"  # in which a record is
    line_of: Callable[[int], int]  # number of a record to the line that it is in

    def at(self, number: int) -> str:
        """Return the place of a record in the file, counted from the names as 0."""
        return f"{self.unit} {self.line_of(number)}"

    def where(self, row: int) -> str:
        """Return the place of a row, from 0, in the file."""
        return self.at(int(self.numbers[row]))

    def refuse(
        self, code: str, at: str = "", place: int | None = None, /, **facts: Any
    ) -> RatingsError:
        """Return the error of this file, at a row and a column."""
        column = "" if place is None else f", column {self.header[place]!r}"
        where = f"{self.name}: {at}{column}" if at else self.name
        hint = f"; if the names are below, add {self.advice}" if self.advice else ""
        return refusal(where, code, **{"hint": hint, **facts})

    def hold(self, texts: Sequence[str]) -> NDArray[np.bool_]:
        """Return which rows have these texts in their columns."""
        columns = zip(self.columns, texts, strict=True)
        same = [column.is_text(text) for column, text in columns]
        return np.array(np.all(same, axis=0))

    def without(self, rows: NDArray[np.bool_], why: str) -> "Sheet":
        """Leave rows out, and say so."""
        if not rows.any():
            return self
        return replace(
            self,
            columns=tuple(column.rows(~rows) for column in self.columns),
            numbers=self.numbers[~rows],
            freq=self.freq[~rows],
            dropped={**self.dropped, why: int(self.freq[rows].sum())},
        )


def finished(sheet: Sheet, options: Reading) -> Sheet:
    """Turn a sheet as it was stored as the options say."""
    header, columns = list(sheet.header), list(sheet.columns)
    if options.transpose or options.no_header:
        cells = [[n, *c.cells()] for n, c in zip(header, columns, strict=True)]
        if options.transpose:
            cells = list(map(list, zip(*cells, strict=True)))
            sheet = replace(
                sheet,
                is_transposed=True,
                unit="column",
                line_of=lambda number: number + 1,
            )
        header = [str(n) for n in range(1, len(cells) + 1)]
        if not options.no_header:
            header, cells = [of[0] for of in cells], [of[1:] for of in cells]
        columns = [Column.of(np.arange(len(rows)), rows) for rows in cells]
    header = [re.sub(r"\s*[\r\n]\s*", " ", name.strip()) for name in header]
    # a separator at the end of every line makes a column without name and cells
    if header and not header[-1] and set(columns[-1].texts) <= {""}:
        header, columns = header[:-1], columns[:-1]
    n_rows = len(columns[0].codes) if columns else 0
    sheet = replace(
        sheet,
        header=tuple(header),
        columns=tuple(columns),
        numbers=np.arange(n_rows) + (not options.no_header),
        freq=np.ones(n_rows, dtype=np.int64),
        has_header=not options.no_header,
    )
    if header:
        sheet = sheet.without(sheet.hold([""] * len(header)), "blank")
        again = sheet.hold(header)
        if sheet.has_header and again.any():
            raise sheet.refuse("names again", sheet.where(int(np.argmax(again))))
    return sheet


# ---- bytes ----


def bytes_of(path: Path | str) -> bytes:
    """Return the bytes of a file, or of standard input for "-"."""
    if str(path) == "-":
        return sys.stdin.buffer.read()
    path = Path(path)
    for code, is_so in (
        ("absent", not path.exists()),
        ("folder", path.is_dir()),
        ("device", path.is_char_device() or path.is_block_device()),  # without an end
    ):
        if is_so:
            raise refusal(str(path), code)
    return path.read_bytes()


def unpacked(name: str, data: bytes, *, is_export: bool) -> tuple[str, bytes]:
    """Return what is in a packed file, by its suffix: the name without it, and it."""
    packed = next((e for mark, e in _PACKED.items() if data.startswith(mark)), None)
    suffix = packed or Path(name).suffix.lower()  # a pipe has no suffix
    if suffix in _OPENED:
        file = partial(_OPENED[suffix], io.BytesIO(data))
        inner = name[: -len(suffix)] if name.lower().endswith(suffix) else name
        data = read_foreign(name, suffix, lambda: file().read(MAX_UNPACKED + 1))
        if len(data) > MAX_UNPACKED:  # it would fill the memory
            raise refusal(name, "unpacked", most=MAX_UNPACKED, do=_IN_BATCHES)
        return inner, data
    if suffix != ".zip" or is_export:  # which may have a file of each annotator
        return name, data
    files = unzipped(name, suffix, data, MAX_UNPACKED, _IN_BATCHES, ".*[^/]")
    if len(files) != 1:
        raise refusal(name, "members", n=len(files), members=", ".join(list(files)[:5]))
    ((inner, read),) = files.items()
    return inner, read()


def unzipped(
    name: str, suffix: str, data: bytes, most: int, do: str, chosen: str
) -> dict[str, Callable[[], bytes]]:
    """Return what reads each file of an archive that is chosen, if all is small."""
    # chosen: what matches their names; do: what is to be done if it does not fit
    packed = read_foreign(name, suffix, lambda: zipfile.ZipFile(io.BytesIO(data)))
    if sum(member.file_size for member in packed.infolist()) > most:
        raise refusal(name, "unpacked", most=most, do=do)
    # a Mac adds a folder to every archive
    meant = re.compile(f"(?!__MACOSX/)({chosen})", re.IGNORECASE | re.DOTALL)
    files = [member for member in packed.infolist() if meant.fullmatch(member.filename)]
    is_new = any(member.compress_type == _ZSTD for member in files)
    read: Callable[[zipfile.ZipInfo], bytes] = packed.read
    if is_new and not hasattr(zipfile, "ZIP_ZSTANDARD"):  # there from Python 3.14 on
        if find_spec("pyarrow") is None:
            raise refusal(name, "zstd")
        read = partial(_zstd_member, library(name, "pyarrow"), data)
    return {
        member.filename: partial(read_foreign, name, suffix, partial(read, member))
        for member in files
    }


def _zstd_member(pyarrow: Any, data: bytes, member: zipfile.ZipInfo) -> bytes:
    # what zstd packed: its own header is 30 bytes and two fields whose length it has
    lengths = struct.unpack_from("<HH", data, member.header_offset + 26)
    begin = member.header_offset + 30 + sum(lengths)
    content: bytes = pyarrow.decompress(
        data[begin : begin + member.compress_size],
        decompressed_size=member.file_size,
        codec="zstd",
        asbytes=True,
    )
    if zlib.crc32(content) != member.CRC:
        raise zipfile.BadZipFile(f"Bad CRC-32 for file {member.filename!r}")
    return content


def read_foreign(
    name: str, suffix: str, read: Callable[[], Any], *errors: type[Exception]
) -> Any:
    """Read by a library that raises what it likes for bytes of other formats."""
    try:
        return read()
    except _ANY + errors as error:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        line = lines[0][:200].rstrip(". ")
        raise refusal(name, "damaged", suffix=suffix, error=line) from error


def refuse_html(name: str, data: bytes) -> None:
    """Refuse what web programs export as if it were a workbook."""
    head = data[:1000].replace(b"\0", b"")  # in UTF-16, too
    if _HTML.match(head.lstrip(b"\xef\xbb\xbf\xff\xfe")):
        raise refusal(name, "html")


def decoded(name: str, data: bytes, encoding: str | None, n_before: int = 0) -> str:
    """Return bytes as text, by the encoding, or by their mark, or as UTF-8."""
    # n_before: lines of the file before these
    marked = next((e for bom, e in _BOMS if data.startswith(bom)), None)
    encoding = encoding or marked or "utf-8"
    for mark, suffix in _MARKS.items():
        if data.startswith(mark):
            raise refusal(name, "kind", suffix=suffix)
    if marked is None and re.fullmatch("utf[-_]?16", encoding, re.IGNORECASE):
        encoding = _of_two_bytes(data) or encoding
    try:
        text = data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeDecodeError as error:
        line = n_before + len((data[: error.start] + b"x").splitlines())
        likely = _of_two_bytes(data) or _likely(data, error.start)
        raise refusal(
            name,
            "encoding",
            line=line,
            encoding=encoding,
            byte=data[error.start],
            hint=f"try --encoding {likely}" if likely else "name it with --encoding",
        ) from error
    except (LookupError, ValueError) as error:
        raise ParameterError(
            f"--encoding: there is no encoding {encoding!r}"
        ) from error
    if "\0" in text:
        line = n_before + text.count("\n", 0, text.index("\0")) + 1
        likely = _of_two_bytes(data)
        hint = f"; try --encoding {likely}" if likely else ""
        raise refusal(name, "zero byte", line=line, hint=hint)
    return text.removeprefix("\ufeff")


def _of_two_bytes(data: bytes) -> str:
    # which UTF-16 bytes without a mark are, by where their zeros are, or none
    even, odd = data[:4000:2].count(0), data[1:4000:2].count(0)
    if 4 * max(even, odd) < len(data[:4000:2]) or min(even, odd) > max(even, odd) / 4:
        return ""
    return "utf-16-be" if even > odd else "utf-16-le"


def _likely(data: bytes, wrong: int) -> str:
    # the encodings of bytes that are frequent letters in words, the first wrong one at
    # a place; none if there is no such encoding
    if "\ufffd" not in data.decode("utf-8", "replace"):
        return "utf-8"
    part = data[max(0, wrong - 1000) : wrong + 20_000]
    texts = {name: part.decode(name, "replace") for name in _LETTERS}
    share = {name: _share(text, _LETTERS[name]) for name, text in texts.items()}
    best = max(share.values())
    alike = {texts[name]: name for name in reversed(texts) if share[name] == best}
    names = list(alike.values())[:-3:-1]  # of each text that it may be, the first
    return " or ".join(names) if best > 1 / 2 else ""


def _share(text: str, letters: str) -> float:
    # the part of the letters beyond ASCII that is frequent, if nearly all that is there
    # beyond ASCII are letters in words of one alphabet and one letter case
    is_latin = letters[0] < "\u0250"
    words = [word for word in _WORD.findall(text) if len(word) > 1]  # not à
    accented = [
        letter
        for word in words
        if word in (word.lower(), word.title(), word.upper())
        if is_latin == any(map(str.isascii, word)) and not _INNER.search(word)
        for letter in (word.lower() if is_latin else word)
        if not letter.isascii()
    ]
    n_frequent = sum(letter in letters for letter in accented)
    n_others = len(re.findall(r"[^\0-\x7f]", text)) - len(accented)
    n_others -= len(_WORD.findall(text)) - len(words)
    # letters of two bytes, as of Japanese, make words of hardly any plain letter
    is_dense = is_latin and 4 * len(accented) >= 3 * sum(map(len, words))
    is_right = 10 * n_others < len(accented) and not is_dense
    return n_frequent / len(accented) if is_right else 0.0


# ---- text ----


def read_text(
    name: str, sha256: Callable[[], str], text: str, kind: str, options: Reading
) -> Sheet:
    """Take a text apart: its comments, its separator, its records."""
    declared = re.match(r'"?sep=(.)"?(\r\n|\n|\r)', text, re.IGNORECASE)
    delimiter = options.delimiter or (declared.group(1) if declared else None)
    *upper, last = (_start_of(name, text, n) for n in options.names_at or [1])
    start = _below_comments(
        name, text, max(last, declared.end() if declared else 0), delimiter
    )
    head, text, n_before = text[:start], text[start:], _n_lines(text, start)
    if not text.strip():
        raise refusal(name, "no records")
    delimiter, rows, n_titles = _separator(name, text, delimiter, n_before)
    advice = names_option(name, "line", rows, n_titles, options)
    n_names, *below = (len(row.cells) for row in rows)
    # R's write.table has no name above its row names
    has_row_names = bool(below) and set(below) == {n_names + 1}
    if n_names + has_row_names < 2:
        raise refusal(
            name,
            "other separator",
            line=n_before + 1,
            delimiter=DELIMITERS.get(delimiter, repr(delimiter)),
            first=text.splitlines()[0].strip()[:60],
        )
    text, findings = without_notes(text, delimiter, n_before)
    sheet = Sheet(
        name=name,
        sha256=sha256,
        header=(),
        columns=(),
        facts={
            "format": kind,
            "delimiter": DELIMITERS.get(delimiter, delimiter),
            "encoding": options.encoding or "utf-8",
        },
        is_simulated=bool(re.search("^#.*SIMULATED", head, re.MULTILINE)),
        findings=findings,
        advice=advice,
        line_of=partial(
            line_of, partial(io.StringIO, text, newline=""), delimiter, n_before
        ),
    )
    reader = reader_of(chain(io.StringIO(text, newline=""), [_END]), delimiter)
    above = [io.StringIO(head[k:], newline="") for k in upper]
    header = joined_names(
        [
            next((record for record in records if not _is_blank(record)), [])
            for records in (*(reader_of(lines, delimiter) for lines in above), reader)
        ]
    )
    columns = _columns(sheet, reader, n_names + has_row_names)
    if has_row_names:
        # or a separator at the end of every row, below names that begin with a rater's
        is_rater = header[0] in ",".join(options.raters).split(",")
        is_last_empty = set(columns[-1].texts) <= {""} and not is_rater
        header = [*header, ""] if is_last_empty else ["", *header]
    return replace(sheet, header=tuple(header), columns=columns)


def _start_of(name: str, text: str, line: int) -> int:
    # where a line that an option names begins
    starts = chain([0], (end.end() for end in _LINE_END.finditer(text)))
    start = next(islice(starts, line - 1, None), len(text))
    if start == len(text) > 0:
        raise refusal(name, "no line", unit="line", n=line)
    return start


def _n_lines(text: str, end: int) -> int:
    return sum(1 for _ in _LINE_END.finditer(text, 0, end))


def without_notes(
    text: str, delimiter: str, n_before: int
) -> tuple[str, tuple[Finding, ...]]:
    """Return a text without the notes below its table, and what the first is."""
    lines = [] if delimiter == " " else list(io.StringIO(text[-TAIL:], newline=""))
    n_back, note = notes_below(
        [next(reader_of([line], delimiter), []) for line in lines]
    )
    end = len(text) - sum(map(len, lines[len(lines) - n_back :]))
    if not note or text.count('"', 0, end) % 2:  # it is in a cell
        return text, ()
    where = f"line {n_before + _n_lines(text, end) + 1}"
    return text[:end], (Finding("note below", where=where, got=note[:60]),)


def _below_comments(name: str, text: str, start: int, delimiter: str | None) -> int:
    # Where the lines at the head end that begin with "#": they are comments, unless the
    # last of them has as many cells as the line below, and may be the header.
    lines = io.StringIO(text[start:], newline="")
    head = [*takewhile(lambda line: line[0] == "#" or not line.strip(), lines)]
    if not head or head[0][0] != "#":
        return start
    n_above = max(k for k, line in enumerate(head) if line[0] == "#")
    last, end = (start + sum(map(len, part)) for part in (head[:n_above], head))
    below = next(io.StringIO(text[end:], newline=""), "")
    two_lines = head[n_above].rstrip("\r\n"), below
    for mark in [delimiter] if delimiter else [",", ";", "\t", "|"]:
        n_cells, n_below = (len(next(reader_of([of], mark), ())) for of in two_lines)
        is_meant = mark != " " or not two_lines[0].startswith("# ")
        if is_meant and 1 < n_cells == n_below:
            if re.match(r"#\s+[^\s,;|]", two_lines[0]) and mark != "\t":
                raise refusal(name, "comment or header", line=_n_lines(text, last) + 1)
            return last
    return end


# ---- where the names are ----


@dataclass(frozen=True, slots=True)
class Row:
    """A row as it is in its file."""

    line: int  # the first of its lines, from 1
    end: int  # the last
    cells: list[str]

    @property
    def n_filled(self) -> int:
        """How many cells are not empty."""
        return sum(map(bool, self.cells))


def joined_names(lines: Sequence[Sequence[str]]) -> list[str]:
    """Return the names that lines make up: merged cells are filled from their left."""
    *upper, last = ([cell.strip() for cell in line] for line in lines)
    places = range(len(last))
    parts = [[next(filter(None, line[k::-1]), "") for k in places] for line in upper]
    return [" ".join(filter(None, name)) for name in zip(*parts, last, strict=True)]


def names_option(
    name: str, unit: str, rows: Sequence[Row], n_titles: int, options: Reading
) -> str:
    """Return the option that takes the names from below the first row, or none."""
    # n_titles: how many rows at the head have fewer cells than the table
    if options.raters and {*",".join(options.raters).split(",")} <= {*rows[0].cells}:
        return ""
    is_known = options.no_header or len(options.names_at) > 1
    lines = [] if is_known else _lines_of_names(rows[n_titles:])
    line, of_lines = (lines or [rows[n_titles].line])[0], ",".join(map(str, lines))
    option = f"--skip {line - 1}" * (line > rows[0].line)
    option = f"--header {of_lines}" if len(lines) > 1 else option
    is_title = option and rows[0].n_filled == bool(rows[0].cells[0])
    if n_titles or (is_title and len(rows[-1].cells) > 2):
        got = ", ".join(filter(None, rows[0].cells))[:60]
        where = f"{name}: {unit} {rows[0].line}"
        raise refusal(where, "titles", got=got, option=option)
    return option


def _lines_of_names(rows: Sequence[Row]) -> list[int]:
    # the first lines that make up a name of every column but the first, all different
    upper: list[Row] = []
    for k, row in enumerate(rows):
        if upper and row.line != upper[-1].end + 1:
            upper = []
        if k and row.cells[0] and not _are_names(row.cells[1:], rows[k + 1 :]):
            break
        names = joined_names([*(above.cells for above in upper), row.cells])
        if all(names[1:]) and len(set(names)) == len(names):
            # names without an item, or with the name of the items alone, as of pandas
            for below in rows[k + 1 : k + 2]:
                rest = below.n_filled - bool(below.cells[0])
                is_name = not below.cells[0] and _are_names(below.cells, rows[k + 2 :])
                if below.line == row.end + 1 and (is_name if rest else upper):
                    return [*(above.line for above in upper), row.line, below.line]
            return [*(above.line for above in upper), row.line]
        upper = [*upper, row] if row.n_filled > bool(row.cells[0]) else []
    return []


def _are_names(cells: Sequence[str], below: Sequence[Row]) -> bool:
    # whether no cell is there below, and no number among those that are
    others = {cell for row in below for cell in row.cells[1:] if cell}
    numbers = [float(cell) for cell in others if _NUMBER.fullmatch(cell)]
    low, high = min(numbers, default=0.0), max(numbers, default=0.0)
    return not any(
        cell in others or (_NUMBER.fullmatch(cell) and low <= float(cell) <= high)
        for cell in cells
    )


def notes_below(rows: Sequence[Sequence[str]]) -> tuple[int, str]:
    """Return how many rows at the end are notes below an empty one, and the first."""
    filled = [[cell.strip() for cell in row if cell.strip()] for row in rows]
    while filled and not filled[-1]:
        filled.pop()
    n = next((k for k, row in enumerate(reversed(filled)) if len(row) != 1), 0)
    above, notes = filled[: len(filled) - n], [*chain(*filled[len(filled) - n :])]
    # a lone rating is a number, or there above, or right below the names
    are_notes = (
        0 < n <= _MOST_NOTES
        and not above[-1]
        and sum(map(bool, above)) > 1
        and not {*notes} & {*chain(*above)}
        and all(any(map(str.isalpha, note)) for note in notes)
    )
    return (len(rows) - len(above), notes[0]) if are_notes else (0, "")


# ---- records ----


@contextmanager
def long_cells() -> Iterator[None]:
    """Let the csv module read cells of any length; the limit is that of all readers."""
    limit = csv.field_size_limit(2**31 - 1)
    try:
        yield
    finally:
        csv.field_size_limit(limit)


def reader_of(lines: Iterable[str], delimiter: str) -> Any:
    """Return a reader of records, by the csv module."""
    if delimiter == " ":  # any number of blanks or tabs, as R's write.table writes
        lines = (line.rstrip(" \t\r\n").replace("\t", " ") for line in lines)
    return csv.reader(lines, delimiter=delimiter, skipinitialspace=delimiter != "\t")


def _is_blank(record: list[str]) -> bool:
    return len(record) < 2 and not "".join(record).strip(" \t")


def _placed(reader: Any, n_before: int) -> Iterator[Row]:
    # the records that are not blank; n_before: lines of the file before them
    begins = n_before + 1
    for record in reader:
        if not _is_blank(record):
            cells = [cell.strip() for cell in record]
            yield Row(begins, n_before + reader.line_num, cells)
        begins = n_before + reader.line_num + 1
    yield Row(begins, begins, [])  # behind the last


def line_of(
    lines: Callable[[], Iterable[str]], delimiter: str, n_before: int, number: int
) -> int:
    """Return the line where a record begins, looked up only for a message."""
    rows = _placed(reader_of(lines(), delimiter), n_before)
    return next(islice(rows, number, None)).line


def _separator(
    name: str, text: str, delimiter: str | None, n_before: int
) -> tuple[str, list[Row], int]:
    # what stands between cells, the first records, and how many of these are titles
    lines = list(islice(io.StringIO(text, newline=""), 5 * SNIFFED))
    marks = [delimiter] if delimiter else DELIMITERS
    heads = {
        mark: rows
        for mark in marks
        for placed in [_placed(reader_of(lines, mark), n_before)]
        if (rows := [row for row in islice(placed, SNIFFED) if row.cells])
    }
    if not heads:
        raise refusal(name, "no records")
    widths = {mark: len(rows[0].cells) for mark, rows in heads.items()}
    of_names = [n for mark, n in widths.items() if mark != " "]
    n_titles = {mark: _n_titles(rows, of_names) for mark, rows in heads.items()}
    if delimiter:
        return delimiter, heads[delimiter], max(n_titles[delimiter], 0)
    # as many cells in every record, or one more below a header without row names,
    # below the fewest titles; a decimal comma is in the rows alone
    if n_titles.get("\t", -1) >= 0:  # tabs are blanks, too
        n_titles.pop(" ", None)
    fewest = min((n for n in n_titles.values() if n >= 0), default=None)
    consistent = [mark for mark, n in n_titles.items() if n == fewest]
    marked = [mark for mark in consistent if mark != " "] or consistent
    are_decimal = not re.search(r"(?<!\d),|,(?!\d)", "".join(lines[:SNIFFED]))
    if "," in marked and are_decimal:  # such commas may be in numbers
        if len(marked) > 1:
            marked.remove(",")
        elif " " in consistent and widths[" "] > widths[","]:
            marked.append(" ")
    if len(marked) > 1:
        names = " and ".join(DELIMITERS[mark] for mark in marked)
        raise refusal(name, "two separators", names=names)
    several = [mark for mark, n in widths.items() if n > 1 and mark != " "]
    if not marked and not several:
        raise refusal(name, "one column", first=lines[0].strip())
    mark = marked[0] if marked else max(several, key=lambda mark: widths[mark])
    return mark, heads[mark], max(n_titles[mark], 0)


def _n_titles(rows: list[Row], of_names: list[int]) -> int:
    # how many rows are above those that have as many cells as the last but notes, or
    # the header one less; -1 if others are as wide, or the first by another separator
    widths = [len(row.cells) for row in rows]
    while len(widths) > 2 and widths[-1] == 1:
        widths.pop()
    del rows[len(widths) :]
    width, first = widths[-1], len(widths) - 1
    while first and widths[first - 1] == width:
        first -= 1
    if first and 1 < widths[first - 1] == width - 1:
        first -= rows[first].line == rows[first - 1].end + 1
    are_titles = all(w < width for w in widths[:first]) and width not in of_names
    is_table = widths[first] > 1 and 2 * first <= len(widths)
    return first if is_table and (are_titles or not first) else -1


def _columns(sheet: Sheet, reader: Any, width: int) -> tuple[Column, ...]:
    # the cells below the names
    numbers: list[dict[str, int]]
    numbers = [defaultdict(count().__next__) for _ in range(width)]  # the next is new
    codes: list[list[Codes]] = [[np.zeros(0, dtype=np.int64)] for _ in range(width)]
    with collector_off():  # lists of text are no cycles, and are looked at in vain
        for records in checked_records(sheet, reader, width):
            for k, cells in enumerate(zip(*records, strict=True)):
                part = map(numbers[k].__getitem__, cells)
                codes[k].append(np.fromiter(part, np.int64, len(records)))
    parts = zip(codes, numbers, strict=True)
    return tuple(Column.of(np.concatenate(codes), number) for codes, number in parts)


def checked_records(
    sheet: Sheet, reader: Any, width: int, n_rows: int = 1
) -> Iterator[list[list[str]]]:
    """Yield records, many at once, or refuse the first that has other cells."""
    # of a reader whose last line is the end's; n_rows: records above, with the names
    is_closed = False
    while records := list(islice(reader, _CHUNK)):
        if set(map(len, records)) != {width}:
            records = [record for record in records if not _is_blank(record)]
            is_closed = records[-1:] == [[_END]]
            records = records[: len(records) - is_closed]
            wrong = (k for k, record in enumerate(records) if len(record) != width)
            if (k := next(wrong, None)) is not None:
                raise sheet.refuse(
                    "open quote" if records[k][-1].endswith(_END) else "width",
                    where=sheet.at(n_rows + k),
                    width=width,
                    n=len(records[k]),
                    cells=", ".join(records[k])[:60],
                )
        yield records
        n_rows += len(records)
    if not is_closed:
        raise sheet.refuse("open quote", where=sheet.at(n_rows - 1))

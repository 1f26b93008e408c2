"""A text as records of cells: its comments, its separator, its lines."""

import csv
import io
import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from masrel._collector import collector_off
from masrel.errors import RatingsError

if TYPE_CHECKING:
    from masrel.ratings._text_cells import SheetOptions

Cells = NDArray[np.object_]

_SNIFFED = 1 << 16  # letters that the separator is found in
_MANY_COLUMNS = 1000
_LARGE = 1 << 22  # letters of a text that pandas reads
_RECORDS = 20  # records that the separator is found in
_BLANKS = " "  # any number of blanks or tabs, as R's write.table writes
DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blanks"}
"""Separators, and what they are called."""


def text_records(
    name: str, text: str, kind: str, options: "SheetOptions"
) -> tuple[Cells, dict[str, Any], Callable[[int], str], bool]:
    """Return a text's records, names first, and what is known of them."""
    # -> records, what the format is, where records are, whether a comment labels them
    # simulated
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
            f"{DELIMITERS.get(delimiter, repr(delimiter))}, got {first.strip()[:60]!r}"
        )
    if not options.no_header:
        lines.refuse_second_header()
    records = lines.cells()
    facts: dict[str, Any] = {
        "format": kind,
        "delimiter": DELIMITERS.get(delimiter, delimiter),
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
        with long_cells(len(text)):
            yield from _csv_reader(io.StringIO(text, newline=""), delimiter)


def _csv_reader(lines: Iterable[str], delimiter: str, *, strict: bool = False) -> Any:
    return csv.reader(
        lines,
        delimiter=delimiter,
        skipinitialspace=delimiter != "\t",
        strict=strict,
    )


def numbered_records(
    lines: Iterable[str], delimiter: str, n_before: int
) -> Iterator[tuple[int, list[str]]]:
    """Return the line where each record begins, and its cells, without blank lines."""
    # n_before: lines of the file before these
    reader, begins = _csv_reader(lines, delimiter), n_before + 1
    for record in reader:
        if record and (len(record) > 1 or record[0].strip(" \t")):
            yield begins, record
        begins = n_before + reader.line_num + 1


def width_error(name: str, line: int, width: int, record: list[str]) -> RatingsError:
    """Return the error of a record that has another number of cells."""
    return RatingsError(
        f"{name}: line {line}: needed {width} cells, as the first line has, got "
        f"{len(record)}: {', '.join(record)[:60]!r}"
    )


@contextmanager
def long_cells(most: int) -> Iterator[None]:
    """Let the csv module read cells of as many letters."""
    # the limit is one for all readers
    limit = csv.field_size_limit()
    csv.field_size_limit(max(limit, most))
    try:
        yield
    finally:
        csv.field_size_limit(limit)


def _delimiter_of(name: str, body: str) -> str:
    head = _head(body)
    n_fields = {}
    for delimiter in DELIMITERS:
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
        names = " and ".join(DELIMITERS[d] for d in marked)
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

    def _records(self) -> Iterator[tuple[int, list[str]]]:
        # -> line where it begins, cells; records of blank lines are left out
        if self._delimiter == _BLANKS:
            for number, record in enumerate(_rows(self._body, _BLANKS), start=1):
                if record:
                    yield number + self._n_before, record
            return
        with long_cells(len(self._body)):
            lines = io.StringIO(self._body, newline="")
            yield from numbered_records(lines, self._delimiter, self._n_before)

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
            plain = self._plain_cells()
            if plain is not None:
                return plain
            rows = self._checked_records()
            if self.has_row_names:
                rows[0] = [*rows[0], ""]
            every = itertools.chain.from_iterable(rows)
            cells = np.fromiter(every, dtype=object, count=len(rows) * self.width)
            return self._named(cells.reshape(len(rows), self.width))
        return self._named(self._parsed())

    def _plain_cells(self) -> Cells | None:
        # where nothing but separators and ends of lines makes cells, else None
        delimiter, body = self._delimiter, self._body.replace("\r\n", "\n")
        if delimiter == _BLANKS or not delimiter.isascii() or self.has_row_names:
            return None
        skipped = () if delimiter == "\t" else (f"{delimiter} ", "\n ")
        if any(mark in body for mark in ('"', "\r", *skipped)) or body[0] == " ":
            return None
        body = body if body.endswith("\n") else f"{body}\n"
        line = (delimiter * (self.width - 1) + "\n").encode()
        marks = body.encode().translate(None, bytes({*range(256)} - {*line}))
        n_records = len(marks) // self.width
        if marks != line * n_records:
            return None
        every = body.replace("\n", delimiter).split(delimiter)
        cells = np.fromiter(every, dtype=object, count=n_records * self.width)
        return cells.reshape(n_records, self.width)

    def _checked_records(self) -> list[list[str]]:
        # by the csv module, a quote that is not closed refused
        rows: list[list[str]] = []
        try:
            # lists of text are no cycles; to look for some in 100 000 of them costs as
            # much as to read them
            with long_cells(len(self._body)), collector_off():
                lines = io.StringIO(self._body, newline="")
                rows = list(_csv_reader(lines, self._delimiter, strict=True))
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
                raise width_error(self._name, line, self.width, record)

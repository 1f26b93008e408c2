"""Rows of a CSV file as text, each with the number of its line."""

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

from masrel.errors import RatingsError

__all__ = ["MISSING", "CsvRow", "CsvRows", "Problems", "read_rows"]

MISSING = ("", "NA")
"""Cells that stand for a missing value; nothing else does."""

_MOST_PROBLEMS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvRow:
    """One record of a CSV file."""

    line: int  # line of the file where it begins, from 1
    # its cells without the blanks around them, as many as the header has
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvRows:
    """A CSV file as text."""

    path: Path  # the file
    header: tuple[str, ...]  # names of the columns, all different
    header_line: int  # line of the header
    rows: tuple[CsvRow, ...]  # the records below it; blank lines are left out


class Problems:
    """Problems of one file, collected to be raised together."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: list[tuple[int, str]] = []

    def add(self, line: int, column: str | None, message: str) -> None:
        """Note a problem."""
        where = f"line {line}" + ("" if column is None else f", column {column!r}")
        self._found.append((line, f"{self._path}: {where}: {message}"))

    def raise_any(self) -> None:
        """Raise what was noted, by line, at most 20 of them."""
        if not self._found:
            return
        texts = [text for _, text in sorted(self._found, key=lambda found: found[0])]
        more = len(texts) - _MOST_PROBLEMS
        if more > 0:
            texts = [*texts[:_MOST_PROBLEMS], f"{self._path}: and {more} more"]
        raise RatingsError("\n".join(texts))


def read_rows(path: Path) -> CsvRows:
    """Read a CSV file as text, without guessing any type."""
    # Lines at the head that begin with ``#`` are comments; a byte order mark, either
    # line ending, blank lines, and blanks around cells do not matter.
    text = _text(path)
    n_comments = _comment_lines(text)
    body = io.StringIO(text, newline="")
    for _ in range(n_comments):
        body.readline()
    records = _records(path, body, n_comments)
    if not records:
        raise RatingsError(f"{path}: needed a header and rows, the file has none")
    header_line, header = records[0]
    _check_header(path, header_line, header)
    problems = Problems(path)
    for line, cells in records[1:]:
        if len(cells) != len(header):
            problems.add(
                line, None, f"needed {len(header)} cells, got {len(cells)}: {cells}"
            )
    problems.raise_any()
    return CsvRows(
        path=path,
        header=header,
        header_line=header_line,
        rows=tuple(CsvRow(line=line, cells=cells) for line, cells in records[1:]),
    )


def _text(path: Path) -> str:
    if not path.is_file():
        raise RatingsError(f"{path}: no such file")
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise RatingsError(
            f"{path}: line {line}: needed UTF-8 text, got the byte "
            f"0x{data[error.start]:02x}; save the file as UTF-8"
        ) from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise RatingsError(f"{path}: line {line}: needed text, got a zero byte")
    return text


def _comment_lines(text: str) -> int:
    # Blank lines between comments count as lines of the head.
    n_lines = 0
    for line in io.StringIO(text, newline=""):
        if line.strip() and not line.startswith("#"):
            break
        n_lines += 1
    return n_lines


def _records(
    path: Path, body: io.StringIO, n_before: int
) -> list[tuple[int, tuple[str, ...]]]:
    # -> (line where the record begins, stripped cells), blank records left out
    reader = csv.reader(body, strict=True)
    records = []
    begins = n_before + 1
    try:
        for cells in reader:
            stripped = tuple(cell.strip() for cell in cells)
            if any(stripped):
                records.append((begins, stripped))
            begins = n_before + reader.line_num + 1
    except csv.Error as error:
        raise RatingsError(
            f"{path}: line {begins}: needed cells separated by commas ({error})"
        ) from error
    return records


def _check_header(path: Path, line: int, header: tuple[str, ...]) -> None:
    if len(header) == 1:
        other = re.search(r"[;\t|]", header[0])
        got = f"one column {header[0]!r}"
        if other:
            got = f"{other.group()!r} as separator"
        raise RatingsError(
            f"{path}: line {line}: needed columns separated by commas, got {got}"
        )
    problems = Problems(path)
    for position, name in enumerate(header, start=1):
        if not name:
            problems.add(line, None, f"column {position} needs a name, got none")
        elif name in header[: position - 1]:
            problems.add(line, name, "needed different names, this one is there twice")
    problems.raise_any()

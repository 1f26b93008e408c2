"""A CSV file of ratings as text: its rows, and which column is what."""

import csv
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from masrel.errors import RatingsError

MISSING = ("", "NA")
"""Cells that stand for a missing value; nothing else does."""

_MAX_PROBLEMS = 20


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
        self._noted: list[tuple[int, str]] = []

    def add(self, line: int, column: str | None, message: str) -> None:
        """Note a problem."""
        where = f"line {line}" + ("" if column is None else f", column {column!r}")
        self._noted.append((line, f"{self._path}: {where}: {message}"))

    def raise_any(self) -> None:
        """Raise what was noted, by line, at most 20 of them."""
        if not self._noted:
            return
        texts = [text for _, text in sorted(self._noted, key=lambda noted: noted[0])]
        more = len(texts) - _MAX_PROBLEMS
        if more > 0:
            texts = [*texts[:_MAX_PROBLEMS], f"{self._path}: and {more} more"]
        raise RatingsError("\n".join(texts))


def read_rows(path: Path) -> CsvRows:
    """Read a CSV file as text, without guessing any type."""
    # A byte order mark, either line ending, blank lines, and blanks around cells do
    # not matter.
    records = _records(path, _text(path))
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


def _records(path: Path, text: str) -> list[tuple[int, tuple[str, ...]]]:
    # -> (line where the record begins, stripped cells), blank records left out
    lines = io.StringIO(text, newline="")
    # lines at the head that begin with "#" are comments, blank lines between them too
    n_before = 0
    for line in io.StringIO(text, newline=""):
        if line.strip() and not line.startswith("#"):
            break
        n_before += 1
        lines.readline()
    reader = csv.reader(lines, strict=True)
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


_NAMES = {
    "item": ("item", "model", "subject"),
    "rater": ("rater",),
    "grade": ("grade", "rating", "score"),
    "session": ("session",),
}
"""Names that are recognized, letter case aside."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LongColumns:
    """Columns of a long table: one row a rating."""

    # item, rater, grade: their positions
    item: int
    rater: int
    grade: int
    session: int | None  # position of the session, if there is one


@dataclass(frozen=True, slots=True, kw_only=True)
class WideColumns:
    """Columns of a wide table: one row an item, one column a rater."""

    item: int  # position of the item
    raters: tuple[int, ...]  # positions of the raters
    session: int | None  # position of the session, if there is one


def find_columns(
    rows: CsvRows, names: Mapping[str, str | None]
) -> LongColumns | WideColumns:
    """Decide whether a table is long or wide, and which column is what."""
    # names: role to the column the caller named for it, or None.
    # A table with a column for the rater or for the grade, named by the caller or by a
    # name that is recognized, is long and needs item, rater and grade. Any other table
    # is wide: the item is the column the caller named, else one whose name is
    # recognized, else the first; every other column but the session is a rater.
    positions = {role: _find(rows, role, names) for role in _NAMES}
    if positions["rater"] is not None or positions["grade"] is not None:
        return _long_columns(rows, positions)
    item, session = positions["item"] or 0, positions["session"]
    raters = tuple(p for p in range(len(rows.header)) if p not in (item, session))
    if not raters:
        raise _error(rows, "needed a column for a rater, got none")
    return WideColumns(item=item, raters=raters, session=session)


def _long_columns(rows: CsvRows, positions: Mapping[str, int | None]) -> LongColumns:
    required = {}
    for role in ("item", "rater", "grade"):
        position = positions[role]
        if position is None:
            raise _error(
                rows,
                f"needed a column for the {role} named {' or '.join(_NAMES[role])}, "
                f"got {', '.join(rows.header)}; say which it is",
            )
        required[role] = position
    used = [*required.values()]
    if (session := positions["session"]) is not None:
        used.append(session)
    if len(set(used)) < len(used):
        raise _error(
            rows,
            "needed different columns for item, rater, grade and session, got "
            + ", ".join(rows.header[p] for p in used),
        )
    return LongColumns(**required, session=session)


def _find(rows: CsvRows, role: str, names: Mapping[str, str | None]) -> int | None:
    name = names[role]
    if name is not None:
        if name not in rows.header:
            raise _error(
                rows,
                f"needed a column {name!r} for the {role}, got "
                + ", ".join(rows.header),
            )
        return rows.header.index(name)
    # a column the caller named for another role is no candidate for this one
    taken = names.values()
    candidates = [
        column
        for column in rows.header
        if column.casefold() in _NAMES[role] and column not in taken
    ]
    if len(candidates) > 1:
        raise _error(
            rows,
            f"needed one column for the {role}, got {' and '.join(candidates)}; say "
            "which it is",
        )
    return rows.header.index(candidates[0]) if candidates else None


def _error(rows: CsvRows, message: str) -> RatingsError:
    return RatingsError(f"{rows.path}: line {rows.header_line}: {message}")

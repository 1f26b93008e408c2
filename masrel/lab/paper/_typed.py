"""A sheet as it was typed in: a CSV file, with the habits of spreadsheets."""

import csv
import hashlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from masrel.errors import RatingsError
from masrel.lab._bounded_files import (
    MAX_SMALL,
    csv_format,
    format_problem,
    read_regular,
)
from masrel.lab.paper._form import FIRST_COLUMNS

_SEPARATORS = (",", ";", "\t")

_LONGEST_CELL = 10_000  # letters of an answer

_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
"""Byte order marks of what spreadsheets call Unicode text."""

_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")


@dataclass(frozen=True, slots=True, kw_only=True)
class TypedRow:
    """A row of a sheet that was typed in."""

    number: int  # as a spreadsheet numbers it, from 1
    cells: dict[str, str]  # by column, without blanks around them

    def __getitem__(self, column: str) -> str:
        """Return a cell; empty where the sheet has no such column."""
        return self.cells.get(column, "")


@dataclass(frozen=True, slots=True, kw_only=True)
class TypedSheet:
    """A sheet that was typed in."""

    path: Path
    sha256: str
    columns: tuple[str, ...]
    rows: tuple[TypedRow, ...]  # those that are not blank


def read_typed(path: Path) -> TypedSheet:
    """Return what was typed into a sheet; RatingsError if it is no such file."""
    data = _bytes(path)
    records = list(_records(path, _text(path, data)))
    # Below the version, and "sep=;", which some spreadsheets write and want first
    head = list(takewhile(_is_head, (record[0] for record in records)))
    start = len(head)
    for line in head:
        problem = format_problem(csv_format(line), newest=1)
        if problem is not None:
            raise RatingsError(f"{path}: {problem}")
    if len(records) <= start:
        raise RatingsError(
            f"{path}: needed the columns {', '.join(FIRST_COLUMNS[1:])}, got nothing"
        )
    columns = _columns(path, start + 1, records[start])
    return TypedSheet(
        path=path,
        sha256=hashlib.sha256(data).hexdigest(),
        columns=tuple(name for name in columns if name),
        rows=tuple(_rows(path, start, columns, records)),
    )


def _is_head(cell: str) -> bool:
    return cell.startswith("#") or cell.casefold().startswith("sep=")


def _bytes(path: Path) -> bytes:
    try:
        return read_regular(path, most=MAX_SMALL)
    except OSError as error:
        reason = error.strerror or str(error)
        raise RatingsError(f"{path}: needed a sheet, got: {reason}") from error


def _text(path: Path, data: bytes) -> str:
    if data.startswith(_WORKBOOKS):
        raise RatingsError(
            f'{path}: needed a CSV file, got a workbook: save the sheet as "CSV UTF-8"'
        )
    try:
        return data.decode("utf-16" if data.startswith(_UTF_16) else "utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise RatingsError(
            f"{path}: line {line}: needed UTF-8 text, got byte "
            f'{data[error.start]:#04x}: save the sheet as "CSV UTF-8"'
        ) from error


def _records(path: Path, text: str) -> Iterator[list[str]]:
    # each with at least one cell, so that a spreadsheet's row has one record
    head = next((line for line in text.splitlines() if "position" in line.lower()), "")
    separator = max(_SEPARATORS, key=head.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        for record in reader:
            cells = [cell.strip() for cell in record]
            if any(len(cell) > _LONGEST_CELL for cell in cells):
                raise RatingsError(
                    f"{path}: line {reader.line_num}: needed cells of at most "
                    f"{_LONGEST_CELL} letters, got a longer one"
                )
            yield cells or [""]
    except csv.Error as error:
        raise RatingsError(
            f"{path}: line {reader.line_num}: needed cells of a CSV file, got: {error}"
        ) from error


def _columns(path: Path, number: int, record: list[str]) -> list[str]:
    names = [name if "." in name else name.casefold() for name in record]
    for name in FIRST_COLUMNS[1:]:
        if name not in names:
            raise RatingsError(
                f"{path}: row {number}: needed the columns "
                f"{', '.join(FIRST_COLUMNS[1:])}, got "
                f"{shortened(', '.join(filter(None, names)))}"
            )
    for name in filter(None, names):
        if names.count(name) > 1:
            raise RatingsError(
                f"{path}: row {number}: needed each column once, got {shortened(name)} "
                "twice"
            )
    return names


def _rows(
    path: Path, start: int, columns: list[str], records: list[list[str]]
) -> Iterator[TypedRow]:
    for number, record in enumerate(records[start + 1 :], start=start + 2):
        if not any(record):
            continue
        if any(record[len(columns) :]):  # such as a comma inside a number
            raise RatingsError(
                f"{path}: row {number}: needed at most {len(columns)} cells, got "
                f"{len(record)}"
            )
        named = list(zip(columns, record, strict=False))
        for column, cell in named:
            if cell and not column:
                raise RatingsError(
                    f"{path}: row {number}: needed cells below the name of a column, "
                    f"got {shortened(cell)!r} below none"
                )
        yield TypedRow(
            number=number, cells={name: cell for name, cell in named if name}
        )


def shortened(text: str, most: int = 100) -> str:
    """Return a text as a message has it."""
    return text if len(text) <= most else f"{text[:most]}…"

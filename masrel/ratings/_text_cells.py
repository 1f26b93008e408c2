"""A file of any format as columns of text: what its cells say, not what they mean.

In: a path, "-" or a pipe, and what the caller says of its format. Out: a `Sheet`.
"""

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import date, datetime
from decimal import Decimal
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError
from masrel.ratings._file_bytes import bytes_of, decoded, unpacked
from masrel.ratings._text_records import Cells, text_records

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
    sha256: Callable[[], str]  # of its bytes
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
    name, data = str(path), bytes_of(path)
    if not data:
        raise RatingsError(f"{name}: needed a header and rows, the file is empty")
    sha256 = partial(str, hashlib.sha256(data).hexdigest())  # which pickle takes
    inner, data = unpacked(name, data, is_export=options.source is not None)
    suffix = Path(inner).suffix.lower()
    left_out: dict[str, int] = {}
    if options.source is not None or suffix in _TYPED_FORMATS:
        from masrel.ratings._typed_files import read_typed

        frame, facts, left_out = read_typed(name, suffix, data, options)
        line_of: Callable[[int], str] = partial(_row_number, int(frame.index[0]))
        records, simulated = frame.to_numpy(dtype=object), False
    else:
        text = decoded(name, data, options.encoding)
        kind = TEXT_FORMATS.get(suffix, "text")
        records, facts, line_of, simulated = text_records(name, text, kind, options)
    if options.transpose:
        records, line_of = records.T, _column_number
    sheet = named_sheet(name, sha256, records, facts, options, line_of)
    return replace(
        sheet,
        is_simulated=simulated,
        is_transposed=options.transpose,
        dropped={**left_out, **sheet.dropped},
    )


def _row_number(first: int, number: int) -> str:
    return f"row {first + number + 1}"


def _column_number(number: int) -> str:
    return f"column {number + 1}"


def named_sheet(
    name: str,
    sha256: Callable[[], str],
    records: Cells,
    facts: dict[str, Any],
    options: SheetOptions,
    line_of: Callable[[int], str],
) -> Sheet:
    """Return records as a sheet, names first unless there are none."""
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


def library(name: str, module: str, extra: str = "files") -> Any:
    """Import a library that not everybody needs, or say how to get it."""
    if find_spec(module.partition(".")[0]) is None:
        raise RatingsError(
            f"{name}: reading it needs {module.partition('.')[0]}: "
            f"pip install 'masrel[{extra}]'"
        )
    return import_module(module)


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

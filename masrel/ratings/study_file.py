"""Reading any CSV file of ratings as text: its rows, its columns, its ratings."""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from masrel.errors import ParameterError, RatingsError
from masrel.ratings.table import (
    DEFAULT_SESSION,
    RATING_COLUMNS,
    SOURCES,
    Ratings,
    _assemble,
)
from masrel.scales import MODIFIED_ASHWORTH, Scale

_MISSING = ("", "NA")
"""Cells that stand for a missing value; nothing else does."""

_MAX_PROBLEMS = 20

_LOOKS_MISSING = frozenset({"n/a", "na", "nan", "null", "none", ".", "-", "?"})

_NAMES = {
    "item": ("item", "model", "subject"),
    "rater": ("rater",),
    "grade": ("grade", "rating", "score"),
    "session": ("session",),
}
"""Names that are recognized, letter case aside."""


_Problem = tuple[int, str | None, str]
"""What is wrong with a file: its line, its column if it is of one, and a message."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _CsvRow:
    """One record of a CSV file."""

    line: int  # line of the file where it begins, from 1
    # its cells without the blanks around them, as many as the header has
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _CsvRows:
    """A CSV file as text."""

    path: Path  # the file
    header: tuple[str, ...]  # names of the columns, all different
    header_line: int  # line of the header
    rows: tuple[_CsvRow, ...]  # the records below it; blank lines are left out


@dataclass(frozen=True, slots=True, kw_only=True)
class _LongColumns:
    """Columns of a long table: one row a rating."""

    # item, rater, grade: their positions
    item: int
    rater: int
    grade: int
    session: int | None  # position of the session, if there is one


@dataclass(frozen=True, slots=True, kw_only=True)
class _WideColumns:
    """Columns of a wide table: one row an item, one column a rater."""

    item: int  # position of the item
    raters: tuple[int, ...]  # positions of the raters
    session: int | None  # position of the session, if there is one


@dataclass(frozen=True, slots=True, kw_only=True)
class _Cell:
    """One rating as it is in the file: the columns of a table, and where it stands."""

    line: int
    column: str
    session: str
    rater: str
    model: str
    repeat: int = 1
    grade: str | None
    mean_speed_deg_s: float = math.nan
    source: str = "foreign"


def read_study_ratings(
    path: Path | str,
    *,
    scale: Scale | None = None,
    item: str | None = None,
    rater: str | None = None,
    grade: str | None = None,
    session: str | None = None,
    categories: Sequence[str] | None = None,
) -> Ratings:
    r"""Read a long or wide CSV file of ratings, everything as text.

    Parameters
    ----------
    path : Path or str
        The file; ``docs/ratings.md`` says what is accepted.
    scale : Scale, optional
        The grades a rater may give.
    item, rater, grade, session : str, optional
        Names of columns, where the file's own names do not say it.
    categories : sequence of str, optional
        The grades a rater may give, in order, instead of `scale`. With neither, the
        scale is the grades found, by value when all are numbers, else as text; with
        a grade 1+ it is the Modified Ashworth Scale.

    Returns
    -------
    Ratings
        The table, rows in the order of the file, a wide one row by row.

    Raises
    ------
    RatingsError
        If the file is not a table of ratings. The message lists up to 20 problems,
        each with file, line, column, what was needed and what came.
    ParameterError
        If both `scale` and `categories` are given, or `categories` are no scale.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "wide.csv"
    ...     _ = path.write_text("patient,Kim,Lee\nA,1,1+\nB,2,NA\n")
    ...     ratings = read_ratings(path, categories=["1", "1+", "2"])
    >>> ratings.table["grade"].tolist()
    ['1', '1+', '2', None]
    """
    if scale is not None and categories is not None:
        raise ParameterError("scale, categories: needed one of them, got both")
    if categories is not None:
        scale = Scale(name="declared", grades=tuple(categories))
    rows = _read_rows(Path(path))
    names = {"item": item, "rater": rater, "grade": grade, "session": session}
    columns = _find_columns(rows, names)
    problems: list[_Problem] = []
    if isinstance(columns, _LongColumns):
        cells = _long_cells(rows, columns, problems)
    else:
        cells = _wide_cells(rows, columns)
    _check_cells(cells, scale, problems)
    if problems:
        raise _refusal(rows.path, problems)
    if scale is None:
        scale = _observed_scale(rows, cells)
    values = {n: [getattr(cell, n) for cell in cells] for n in RATING_COLUMNS}
    return _assemble(values, scale, rows.path)


def _long_cells(
    rows: _CsvRows, columns: _LongColumns, problems: list[_Problem]
) -> list[_Cell]:
    extra: dict[str, int] = {
        name: rows.header.index(name)
        for name in ("repeat", "mean_speed_deg_s", "source")
        if name in rows.header
    }
    at = columns.session
    cells = []
    for row in rows.rows:
        texts = {name: row.cells[position] for name, position in extra.items()}
        grade = row.cells[columns.grade]
        repeat, speed, source = _extra_values(texts, row.line, problems)
        cells.append(
            _Cell(
                line=row.line,
                column=rows.header[columns.grade],
                session=DEFAULT_SESSION if at is None else row.cells[at],
                rater=row.cells[columns.rater],
                model=row.cells[columns.item],
                grade=None if grade in _MISSING else grade,
                repeat=repeat,
                mean_speed_deg_s=speed,
                source=source,
            )
        )
        for role in ("item", "rater"):
            position = getattr(columns, role)
            if row.cells[position] in _MISSING:
                problems.append((row.line, rows.header[position], f"needed the {role}"))
    return cells


def _wide_cells(rows: _CsvRows, columns: _WideColumns) -> list[_Cell]:
    at = columns.session
    return [
        _Cell(
            line=row.line,
            column=rows.header[position],
            session=DEFAULT_SESSION if at is None else row.cells[at],
            rater=rows.header[position],
            model=row.cells[columns.item],
            grade=None if row.cells[position] in _MISSING else row.cells[position],
        )
        for row in rows.rows
        for position in columns.raters
    ]


def _extra_values(
    texts: Mapping[str, str], line: int, problems: list[_Problem]
) -> tuple[int, float, str]:
    # repeat, mean speed and source of one row, from the columns a file may lack
    text, repeat = texts.get("repeat", "1"), 1
    if text.isascii() and text.isdigit() and int(text) >= 1:
        repeat = int(text)
    else:
        problems.append((line, "repeat", f"needed a whole number from 1, got {text!r}"))
    text, speed = texts.get("mean_speed_deg_s", ""), math.nan
    if text not in _MISSING:
        try:
            speed = float(text)
        except ValueError:
            speed = math.nan
        if not 0 <= speed < math.inf:
            problems.append(
                (line, "mean_speed_deg_s", f"needed a speed of 0 or more, got {text!r}")
            )
    source = texts.get("source", "foreign")
    if source not in SOURCES:
        problems.append(
            (line, "source", f"needed one of {', '.join(SOURCES)}, got {source!r}")
        )
    return repeat, speed, source


def _check_cells(
    cells: list[_Cell], scale: Scale | None, problems: list[_Problem]
) -> None:
    kind = "a grade" if scale is None else f"one of {', '.join(scale.grades)}"
    hint = "; name the categories if it is a grade" if scale is None else ""
    first_lines: dict[tuple[str, str, str, int], int] = {}
    for cell in cells:
        if not cell.model or not cell.session:
            problems.append((cell.line, None, "needed an item and a session, got none"))
            continue
        key = (cell.session, cell.rater, cell.model, cell.repeat)
        first = first_lines.setdefault(key, cell.line)
        if first != cell.line:
            message = (
                f"needed one rating of {cell.model!r} by {cell.rater!r} in session "
                f"{cell.session!r}, line {first} has one already"
            )
            problems.append((cell.line, cell.column, message))
        if cell.grade is None:
            continue
        looks_missing = cell.grade.casefold() in _LOOKS_MISSING
        if looks_missing if scale is None else cell.grade not in scale.grades:
            message = (
                f"needed {kind}, or an empty cell or NA when missing, "
                f"got {cell.grade!r}{hint}"
            )
            problems.append((cell.line, cell.column, message))


def _observed_scale(rows: _CsvRows, cells: list[_Cell]) -> Scale:
    grades = sorted({cell.grade for cell in cells if cell.grade is not None})
    if not grades:
        problem = (rows.header_line, None, "needed at least one grade, got none")
        raise _refusal(rows.path, [problem])
    try:
        values = {grade: float(grade) for grade in grades}
    except ValueError:
        # No other scale has a grade 1+: its order is known, and its other grades.
        if "1+" in grades and set(grades) <= set(MODIFIED_ASHWORTH.grades):
            return MODIFIED_ASHWORTH
        return Scale(name="observed", grades=tuple(grades))
    return Scale(name="observed", grades=tuple(sorted(grades, key=values.__getitem__)))


def _read_rows(path: Path) -> _CsvRows:
    """Read a CSV file as text, without guessing any type."""
    # A byte order mark, either line ending, blank lines, and blanks around cells do
    # not matter.
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
    records = _records(path, text)
    if not records:
        raise RatingsError(f"{path}: needed a header and rows, the file has none")
    header_line, header = records[0]
    _check_header(path, header_line, header)
    problems: list[_Problem] = []
    for line, cells in records[1:]:
        if len(cells) != len(header):
            problems.append(
                (line, None, f"needed {len(header)} cells, got {len(cells)}: {cells}")
            )
    if problems:
        raise _refusal(path, problems)
    return _CsvRows(
        path=path,
        header=header,
        header_line=header_line,
        rows=tuple(_CsvRow(line=line, cells=cells) for line, cells in records[1:]),
    )


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
    problems: list[_Problem] = []
    for position, name in enumerate(header, start=1):
        if not name:
            problems.append((line, None, f"column {position} needs a name, got none"))
        elif name in header[: position - 1]:
            problems.append(
                (line, name, "needed different names, this one is there twice")
            )
    if problems:
        raise _refusal(path, problems)


def _find_columns(
    rows: _CsvRows, names: Mapping[str, str | None]
) -> _LongColumns | _WideColumns:
    """Decide whether a table is long or wide, and which column is what."""
    # names: role to the column the caller named for it, or None.
    # A table with a column for the rater or for the grade, named by the caller or by a
    # name that is recognized, is long and needs item, rater and grade. Any other table
    # is wide: the item is the column the caller named, else one whose name is
    # recognized, else the first; every other column but the session is a rater.
    positions = {role: _find(rows, role, names) for role in _NAMES}
    session = positions["session"]
    if positions["rater"] is None and positions["grade"] is None:
        item = positions["item"] or 0
        raters = tuple(p for p in range(len(rows.header)) if p not in (item, session))
        if not raters:
            raise _error(rows, "needed a column for a rater, got none")
        return _WideColumns(item=item, raters=raters, session=session)
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
    used = [*required.values(), *([] if session is None else [session])]
    if len(set(used)) < len(used):
        raise _error(
            rows,
            "needed different columns for item, rater, grade and session, got "
            + ", ".join(rows.header[p] for p in used),
        )
    return _LongColumns(**required, session=session)


def _find(rows: _CsvRows, role: str, names: Mapping[str, str | None]) -> int | None:
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


def _error(rows: _CsvRows, message: str) -> RatingsError:
    return RatingsError(f"{rows.path}: line {rows.header_line}: {message}")


def _refusal(path: Path, problems: Sequence[_Problem]) -> RatingsError:
    # the error with the problems of a file by line, the first 20 of them
    texts = []
    for line, column, message in sorted(problems, key=lambda problem: problem[0]):
        where = f"line {line}" + ("" if column is None else f", column {column!r}")
        texts.append(f"{path}: {where}: {message}")
    more = len(texts) - _MAX_PROBLEMS
    if more > 0:
        texts = [*texts[:_MAX_PROBLEMS], f"{path}: and {more} more"]
    return RatingsError("\n".join(texts))

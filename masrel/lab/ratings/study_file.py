"""Reading a study's table of ratings: one row a rating, every cell checked."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any

from masrel._files import from_safe_cell
from masrel._input import listed, not_utf8
from masrel.errors import RatingsError
from masrel.lab._bounded_files import (
    MAX_TABLE,
    csv_format,
    format_problem,
    read_regular,
)
from masrel.lab.ratings.table import (
    _FORMAT,
    _NEEDED_TIME,
    _YES_NO,
    DEFAULT_SESSION,
    RATING_COLUMNS,
    SOURCES,
    Rating,
    Ratings,
    _assemble,
    _is_utc,
)
from masrel.lab.run._state import FELT
from masrel.scales import Scale

_MISSING = ("", "NA")
"""Cells that stand for a missing value; nothing else does."""

_MAX_PROBLEMS = 20

_NAMES = {
    "model": ("model", "item", "subject"),
    "rater": ("rater",),
    "grade": ("grade", "rating", "score"),
    "session": ("session",),
}
"""Names of columns that are recognized, letter case aside."""


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
class _Cell:
    """One rating as it is in the file: the columns of a table, and where it stands."""

    line: int
    column: str
    session: str
    rater: str
    model: str
    repeat: int
    grade: str | None
    mean_speed_deg_s: float
    source: str
    n_stretches: int | None
    min_speed_deg_s: float
    max_speed_deg_s: float
    speeds_deg_s: tuple[float | None, ...] | None
    graded_stretch: int | None
    felt: str | None
    grades_from: str | None
    device: str | None
    position: int | None
    code: str | None
    n_attempts: int | None
    first_grade: str | None
    graded_at: str | None
    grip_lost: bool | None


def read_study_ratings(path: Path | str, scale: Scale) -> Ratings:
    r"""Read a study's table of ratings, one row a rating, everything as text.

    Parameters
    ----------
    path : Path or str
        A CSV file with columns `rater`, `model` (or `item`) and `grade`;
        ``docs/ratings.md`` has the others. Any other file is for `read_ratings`.
    scale : Scale
        The grades a rater may give.

    Returns
    -------
    Ratings
        The table, rows in the order of the file.

    Raises
    ------
    RatingsError
        If the file is not a table of ratings. The message lists up to 20 problems,
        each with file, line, column, what was needed and what came.

    Examples
    --------
    >>> import tempfile
    >>> from masrel.scales import MODIFIED_ASHWORTH
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "ratings.csv"
    ...     _ = path.write_text("rater,model,grade\nR1,HM2,1+\nR2,HM2,NA\n")
    ...     ratings = read_study_ratings(path, MODIFIED_ASHWORTH)
    >>> [row.grade for row in ratings.rows]
    ['1+', None]
    """
    rows = _read_rows(Path(path))
    places = {role: _find(rows, role) for role in _NAMES}
    for role in ("rater", "model", "grade"):
        if places[role] is None:
            raise _error(
                rows,
                f"needed a column for the {role} named {' or '.join(_NAMES[role])}, "
                f"got {listed(rows.header)}; masrel agree reads other tables",
            )
    problems: list[_Problem] = []
    cells = _long_cells(rows, places, problems)
    _check_cells(cells, scale, problems)
    if problems:
        raise _refusal(rows.path, problems)
    taken = attrgetter(*RATING_COLUMNS)
    return _assemble((Rating(*taken(cell)) for cell in cells), scale, rows.path)


def _long_cells(
    rows: _CsvRows, places: Mapping[str, int | None], problems: list[_Problem]
) -> list[_Cell]:
    columns = {role: place for role, place in places.items() if place is not None}
    for name in ("repeat", *RATING_COLUMNS[5:]):
        if name in rows.header:
            columns[name] = rows.header.index(name)
    cells = []
    for row in rows.rows:
        texts = {role: row.cells[place] for role, place in columns.items()}
        row_problems: list[tuple[str, str]] = []
        extra = _extra_values(texts, row_problems)
        problems += [(row.line, name, text) for name, text in row_problems]
        cells.append(
            _Cell(
                line=row.line,
                column=rows.header[columns["grade"]],
                session=texts.get("session", DEFAULT_SESSION),
                rater=texts["rater"],
                model=texts["model"],
                grade=None if texts["grade"] in _MISSING else texts["grade"],
                **extra,
            )
        )
        for role in ("model", "rater"):
            if texts[role] in _MISSING:
                problems.append(
                    (row.line, rows.header[columns[role]], f"needed the {role}")
                )
    return cells


_Problems = list[tuple[str, str]]
"""Column and message of what is wrong with a row."""


def _extra_values(texts: Mapping[str, str], problems: _Problems) -> dict[str, Any]:
    # the values of one row from the columns that a file may lack
    n_stretches = _whole(texts, "n_stretches", 0, problems)
    speeds = _speeds(texts, n_stretches, problems)
    graded = _whole(texts, "graded_stretch", 1, problems)
    if graded is not None and graded > (n_stretches or 0):
        problems.append(("graded_stretch", f"needed at most n_stretches, got {graded}"))
    values: dict[str, Any] = {
        "repeat": _whole({"repeat": "1", **texts}, "repeat", 1, problems),
        "source": texts.get("source", "foreign"),
        **{
            name: None if (text := texts.get(name, "NA")) in _MISSING else text
            for name in _TEXTS
        },
        "position": _whole(texts, "position", 1, problems),
        "n_attempts": _whole(texts, "n_attempts", 0, problems),
        "n_stretches": n_stretches,
        "speeds_deg_s": speeds,
        "graded_stretch": graded,
    }
    for name in ("mean_speed_deg_s", "min_speed_deg_s", "max_speed_deg_s"):
        values[name] = _speed(name, texts.get(name, ""), problems)
    _texts = {"source": SOURCES, "felt": (*FELT, None), "grip_lost": (*_YES_NO, None)}
    for name, known in _texts.items():
        if values[name] not in known:
            names = listed(text for text in known if text is not None)
            problems.append((name, f"needed one of {names}, got {values[name]!r}"))
    if (lost := values["grip_lost"]) is not None:
        values["grip_lost"] = lost == _YES_NO[True]
    time = values["graded_at"]
    if time is not None and not _is_utc(time):
        problems.append(("graded_at", f"{_NEEDED_TIME}, got {time!r}"))
    return values


def _whole(
    texts: Mapping[str, str], name: str, least: int, problems: _Problems
) -> int | None:
    # None where the cell is missing, or no such number; a repeat is never missing
    text = texts.get(name, "NA")
    if text in _MISSING and name != "repeat":
        return None
    # more digits than any count has
    if text.isascii() and text.isdigit() and len(text) < 19 and int(text) >= least:
        return int(text)
    problems.append((name, f"needed a whole number from {least}, got {text!r}"))
    return None


def _speed(name: str, text: str, problems: _Problems) -> float:
    if text in _MISSING:
        return math.nan
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0 <= speed < math.inf:
        problems.append((name, f"needed a speed of 0 or more, got {text!r}"))
    return speed


def _speeds(
    texts: Mapping[str, str], n_stretches: int | None, problems: _Problems
) -> tuple[float | None, ...] | None:
    # one a stretch, separated by semicolons
    text = texts.get("speeds_deg_s", "NA")
    if text in _MISSING and n_stretches != 1:
        return () if n_stretches == 0 else None
    cells = text.split(";")
    if len(cells) != n_stretches:
        message = f"needed {n_stretches} separated by semicolons, got {text!r}"
        problems.append(("speeds_deg_s", message))
    return tuple(
        None
        if cell.strip() in _MISSING
        else _speed("speeds_deg_s", cell.strip(), problems)
        for cell in cells
    )


_TEXTS = (
    *("felt", "grades_from", "device", "code", "first_grade", "graded_at"),
    "grip_lost",
)
"""Columns of text that a file may lack."""


def _check_cells(cells: list[_Cell], scale: Scale, problems: list[_Problem]) -> None:
    first_lines: dict[tuple[str, str, str, int], int] = {}
    for cell in cells:
        if not cell.session:
            problems.append((cell.line, None, "needed a session, got none"))
            continue
        key = (cell.session, cell.rater, cell.model, cell.repeat)
        first = first_lines.setdefault(key, cell.line)
        if first != cell.line:
            message = (
                f"needed one rating of {cell.model!r} by {cell.rater!r} in session "
                f"{cell.session!r}, line {first} has one already"
            )
            problems.append((cell.line, cell.column, message))
        grades = {cell.column: cell.grade, "first_grade": cell.first_grade}
        for column, grade in grades.items():
            if grade is not None and grade not in scale.grades:
                message = (
                    f"needed one of {listed(scale.grades)}, or an empty cell or NA "
                    f"when missing, got {grade!r}"
                )
                problems.append((cell.line, column, message))


def _read_rows(path: Path) -> _CsvRows:
    """Read a CSV file as text, without guessing any type."""
    # A byte order mark, either line ending, blank lines, and blanks around cells do
    # not matter.
    try:
        data = read_regular(path, most=MAX_TABLE)
    except OSError as error:
        is_absent = isinstance(error, FileNotFoundError)
        reason = "no such file" if is_absent else error.strerror
        raise RatingsError(f"{path}: {reason}") from error
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RatingsError(f"{path}: {not_utf8(error)}") from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise RatingsError(f"{path}: line {line}: needed text, got a zero byte")
    problem = format_problem(csv_format(text), newest=_FORMAT)
    if problem is not None:
        raise RatingsError(f"{path}: {problem}")
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
            stripped = tuple(from_safe_cell(cell.strip()) for cell in cells)
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
        raise RatingsError(
            f"{path}: line {line}: needed columns separated by commas, got one, "
            f"{header[0]!r}"
        )
    problems: list[_Problem] = []
    seen: set[str] = set()
    for position, name in enumerate(header, start=1):
        if not name:
            problems.append((line, None, f"column {position} needs a name, got none"))
        elif name in seen:
            problems.append(
                (line, name, "needed different names, this one is there twice")
            )
        seen.add(name)
    if problems:
        raise _refusal(path, problems)


def _find(rows: _CsvRows, role: str) -> int | None:
    places = [
        place
        for place, column in enumerate(rows.header)
        if column.casefold() in _NAMES[role]
    ]
    if len(places) > 1:
        names = " and ".join(rows.header[place] for place in places)
        raise _error(rows, f"needed one column for the {role}, got {names}")
    return places[0] if places else None


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

"""Reading tables of a study, every cell checked: ratings, grades given in person."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from masrel._files import from_safe_cell
from masrel._input import listed, not_utf8
from masrel.errors import RatingsError
from masrel.lab._study_files import (
    MAX_TABLE,
    YES_NO,
    check_format,
    csv_format,
    read_regular,
    repeated,
)
from masrel.lab.ratings.table import (
    _DEFAULTS,
    _FLOATS,
    _FORMAT,
    _WHOLE,
    RATING_COLUMNS,
    Ratings,
    _assemble,
    _problems,
)
from masrel.scales import Scale

_MISSING = ("", "NA")  # cells that stand for a missing value; nothing else does

_MAX_PROBLEMS = 20

# Names of columns that are recognized, letter case aside
_NAMES = {
    "model": ("model", "item", "subject"),
    "rater": ("rater",),
    "grade": ("grade", "rating", "score"),
    "session": ("session",),
}


# What is wrong with a file: its line, its column if it is of one, and a message
_Problem = tuple[int, str | None, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class _CsvRows:
    """A CSV file as text."""

    path: Path  # the file
    header: tuple[str, ...]  # names of the columns, all different
    header_line: int  # line of the header
    # the line where each record begins, and its cells by column without the blanks
    # around them; blank lines are left out
    rows: list[tuple[int, dict[str, str]]]


def read_study_ratings(path: Path | str, scale: Scale) -> Ratings:
    r"""Read a study's table of ratings, one row a rating, everything as text.

    Parameters
    ----------
    path : Path or str
        A CSV file with columns `rater`, `model` (or `item`) and `grade`;
        ``docs/reference/formats/ratings.md`` has the others. Any other file is for
        `read_ratings`.
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
    names = {name: name for name in RATING_COLUMNS if name in rows.header}
    problems: list[_Problem] = []
    for role in _NAMES:
        columns = [name for name in rows.header if name.casefold() in _NAMES[role]]
        if len(columns) > 1:
            message = f"needed one column for the {role}, got {' and '.join(columns)}"
            problems.append((rows.header_line, None, message))
        elif columns:
            names[role] = columns[0]
        elif role != "session":
            message = (
                f"needed a column for the {role} named {' or '.join(_NAMES[role])}, "
                f"got {listed(rows.header)}; masrel agree reads other tables"
            )
            problems.append((rows.header_line, None, message))
    _refuse(rows.path, problems[:1])
    values = [
        (line, _DEFAULTS | _values({name: cells[names[name]] for name in names}))
        for line, cells in rows.rows
    ]
    problems = [
        (line, names.get(column, column), message)
        for line, column, message in _problems(values, scale, "line")
    ]
    _refuse(rows.path, problems)
    return _assemble((row for _, row in values), scale, rows.path)


def _values(texts: Mapping[str, str]) -> dict[str, Any]:
    # what the cells of one row mean; a cell that cannot be read stays text
    values: dict[str, Any] = {n: _value(n, text) for n, text in texts.items()}
    speeds, n_stretches = texts.get("speeds_deg_s", "NA"), values.get("n_stretches")
    if speeds in _MISSING and n_stretches != 1:
        values["speeds_deg_s"] = () if n_stretches == 0 else None
    else:
        cells = (cell.strip() for cell in speeds.split(";"))  # one a stretch
        values["speeds_deg_s"] = tuple(
            None if cell in _MISSING else _speed(cell) for cell in cells
        )
    return values


def _value(name: str, text: str) -> str | float | None:
    if name in _FLOATS:
        return math.nan if text in _MISSING else _speed(text)
    if not text or (text in _MISSING and name not in ("session", "repeat")):
        return None
    # more digits than any count has
    if name in _WHOLE and text.isascii() and text.isdigit() and len(text) < 19:
        return int(text)
    if name == "grip_lost" and text in YES_NO:
        return text == YES_NO[True]
    return text


def _speed(text: str) -> float | str:
    try:
        speed = float(text)
    except ValueError:
        return text
    return speed if 0 <= speed < math.inf else text


@dataclass(frozen=True, slots=True, kw_only=True)
class InPersonRow:
    """One rater's grade of one patient and of the model made of the patient.

    Attributes
    ----------
    line : int
        Line of the file.
    source_table : str
        Where the row is printed.
    rater, subject, model : str
        Who graded whom, and the haptic model made of the patient.
    in_person_grade, haptic_grade : str or None
        The grades; None is missing.
    note : str
        A remark.
    """

    line: int
    source_table: str
    rater: str
    subject: str
    model: str
    in_person_grade: str | None
    haptic_grade: str | None
    note: str


_IN_PERSON_COLUMNS = tuple(field.name for field in fields(InPersonRow))[1:]


@dataclass(frozen=True, slots=True, kw_only=True)
class InPerson:
    """A table of in-person grades.

    Attributes
    ----------
    rows : tuple of InPersonRow
        Its rows, in the order of the file.
    source_path : Path
        The file.
    """

    rows: tuple[InPersonRow, ...]
    source_path: Path


def read_in_person(path: Path | str) -> InPerson:
    """Read a table of in-person grades.

    Parameters
    ----------
    path : Path or str
        CSV with the columns source_table, rater, subject, model, in_person_grade,
        haptic_grade, note; others are left aside. An empty cell or NA is a missing
        grade.

    Returns
    -------
    InPerson
        The table, everything text.

    Raises
    ------
    RatingsError
        If a column is missing, a row lacks source table, rater, subject or model,
        or is there twice. The message lists up to 20 problems.
    """
    rows = _read_rows(Path(path))
    _check_columns(rows, _IN_PERSON_COLUMNS)
    problems: list[_Problem] = []
    seen: dict[tuple[str, str, str], int] = {}
    graded = []
    for line, cell in rows.rows:
        table, rater, subject = cell["source_table"], cell["rater"], cell["subject"]
        problems += [
            (line, name, "needed text, got none")
            for name in ("source_table", "rater", "subject", "model")
            if cell[name] in _MISSING
        ]
        first = seen.setdefault((table, rater, subject), line)
        if first != line:
            message = (
                f"needed one row of {subject!r} by {rater!r} in {table!r}, line "
                f"{first} has one already"
            )
            problems.append((line, None, message))
        grades: dict[str, Any] = {
            name: None if cell[name] in _MISSING else cell[name]
            for name in ("in_person_grade", "haptic_grade")
        }
        values = {name: cell[name] for name in _IN_PERSON_COLUMNS} | grades
        graded.append(InPersonRow(line=line, **values))
    _refuse(rows.path, problems)
    return InPerson(rows=tuple(graded), source_path=rows.path)


def _check_columns(rows: _CsvRows, needed: Sequence[str]) -> None:
    message = f"needed the columns {listed(needed)}, got {listed(rows.header)}"
    is_lacking = not {*needed} <= {*rows.header}
    _refuse(rows.path, [(rows.header_line, None, message)] * is_lacking)


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
    check_format(path, csv_format(text), newest=_FORMAT, error=RatingsError)
    records = _records(path, text)
    if not records:
        raise RatingsError(f"{path}: needed a header and rows, the file has none")
    (header_line, header), *others = records
    _check_header(path, header_line, header)
    n = len(header)
    problems: list[_Problem] = [
        (line, None, f"needed {n} cells, got {len(cells)}: {cells}")
        for line, cells in others
        if len(cells) != n
    ]
    _refuse(path, problems)
    return _CsvRows(
        path=path,
        header=header,
        header_line=header_line,
        rows=[(line, dict(zip(header, cells, strict=True))) for line, cells in others],
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
    problems: list[_Problem] = []
    if len(header) == 1:
        message = f"needed columns separated by commas, got one, {header[0]!r}"
        problems.append((line, None, message))
    for place, (name, is_again) in enumerate(
        zip(header, repeated(header), strict=True)
    ):
        if not name:
            problems.append((line, None, f"column {place + 1} needs a name, got none"))
        elif is_again:
            message = "needed different names, this one is there twice"
            problems.append((line, name, message))
    _refuse(path, problems)


def _refuse(path: Path, problems: Sequence[_Problem]) -> None:
    # what is wrong with a file by line, if anything is, the first 20 of it
    texts = []
    for line, column, message in sorted(problems, key=lambda problem: problem[0]):
        where = f"line {line}" + ("" if column is None else f", column {column!r}")
        texts.append(f"{path}: {where}: {message}")
    more = len(texts) - _MAX_PROBLEMS
    if more > 0:
        texts = [*texts[:_MAX_PROBLEMS], f"{path}: and {more} more"]
    if texts:
        raise RatingsError("\n".join(texts))

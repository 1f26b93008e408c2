"""Files of ratings: reading any as text, writing one, and grades given in person."""

import csv
import hashlib
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from masrel.errors import ParameterError, RatingsError
from masrel.ratings._csv_rows import (
    MISSING,
    CsvRows,
    LongColumns,
    Problems,
    WideColumns,
    find_columns,
    read_rows,
)
from masrel.ratings.table import (
    DEFAULT_SESSION,
    RATING_COLUMNS,
    SOURCES,
    Ratings,
    _assemble,
)
from masrel.scales import MODIFIED_ASHWORTH, Scale

_LOOKS_MISSING = frozenset({"n/a", "na", "nan", "null", "none", ".", "-", "?"})


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


def read_ratings(
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
    rows = read_rows(Path(path))
    names = {"item": item, "rater": rater, "grade": grade, "session": session}
    columns = find_columns(rows, names)
    problems = Problems(rows.path)
    if isinstance(columns, LongColumns):
        cells = _long_cells(rows, columns, problems)
    else:
        cells = _wide_cells(rows, columns)
    _check_cells(cells, scale, problems)
    problems.raise_any()
    if scale is None:
        scale = _observed_scale(rows, cells)
    values = {n: [getattr(cell, n) for cell in cells] for n in RATING_COLUMNS}
    return _assemble(values, scale, rows.path)


def _long_cells(rows: CsvRows, columns: LongColumns, problems: Problems) -> list[_Cell]:
    extra = {
        name: rows.header.index(name)
        for name in ("repeat", "mean_speed_deg_s", "source")
        if name in rows.header
    }
    at = columns.session
    cells = []
    for row in rows.rows:
        texts = {name: row.cells[position] for name, position in extra.items()}
        grade = row.cells[columns.grade]
        speed = texts.get("mean_speed_deg_s", "")
        cells.append(
            _Cell(
                line=row.line,
                column=rows.header[columns.grade],
                session=DEFAULT_SESSION if at is None else row.cells[at],
                rater=row.cells[columns.rater],
                model=row.cells[columns.item],
                grade=None if grade in MISSING else grade,
                repeat=_repeat(texts.get("repeat", "1"), row.line, problems),
                mean_speed_deg_s=_speed(speed, row.line, problems),
                source=_source(texts.get("source", "foreign"), row.line, problems),
            )
        )
        for role in ("item", "rater"):
            position = getattr(columns, role)
            if row.cells[position] in MISSING:
                problems.add(row.line, rows.header[position], f"needed the {role}")
    return cells


def _wide_cells(rows: CsvRows, columns: WideColumns) -> list[_Cell]:
    at = columns.session
    return [
        _Cell(
            line=row.line,
            column=rows.header[position],
            session=DEFAULT_SESSION if at is None else row.cells[at],
            rater=rows.header[position],
            model=row.cells[columns.item],
            grade=None if row.cells[position] in MISSING else row.cells[position],
        )
        for row in rows.rows
        for position in columns.raters
    ]


def _repeat(text: str, line: int, problems: Problems) -> int:
    if text.isascii() and text.isdigit() and int(text) >= 1:
        return int(text)
    problems.add(line, "repeat", f"needed a whole number from 1, got {text!r}")
    return 1


def _speed(text: str, line: int, problems: Problems) -> float:
    if text in MISSING:
        return math.nan
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0 <= speed < math.inf:
        problems.add(
            line, "mean_speed_deg_s", f"needed a speed of 0 or more, got {text!r}"
        )
    return speed


def _source(text: str, line: int, problems: Problems) -> str:
    if text not in SOURCES:
        problems.add(
            line, "source", f"needed one of {', '.join(SOURCES)}, got {text!r}"
        )
    return text


def _check_cells(cells: list[_Cell], scale: Scale | None, problems: Problems) -> None:
    kind = "a grade" if scale is None else f"one of {', '.join(scale.grades)}"
    hint = "; name the categories if it is a grade" if scale is None else ""
    first_lines: dict[tuple[str, str, str, int], int] = {}
    for cell in cells:
        if not cell.model or not cell.session:
            problems.add(cell.line, None, "needed an item and a session, got none")
            continue
        key = (cell.session, cell.rater, cell.model, cell.repeat)
        first = first_lines.setdefault(key, cell.line)
        if first != cell.line:
            problems.add(
                cell.line,
                cell.column,
                f"needed one rating of {cell.model!r} by {cell.rater!r} in session "
                f"{cell.session!r}, line {first} has one already",
            )
        if cell.grade is None:
            continue
        looks_missing = cell.grade.casefold() in _LOOKS_MISSING
        if looks_missing if scale is None else cell.grade not in scale.grades:
            problems.add(
                cell.line,
                cell.column,
                f"needed {kind}, or an empty cell or NA when missing, "
                f"got {cell.grade!r}{hint}",
            )


def _observed_scale(rows: CsvRows, cells: list[_Cell]) -> Scale:
    grades = sorted({cell.grade for cell in cells if cell.grade is not None})
    if not grades:
        problems = Problems(rows.path)
        problems.add(rows.header_line, None, "needed at least one grade, got none")
        problems.raise_any()
    try:
        values = {grade: float(grade) for grade in grades}
    except ValueError:
        # No other scale has a grade 1+: its order is known, and its other grades.
        if "1+" in grades and set(grades) <= set(MODIFIED_ASHWORTH.grades):
            return MODIFIED_ASHWORTH
        return Scale(name="observed", grades=tuple(grades))
    return Scale(name="observed", grades=tuple(sorted(grades, key=values.__getitem__)))


def write_ratings(ratings: Ratings, path: Path) -> None:
    """Write a table of ratings; the same table gives the same bytes.

    Parameters
    ----------
    ratings : Ratings
        The table.
    path : Path
        The CSV file; its folder is made when missing.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    head = "# Ratings, one row a rating; grades are text; NA is missing.\n"
    if ratings.simulated:
        head = f"# SIMULATED: not grades of persons on hardware.\n{head}"
    path.write_text(head + _body(ratings), encoding="utf-8", newline="")


def ratings_hash(ratings: Ratings) -> str:
    """Return the SHA-256 of a table's rows and of its scale.

    Parameters
    ----------
    ratings : Ratings
        The table.

    Returns
    -------
    str
        In hexadecimal; where the table was read from does not matter.
    """
    scale = "\n".join((ratings.scale.name, *ratings.scale.grades))
    return hashlib.sha256(f"{scale}\n\n{_body(ratings)}".encode()).hexdigest()


def _body(ratings: Ratings) -> str:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(RATING_COLUMNS)
    columns = [ratings.table[name].tolist() for name in RATING_COLUMNS]
    for row in zip(*columns, strict=True):
        writer.writerow([_as_text(value) for value in row])
    return text.getvalue()


def _as_text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "NA"
    return repr(value) if isinstance(value, float) else str(value)


_IN_PERSON_COLUMNS = (
    "source_table",  # where the row is printed
    "rater",
    "subject",  # the patient
    "model",  # the haptic model made of the patient
    "in_person_grade",
    "haptic_grade",
    "note",
)


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
    rows = read_rows(Path(path))
    if not set(_IN_PERSON_COLUMNS) <= set(rows.header):
        raise RatingsError(
            f"{rows.path}: line {rows.header_line}: needed the columns "
            f"{', '.join(_IN_PERSON_COLUMNS)}, got {', '.join(rows.header)}"
        )
    problems = Problems(rows.path)
    seen: dict[tuple[str, str, str], int] = {}
    graded = []
    for row in rows.rows:
        cell = dict(zip(rows.header, row.cells, strict=True))
        for name in ("source_table", "rater", "subject", "model"):
            if cell[name] in MISSING:
                problems.add(row.line, name, "needed text, got none")
        key = (cell["source_table"], cell["rater"], cell["subject"])
        first = seen.setdefault(key, row.line)
        if first != row.line:
            problems.add(
                row.line,
                None,
                f"needed one row of {cell['subject']!r} by {cell['rater']!r} in "
                f"{cell['source_table']!r}, line {first} has one already",
            )
        graded.append(_in_person_row(row.line, cell))
    problems.raise_any()
    return InPerson(rows=tuple(graded), source_path=rows.path)


def _in_person_row(line: int, cell: dict[str, str]) -> InPersonRow:
    in_person, haptic = cell["in_person_grade"], cell["haptic_grade"]
    return InPersonRow(
        line=line,
        source_table=cell["source_table"],
        rater=cell["rater"],
        subject=cell["subject"],
        model=cell["model"],
        in_person_grade=None if in_person in MISSING else in_person,
        haptic_grade=None if haptic in MISSING else haptic,
        note=cell["note"],
    )

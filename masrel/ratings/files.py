"""Reading any CSV file of ratings as text."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from masrel.errors import ParameterError
from masrel.ratings.columns import Chosen, LongColumns, WideColumns, find_columns
from masrel.ratings.rows import MISSING, CsvRows, Problems, read_rows
from masrel.ratings.table import (
    DEFAULT_SESSION,
    SOURCES,
    Ratings,
    assemble,
)
from masrel.scales import MODIFIED_ASHWORTH, Scale

__all__ = ["read_ratings"]

_LOOKS_MISSING = frozenset({"n/a", "na", "nan", "null", "none", ".", "-", "?"})


@dataclass(frozen=True, slots=True, kw_only=True)
class _Cell:
    """One rating as it is in the file, with where it stands."""

    line: int
    column: str
    session: str
    rater: str
    model: str
    grade: str | None
    repeat: int = 1
    speed: float = math.nan
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
    chosen = Chosen(item=item, rater=rater, grade=grade, session=session)
    columns = find_columns(rows, chosen)
    problems = Problems(rows.path)
    if isinstance(columns, LongColumns):
        cells = _long_cells(rows, columns, problems)
    else:
        cells = _wide_cells(rows, columns)
    _check(cells, scale, problems)
    problems.raise_any()
    if scale is None:
        scale = _observed_scale(rows, cells)
    return assemble([_as_row(cell) for cell in cells], scale, rows.path)


def _long_cells(rows: CsvRows, columns: LongColumns, problems: Problems) -> list[_Cell]:
    extra = {
        name: rows.header.index(name)
        for name in ("repeat", "mean_speed_deg_s", "source")
        if name in rows.header
    }
    cells = []
    for row in rows.rows:
        values = {name: row.cells[position] for name, position in extra.items()}
        session = _session(row.cells, columns.session)
        given = row.cells[columns.grade]
        cells.append(
            _Cell(
                line=row.line,
                column=rows.header[columns.grade],
                session=session,
                rater=row.cells[columns.rater],
                model=row.cells[columns.item],
                grade=None if given in MISSING else given,
                repeat=_repeat(values.get("repeat", "1"), row.line, problems),
                speed=_speed(values.get("mean_speed_deg_s", ""), row.line, problems),
                source=_source(values.get("source", "foreign"), row.line, problems),
            )
        )
        for what in ("item", "rater"):
            position = getattr(columns, what)
            if row.cells[position] in MISSING:
                problems.add(row.line, rows.header[position], f"needed the {what}")
    return cells


def _wide_cells(rows: CsvRows, columns: WideColumns) -> list[_Cell]:
    return [
        _Cell(
            line=row.line,
            column=rows.header[position],
            session=_session(row.cells, columns.session),
            rater=rows.header[position],
            model=row.cells[columns.item],
            grade=None if row.cells[position] in MISSING else row.cells[position],
        )
        for row in rows.rows
        for position in columns.raters
    ]


def _session(cells: tuple[str, ...], position: int | None) -> str:
    return DEFAULT_SESSION if position is None else cells[position]


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


def _check(cells: list[_Cell], scale: Scale | None, problems: Problems) -> None:
    seen: dict[tuple[str, str, str, int], int] = {}
    for cell in cells:
        if not cell.model or not cell.session:
            problems.add(cell.line, None, "needed an item and a session, got none")
            continue
        key = (cell.session, cell.rater, cell.model, cell.repeat)
        first = seen.setdefault(key, cell.line)
        if first != cell.line:
            problems.add(
                cell.line,
                cell.column,
                f"needed one rating of {cell.model!r} by {cell.rater!r} in session "
                f"{cell.session!r}, line {first} has one already",
            )
        _check_grade(cell, scale, problems)


def _check_grade(cell: _Cell, scale: Scale | None, problems: Problems) -> None:
    if cell.grade is None:
        return
    missing = "an empty cell or NA when missing"
    if scale is not None and cell.grade not in scale.grades:
        problems.add(
            cell.line,
            cell.column,
            f"needed one of {', '.join(scale.grades)}, or {missing}, "
            f"got {cell.grade!r}",
        )
    if scale is None and cell.grade.casefold() in _LOOKS_MISSING:
        problems.add(
            cell.line,
            cell.column,
            f"needed a grade, or {missing}, got {cell.grade!r}; name the categories "
            "if it is a grade",
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


def _as_row(cell: _Cell) -> dict[str, object]:
    return {
        "session": cell.session,
        "rater": cell.rater,
        "model": cell.model,
        "repeat": cell.repeat,
        "grade": cell.grade,
        "mean_speed_deg_s": cell.speed,
        "source": cell.source,
    }

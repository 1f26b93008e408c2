"""Grades raters gave patients in person, beside those of the models made of them."""

from dataclasses import dataclass
from pathlib import Path

from masrel.errors import RatingsError
from masrel.lab.ratings.study_file import _MISSING, _Problem, _read_rows, _refusal

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
    rows = _read_rows(Path(path))
    if not set(_IN_PERSON_COLUMNS) <= set(rows.header):
        raise RatingsError(
            f"{rows.path}: line {rows.header_line}: needed the columns "
            f"{', '.join(_IN_PERSON_COLUMNS)}, got {', '.join(rows.header)}"
        )
    problems: list[_Problem] = []
    seen: dict[tuple[str, str, str], int] = {}
    graded = []
    for row in rows.rows:
        cell = dict(zip(rows.header, row.cells, strict=True))
        for name in ("source_table", "rater", "subject", "model"):
            if cell[name] in _MISSING:
                problems.append((row.line, name, "needed text, got none"))
        key = (cell["source_table"], cell["rater"], cell["subject"])
        first = seen.setdefault(key, row.line)
        if first != row.line:
            message = (
                f"needed one row of {cell['subject']!r} by {cell['rater']!r} in "
                f"{cell['source_table']!r}, line {first} has one already"
            )
            problems.append((row.line, None, message))
        in_person, haptic = cell["in_person_grade"], cell["haptic_grade"]
        graded.append(
            InPersonRow(
                line=row.line,
                source_table=cell["source_table"],
                rater=cell["rater"],
                subject=cell["subject"],
                model=cell["model"],
                in_person_grade=None if in_person in _MISSING else in_person,
                haptic_grade=None if haptic in _MISSING else haptic,
                note=cell["note"],
            )
        )
    if problems:
        raise _refusal(rows.path, problems)
    return InPerson(rows=tuple(graded), source_path=rows.path)

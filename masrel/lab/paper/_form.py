"""What a sheet asks for, compared with what was typed."""

import csv
import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from masrel._input import not_utf8
from masrel.errors import ParameterError, RatingsError
from masrel.lab._study_files import (
    MAX_SMALL,
    check_format,
    csv_format,
    read_regular,
    sha256_of,
)
from masrel.lab.protocol import Protocol, Question
from masrel.lab.protocol._values import Answer, When, checked_answer, questions_of
from masrel.lab.run._state import NO_GRADE
from masrel.lab.schedule.presentation import Schedule

FIRST_COLUMNS = ("sheet", "position", "code", "grade")
"""Columns of every sheet that is typed in; those of questions follow."""

AFTERWARDS: tuple[When, ...] = ("session", "study")
"""What replaces a position in the rows of questions about these."""

Position = int | When
"""The position of a presentation, or what else a row is about."""


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionColumn:
    """A question of a sheet, and the column that its answers are typed into."""

    column: str
    questionnaire: str
    question: Question


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """A sheet as it is before anybody has written on it."""

    id: str
    rater: str
    session: str
    codes: tuple[str, ...]  # by position, from 1
    questions: Mapping[When, tuple[QuestionColumn, ...]]  # by what they are about

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of the sheet that is typed in."""
        asked_for = (each.column for part in self.questions.values() for each in part)
        return (*FIRST_COLUMNS, *asked_for)

    @property
    def afterwards(self) -> tuple[When, ...]:
        """What there are questions about besides presentations."""
        return tuple(when for when in AFTERWARDS if self.questions[when])

    @property
    def places(self) -> tuple[tuple[Position, str], ...]:
        """What each row is about, in order, with its code; empty where it has none."""
        of_codes = enumerate(self.codes, start=1)
        return (*of_codes, *((when, "") for when in self.afterwards))


def form_of(protocol: Protocol, schedule: Schedule) -> Form:
    """Return the sheet of a schedule; it names no model."""
    codes = tuple(shown.code for shown in schedule.presentations)
    # a rater is asked about the study on the sheet of the last session
    sessions = [each.id for each in protocol.sessions if schedule.rater in each.raters]
    is_last = schedule.session == sessions[-1]
    # The id is of blinded codes alone, so that it says nothing about the order of
    # models; letter and hyphen keep spreadsheets from taking it for a number.
    named = [schedule.study, schedule.rater, schedule.session, *codes]
    digest = sha256_of(json.dumps(named).encode()).upper()
    return Form(
        id=f"S{digest[:4]}-{digest[4:8]}",
        rater=schedule.rater,
        session=schedule.session,
        codes=codes,
        questions={
            "presentation": _columns_of(protocol, "presentation"),
            "session": _columns_of(protocol, "session"),
            "study": _columns_of(protocol, "study") if is_last else (),
        },
    )


def _columns_of(protocol: Protocol, when: When) -> tuple[QuestionColumn, ...]:
    return tuple(
        QuestionColumn(
            column=f"{questionnaire.id}.{question.id}",
            questionnaire=questionnaire.id,
            question=question,
        )
        for questionnaire, question in questions_of(protocol, when)
    )


_SEPARATORS = (",", ";", "\t")

_LONGEST_CELL = 10_000  # letters of an answer

# Byte order marks of what spreadsheets call Unicode text
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")

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
    """Return what was typed into a sheet; RatingsError if it is not such a file."""
    try:
        data = read_regular(path, most=MAX_SMALL)
    except OSError as error:
        reason = error.strerror or str(error)
        raise RatingsError(f"{path}: needed a sheet, got: {reason}") from error
    records = list(_records(path, _text(path, data)))
    # Below the version, and "sep=;", which some spreadsheets write and want first
    head = list(takewhile(_is_head, (record[0] for record in records)))
    start = len(head)
    for line in head:
        check_format(path, csv_format(line), newest=1, error=RatingsError)
    if len(records) <= start:
        raise RatingsError(
            f"{path}: needed the columns {', '.join(FIRST_COLUMNS[1:])}, got nothing"
        )
    columns = _columns(path, start + 1, records[start])
    return TypedSheet(
        path=path,
        sha256=sha256_of(data),
        columns=tuple(name for name in columns if name),
        rows=tuple(_rows(path, start, columns, records)),
    )


def has_answers(path: Path) -> bool:
    """Return whether something has been typed into a file, or it cannot be read."""
    blank = {"sheet", "position", "code"}
    try:
        rows = read_typed(path).rows
    except RatingsError:
        return True
    return any(
        cell for row in rows for key, cell in row.cells.items() if key not in blank
    )


def _is_head(cell: str) -> bool:
    return cell.startswith("#") or cell.casefold().startswith("sep=")


def _text(path: Path, data: bytes) -> str:
    if data.startswith(_WORKBOOKS):
        raise RatingsError(
            f'{path}: needed a CSV file, got a workbook: save the sheet as "CSV UTF-8"'
        )
    try:
        return data.decode("utf-16" if data.startswith(_UTF_16) else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise RatingsError(
            f'{path}: {not_utf8(error)}, in a spreadsheet as "CSV UTF-8"'
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


_MAX_PROBLEMS = 20

_DECIMAL_COMMA = re.compile(r"(\d{1,2}),(\d{1,2})")

Answers = tuple[tuple[QuestionColumn, Answer], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FilledRow:
    """A presentation as it is on a sheet, or what stands there about the session."""

    number: int  # row of the file
    place: Position
    code: str | None
    grade: str | None
    answers: Answers


def fill_form(
    sheet: TypedSheet, form: Form, grades: Sequence[str], others: Iterable[Form]
) -> tuple[FilledRow, ...]:
    """Return the rows of a sheet by position; RatingsError says all that is wrong.

    `others` are the sheets of the study's other raters and sessions.
    """
    _check_columns(sheet, form)
    _refuse_other_sheet(sheet, form, others)
    problems: list[str] = []
    filled: dict[Position, FilledRow] = {}
    for row in sheet.rows:
        where = f"{sheet.path}: row {row.number}"
        try:
            place = _place(row, form, where)
            if place in filled:
                raise ParameterError(
                    f"{where}: needed each presentation once, got that of row "
                    f"{filled[place].number} again"
                )
        except ParameterError as error:
            problems.append(str(error))
            continue
        filled[place] = _filled_row(row, place, form, grades, where, problems)
    problems += _absent(sheet, form, filled)
    if problems:
        more = len(problems) - _MAX_PROBLEMS
        listed = problems[:_MAX_PROBLEMS] + ([f"and {more} more"] if more > 0 else [])
        raise RatingsError("\n".join(listed))
    return tuple(filled[place] for place, _ in form.places)


def _check_columns(sheet: TypedSheet, form: Form) -> None:
    stray = [name for name in sheet.columns if name not in form.columns]
    absent = [
        each for each in form.columns[len(FIRST_COLUMNS) :] if each not in sheet.columns
    ]
    if stray or absent:
        got = f"{shortened(stray[0])} too" if stray else f"no {absent[0]}"
        needed = f"needed the columns {', '.join(form.columns)}"
        raise RatingsError(f"{sheet.path}: {needed}, got {got}")


def _refuse_other_sheet(sheet: TypedSheet, form: Form, others: Iterable[Form]) -> None:
    needed = f"the sheet of rater {form.rater} in session {form.session}"
    for row in sheet.rows:
        if row["sheet"] not in ("", form.id):
            owner = next((o for o in others if o.id == row["sheet"]), None)
            raise RatingsError(
                f"{sheet.path}: row {row.number}: needed {form.id}, {needed}, got "
                f"{shortened(row['sheet'])}, {_whose(owner)}"
            )
    codes = {row["code"].upper() for row in sheet.rows} - {""}
    if codes and not codes & set(form.codes):
        owner = next((o for o in others if codes <= set(o.codes)), None)
        raise RatingsError(f"{sheet.path}: needed {needed}, got {_whose(owner)}")


def _whose(form: Form | None) -> str:
    if form is None:
        return "a sheet of another study or of a schedule that was drawn again"
    return f"that of rater {form.rater} in session {form.session}"


def _place(row: TypedRow, form: Form, where: str) -> Position:
    """Return the position that a row is of, or what else it is about."""
    code, position = row["code"].upper(), row["position"].casefold()
    for place, its_code in form.places:
        if (position, code) == (str(place), its_code):
            return place
    if code in form.codes:
        raise ParameterError(
            f"{where}: position: needed {form.codes.index(code) + 1}, that of code "
            f"{code}, got {shortened(row['position'])!r}"
        )
    needed = "a code of the sheet"
    if position.isdecimal() and 1 <= int(position) <= len(form.codes):
        needed = f"{form.codes[int(position) - 1]} at position {int(position)}"
    raise ParameterError(
        f"{where}: code: needed {needed}, got {shortened(row['code'])!r}"
    )


def _filled_row(
    row: TypedRow,
    place: Position,
    form: Form,
    grades: Sequence[str],
    where: str,
    problems: list[str],
) -> FilledRow:
    grade, is_graded = row["grade"], isinstance(place, int)
    if is_graded and grade not in (*grades, NO_GRADE):
        problems.append(f"{where}: {_needed_grade(grades, grade)}")
    if not is_graded and grade:
        problems.append(
            f"{where}: grade: needed only in rows of presentations, got "
            f"{shortened(grade)!r}"
        )
    about: When = "presentation" if isinstance(place, int) else place
    for when, columns in form.questions.items():
        problems += [
            f"{where}: {column.column}: needed an empty cell in this row, got "
            f"{shortened(row[column.column])!r}"
            for column in columns
            if when != about and row[column.column]
        ]
    return FilledRow(
        number=row.number,
        place=place,
        code=form.codes[place - 1] if isinstance(place, int) else None,
        grade=None if grade in ("", NO_GRADE) else grade,
        answers=tuple(_answers(row, form.questions[about], where, problems)),
    )


def _needed_grade(grades: Sequence[str], got: str) -> str:
    return (
        f"grade: needed one of {', '.join(grades)}, or {NO_GRADE} if there is none, "
        f"got {repr(shortened(got)) if got else 'an empty cell'}"
    )


def off_scale(file: Path, grades: Sequence[str]) -> Iterator[str]:
    """Yield each grade off the scale on a sheet that may not be filled in yet."""
    try:
        rows = read_typed(file).rows
    except RatingsError as error:
        yield str(error)
        return
    for row in rows:
        if row["grade"] not in ("", *grades, NO_GRADE):
            yield f"{file}: row {row.number}: {_needed_grade(grades, row['grade'])}"


def _answers(
    row: TypedRow, columns: Sequence[QuestionColumn], where: str, problems: list[str]
) -> Iterator[tuple[QuestionColumn, Answer]]:
    for column in columns:
        question, text = column.question, row[column.column]
        if text == NO_GRADE and text not in question.choices:
            yield column, None  # was left out on paper, and nobody can be asked again
            continue
        if question.type == "visual-analogue":
            text = _DECIMAL_COMMA.sub(r"\1.\2", text)
        try:
            answer = checked_answer(question, text, where=f"{where}: {column.column}")
        except ParameterError as error:
            problems.append(f"{shortened(str(error), 400)} ({NO_GRADE}: was left out)")
            continue
        yield column, answer


def _absent(
    sheet: TypedSheet, form: Form, filled: dict[Position, FilledRow]
) -> Iterator[str]:
    absent = [
        f"position {position}, code {code}"
        for position, code in enumerate(form.codes, start=1)
        if position not in filled
    ]
    if absent:
        yield (
            f"{sheet.path}: needed a row for each of {len(form.codes)} presentations, "
            f"got none of {'; '.join(absent)}: its grade is {NO_GRADE} if there is "
            "none"
        )
    for when in form.afterwards:
        if when not in filled:
            yield (
                f"{sheet.path}: needed a row with {when!r} in the column position, got "
                "none"
            )

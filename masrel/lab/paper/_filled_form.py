"""What was written on a sheet, held against what the sheet asks for."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from masrel.errors import ParameterError, RatingsError
from masrel.lab.paper._differences import NO_GRADE
from masrel.lab.paper._form import FIRST_COLUMNS, Form, QuestionColumn
from masrel.lab.paper._typed import TypedRow, TypedSheet, read_typed, shortened
from masrel.lab.protocol._questions import Answer, When, checked_answer

_MAX_PROBLEMS = 20

_DECIMAL_COMMA = re.compile(r"(\d{1,2}),(\d{1,2})")

Position = int | When
"""The position of a presentation, or what else a row is about."""

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
    order: list[Position] = [*range(1, len(form.codes) + 1), *form.afterwards]
    return tuple(filled[place] for place in order)


def _check_columns(sheet: TypedSheet, form: Form) -> None:
    for column in sheet.columns:
        if column not in form.columns:
            raise RatingsError(
                f"{sheet.path}: needed the columns {', '.join(form.columns)}, got "
                f"{shortened(column)} too"
            )
    for column in form.columns[len(FIRST_COLUMNS) :]:
        if column not in sheet.columns:
            raise RatingsError(
                f"{sheet.path}: needed the columns {', '.join(form.columns)}, got no "
                f"{column}"
            )


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
        return "a sheet of another study or of a schedule that was drawn anew"
    return f"that of rater {form.rater} in session {form.session}"


def _place(row: TypedRow, form: Form, where: str) -> Position:
    """Return the position that a row is of, or what else it is about."""
    code, position = row["code"].upper(), row["position"].casefold()
    for when in form.afterwards:
        if position == when and not code:
            return when
    if code in form.codes:
        place = form.codes.index(code) + 1
        if position == str(place):
            return place
        raise ParameterError(
            f"{where}: position: needed {place}, that of code {code}, got "
            f"{shortened(row['position'])!r}"
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
            f"{where}: grade: needed of presentations, got {shortened(grade)!r}"
        )
    about: When = "presentation" if isinstance(place, int) else place
    for when, columns in form.questions.items():
        for column in columns if when != about else ():
            if row[column.column]:
                problems.append(
                    f"{where}: {column.column}: needed an empty cell in this row, got "
                    f"{shortened(row[column.column])!r}"
                )
    return FilledRow(
        number=row.number,
        place=place,
        code=form.codes[place - 1] if isinstance(place, int) else None,
        grade=None if grade in ("", NO_GRADE) else grade,
        answers=tuple(_answers(row, form.questions[about], where, problems)),
    )


def _needed_grade(grades: Sequence[str], got: str) -> str:
    return (
        f"grade: needed one of {', '.join(grades)}, or {NO_GRADE} where there is none, "
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
            f"got none of {'; '.join(absent)}: its grade is {NO_GRADE} where there is "
            "none"
        )
    for when in form.afterwards:
        if when not in filled:
            yield (
                f"{sheet.path}: needed a row with {when!r} in the column position, got "
                "none"
            )

"""What differs between the two entries of a sheet, by the session's log."""

from collections.abc import Iterator
from dataclasses import dataclass

from masrel.run._state import SessionState

GRADE = "grade"
"""The column of grades."""

NO_GRADE = "NA"
"""What is typed where a presentation has no grade."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetDifference:
    """A cell in which the second entry of a sheet differs from the log.

    Attributes
    ----------
    code : str or None
        Of the presentation; None for a question about the session.
    column : str
        ``"grade"``, or the column of a question.
    first, second : str
        What the log has and what the second file has; "NA" where that is nothing.
    file : str
        Name of the second file.
    row : int
        Its row.
    who : str
        Who typed it.
    """

    code: str | None
    column: str
    first: str
    second: str
    file: str
    row: int
    who: str


def sheet_differences(state: SessionState) -> tuple[SheetDifference, ...]:
    """Return in what the last second entry of a sheet differs from the log."""
    return tuple(sorted(_differences(state), key=lambda each: each.row))


def _differences(state: SessionState) -> Iterator[SheetDifference]:
    first: dict[tuple[str | None, str], object] = {
        (code, GRADE): grade for code, grade in state.grades.items()
    }
    for (questionnaire, question, code), answer in state.answers.items():
        first[code, f"{questionnaire}.{question}"] = answer
    for (code, column), event in state.reentered.items():
        fields, before = event.fields, first.get((code, column))
        if before != fields["value"]:
            yield SheetDifference(
                code=code,
                column=column,
                first=_shown(before),
                second=_shown(fields["value"]),
                file=str(fields["file"]),
                row=int(str(fields["row"])),
                who=str(fields["who"]),
            )


def _shown(value: object) -> str:
    return NO_GRADE if value is None else str(value)

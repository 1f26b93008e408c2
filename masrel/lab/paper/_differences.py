"""What differs between the two entries of a sheet, by the session's log."""

from collections.abc import Mapping
from dataclasses import dataclass

from masrel.lab.protocol._values import Answer
from masrel.lab.run._state import SessionState

StudyAnswers = Mapping[tuple[str, str], Answer]
"""What a rater answered about the study, by questionnaire and question."""

NO_GRADE = "NA"
"""What is typed where a presentation has no grade."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetDifference:
    """A cell in which the second entry of a sheet differs from the log.

    Attributes
    ----------
    code : str or None
        Of the presentation; None for a question about the session or the study.
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


def sheet_differences(
    state: SessionState, of_study: StudyAnswers
) -> tuple[SheetDifference, ...]:
    """Return in what the last second entry of a sheet differs from the logs."""
    first: dict[tuple[str | None, str], object] = {
        (code, "grade"): grade for code, grade in state.grades.items()
    }
    for (questionnaire, question), answer in of_study.items():
        first[None, f"{questionnaire}.{question}"] = answer
    for (questionnaire, question, code), answer in state.answers.items():
        first[code, f"{questionnaire}.{question}"] = answer
    differences = [
        SheetDifference(
            code=code,
            column=column,
            first=_shown(first.get((code, column))),
            second=_shown(event.fields["value"]),
            file=str(event.fields["file"]),
            row=int(str(event.fields["row"])),
            who=str(event.fields["who"]),
        )
        for (code, column), event in state.reentered.items()
        if event.fields["value"] != first.get((code, column))
    ]
    return tuple(sorted(differences, key=lambda each: each.row))


def _shown(value: object) -> str:
    return NO_GRADE if value is None else str(value)

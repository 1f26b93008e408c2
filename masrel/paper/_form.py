"""What is asked on a rater's sheet of one session, and what the sheet is called."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass

from masrel.protocol import Protocol, Question, Questionnaire
from masrel.schedule import Schedule

FIRST_COLUMNS = ("sheet", "position", "code", "grade")
"""Columns of every sheet that is typed in; those of questions follow."""

OF_SESSION = "session"
"""What stands for a position in the row of what is asked after the session."""

NO_GRADE = "NA"
"""What is typed where a presentation has no grade."""


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
    of_presentation: tuple[QuestionColumn, ...]
    of_session: tuple[QuestionColumn, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of the sheet that is typed in."""
        questions = (*self.of_presentation, *self.of_session)
        return (*FIRST_COLUMNS, *(each.column for each in questions))


def form_of(protocol: Protocol, schedule: Schedule) -> Form:
    """Return the sheet of a schedule; it names no model."""
    codes = tuple(shown.code for shown in schedule.presentations)
    return Form(
        id=_id_of(schedule.study, schedule.rater, schedule.session, codes),
        rater=schedule.rater,
        session=schedule.session,
        codes=codes,
        of_presentation=_columns_of(questionnaires_at(protocol, "presentation")),
        of_session=_columns_of(questionnaires_at(protocol, "session")),
    )


def questionnaires_at(protocol: Protocol, when: str) -> tuple[Questionnaire, ...]:
    """Return the questionnaires that come after a presentation, or a session."""
    return tuple(each for each in protocol.questionnaires if each.when == when)


def _columns_of(questionnaires: Sequence[Questionnaire]) -> tuple[QuestionColumn, ...]:
    return tuple(
        QuestionColumn(
            column=f"{questionnaire.id}.{question.id}",
            questionnaire=questionnaire.id,
            question=question,
        )
        for questionnaire in questionnaires
        for question in questionnaire.questions
    )


def _id_of(study: str, rater: str, session: str, codes: Sequence[str]) -> str:
    # Of blinded codes alone, so that it says nothing about the order of models; the
    # letter and the hyphen keep spreadsheets from taking it for a number.
    content = json.dumps([study, rater, session, *codes]).encode()
    digest = hashlib.sha256(content).hexdigest().upper()
    return f"S{digest[:4]}-{digest[4:8]}"

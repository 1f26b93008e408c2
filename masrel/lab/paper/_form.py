"""What is asked on a rater's sheet of one session, and what the sheet is called."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from masrel.lab.protocol import Protocol, Question
from masrel.lab.protocol._questions import When, questions_of
from masrel.lab.schedule import Schedule

FIRST_COLUMNS = ("sheet", "position", "code", "grade")
"""Columns of every sheet that is typed in; those of questions follow."""

AFTERWARDS: tuple[When, ...] = ("session", "study")
"""What stands for a position in the rows of what is asked about these."""


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


def form_of(protocol: Protocol, schedule: Schedule) -> Form:
    """Return the sheet of a schedule; it names no model."""
    codes = tuple(shown.code for shown in schedule.presentations)
    # a rater is asked about the study on the sheet of the last session
    is_last = (
        schedule.session
        == [
            session.id
            for session in protocol.sessions
            if schedule.rater in session.raters
        ][-1]
    )
    return Form(
        id=_id_of(schedule.study, schedule.rater, schedule.session, codes),
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


def _id_of(study: str, rater: str, session: str, codes: Sequence[str]) -> str:
    # Of blinded codes alone, so that it says nothing about the order of models; the
    # letter and the hyphen keep spreadsheets from taking it for a number.
    content = json.dumps([study, rater, session, *codes]).encode()
    digest = hashlib.sha256(content).hexdigest().upper()
    return f"S{digest[:4]}-{digest[4:8]}"

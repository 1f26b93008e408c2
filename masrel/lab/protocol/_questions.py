"""What is asked when, and what answers a question."""

import math

from masrel.errors import ParameterError
from masrel.lab.protocol.definition import Protocol, Question, Questionnaire, _When

When = _When

_LONGEST = 10_000  # letters of an answer

Answer = str | int | float | None
"""What can stand in a log as an answer; None for none."""


def questions_of(
    protocol: Protocol, when: When
) -> list[tuple[Questionnaire, Question]]:
    """Return the questions that are asked then, in order."""
    return [
        (questionnaire, question)
        for questionnaire in protocol.questionnaires
        if questionnaire.when == when
        for question in questionnaire.questions
    ]


def checked_answer(question: Question, answer: Answer, *, where: str) -> Answer:
    """Return an answer as the log has it, also of a text; refuse any other.

    `where` begins the message: what is answered, of which file.
    """
    if isinstance(answer, str):
        answer = answer.strip()
    if answer in (None, ""):
        if question.required:
            raise ParameterError(f"{where}: needed {question.needed}, got none")
        return None
    if isinstance(answer, bool) or (value := _value(question, answer)) is None:
        raise ParameterError(f"{where}: needed {question.needed}, got {answer!r}")
    return value


def _value(question: Question, answer: str | float) -> str | int | float | None:
    # None where it does not answer the question
    if question.type == "text":
        return answer if isinstance(answer, str) and _can_be_kept(answer) else None
    if question.type == "choice":
        return answer if answer in question.choices else None
    try:
        number = float(answer)
    except (ValueError, OverflowError):  # a whole number beyond every float
        return None
    if question.range is None or not math.isfinite(number):
        return None
    low, high = question.range
    if not low <= number <= high:
        return None
    if number.is_integer():
        return int(number)
    return None if question.type == "whole" else number


def _can_be_kept(text: str) -> bool:
    # a lone surrogate, as a program may pass it, is in no file
    return len(text) <= _LONGEST and not any("\ud800" <= s <= "\udfff" for s in text)

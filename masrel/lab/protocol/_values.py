"""What answers a question, and what a field of a rater holds."""

import math
import re
from contextlib import suppress
from datetime import date, datetime

from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab.protocol._decode import got
from masrel.lab.protocol.definition import (
    Protocol,
    Question,
    Questionnaire,
    RaterField,
    _When,
)

When = _When

_LONGEST = 10_000  # letters of an answer
_SURROGATE = re.compile("[\ud800-\udfff]")

Answer = str | int | float | None
"""What a log can hold as an answer; None for no answer."""


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

    `where` begins the message: the question and its file.
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
        # a lone surrogate, as a program may pass it, is in no file
        can_be_kept = isinstance(answer, str) and len(answer) <= _LONGEST
        return answer if can_be_kept and not _SURROGATE.search(str(answer)) else None
    if question.type == "choice":
        return answer if answer in question.choices else None
    try:
        number = float(answer)
    except (ValueError, OverflowError):  # a whole number beyond every float
        return None
    low, high = question.range or (math.inf, -math.inf)
    if not low <= number <= high:  # nor is nan
        return None
    if number.is_integer():
        return int(number)
    return None if question.type == "whole" else number


FieldValue = str | int | float
"""What a field holds; a date is text, ``YYYY-MM-DD``."""

RESERVED = ("rater", "site", "status", "late")
"""Columns of ``raters.csv`` that are not fields."""

_LARGEST = 2**63  # whole numbers that the hash of a protocol can hold

_FORMS = {
    "text": "text that is not empty (in quotes)",
    "whole": "a whole number",
    "number": "a number",
    "date": "a date, YYYY-MM-DD",
}


def needed_of(field: RaterField) -> str:
    """Say what a value of a field is."""
    if field.type == "choice":
        return f"one of {listed(got(choice) for choice in field.choices)}"
    return _FORMS[field.type]


def field_value(field: RaterField, value: object) -> FieldValue | None:
    """Return a value as its field holds it, or None if it is of another type."""
    match field.type, value:
        case _, bool() | datetime():
            return None
        case "date", date():
            return value.isoformat()
        case "date", str():
            with suppress(ValueError):
                return value if date.fromisoformat(value).isoformat() == value else None
        case "whole", int(number) if abs(number) < _LARGEST:
            return number
        case "number", int(number) | float(number) if abs(number) < _LARGEST:
            return number  # not of nan
        case "text", str() if value.strip():
            return value
        case "choice", str() if value.strip() and value in field.choices:
            return value
    return None


def parsed_value(field: RaterField, text: str) -> FieldValue | None:
    """Return the value that a text means, or None if it means none."""
    kind = {"whole": int, "number": float}.get(field.type, str)
    try:
        return field_value(field, kind(text.strip()))
    except ValueError:
        return None


def field_heading(name: str, field: RaterField) -> str:
    """Return what a field is called in a table, unit included."""
    return (field.title or name) + (f" ({field.unit})" if field.unit else "")

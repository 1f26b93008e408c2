"""Questionnaires: their keys, the rules across these, and what answers a question."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

from msgspec import Meta

from masrel.errors import ParameterError
from masrel.lab.protocol._decode import got, with_id
from masrel.lab.protocol._keys import _Identifier, _Table, _Text

if TYPE_CHECKING:
    from masrel.lab.protocol.definition import Protocol

When = Literal["presentation", "session", "study"]
"""What questions are about, and so when they are asked."""

_Whole = Annotated[int, Meta(ge=-1_000_000, le=1_000_000)]

ANALOGUE_RANGE = (0, 100)
"""The ends of a visual analogue scale."""

_LONGEST = 10_000  # letters of an answer

Answer = str | int | float | None
"""What can stand in a log as an answer; None for none."""


class Question(_Table, frozen=True, kw_only=True):
    """``[[questionnaires.questions]]``: one question and what can answer it."""

    id: _Identifier
    text: _Text
    type: Literal["whole", "visual-analogue", "choice", "text"]
    low: _Whole | None = None
    high: _Whole | None = None
    low_label: str = ""
    high_label: str = ""
    choices: tuple[_Text, ...] = ()
    required: bool = True
    public: bool = False

    @property
    def range(self) -> tuple[int, int] | None:
        """The least and the largest answer; None where answers are no numbers."""
        if self.type == "visual-analogue":
            return ANALOGUE_RANGE
        if self.low is None or self.high is None:
            return None
        return self.low, self.high

    @property
    def needed(self) -> str:
        """What an answer is, in words."""
        if self.type == "text":
            return "text"
        if self.type == "choice":
            return f"one of {', '.join(self.choices)}"
        low, high = self.range or ANALOGUE_RANGE
        kind = "a whole number" if self.type == "whole" else "a number"
        return f"{kind}, {low} to {high}"


class Questionnaire(_Table, frozen=True, kw_only=True):
    """``[[questionnaires]]``: questions that are asked together."""

    id: _Identifier
    title: _Text
    when: When
    questions: Annotated[tuple[Question, ...], Meta(min_length=1)]


def questions_of(
    protocol: "Protocol", when: When
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
    low, high = question.range or ANALOGUE_RANGE
    if not math.isfinite(number) or not low <= number <= high:
        return None
    if number.is_integer():
        return int(number)
    return None if question.type == "whole" else number


def _can_be_kept(text: str) -> bool:
    # a lone surrogate, as a program may pass it, is in no file
    return len(text) <= _LONGEST and not any("\ud800" <= s <= "\udfff" for s in text)


def question_rules(values: dict[str, Any]) -> Iterator[str]:
    """Check that each question has the keys of its type, and its own id."""
    for index, questionnaire in enumerate(values.get("questionnaires") or []):
        ids: set[str] = set()
        for place, question in enumerate((questionnaire or {}).get("questions") or []):
            if question is None:
                continue
            where = f"questionnaires[{index}].questions[{place}]"
            name = question.get("id")
            if name is not None and name.casefold() in ids:
                yield (
                    f"{where}.id: needed ids that differ by more than case, got "
                    f"{got(name)} again"
                )
            ids.add((name or "").casefold())
            for problem in (*_range_rules(question), *_choice_rules(question)):
                yield f"{where}.{problem}{with_id(question)}"


def _range_rules(question: dict[str, Any]) -> Iterator[str]:
    kind, low, high = (question.get(key) for key in ("type", "low", "high"))
    if kind is None:
        return
    for key in ("low", "high"):
        if kind == "whole" and question.get(key, "unusable") is None:
            yield f"{key}: needed a whole number for type {got(kind)}, got none"
        elif kind != "whole" and question.get(key) is not None:
            yield (
                f'{key}: needed for type "whole" only, got {got(question[key])} for '
                f"type {got(kind)}"
            )
    if kind == "whole" and low is not None and high is not None and low >= high:
        yield f"low: needed less than high ({high}), got {low}"
    for key in ("low_label", "high_label"):
        if kind in ("choice", "text") and question.get(key):
            yield (
                f'{key}: needed for type "whole" or "visual-analogue" only, got it for '
                f"type {got(kind)}"
            )


def _choice_rules(question: dict[str, Any]) -> Iterator[str]:
    kind, choices = question.get("type"), question.get("choices")
    if kind is None or choices is None:
        return
    if kind != "choice":
        if choices:
            yield (
                f'choices: needed for type "choice" only, got them for type {got(kind)}'
            )
        return
    if len(choices) < 2:
        yield f"choices: needed at least 2 texts, got {got(choices)}"
    for place, choice in enumerate(choices):
        if choice is None:
            continue
        if choice in choices[:place]:
            yield (
                f"choices[{place}]: needed choices that differ, got {got(choice)} again"
            )
        if choice != choice.strip() or not choice.isprintable():
            yield (
                f"choices[{place}]: needed a choice without spaces around it or "
                f"control characters, got {got(choice)}"
            )

"""What answers a question is kept as its type; anything else is refused."""

from typing import Any

import pytest

from masrel.errors import ParameterError
from masrel.lab.protocol import Question
from masrel.lab.protocol._values import checked_answer


def question(**keys: Any) -> Question:
    return Question(id="x", text="X?", **keys)


@pytest.mark.parametrize(
    ("asked", "answer", "kept"),
    [
        (question(type="whole", low=1, high=10), " 7 ", 7),
        (question(type="whole", low=1, high=10), 10, 10),
        (question(type="visual-analogue"), "62.5", 62.5),
        (question(type="visual-analogue"), 63.0, 63),
        (question(type="choice", choices=("yes", "no")), "no", "no"),
        (question(type="text"), " it stuck ", "it stuck"),
        (question(type="text", required=False), " ", None),
    ],
)
def test_an_answer_is_kept_as_its_type(
    asked: Question, answer: str | float, kept: str | float
) -> None:
    got = checked_answer(asked, answer, where="x")
    assert got == kept
    assert type(got) is type(kept)


@pytest.mark.parametrize(
    ("asked", "answer", "needed"),
    [
        (question(type="whole", low=1, high=10), 11, "a whole number, 1 to 10"),
        (question(type="whole", low=1, high=10), 7.5, "a whole number, 1 to 10"),
        (question(type="whole", low=1, high=10), True, "a whole number, 1 to 10"),
        (question(type="whole", low=1, high=10), "nan", "a whole number, 1 to 10"),
        (question(type="visual-analogue"), -1, "a number, 0 to 100"),
        (question(type="choice", choices=("yes", "no")), "Yes", "one of yes, no"),
        (question(type="text"), "", "text"),
        (question(type="text"), "\ud800", "text"),
    ],
)
def test_what_answers_no_question_is_refused(
    asked: Question, answer: str | float, needed: str
) -> None:
    with pytest.raises(ParameterError, match=f"^a.csv, line 3: needed {needed}, got "):
        checked_answer(asked, answer, where="a.csv, line 3")

"""`[occasions]`, the order of sessions, questionnaires: each mistake a sentence."""

from pathlib import Path
from typing import Any

import pytest

from masrel.errors import ParameterError, ProtocolError
from masrel.lab.protocol import Question, read_protocol
from masrel.lab.protocol._questions import checked_answer
from tests.lab.protocol.documents import changed, write

WHOLE = {"id": "score", "text": "How real?", "type": "whole", "low": 1, "high": 10}


def asking(**keys: Any) -> list[dict[str, Any]]:
    """Questionnaires of one question, with these keys in place of a whole number's."""
    question = {key: v for key, v in (WHOLE | keys).items() if v is not None}
    return [{"id": "q", "title": "Q", "when": "session", "questions": [question]}]


def problem_of(document: dict[str, Any], folder: Path) -> str:
    path = write(document, folder)
    with pytest.raises(ProtocolError) as caught:
        read_protocol(path)
    (problem,) = caught.value.problems
    return problem.removeprefix(f"{path}: ")


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        (
            {"practice": ["HM1", "HM9"]},
            'practice[1]: needed a model of [[models]] (HM1, D1), got "HM9"',
        ),
        (
            {"break_after": 2},
            "break_after: needed fewer than the 2 presentations of a session, as no "
            "break comes after the last, got 2",
        ),
        (
            {"break_after": 0},
            "break_after: needed a whole number at least 1, got 0",
        ),
        (
            {"break_minutes": 3.0},
            "break_minutes: needed with occasions.break_after only, got 3",
        ),
        (
            {"resume": "never"},
            'resume: needed one of "always", "ask", "restart", "same-day", got "never"',
        ),
    ],
)
def test_what_is_wrong_with_occasions_is_said_once(
    tmp_path: Path, table: dict[str, object], problem: str
) -> None:
    document = changed("occasions", to=table)
    assert problem_of(document, tmp_path) == f"occasions.{problem}"


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        (
            {"after": "later"},
            "after: needed another session of [[sessions]] (test, retest), got "
            '"later" (id "retest")',
        ),
        (
            {"after": "retest"},
            "after: needed a session that does not come after this one, got "
            '"retest" (id "retest")',
        ),
        (
            {"after": "test", "at_least_days": 9, "at_most_days": 7},
            'at_least_days: needed at most at_most_days (7), got 9 (id "retest")',
        ),
        (
            {"at_least_days": 9},
            'at_least_days: needed with after only, got it alone (id "retest")',
        ),
    ],
)
def test_what_is_wrong_with_the_order_of_sessions_is_said_once(
    tmp_path: Path, keys: dict[str, object], problem: str
) -> None:
    document = changed("sessions", 1, "note", to="")
    document["sessions"][1] |= keys
    assert problem_of(document, tmp_path) == f"sessions[1].{problem}"


def test_sessions_that_come_after_each_other_are_all_refused(tmp_path: Path) -> None:
    document = changed("sessions", 1, "after", to="test")
    document["sessions"][0]["after"] = "retest"
    path = write(document, tmp_path)
    with pytest.raises(ProtocolError) as caught:
        read_protocol(path)
    assert len(caught.value.problems) == 2


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ({"low": 10, "high": 1}, "low: needed less than high (1), got 10"),
        ({"high": None}, 'high: needed a whole number for type "whole", got none'),
        (
            {"type": "text", "low": None},
            'high: needed for type "whole" only, got 10 for type "text"',
        ),
        (
            {"type": "choice", "low": None, "high": None},
            "choices: needed at least 2 texts, got an array of 0",
        ),
        (
            {"type": "choice", "low": None, "high": None, "choices": ["a", "a"]},
            'choices[1]: needed choices that differ, got "a" again',
        ),
        (
            {"choices": ["a", "b"]},
            'choices: needed for type "choice" only, got them for type "whole"',
        ),
        (
            {"type": "text", "low": None, "high": None, "low_label": "x"},
            'low_label: needed for type "whole" or "visual-analogue" only, got it for '
            'type "text"',
        ),
    ],
)
def test_what_is_wrong_with_a_question_is_said_once(
    tmp_path: Path, keys: dict[str, object], problem: str
) -> None:
    document = changed("questionnaires", to=asking(**keys))
    where = "questionnaires[0].questions[0]."
    assert problem_of(document, tmp_path).startswith(f"{where}{problem}")


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

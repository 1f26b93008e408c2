"""Each action of the coordinator's page leaves the events of its command."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import DeviceError
from masrel.lab.hess import EmergencyStop
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.run import GradeRequest, ScriptGrades, read_log, run_session
from masrel.lab.schedule import read_schedule
from tests.lab.serve.pages import (
    ACTIONS,
    EACH,
    OCCASIONS,
    SessionManager,
    Tablet,
    small_study,
    with_tablets,
)

QUESTIONS = f"""{EACH}
[[questionnaires]]
id = "all"
title = "The study"
when = "study"

[[questionnaires.questions]]
id = "years"
text = "How many years?"
type = "whole"
low = 0
high = 60
"""
ANSWERS = {"realism.score": 60, "each.sure": "yes", "all.years": 7}

Fields = dict[str, str]
Events = list[tuple[str, dict[str, Any]]]


class Stopped(ScriptGrades):
    """A script whose presentations are all ended by the emergency stop."""

    @contextmanager
    def listening(self, request: GradeRequest, stop: EmergencyStop) -> Iterator[None]:  # noqa: ARG002 - the interface's
        """Press the stop."""
        stop.press("test")
        yield


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> StudyPaths:
    """R1 has graded every model, R2 was stopped at the first, R3 joins now."""
    study = small_study(
        tmp_path_factory.mktemp("study") / "drawn",
        OCCASIONS.replace('practice = ["HM1"]', "") + QUESTIONS,
        ('scheme = "random-order"', 'scheme = "williams"'),
    )
    protocol = read_protocol(study.protocol)
    run_session(
        *(study, protocol, "R1", "test"),
        grades=ScriptGrades(["2"] * 4, answers=ANSWERS),
        clock="simulated",
    )
    with pytest.raises(DeviceError):
        run_session(
            *(study, protocol, "R2", "test"),
            grades=Stopped(["2"] * 4),
            clock="real",  # to no other is anybody listened
        )
    text = study.protocol.read_text()
    text = text.replace('raters = ["R1", "R2"]', 'raters = ["R1", "R2", "R3"]')
    study.protocol.write_text(f'{text}\n[[raters]]\nid = "R3"\n')
    return study


def copied(study: StudyPaths, root: Path) -> StudyPaths:
    return StudyPaths(shutil.copytree(study.root, root))


def events_of(study: StudyPaths) -> dict[str, Events]:
    """Every log of a study, without times."""
    return {
        log.name: [(event.kind, dict(event.fields)) for event in read_log(log)]
        for log in (*study.logs(), *study.conduct_logs())
    }


def by_the_page(study: StudyPaths, act: str, fields: Fields) -> str:
    """Do it at the page -> what the page says when it is refused."""
    said: list[str] = []

    async def run(_: SessionManager, page: Tablet) -> None:
        status, body = await page.post(act, **fields)
        assert status == (422 if "why" in body else 200), body
        said.append(body.get("why", ""))

    with_tablets(study, run, coordinated=True)
    return said[0].replace(str(study.root), "STUDY")


def by_the_verb(study: StudyPaths, verb: str, *words: str) -> str:
    """Do it at the command line -> what it says when it is refused."""
    result = CliRunner().invoke(cli, [*verb.split(), str(study.root), *words])
    if result.exit_code == 0:
        return ""
    return f"{result.exception}".replace(str(study.root), "STUDY")


# What is signed in the fields of the page, and in the words of the verb.
BY = {"who": "Kim", "why": "asked to"}
BY_KIM = ("--who", "Kim", "--why", "asked to")
OF_R1 = {"rater": "R1", "session": "test", **BY}
OF_VERB_R1 = ("--rater", "R1", "--session", "test", *BY_KIM)
OF_VERB_R2 = ("--rater", "R2", "--session", "test", *BY_KIM)

CASES: dict[str, tuple[str, Fields, tuple[str, ...]]] = {
    "adverse event": (
        "note",
        {
            **{"text": "wrist hurts", "who": "Kim", "kind": "adverse-event"},
            **{"severity": "mild", "rater": "R1", "session": "test"},
            **{"action": "a break", "outcome": ""},
        },
        (
            *("record adverse-event", "wrist hurts", "--who", "Kim"),
            *("--severity", "mild", "--rater", "R1", "--session", "test"),
            *("--action", "a break"),
        ),
    ),
    "note": (
        "note",
        {"text": "the window was open", "who": "Kim", "kind": "note", "rater": ""},
        ("record note", "the window was open", "--who", "Kim"),
    ),
    "withdraw": (
        "withdraw",
        {"rater": "R2", **BY},
        ("record withdraw", "--rater", "R2", *BY_KIM),
    ),
    "unblind": (
        "unblind",
        {"code": "GRADED", "rater": "R1", "session": "", **BY},
        ("record unblind", "GRADED", "--rater", "R1", *BY_KIM),
    ),
    "draw": ("draw", {}, ("schedule",)),
    "skip": (
        "skip",
        {"rater": "R2", "session": "test", "code": "FAULTED", **BY},
        ("record skip", *OF_VERB_R2, "--code", "FAULTED"),
    ),
    "correct": (
        "correct",
        {**OF_R1, "code": "GRADED", "grade": "1+"},
        ("record correct", *OF_VERB_R1, "--code", "GRADED", "--grade", "1+"),
    ),
    "correct to missing": (
        "correct",
        {**OF_R1, "code": "GRADED", "grade": "NA"},
        ("record correct", *OF_VERB_R1, "--code", "GRADED", "--grade", "NA"),
    ),
    "correct late": (
        "correct",
        {**OF_R1, "rater": "R2", "code": "FAULTED", "grade": "4"},
        (
            *("record correct", *OF_VERB_R2),
            *("--code", "FAULTED", "--grade", "4"),
        ),
    ),
    "answer about a session": (
        "answer",
        {**OF_R1, "question": "realism.score", "answer": " 70.5 ", "code": ""},
        (
            "record answer",
            *OF_VERB_R1,
            "--question",
            "realism.score",
            "--answer",
            "70.5",
        ),
    ),
    "answer about a model": (
        "answer",
        {**OF_R1, "question": "each.sure", "answer": "no", "code": "GRADED"},
        (
            "record answer",
            *OF_VERB_R1,
            "--question",
            "each.sure",
            "--answer",
            "no",
            "--code",
            "GRADED",
        ),
    ),
    "no answer": (
        "answer",
        {**OF_R1, "question": "each.words", "answer": "", "code": "GRADED"},
        (
            "record answer",
            *OF_VERB_R1,
            "--question",
            "each.words",
            "--answer",
            "NA",
            "--code",
            "GRADED",
        ),
    ),
    "answer about the study": (
        "answer",
        {**OF_R1, "question": "all.years", "answer": "12"},
        ("record answer", *OF_VERB_R1, "--question", "all.years", "--answer", "12"),
    ),
}

REFUSED: dict[str, tuple[str, Fields, tuple[str, ...]]] = {
    "no rater": (
        "withdraw",
        {"rater": "R9", **BY},
        ("record withdraw", "--rater", "R9", *BY_KIM),
    ),
    "no code": (
        "unblind",
        {"code": "XX", **BY},
        ("record unblind", "XX", *BY_KIM),
    ),
    "no fault": (
        "skip",
        {**OF_R1, "code": "GRADED"},
        ("record skip", *OF_VERB_R1, "--code", "GRADED"),
    ),
    "no grade of the scale": (
        "correct",
        {**OF_R1, "code": "GRADED", "grade": "5"},
        ("record correct", *OF_VERB_R1, "--code", "GRADED", "--grade", "5"),
    ),
    "no presentation": (
        "correct",
        {**OF_R1, "code": "FAULTED", "grade": "4"},
        ("record correct", *OF_VERB_R1, "--code", "FAULTED", "--grade", "4"),
    ),
    "no number": (
        "answer",
        {**OF_R1, "question": "all.years", "answer": "many"},
        (
            *("record answer", *OF_VERB_R1),
            *("--question", "all.years", "--answer", "many"),
        ),
    ),
    "out of range": (
        "answer",
        {**OF_R1, "question": "all.years", "answer": "61"},
        ("record answer", *OF_VERB_R1, "--question", "all.years", "--answer", "61"),
    ),
    "no code of a question": (
        "answer",
        {**OF_R1, "question": "each.sure", "answer": "no"},
        ("record answer", *OF_VERB_R1, "--question", "each.sure", "--answer", "no"),
    ),
}


@pytest.mark.parametrize("case", [*CASES, *REFUSED])
def test_an_act_leaves_the_events_of_its_verb_or_is_refused_in_the_same_sentence(
    drawn: StudyPaths, tmp_path: Path, case: str
) -> None:
    act, fields, (verb, *words) = {**CASES, **REFUSED}[case]
    first = {
        name: read_schedule(drawn.schedule_file(rater, "test")).presentations[0].code
        for name, rater in (("GRADED", "R1"), ("FAULTED", "R2"))
    }
    at_page, at_verb = (copied(drawn, tmp_path / name) for name in ("page", "verb"))
    fields = {name: first.get(value, value) for name, value in fields.items()}
    of_page = by_the_page(at_page, act, fields)
    of_verb = by_the_verb(at_verb, verb, *(first.get(word, word) for word in words))
    # the command names its option where the page names the field
    assert of_page == of_verb.removeprefix("--")
    assert (of_page != "") is (case in REFUSED)
    assert events_of(at_page) == events_of(at_verb)
    assert (events_of(at_page) == events_of(drawn)) is (case in REFUSED)
    for copy in (at_page, at_verb):
        assert copy.schedule_file("R3", "test").exists() is (case == "draw")


def test_every_act_that_leaves_an_event_is_compared() -> None:
    assert {act for act, _, _ in CASES.values()} == {*ACTIONS, "correct"}

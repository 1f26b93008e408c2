"""The session manager: one session at a time, each answer once, and how it ends."""

import asyncio
import io
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import permutations
from pathlib import Path

import pytest

from masrel.errors import ParameterError, SessionStoppedError
from masrel.lab._event_log import read_log
from masrel.lab.protocol import StudyPaths, read_protocol, scale_of
from masrel.lab.ratings import answers_from_logs, ratings_from_logs
from masrel.lab.run.console import ConsoleGrades
from masrel.lab.run.session import run_session
from tests.lab.serve.pages import (
    EACH,
    OCCASIONS,
    AskOverError,
    Page,
    SessionManager,
    at,
    correction,
    kinds,
    logged,
    small_study,
)


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    """A small study with instructions, practice, a break and a questionnaire."""
    return small_study(tmp_path / "study", OCCASIONS)


def test_what_is_sent_again_is_entered_once_and_another_answer_is_told(
    study: StudyPaths,
) -> None:
    # by a page that never saw the answer, while the session runs and when it is over
    async def act(manager: SessionManager) -> None:
        page = Page(manager)
        await manager.start("R1", "test")
        ask = (await page.until("grade"))["ask"]
        both = [manager.answer(ask, {"grade": "1"}) for _ in range(2)]
        other = manager.answer(ask, {"grade": "3"})
        results = await asyncio.gather(*both, other, return_exceptions=True)
        assert results[:2] == [None, None]
        assert isinstance(results[2], AskOverError)
        await manager.answer(ask, {"grade": "1"})  # of a tablet that was offline
        await page.until("break")
        code = logged(study, "grade")[-1]["code"]
        for wrong, grade, match in (
            ("999", "2", "needed a code that was graded"),
            (code, "7", "needed one of 0, 1"),
        ):
            with pytest.raises(ParameterError, match=match):
                await manager.correct("R1", "test", **correction(wrong, grade))
        again = {**correction(code, "2"), "rehearsal": True}
        with pytest.raises(ParameterError, match="rehearsal"):
            await manager.correct("R1", "test", **again)
        for grade in ("3", "3", "1", "3"):
            await manager.correct("R1", "test", **correction(code, grade))
        await manager.leave()
        await manager.correct("R1", "test", **correction(code, "3"))

    at(study, act)
    assert kinds(study).count("practice-grade") == 1
    assert [each["grade"] for each in logged(study, "correction")] == ["3", "1", "3"]


def test_a_session_that_is_left_or_stopped_between_presentations_goes_on_where_it_was(
    study: StudyPaths,
) -> None:
    async def act(manager: SessionManager) -> None:
        page = Page(manager)
        await manager.start("R1", "test")
        state = await page.until("grade")
        left = asyncio.create_task(manager.leave())
        await asyncio.sleep(0)
        with pytest.raises(AskOverError, match="was stopped on request"):
            await manager.answer(state["ask"], {"grade": "2"})
        await left
        assert "practice-grade" not in kinds(study)
        await manager.start("R1", "test")
        state = await page.until("grade")
        # what was tapped before the session is left counts
        tap = asyncio.create_task(manager.answer(state["ask"], {"grade": "2"}))
        await asyncio.sleep(0)
        await manager.leave()
        await tap
        assert manager.state()["how"] == "stopped"
        assert kinds(study)[-2:] == ["practice-grade", "stopped"]
        await manager.start("R1", "test")
        await page.until("ready")
        manager.stop("coordinator's page")
        while (over := manager.state())["screen"] != "over":
            await manager.changed(manager.version)
        assert over["how"] == "stopped"
        assert "by an emergency stop (coordinator's page)" in over["text"]
        await manager.start("R1", "test")
        assert (await page.until("over"))["how"] == "complete"

    at(study, act)
    assert kinds(study).count("grade") == kinds(study).count("presented") == 4


def test_one_session_runs_at_a_time_and_no_unknown_one(study: StudyPaths) -> None:
    async def act(manager: SessionManager) -> None:
        for rater, session in (("R9", "test"), ("R1", "retest")):
            with pytest.raises(ParameterError, match="needed one of"):
                await manager.start(rater, session)
        both = (manager.start("R1", "test"), manager.start("R2", "test"))
        results = await asyncio.gather(*both, return_exceptions=True)
        assert [type(result) for result in results] == [type(None), ParameterError]
        with pytest.raises(ParameterError, match="needed no other session running"):
            await manager.start("R2", "test")

    at(study, act)
    assert not study.log_file("R2", "test").exists()


WHY = "wrong button"


@pytest.fixture
def every_occasion(tmp_path: Path) -> StudyPaths:
    """One with every occasion; the hand is too fast for the device in one."""
    return small_study(
        tmp_path / "drawn",
        OCCASIONS.replace("HM1", "HM3") + EACH,
        ("stretches = 1\n", "stretches = 2\n"),
        ("speed_limit_deg_s = 400.0", "speed_limit_deg_s = 120.0"),
    )


@dataclass
class Rater:
    """What a rater means to say, however it is said: each screen -> what."""

    graded: list[str] = field(default_factory=list)
    is_again: bool = False
    is_corrected: bool = False
    is_left: bool = False

    def corrects(self, code: str) -> str | None:
        """The code of a grade that is corrected before this presentation."""
        if self.is_corrected or not self.graded or code.startswith("P"):
            return None
        self.is_corrected = True
        return self.graded[-1]

    def grade(self, code: str) -> str | None:
        """The grade; None for again."""
        if not self.is_again:
            self.is_again = True
            return None
        if not code.startswith("P"):
            self.graded.append(code)
        return ("2", "1+", "3", "1", "4")[len(self.graded)]

    def leaves(self) -> bool:
        """Whether the session is left at a break."""
        is_first, self.is_left = not self.is_left, True
        return is_first


class Typist(io.StringIO):
    """A rater at the console, who reads what is asked and types what is meant."""

    def __init__(self, meant: Callable[[str], str]) -> None:
        super().__init__()
        self._meant = meant

    def readline(self, _size: int = -1) -> str:  # type: ignore[override]
        shown = self.getvalue()
        self.seek(0)
        self.truncate()
        return f"{self._meant(shown)}\n"


def at_the_console(study: StudyPaths, rater: Rater) -> None:
    """Go on until the session is left, or over."""
    protocol = read_protocol(study.protocol)

    def meant(shown: str) -> str:
        if begins := re.search(r"code (\w+).*Enter to begin", shown):
            code = rater.corrects(begins[1])
            return "" if code is None else f"correct {code} 0 {WHY}"
        if asked := re.search(r"Grade of (\w+)", shown):
            grade = rater.grade(asked[1])
            return "again" if grade is None else f"{grade} 2"
        if "A break" in shown:
            return "stop" if rater.leaves() else ""
        typed = {"Present it": f"skip {WHY}", "How real?": "60", "Sure?": "yes"}
        return next((typed[words] for words in typed if words in shown), "")

    typist = Typist(meant)
    grades = ConsoleGrades(scale_of(protocol), answers=typist, questions=typist)
    with suppress(SessionStoppedError):
        run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")


def by_the_browser(study: StudyPaths, rater: Rater) -> None:
    """Go on until the session is left, or over."""
    answers = {"How real?": 60, "Sure?": "yes", "Why?": None}

    async def act(manager: SessionManager) -> None:
        page = Page(manager, fault={"skip": WHY})
        await manager.start("R1", "test")
        while (state := await page.until(*ASKED))["screen"] != "over":
            screen, code = state["screen"], state["code"]
            if screen == "break" and rater.leaves():
                await manager.leave()
                continue
            if screen == "ready" and (wrong := rater.corrects(code)):
                await manager.correct("R1", "test", **correction(wrong, "0"))
            elif screen == "grade":
                grade = rater.grade(code)
                given = {"again": True} if grade is None else {"grade": grade}
                page.answers["grade"] = {**given, "stretch": 2}
            elif screen == "question":
                page.answers["question"] = {"answer": answers[state["text"]]}
            await page.answer(state)

    at(study, act)


ASKED = ("ready", "grade", "break", "question", "over")


SOURCES = {"console": at_the_console, "browser": by_the_browser}


def graded(study: StudyPaths, *sources: str) -> list[tuple[str, dict[str, object]]]:
    # in a copy of the study, by one source until it is left, and then by the other
    copy = StudyPaths(study.root.with_name("-".join(sources)))
    shutil.copytree(study.root, copy.root)
    rater = Rater()
    for source in sources:
        SOURCES[source](copy, rater)
    log = read_log(copy.log_file("R1", "test"))
    assert tuple(e.fields["grades"] for e in log if "grades" in e.fields) == sources
    table = ratings_from_logs(copy, read_protocol(copy.protocol)).table
    by_position = table.sort_values("position")["grades_from"].tolist()
    assert by_position == [sources[0]] * 2 + [sources[1]] * 2  # left at a break
    answers = answers_from_logs(copy, read_protocol(copy.protocol))
    assert {each.grades_from for each in answers} == set(sources)
    return [  # all but times and source
        (
            event.kind,
            {key: event.fields[key] for key in event.fields if key != "grades"},
        )
        for event in log
    ]


@pytest.mark.slow
def test_events_are_equal_but_for_source_and_times(every_occasion: StudyPaths) -> None:
    console = graded(every_occasion, "console", "console")
    for sources in (("browser", "browser"), *permutations(SOURCES)):
        assert graded(every_occasion, *sources) == console, sources
    assert {kind for kind, _ in console} == {
        *("session", "instructed", "practised", "practice-grade", "presented", "grade"),
        *("fault", "skipped", "break", "answered", "correction", "stopped", "resumed"),
        "complete",
    }

"""A session by the browser leaves the events of one at the console, and the two go on
with one another's."""

import io
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import permutations
from pathlib import Path

import pytest

from masrel.errors import SessionStoppedError
from masrel.lab.protocol import StudyPaths, read_protocol, scale_of
from masrel.lab.ratings import answers_from_logs, ratings_from_logs
from masrel.lab.run import ConsoleGrades, read_log, run_session
from tests.lab.serve.pages import (
    EACH,
    OCCASIONS,
    Page,
    SessionManager,
    at,
    correction,
    small_study,
)

WHY = "wrong button"


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
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


def facts(study: StudyPaths) -> list[tuple[str, dict[str, object]]]:
    # all but times and source
    log = read_log(study.log_file("R1", "test"))
    return [
        (
            event.kind,
            {key: event.fields[key] for key in event.fields if key != "grades"},
        )
        for event in log
    ]


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
    return facts(copy)


@pytest.mark.slow
def test_events_are_equal_but_for_source_and_times(study: StudyPaths) -> None:
    console = graded(study, "console", "console")
    for sources in (("browser", "browser"), *permutations(SOURCES)):
        assert graded(study, *sources) == console, sources
    assert {kind for kind, _ in console} == {
        *("session", "instructed", "practised", "practice-grade", "presented", "grade"),
        *("fault", "skipped", "break", "answered", "correction", "stopped", "resumed"),
        "complete",
    }

"""The coordinator's page: sessions, long work, and no model is named too early."""

import asyncio
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import DeviceError
from masrel.lab._event_log import read_log
from masrel.lab.conduct import read_conduct
from masrel.lab.hess import EmergencyStop
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.recording import read_recording
from masrel.lab.run._grade_sources import GradeRequest
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from tests.lab.script import ScriptGrades
from tests.lab.serve.pages import (
    ACTIONS,
    EACH,
    OCCASIONS,
    SessionManager,
    Tablet,
    logged,
    processes_of,
    small_study,
    with_tablets,
)

BY = {"who": "Kim", "why": "asked to"}
R1 = {"rater": "R1", "session": "test"}


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    return small_study(tmp_path / "study", OCCASIONS)


def test_what_is_sent_twice_is_done_once(study: StudyPaths) -> None:
    async def run(_: SessionManager, page: Tablet) -> None:
        note = {"text": "late", "who": "Kim"}
        both = [page.done("note", id="0123456789ab", **note) for _ in range(2)]
        first, second = await asyncio.gather(*both)
        assert first == second == await page.done("note", id="0123456789ab", **note)
        await page.done("note", id="another-one", **note)
        # what was changed before it was sent again is another act
        await page.done("note", id="another-one", **note | {"text": "very late"})

    with_tablets(study, run, coordinated=True)
    texts = [event.fields["text"] for event in read_conduct(study)]
    assert texts == ["late", "late", "very late"]


REFUSED: list[tuple[str, dict[str, Any], str]] = [
    ("note", {"text": "x"}, "who: needed text, got none"),
    ("note", {"text": "x", "who": "K", "kind": "joke"}, "kind: needed one of"),
    ("note", {"text": "x", "who": "K", "kind": {}}, "kind: needed text, got {}"),
    ("start", {"rater": "R9", "session": "test"}, "rater: needed one of"),
    ("start", {"rater": 7, "session": "test"}, "rater: needed text, got 7"),
    ("skip", {**R1, "code": "1", **BY}, "no such"),
    ("job", {"verb": "demo"}, "job: needed one of ratings"),
    ("job", {"verb": "demo", "cancel": True}, "job: needed one of ratings"),
    ("tablet", {"rater": "R9"}, "rater: needed one of R1, R2"),
    ("answer", {**R1, "question": "a.b", **BY}, "question: needed one of"),
]


def test_what_cannot_be_is_one_sentence(study: StudyPaths) -> None:
    async def run(_: SessionManager, page: Tablet) -> None:
        for action, fields, why in REFUSED:
            status, body = await page.post(action, **fields)
            assert (status, why in body["why"]) == (422, True), body
            assert "\n" not in body["why"]

    before = study.conduct_file.read_bytes()
    with_tablets(study, run, coordinated=True)
    assert study.conduct_file.read_bytes() == before


def screens(events: list[tuple[str, Any]]) -> set[str]:
    """Which of a session the page was told."""
    return {data["screen"] for kind, data in events if kind == "desk"}


@pytest.mark.slow
def test_a_session_is_followed_and_no_model_is_named_before_unblinding(
    study: StudyPaths,
) -> None:
    pages: list[Tablet] = []

    async def run(_: SessionManager, page: Tablet, tablet: Tablet) -> None:
        pages.append(page)
        async with page.listening() as events:
            await page.done("start", **R1)
            for screen in ("instructions", "ready", "grade"):
                await tablet.until(screen)
                while screen not in screens(events):
                    await asyncio.sleep(0.01)
            await page.done("leave")
            await page.done("start", **R1)
            await tablet.until("break")
            code = (await tablet.until("ready"))["last"]["code"]
            await page.done("correct", **R1, code=code, grade="3", **BY)
            await tablet.until("over")
            await page.done("correct", **R1, code=code, grade="NA", **BY)
            while "over" not in screens(events):
                await asyncio.sleep(0.01)
        state = await page.state()
        assert state["overview"]["sessions"][0]["stage"] == "complete"
        kinds = {kind for kind, _ in events}
        assert {"desk", "overview", "log"} <= kinds
        page.sent.append("unblinded")
        shown = await page.done("unblind", code=code, rater="R1", **BY)
        schedule = read_schedule(study.schedule_file("R1", "test"))
        named = {p.code: p.model for p in schedule.presentations}[code]
        assert f"is {named}." in shown["text"]

    with_tablets(study, run, "R1", coordinated=True)
    sent = "\n".join(pages[0].sent).partition("unblinded")[0]
    for secret in (r"HM\d", "catch_angle", "residual", r"\.partial", r"\bseed\b"):
        assert not re.search(secret, sent), secret
    assert [each["grade"] for each in logged(study, "correction")] == ["3", None]


def test_the_live_view_is_the_recording_twenty_times_a_second(tmp_path: Path) -> None:
    study = small_study(tmp_path / "study", quick=True)
    frames: list[dict[str, Any]] = []

    async def run(_: SessionManager, page: Tablet, tablet: Tablet) -> None:
        async with page.listening() as events:
            await page.done("start", **R1)
            await tablet.answer(await tablet.until("ready"), begin=True)
            await tablet.until("grade")
            await asyncio.sleep(0.2)
            frames.extend(data for kind, data in events if kind == "live")

    with_tablets(study, run, "R1", clock="real", coordinated=True)
    assert frames.pop(0) == {"begins": True}
    (event,) = logged(study, "presented")
    columns = read_recording(study.sessions / str(event["recording"])).columns
    names = ("time_s", "angle_deg", "torque_nm", "phase")
    shown = {name: np.concatenate([f[name] for f in frames]) for name in names}
    rows = np.searchsorted(columns["time_s"], shown["time_s"] - 6e-4)
    assert np.abs(columns["angle_deg"][rows] - shown["angle_deg"]).max() < 0.5
    assert (np.diff(shown["time_s"]) >= 0.0).all()
    assert shown["time_s"][-1] > 0.9 * columns["time_s"][-1]
    # 25 a second; a busy machine stalls some of them, which the median leaves out
    moments = [frame["time_s"][0] for frame in frames]
    assert np.median(np.diff(moments)) <= 1 / 15


async def over(page: Tablet) -> dict[str, Any]:
    """Wait until all long work is over -> it."""
    async with asyncio.timeout(60.0):
        while True:
            jobs: dict[str, Any] = (await page.state())["jobs"]
            if all(job["status"] != "running" for job in jobs.values()):
                return jobs
            await asyncio.sleep(0.05)


def test_long_work_runs_once_at_a_time_and_can_be_stopped(study: StudyPaths) -> None:
    async def run(_: SessionManager, page: Tablet) -> None:
        # two screens at once, and one later
        await asyncio.gather(*(page.done("job", verb="report") for _ in range(2)))
        await page.done("job", verb="report")
        async with asyncio.timeout(30.0):  # a busy machine takes its time to begin it
            while not (started := commands_of(study)):
                await asyncio.sleep(0.01)
        assert len(started) == 1
        assert (await page.state())["jobs"]["report"]["status"] == "running"
        await page.done("job", verb="report", cancel=True)
        assert (await over(page))["report"]["status"] == "cancelled"

    with_tablets(study, run, coordinated=True)


def commands_of(study: StudyPaths) -> list[int]:
    """Processes of commands, without those that these have started."""
    return [
        process
        for process in processes_of(study, b"masrel")
        if f"PPid:\t{os.getpid()}\n" in Path(f"/proc/{process}/status").read_text()
    ]


def test_a_protocol_that_is_being_edited_leaves_the_page_its_stream(
    study: StudyPaths,
) -> None:
    async def run(manager: SessionManager, page: Tablet) -> None:
        async with page.listening() as events, asyncio.timeout(30.0):
            while "overview" not in dict(events):
                await asyncio.sleep(0.01)
            before = dict(events)["overview"]
            study.protocol.write_text("[study\n")
            manager.note_change()
            while dict(events)["overview"] == before:
                await asyncio.sleep(0.01)
            after = dict(events)["overview"]
        assert before["problem"] is None
        assert "protocol.toml" in after["problem"]
        assert after["sessions"] == before["sessions"]

    with_tablets(study, run, coordinated=True)


def test_files_of_the_report_alone_are_served(study: StudyPaths) -> None:
    folder = study.root / "report"
    folder.mkdir()
    (folder / "report.html").write_text("<p>the report</p>")
    (study.root / "secret.html").write_text("no part of it")
    (folder / "link.html").symlink_to(study.root / "secret.html")

    async def run(_: SessionManager, page: Tablet) -> None:
        assert "the report" in (await page.get("/report/report.html")).text
        others = ("link.html", "none.html", "../protocol.toml", "%2e%2e/protocol.toml")
        for path in others:
            assert (await page.get(f"/report/{path}")).status_code == 404

    with_tablets(study, run, coordinated=True)


def test_an_address_for_a_tablet_is_that_of_its_rater(study: StudyPaths) -> None:
    async def run(manager: SessionManager, page: Tablet, tablet: Tablet) -> None:
        made = await page.done("tablet", rater="R2")
        assert made["picture"].startswith("data:image/svg+xml")
        await manager.start("R1", "test")
        other = tablet.at(made["address"])
        await other.open()
        assert (await other.state())["screen"] == "other"
        assert (await tablet.until("ready"))["screen"] == "ready"

    with_tablets(study, run, "R1", coordinated=True)


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
BY_KIM = ("--who", "Kim", "--why", "asked to")
OF_R1 = {**R1, **BY}
OF_VERB_R1 = ("--rater", "R1", "--session", "test", *BY_KIM)
OF_VERB_R2 = ("--rater", "R2", "--session", "test", *BY_KIM)

CASES: dict[str, tuple[str, Fields, tuple[str, ...]]] = {
    "adverse event": (
        "note",
        {
            **{"text": "wrist hurts", "who": "Kim", "kind": "adverse-event"},
            **{"severity": "mild", "rater": "R1", "session": "test"},
            **{"action": "a break", "outcome": "", "relatedness": "possible"},
            **{"seriousness": "not serious", "onset": "2026-01-05"},
        },
        (
            *("record adverse-event", "wrist hurts", "--who", "Kim"),
            *("--severity", "mild", "--rater", "R1", "--session", "test"),
            *("--action", "a break", "--relatedness", "possible"),
            *("--seriousness", "not serious", "--onset", "2026-01-05"),
        ),
    ),
    "note": (
        "note",
        {"text": "the window was open", "who": "Kim", "kind": "note", "rater": ""},
        ("record note", "the window was open", "--who", "Kim"),
    ),
    "withdraw": (
        "withdraw",
        {"rater": "R2", "on": "2026-01-05", **BY},
        ("record withdraw", "--rater", "R2", "--on", "2026-01-05", *BY_KIM),
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
    "day": (
        "day",
        {**OF_R1, "on": "2026-01-05"},
        ("record day", *OF_VERB_R1, "--on", "2026-01-05"),
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

REFUSALS: dict[str, tuple[str, Fields, tuple[str, ...]]] = {
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
    "no day": (
        "day",
        {**OF_R1, "on": "5 May"},
        ("record day", *OF_VERB_R1, "--on", "5 May"),
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


@pytest.mark.parametrize("case", [*CASES, *REFUSALS])
def test_an_act_leaves_the_events_of_its_verb_or_is_refused_in_the_same_sentence(
    drawn: StudyPaths, tmp_path: Path, case: str
) -> None:
    act, fields, (verb, *words) = {**CASES, **REFUSALS}[case]
    first = {
        name: read_schedule(drawn.schedule_file(rater, "test")).presentations[0].code
        for name, rater in (("GRADED", "R1"), ("FAULTED", "R2"))
    }
    at_page, at_verb = (
        StudyPaths(shutil.copytree(drawn.root, tmp_path / name))
        for name in ("page", "verb")
    )
    fields = {name: first.get(value, value) for name, value in fields.items()}
    of_page = by_the_page(at_page, act, fields)
    of_verb = by_the_verb(at_verb, verb, *(first.get(word, word) for word in words))
    # the command names its option where the page names the field
    assert of_page == of_verb.removeprefix("--")
    assert (of_page != "") is (case in REFUSALS)
    assert events_of(at_page) == events_of(at_verb)
    assert (events_of(at_page) == events_of(drawn)) is (case in REFUSALS)
    for copy in (at_page, at_verb):
        assert copy.schedule_file("R3", "test").exists() is (case == "draw")


def test_every_act_that_leaves_an_event_is_compared() -> None:
    assert {act for act, _, _ in CASES.values()} == {*ACTIONS, "correct"}

"""The coordinator's page: each act is the verb's, and no model is named too early."""

import asyncio
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from masrel.lab.conduct import read_conduct
from masrel.lab.protocol import StudyPaths
from masrel.lab.recording import read_recording
from masrel.lab.run import read_log
from masrel.lab.schedule import read_schedule
from masrel.lab.serve._desk import Desk
from tests.lab.serve.desks import OCCASIONS, small_study
from tests.lab.serve.tablets import Tablet, with_tablets

BY = {"who": "Kim", "why": "asked to"}


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    return small_study(tmp_path / "study", OCCASIONS)


def codes(study: StudyPaths, rater: str = "R1") -> list[str]:
    schedule = read_schedule(study.schedule_file(rater, "test"))
    return [shown.code for shown in schedule.presentations]


def events_of(study: StudyPaths) -> list[tuple[str, dict[str, Any]]]:
    return [(event.kind, dict(event.fields)) for event in read_conduct(study)]


async def done(page: Tablet, act: str, **fields: Any) -> dict[str, Any]:
    status, body = await page.post(act, **fields)
    assert status == 200, body
    return body


def test_what_is_sent_twice_is_done_once(study: StudyPaths) -> None:
    async def run(_: Desk, page: Tablet) -> None:
        note = {"text": "late", "who": "Kim"}
        both = [done(page, "note", id="0123456789ab", **note) for _ in range(2)]
        first, second = await asyncio.gather(*both)
        assert first == second == await done(page, "note", id="0123456789ab", **note)
        await done(page, "note", id="another-one", **note)
        # what was changed before it was sent again is another act
        await done(page, "note", id="another-one", **note | {"text": "very late"})

    with_tablets(study, run, coordinated=True)
    texts = [fields["text"] for _, fields in events_of(study)]
    assert texts == ["late", "late", "very late"]


@pytest.mark.parametrize(
    ("act", "fields", "why"),
    [
        ("note", {"text": "x"}, "who: needed text, got none"),
        ("note", {"text": "x", "who": "K", "kind": "joke"}, "kind: needed one of"),
        ("note", {"text": "x", "who": "K", "kind": {}}, "kind: needed text, got {}"),
        ("start", {"rater": "R9", "session": "test"}, "rater: needed one of"),
        ("start", {"rater": 7, "session": "test"}, "rater: needed text, got 7"),
        ("withdraw", {"rater": "R9", **BY}, "rater: needed one of"),
        ("unblind", {"code": "XX", **BY}, "needed one of a drawn schedule"),
        ("skip", {"rater": "R1", "session": "test", "code": "1", **BY}, "no such"),
        ("job", {"verb": "demo"}, "job: needed one of ratings"),
        ("job", {"verb": "demo", "cancel": True}, "job: needed one of ratings"),
        ("tablet", {"rater": "R9"}, "rater: needed one of R1, R2"),
        (
            "answer",
            {"rater": "R1", "session": "test", "question": "a.b", **BY},
            "question: needed one of",
        ),
    ],
)
def test_what_cannot_be_is_one_sentence(
    study: StudyPaths, act: str, fields: dict[str, Any], why: str
) -> None:
    async def run(_: Desk, page: Tablet) -> None:
        status, body = await page.post(act, **fields)
        assert status == 422
        assert why in body["why"]
        assert "\n" not in body["why"]

    with_tablets(study, run, coordinated=True)
    assert not study.conduct_file.exists()


@pytest.mark.slow
def test_a_session_is_followed_and_no_model_is_named_before_unblinding(
    study: StudyPaths,
) -> None:
    pages: list[Tablet] = []

    async def run(_: Desk, page: Tablet, tablet: Tablet) -> None:
        pages.append(page)
        async with page.listening() as events:
            await done(page, "start", rater="R1", session="test")
            await tablet.until("ready")
            await done(page, "leave")
            await done(page, "start", rater="R1", session="test")
            while (await tablet.until("ready"))["last"] is None:
                state = await tablet.state()
                await tablet.answer(state, begin=True)
                await tablet.answer(await tablet.until("grade"), grade="2")
            code = (await tablet.state())["last"]["code"]
            where = {"rater": "R1", "session": "test"}
            await done(page, "correct", **where, code=code, grade="3", **BY)
            await tablet.until("over")
            await done(page, "correct", **where, code=code, grade="NA", **BY)
            question = {"question": "realism.score", "answer": "70"}
            await done(page, "answer", **where, **question, **BY)
        state = await page.state()
        assert state["overview"]["sessions"][0]["stage"] == "complete"
        kinds = {kind for kind, _ in events}
        assert {"desk", "overview", "log"} <= kinds
        screens = {data["screen"] for kind, data in events if kind == "desk"}
        assert {"instructions", "ready", "grade", "over"} <= screens
        page.sent.append("unblinded")
        shown = await done(page, "unblind", code=code, rater="R1", **BY)
        model = read_schedule(study.schedule_file("R1", "test"))
        named = {p.code: p.model for p in model.presentations}[code]
        assert f"is {named}." in shown["text"]

    with_tablets(study, run, "R1", coordinated=True)
    sent = "\n".join(pages[0].sent).partition("unblinded")[0]
    for secret in (r"HM\d", "catch_angle", "residual", r"\.partial", r"\bseed\b"):
        assert not re.search(secret, sent), secret
    log = read_log(study.log_file("R1", "test"))
    assert [e.fields["grade"] for e in log if e.kind == "correction"] == ["3", None]
    (answer,) = (e for e in log if e.kind == "answer-correction")
    assert answer.fields["answer"] == 70


def test_the_live_view_is_the_recording_twenty_times_a_second(tmp_path: Path) -> None:
    study = small_study(tmp_path / "study", quick=True)
    frames: list[dict[str, Any]] = []

    async def run(_: Desk, page: Tablet, tablet: Tablet) -> None:
        async with page.listening() as events:
            await done(page, "start", rater="R1", session="test")
            await tablet.answer(await tablet.until("ready"), begin=True)
            await tablet.until("grade")
            await asyncio.sleep(0.2)
            frames.extend(data for kind, data in events if kind == "live")

    with_tablets(study, run, "R1", clock="real", coordinated=True)
    assert frames[0] == {"begins": True}
    (event,) = (
        e for e in read_log(study.log_file("R1", "test")) if e.kind == "presented"
    )
    recording = read_recording(study.sessions / str(event.fields["recording"]))
    columns = recording.columns
    shown = {name: [] for name in ("time_s", "angle_deg", "torque_nm", "phase")}
    for frame in frames[1:]:
        for name, values in shown.items():
            values.extend(frame[name])
    rows = np.searchsorted(columns["time_s"], np.array(shown["time_s"]) - 6e-4)
    assert np.abs(columns["angle_deg"][rows] - shown["angle_deg"]).max() < 0.5
    assert (np.diff(shown["time_s"]) >= 0.0).all()
    lasted_s = columns["time_s"][-1]
    assert shown["time_s"][-1] > 0.9 * lasted_s
    # 25 a second; a busy machine stalls some of them, which the median leaves out
    moments = [frame["time_s"][0] for frame in frames[1:] if frame["time_s"]]
    assert np.median(np.diff(moments)) <= 1 / 15


@pytest.mark.slow
def test_long_work_is_the_verb_itself_and_its_report_is_served(
    study: StudyPaths,
) -> None:
    async def run(_: Desk, page: Tablet) -> None:
        for job in ("check", "verify"):
            await done(page, "job", verb=job)
        async with asyncio.timeout(60.0):
            while True:
                jobs = (await page.state())["jobs"]
                if all(job["status"] != "running" for job in jobs.values()):
                    break
                await asyncio.sleep(0.1)
        assert {name: job["status"] for name, job in jobs.items()} == {
            "check": "done",
            "verify": "done",
        }
        assert any("whole" in line for line in jobs["verify"]["lines"])

    with_tablets(study, run, coordinated=True)
    assert not (study.root / "report").exists()


def test_long_work_runs_once_at_a_time_and_can_be_stopped(study: StudyPaths) -> None:
    async def run(_: Desk, page: Tablet) -> None:
        await done(page, "job", verb="report")
        await done(page, "job", verb="report")  # runs already: no second one
        assert (await page.state())["jobs"]["report"]["status"] == "running"
        await done(page, "job", verb="report", cancel=True)
        async with asyncio.timeout(30.0):
            while (await page.state())["jobs"]["report"]["status"] == "running":
                await asyncio.sleep(0.05)
        assert (await page.state())["jobs"]["report"]["status"] == "cancelled"

    with_tablets(study, run, coordinated=True)


def test_two_screens_that_start_the_same_work_at_once_start_it_once(
    study: StudyPaths,
) -> None:
    async def run(_: Desk, page: Tablet) -> None:
        await asyncio.gather(*(done(page, "job", verb="report") for _ in range(2)))
        async with asyncio.timeout(30.0):  # a busy machine takes its time to begin it
            while not (verbs := _verbs_of(study)):
                await asyncio.sleep(0.01)
        assert len(verbs) == 1
        await done(page, "job", verb="report", cancel=True)

    with_tablets(study, run, coordinated=True)


def _verbs_of(study: StudyPaths) -> list[Path]:
    # processes that are a verb about this study, without those that draw for them
    name = str(study.root).encode()
    files = Path("/proc").glob("[0-9]*/cmdline")
    words = {file: _words(file) for file in files}
    verbs = [file for file in words if b"masrel" in words[file] and name in words[file]]
    return [file for file in verbs if _parent(file.parent) == os.getpid()]


def _parent(process: Path) -> int | None:
    try:
        return int((process / "stat").read_text().rpartition(")")[2].split()[1])
    except OSError:  # it ended meanwhile
        return None


def _words(file: Path) -> list[bytes]:
    try:
        return file.read_bytes().split(b"\0")
    except OSError:  # it ended meanwhile
        return []


def test_a_protocol_that_is_being_edited_leaves_the_page_its_stream(
    study: StudyPaths,
) -> None:
    async def run(desk: Desk, page: Tablet) -> None:
        async with page.listening() as events, asyncio.timeout(30.0):
            while "overview" not in dict(events):
                await asyncio.sleep(0.01)
            before = dict(events)["overview"]
            study.protocol.write_text("[study\n")
            desk.note_change()
            while dict(events)["overview"] == before:
                await asyncio.sleep(0.01)
            after = dict(events)["overview"]
        assert before["problem"] is None
        assert "protocol.toml" in after["problem"]
        assert after["sessions"] == before["sessions"]

    with_tablets(study, run, coordinated=True)


def test_the_log_of_a_rehearsal_is_shown_while_it_runs(study: StudyPaths) -> None:
    async def run(_: Desk, page: Tablet, tablet: Tablet) -> None:
        for is_rehearsal in (False, True):
            where = {"rater": "R1", "session": "test", "rehearsal": is_rehearsal}
            await done(page, "start", **where)
            await tablet.until("instructions")
            state = await page.state()
            assert [each["event"] for each in state["log"]] == ["session"]
            assert state["desk"]["session"]["rehearsal"] is is_rehearsal
            await tablet.until("ready")
            log = (await page.state())["log"]
            assert [each["event"] for each in log] == ["session", "instructed"]
            await done(page, "leave")
            assert (await page.state())["log"] == []

    with_tablets(study, run, "R1", coordinated=True)


def test_missing_schedules_are_drawn(study: StudyPaths) -> None:
    file = study.schedule_file("R2", "test")
    before = file.read_bytes()
    file.unlink()

    async def run(_: Desk, page: Tablet) -> None:
        sessions = (await page.state())["overview"]["sessions"]
        assert [each["stage"] for each in sessions] == ["drawn", "not drawn"]
        assert (await done(page, "draw"))["text"] == "All 2 schedules are drawn."

    with_tablets(study, run, coordinated=True)
    assert file.read_bytes() == before


def test_files_of_the_report_alone_are_served(study: StudyPaths) -> None:
    folder = study.root / "report"
    folder.mkdir()
    (folder / "report.html").write_text("<p>the report</p>")
    (study.root / "secret.html").write_text("no part of it")
    (folder / "link.html").symlink_to(study.root / "secret.html")

    async def run(_: Desk, page: Tablet) -> None:
        assert "the report" in (await page.get("/report/report.html")).text
        others = ("link.html", "none.html", "../protocol.toml", "%2e%2e/protocol.toml")
        for path in others:
            assert (await page.get(f"/report/{path}")).status_code == 404

    with_tablets(study, run, coordinated=True)


def test_an_address_for_a_tablet_is_that_of_its_rater(study: StudyPaths) -> None:
    async def run(desk: Desk, page: Tablet, tablet: Tablet) -> None:
        made = await done(page, "tablet", rater="R2")
        assert made["picture"].startswith("data:image/svg+xml")
        await desk.start("R1", "test")
        other = tablet.at(made["address"])
        await other.open()
        assert (await other.state())["screen"] == "other"
        assert (await tablet.until("ready"))["screen"] == "ready"

    with_tablets(study, run, "R1", coordinated=True)

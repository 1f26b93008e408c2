"""The coordinator's page: sessions, long work, and no model is named too early."""

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
from masrel.lab.schedule import read_schedule
from tests.lab.serve.pages import (
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

    with_tablets(study, run, coordinated=True)
    assert not study.conduct_file.exists()


@pytest.mark.slow
def test_a_session_is_followed_and_no_model_is_named_before_unblinding(
    study: StudyPaths,
) -> None:
    pages: list[Tablet] = []

    async def run(_: SessionManager, page: Tablet, tablet: Tablet) -> None:
        pages.append(page)
        async with page.listening() as events:
            await page.done("start", **R1)
            await tablet.until("ready")
            await page.done("leave")
            await page.done("start", **R1)
            await tablet.until("break")
            code = (await tablet.until("ready"))["last"]["code"]
            await page.done("correct", **R1, code=code, grade="3", **BY)
            await tablet.until("over")
            await page.done("correct", **R1, code=code, grade="NA", **BY)
        state = await page.state()
        assert state["overview"]["sessions"][0]["stage"] == "complete"
        kinds = {kind for kind, _ in events}
        assert {"desk", "overview", "log"} <= kinds
        screens = {data["screen"] for kind, data in events if kind == "desk"}
        assert {"instructions", "ready", "grade", "over"} <= screens
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

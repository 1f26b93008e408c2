"""The session manager: one session at a time, each answer once, and how it ends."""

import asyncio
from pathlib import Path

import pytest

from masrel.errors import ParameterError
from masrel.lab.protocol import StudyPaths
from tests.lab.serve.pages import (
    OCCASIONS,
    AnswerRefusedError,
    AskOverError,
    Page,
    SessionManager,
    at,
    correction,
    kinds,
    logged,
    n_sampled,
    small_study,
)


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    """A small study with instructions, practice, a break and a questionnaire."""
    return small_study(tmp_path / "study", OCCASIONS)


def test_the_same_answer_twice_is_entered_once_and_another_is_told(
    study: StudyPaths,
) -> None:
    async def act(manager: SessionManager) -> None:
        await manager.start("R1", "test")
        ask = (await Page(manager).until("grade"))["ask"]
        both = [manager.answer(ask, {"grade": "1"}) for _ in range(2)]
        other = manager.answer(ask, {"grade": "3"})
        results = await asyncio.gather(*both, other, return_exceptions=True)
        assert results[:2] == [None, None]
        assert isinstance(results[2], AskOverError)
        await manager.answer(ask, {"grade": "1"})  # of a tablet that was offline

    at(study, act)
    assert kinds(study).count("practice-grade") == 1


def test_a_correction_sent_again_is_entered_once(study: StudyPaths) -> None:
    # by a page that never saw the answer, while the session runs and when it is over
    async def act(manager: SessionManager) -> None:
        await manager.start("R1", "test")
        await Page(manager).until("break")
        code = logged(study, "grade")[-1]["code"]
        for wrong, grade, match in (
            ("999", "2", "needed a code that was graded"),
            (code, "7", "needed one of 0, 1"),
        ):
            with pytest.raises(ParameterError, match=match):
                await manager.correct("R1", "test", **correction(wrong, grade))
        with pytest.raises(ParameterError, match="rehearsal"):
            await manager.correct("R1", "test", **correction(code, "2"), rehearsal=True)
        for grade in ("3", "3", "1", "3"):
            await manager.correct("R1", "test", **correction(code, grade))
        await manager.leave()
        await manager.correct("R1", "test", **correction(code, "3"))

    at(study, act)
    assert [each["grade"] for each in logged(study, "correction")] == ["3", "1", "3"]


@pytest.mark.slow
def test_a_session_that_is_left_goes_on_where_it_was(study: StudyPaths) -> None:
    async def act(manager: SessionManager) -> None:
        page = Page(manager)
        for _ in range(3):
            await manager.start("R1", "test")
            state = await page.until("grade")
            # what was tapped before the session is left counts
            tap = asyncio.create_task(manager.answer(state["ask"], {"grade": "2"}))
            await asyncio.sleep(0)
            await manager.leave()
            await tap
            assert manager.state()["how"] == "stopped"
        await manager.start("R1", "test")
        await page.until("ready")
        assert manager.state()["last"] is not None  # it can be corrected still
        assert (await page.until("over"))["how"] == "complete"

    at(study, act)
    assert kinds(study).count("grade") == kinds(study).count("presented") == 4


def test_an_answer_that_comes_after_the_session_is_left_is_not_taken(
    study: StudyPaths,
) -> None:
    async def act(manager: SessionManager) -> None:
        await manager.start("R1", "test")
        state = await Page(manager).until("grade")
        left = asyncio.create_task(manager.leave())
        await asyncio.sleep(0)
        with pytest.raises(AskOverError, match="was stopped on request"):
            await manager.answer(state["ask"], {"grade": "2"})
        await left

    at(study, act)
    assert "practice-grade" not in kinds(study)


def test_one_session_runs_at_a_time_and_no_unknown_one(study: StudyPaths) -> None:
    async def act(manager: SessionManager) -> None:
        for rater, session in (("R9", "test"), ("R1", "retest")):
            with pytest.raises(ParameterError, match="needed one of"):
                await manager.start(rater, session)
        both = (manager.start("R1", "test"), manager.start("R2", "test"))
        results = await asyncio.gather(*both, return_exceptions=True)
        assert [type(result) for result in results] == [type(None), ParameterError]
        with pytest.raises(ParameterError, match="needed none that runs"):
            await manager.start("R2", "test")

    at(study, act)
    assert not study.log_file("R2", "test").exists()


@pytest.mark.slow
def test_an_emergency_stop_is_a_fault_and_what_it_stopped_can_be_skipped(
    tmp_path: Path,
) -> None:
    study = small_study(tmp_path / "study", quick=True)

    async def act(manager: SessionManager) -> None:
        page = Page(manager)
        await manager.start("R1", "test")
        assert (await page.until("presenting"))["ask"] is None
        await n_sampled(manager, 20)
        with pytest.raises(ParameterError, match="needed a presentation that is over"):
            await manager.correct("R1", "test", **correction("999", "1"))
        for _ in range(3):  # one press is meant
            manager.stop("rater's page")
        fault = await page.until("fault")
        assert fault["why"] == "emergency stop: rater's page"
        assert fault["may_skip"] is True
        for wrong in ({"skip": " "}, {"again": "yes"}):
            with pytest.raises(AnswerRefusedError, match="why not"):
                await manager.answer(fault["ask"], wrong)
        await manager.answer(fault["ask"], {"skip": "the arm slipped"})
        await page.until("over")

    at(study, act, clock="real")
    assert kinds(study)[1:4] == ["presented", "fault", "skipped"]
    (skipped,) = logged(study, "skipped")
    assert (skipped["who"], skipped["why"]) == ("R1", "the arm slipped")
    assert kinds(study).count("grade") == 3


def test_an_emergency_stop_between_presentations_stops_the_session(
    study: StudyPaths,
) -> None:
    async def act(manager: SessionManager) -> None:
        await manager.start("R1", "test")
        await Page(manager).until("ready")
        manager.stop("coordinator's page")
        while (over := manager.state())["screen"] != "over":
            await manager.changed(manager.version)
        assert over["how"] == "stopped"
        assert "by an emergency stop (coordinator's page)" in over["text"]

    at(study, act)
    assert kinds(study)[-1] == "stopped"

"""A session by the desk: what it asks, answered as a page answers it."""

import asyncio
from pathlib import Path

import pytest

from masrel.errors import ParameterError
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.ratings import ratings_from_logs
from masrel.lab.run import read_log
from masrel.lab.serve._desk import AnswerRefusedError, AskOverError, Desk
from tests.lab.serve.desks import OCCASIONS, Page, at, kinds, n_sampled, small_study

WHY = {"who": "R1", "why": "wrong button"}


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    """A small study with instructions, practice, a break and a questionnaire."""
    return small_study(tmp_path / "study", OCCASIONS)


@pytest.fixture
def quick(tmp_path: Path) -> StudyPaths:
    """One whose stretches are quick, for the real clock."""
    return small_study(tmp_path / "study", quick=True)


def corrections(study: StudyPaths) -> list[object]:
    log = read_log(study.log_file("R1", "test"))
    return [e.fields["grade"] for e in log if e.kind == "correction"]


def test_a_whole_session_is_answered_by_a_page(study: StudyPaths) -> None:
    screens: list[str] = []

    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        over = await page.until("over")
        assert (over["how"], over["session"]) == ("complete", None)
        screens.extend(page.screens)

    at(study, act)
    assert screens == [
        *("instructions", "ready", "grade"),
        *["ready", "grade"] * 2,
        "break",
        *["ready", "grade"] * 2,
        "question",
    ]
    assert kinds(study) == [
        *("session", "instructed", "practised", "practice-grade"),
        *["presented", "grade"] * 2,
        "break",
        *["presented", "grade"] * 2,
        *("answered", "complete"),
    ]
    header = read_log(study.log_file("R1", "test"))[0].fields
    assert header["grades"] == "browser"
    ratings = ratings_from_logs(study, read_protocol(study.protocol))
    assert ratings.n_from_persons == 4
    assert ratings.table.query("rater == 'R1'")["graded_at"].notna().all()


def test_what_cannot_be_is_refused_and_asked_still(study: StudyPaths) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        state = await page.until("grade")
        stretches = [{"grade": "2", "stretch": which} for which in (5, True, 1.0)]
        for wrong in ({"grade": "7"}, *stretches, {}):
            with pytest.raises(AnswerRefusedError, match=r"needed one of|got"):
                await desk.answer(state["ask"], wrong)
        await desk.answer(state["ask"], {"grade": "1+"})

    at(study, act)
    assert "practice-grade" in kinds(study)


def test_the_same_answer_twice_is_entered_once_and_another_is_told(
    study: StudyPaths,
) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        ask = (await page.until("grade"))["ask"]
        both = [desk.answer(ask, {"grade": "1"}) for _ in range(2)]
        other = desk.answer(ask, {"grade": "3"})
        results = await asyncio.gather(*both, other, return_exceptions=True)
        assert results[:2] == [None, None]
        assert isinstance(results[2], AskOverError)
        await desk.answer(ask, {"grade": "1"})  # of a tablet that was offline

    at(study, act)
    assert kinds(study).count("practice-grade") == 1


def test_a_grade_is_corrected_while_the_session_runs_and_after_it(
    study: StudyPaths,
) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        while (state := await page.until("ready"))["last"] is None:
            await page.answer(state)
            await page.answer(await page.until("grade"))
        code = state["last"]["code"]
        assert state["last"]["grade"] == "2"
        await desk.correct("R1", "test", code, "3", **WHY)
        assert desk.state()["last"] == {"code": code, "grade": "3"}
        await page.until("question")
        await desk.correct("R1", "test", code, "0", **WHY)
        await page.until("over")
        await desk.correct("R1", "test", code, "1", **WHY)

    at(study, act)
    assert corrections(study) == ["3", "0", "1"]


def test_a_correction_sent_again_is_entered_once(study: StudyPaths) -> None:
    # by a page that never saw the answer, while the session runs and when it is over
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        code = (await page.until("break"))["code"]
        code = read_log(study.log_file("R1", "test"))[-1].fields["code"]
        for grade in ("3", "3", "1", "3"):
            await desk.correct("R1", "test", str(code), grade, **WHY)
        await desk.leave()
        await desk.correct("R1", "test", str(code), "3", **WHY)

    at(study, act)
    assert corrections(study) == ["3", "1", "3"]


def test_what_cannot_be_corrected_is_said_in_a_sentence(study: StudyPaths) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        code = (await page.until("break"))["code"]
        for wrong, grade, match in (
            ("999", "2", "needed a code that was graded"),
            (code, "2", "needed a code that was graded"),
            (code, "7", "needed one of 0, 1"),
        ):
            with pytest.raises(ParameterError, match=match):
                await desk.correct("R1", "test", wrong, grade, **WHY)
        with pytest.raises(ParameterError, match="rehearsal"):
            await desk.correct("R1", "test", code, "2", **WHY, rehearsal=True)

    at(study, act)
    assert corrections(study) == []


@pytest.mark.slow
def test_a_session_that_is_left_goes_on_where_it_was(study: StudyPaths) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        for _ in range(3):
            await desk.start("R1", "test")
            state = await page.until("grade")
            # what was tapped before the session is left counts
            tap = asyncio.create_task(desk.answer(state["ask"], {"grade": "2"}))
            await asyncio.sleep(0)
            await desk.leave()
            await tap
            assert desk.state()["how"] == "stopped"
        await desk.start("R1", "test")
        await page.until("ready")
        assert desk.state()["last"] is not None  # it can be corrected still
        await page.until("over")
        assert desk.state()["how"] == "complete"

    at(study, act)
    assert kinds(study).count("grade") == 4
    assert kinds(study).count("presented") == 4


def test_an_answer_that_comes_after_the_session_is_left_is_not_taken(
    study: StudyPaths,
) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        state = await page.until("grade")
        left = asyncio.create_task(desk.leave())
        await asyncio.sleep(0)
        with pytest.raises(AskOverError, match="was stopped on request"):
            await desk.answer(state["ask"], {"grade": "2"})
        await left

    at(study, act)
    assert "practice-grade" not in kinds(study)


def test_one_session_runs_at_a_time_and_no_unknown_one(study: StudyPaths) -> None:
    async def act(desk: Desk) -> None:
        for rater, session in (("R9", "test"), ("R1", "retest")):
            with pytest.raises(ParameterError, match="needed one of"):
                await desk.start(rater, session)
        both = (desk.start("R1", "test"), desk.start("R2", "test"))
        results = await asyncio.gather(*both, return_exceptions=True)
        assert [type(result) for result in results] == [type(None), ParameterError]
        with pytest.raises(ParameterError, match="needed none that runs"):
            await desk.start("R2", "test")

    at(study, act)
    assert not study.log_file("R2", "test").exists()


def test_again_presents_the_model_again(quick: StudyPaths) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        state = await page.until("grade")
        await desk.answer(state["ask"], {"again": True})
        again = await page.until("ready")
        assert (again["code"], again["again"]) == (state["code"], True)
        assert again["ask"] != state["ask"]
        await page.until("over")

    at(quick, act)
    assert kinds(quick)[:4] == ["session", "presented", "presented", "grade"]


@pytest.mark.slow
def test_an_emergency_stop_is_a_fault_and_what_it_stopped_can_be_skipped(
    quick: StudyPaths,
) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        state = await page.until("presenting")
        assert state["ask"] is None
        await n_sampled(desk, 20)
        with pytest.raises(ParameterError, match="needed a presentation that is over"):
            await desk.correct("R1", "test", "999", "1", **WHY)
        for _ in range(3):  # one press is meant
            desk.stop("rater's page")
        fault = await page.until("fault")
        assert fault["why"] == "emergency stop: rater's page"
        assert fault["may_skip"] is True
        for wrong in ({"skip": " "}, {"again": "yes"}):
            with pytest.raises(AnswerRefusedError, match="why not"):
                await desk.answer(fault["ask"], wrong)
        await desk.answer(fault["ask"], {"skip": "the arm slipped"})
        await page.until("over")

    at(quick, act, clock="real")
    assert kinds(quick)[1:4] == ["presented", "fault", "skipped"]
    log = read_log(quick.log_file("R1", "test"))
    skipped = log[3].fields
    assert (skipped["who"], skipped["why"]) == ("R1", "the arm slipped")
    assert kinds(quick).count("grade") == 3


def test_an_emergency_stop_between_presentations_stops_the_session(
    study: StudyPaths,
) -> None:
    async def act(desk: Desk) -> None:
        page = Page(desk)
        await desk.start("R1", "test")
        await page.until("ready")
        desk.stop("coordinator's page")
        while desk.running is not None:
            await desk.changed(desk.version)
        over = desk.state()
        assert over["how"] == "stopped"
        assert "by an emergency stop (coordinator's page)" in over["text"]

    at(study, act)
    assert kinds(study)[-1] == "stopped"

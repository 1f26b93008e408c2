"""The rater's page: what it shows and takes, to whom, and what it never says."""

import asyncio
import json
import re
import tomllib
from pathlib import Path
from typing import Literal, get_args, get_type_hints

import pytest

import masrel.lab.serve
from masrel.errors import MasrelError, ParameterError
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.protocol.definition import Study
from masrel.lab.schedule.presentation import read_schedule
from masrel.scales import PUBLISHED_SCALES
from tests.lab.serve.pages import (
    OCCASIONS,
    SessionManager,
    Tablet,
    correction,
    kinds,
    logged,
    n_sampled,
    seen,
    small_study,
    with_tablets,
)

LANGUAGES = get_args(get_type_hints(Study)["language"])
HERE = Path(masrel.lab.serve.__file__).parent


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    return small_study(tmp_path / "study", OCCASIONS)


# What no answer to a rater's tablet may have in it: models, what they are made of and
# meant to be, orders, and who else rates.
SECRETS = (
    *(r"HM\d", r"\bR2\b", r"\bR3\b", "model_id", "intended", "catch_angle", "catch_t"),
    *("residual", "stiffness", "damping", "seed", "repeats", r"\b20240\b", "nms_rad"),
    *("dummy", r"\b130(\.0)?\b", r"\b115(\.0)?\b", r"\bsamples\b", r"\.partial"),
)


def check_order(study: StudyPaths, sent: list[str]) -> None:
    """No code comes early, and with it the last one's alone, to correct its grade."""
    schedule = read_schedule(study.schedule_file("R1", "test"))
    codes = [each.code for each in schedule.presentations]
    assert all(any(code in text for text in sent) for code in codes)
    reached = -1
    for text in sent:
        here = [i for i, code in enumerate(codes) if code in text]
        assert max(here, default=-1) <= reached + 1
        assert max(here, default=-1) - min(here, default=-1) <= 1
        reached = max(reached, *here, -1)


@pytest.mark.parametrize(
    "clock", ["simulated", pytest.param("real", marks=pytest.mark.slow)]
)
def test_nothing_that_a_tablet_is_sent_says_what_is_presented(
    tmp_path: Path, clock: Literal["real", "simulated"]
) -> None:
    study = small_study(tmp_path / "study", OCCASIONS, quick=True)
    tablets: list[Tablet] = []

    async def act(manager: SessionManager, mine: Tablet, other: Tablet) -> None:
        tablets.extend((mine, other))
        await manager.start("R1", "test")
        async with mine.listening(), other.listening() as events:
            await mine.until("break")
            state = await mine.until("ready")
            code, why = state["last"]["code"], "wrong button"
            await mine.done("correct", code=code, grade="3", why=why)
            assert (await mine.post("correct", code="xx", grade="3", why=why))[0] == 409
            for wrong in ({"begin": 1}, {"skip": "HM"}, {}):
                body = {"ask": state["ask"], "answer": wrong}
                assert (await mine.post("answer", **body))[0] == 422
            assert (await mine.until("over"))["how"] == "complete"
            await seen(events, "waiting")

    with_tablets(study, act, "R1", "R2", clock=clock)
    assert {"practised", "presented", "correction", "answered"} <= {*kinds(study)}
    for tablet, more in zip(tablets, ((), (r"\bR1\b", "code")), strict=True):
        sent = "\n".join(tablet.sent)
        words = sent.partition('id="words">')[0] + sent.partition("</html>")[2]
        for secret in (*SECRETS, *more):
            assert not re.search(secret, words), secret
        assert tablet.sent
    check_order(study, tablets[0].sent)


def test_another_raters_tablet_sees_no_state_and_cannot_act(study: StudyPaths) -> None:
    async def act(manager: SessionManager, mine: Tablet, other: Tablet) -> None:
        await manager.start("R1", "test")
        state = await mine.until("ready")
        shown = await other.state()
        which = {name: shown.pop(name) for name in ("server", "version")}
        assert shown == {"screen": "other", "session": None, "ask": None}
        assert None not in which.values()
        body = {"ask": state["ask"], "answer": {"begin": True}}
        status, refusal = await other.post("answer", **body)
        assert (status, refusal["state"]["screen"]) == (403, "other")
        assert (await other.post("done"))[0] == 403
        last = {"code": state["code"], "grade": "1", "why": "x"}
        assert (await other.post("correct", **last))[0] == 409
        assert (await mine.state())["ask"] == state["ask"]
        await manager.leave()
        assert (await other.state())["screen"] == "waiting"
        assert (await mine.state())["screen"] == "over"

    with_tablets(study, act, "R1", "R2")


def test_a_failed_session_says_nothing_and_a_new_tablet_is_the_first_raters_it_shows(
    study: StudyPaths, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "protocol.toml: models[0] (HM1): needed another angle"
    over = {"screen": "over", "how": "failed", "text": text, "rater": "R1"}

    async def act(manager: SessionManager, tablet: Tablet, new: Tablet) -> None:
        await manager.start("R1", "test")
        await tablet.until("instructions")
        await manager.leave()
        monkeypatch.setattr(manager, "_over", over)
        state = await tablet.state()
        assert (state["screen"], state["how"]) == ("over", "failed")
        assert "HM1" not in "".join(tablet.sent)
        assert (await new.state())["screen"] == "waiting"
        await manager.start("R2", "test")
        await new.until("instructions")  # it has not become the first rater's
        await manager.leave()
        await manager.start("R1", "test")
        assert (await new.state())["screen"] == "other"  # but the second one's

    with_tablets(study, act, "R1", None)


def test_a_stream_says_that_it_is_there(
    study: StudyPaths, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("masrel.lab.serve._role_pages._BEAT_S", 0.01)

    async def act(_: SessionManager, tablet: Tablet) -> None:
        async with tablet.listening() as events:
            while ("beat", {}) not in events:
                await asyncio.sleep(0.01)
            assert events[0][1]["screen"] == "waiting"

    with_tablets(study, act, None)


def test_of_two_tablets_one_acts_what_it_says_is_on_disk_and_the_other_is_told(
    study: StudyPaths,
) -> None:
    async def act(manager: SessionManager, one: Tablet, two: Tablet) -> None:
        await manager.start("R1", "test")
        async with two.listening() as events:
            state = await one.until("grade")
            first = one.post("answer", ask=state["ask"], answer={"grade": "1"})
            second = two.post("answer", ask=state["ask"], answer={"grade": "3"})
            results = await asyncio.gather(first, second)
            assert sorted(status for status, _ in results) == [200, 409]
            assert results[0][1]["state"]["screen"] == "ready"
            told = next(body for status, body in results if status == 409)
            assert told["why"] == "this was answered already"
            before = len(events)
            state = await one.answer(results[0][1]["state"], begin=True)
            while len(events) == before:
                await asyncio.sleep(0.01)
            latest = events[-1][1]
            assert (latest["screen"], latest["ask"]) == (state["screen"], state["ask"])

            for n in (2, 3):  # a grade is on disk when its answer comes
                state = await one.until("grade")
                await one.answer(state, grade="1+", stretch=None)
                assert len(logged(study, "grade", "practice-grade")) == n
                await one.answer(state, grade="1+", stretch=None)  # it was offline

    with_tablets(study, act, "R1", "R1")
    assert kinds(study).count("practice-grade") == 1


@pytest.mark.slow
def test_done_ends_what_is_presented_and_nothing_that_comes_later(
    tmp_path: Path,
) -> None:
    thrice = ("stretches = 1", "stretches = 3")
    study = small_study(tmp_path / "study", "", thrice, quick=True)

    async def act(manager: SessionManager, tablet: Tablet) -> None:
        await manager.start("R1", "test")
        async with tablet.listening() as events:
            await tablet.answer(await tablet.until("ready"), begin=True)
            shown = await tablet.until("presenting")
            names = ("code", "position", "practice", "again")
            which = {name: shown[name] for name in names}
            for name, other in (("code", "no"), ("position", 9), ("again", True)):
                assert (await tablet.post("done", **{**which, name: other}))[0] == 409
            while ("stretches", {"n_over": 1}) not in events:
                await asyncio.sleep(0.05)
            assert (await tablet.state())["screen"] == "presenting"
            await tablet.done("done", **which)
            await tablet.until("grade")
            assert (await tablet.post("done", **which))[0] == 409

    with_tablets(study, act, "R1", clock="real")


@pytest.mark.slow
def test_the_emergency_stop_of_any_tablet_is_a_fault_of_what_is_presented(
    tmp_path: Path,
) -> None:
    study = small_study(tmp_path / "study", quick=True)

    async def act(manager: SessionManager, mine: Tablet, other: Tablet) -> None:
        await manager.start("R1", "test")
        await mine.answer(await mine.until("ready"), begin=True)
        await n_sampled(manager, 20)
        with pytest.raises(ParameterError, match="needed a presentation that is over"):
            await manager.correct("R1", "test", **correction("999", "1"))
        await other.done("stop")
        fault = await mine.until("fault")
        assert fault["why"] == "emergency stop: rater's page"
        assert fault["may_skip"] is True
        for wrong in ({"skip": " "}, {"again": "yes"}):
            status, _ = await mine.post("answer", ask=fault["ask"], answer=wrong)
            assert status == 422
        await mine.answer(fault, skip="the arm slipped")
        await mine.until("over")

    with_tablets(study, act, "R1", "R2", clock="real")
    assert kinds(study)[1:4] == ["presented", "fault", "skipped"]
    (skipped,) = logged(study, "skipped")
    assert (skipped["who"], skipped["why"]) == ("R1", "the arm slipped")
    assert kinds(study).count("grade") == 3


@pytest.mark.parametrize("anchors", [{}, {"1+": "a catch, then <some>"}])
def test_no_word_of_masrels_own_is_shown_as_that_of_a_scale(
    study: StudyPaths, anchors: dict[str, str]
) -> None:
    table = "".join(f"anchors.'{key}' = '{anchors[key]}'\n" for key in anchors)
    text = study.protocol.read_text()
    study.protocol.write_text(text.replace("[scale]\n", f"[scale]\n{table}"))
    scale = PUBLISHED_SCALES["modified-ashworth"]

    async def act(manager: SessionManager, tablet: Tablet) -> None:
        page = await tablet.open()
        await manager.start("R1", "test")
        state = await tablet.until("grade")
        assert state["grades"] == list(scale.scale.grades)
        assert (state["scale"], state["anchors"]) == ("MAS", anchors)
        assert state["source"] == f"{scale.title}. {scale.source}"
        sent = page + json.dumps(state)
        assert not [words for words in scale.meanings.values() if words in sent]

    with_tablets(study, act, "R1")


def words_in(language: str) -> dict[str, str]:
    return tomllib.loads((HERE / "words" / f"{language}.toml").read_text("utf-8"))


def test_a_page_is_in_the_language_of_the_study(study: StudyPaths) -> None:
    text = study.protocol.read_text()
    in_german = text.replace("[study]\n", '[study]\nlanguage = "de"\n')
    study.protocol.write_text(in_german)

    async def act(_: SessionManager, tablet: Tablet) -> None:
        page = await tablet.open()
        assert '<html lang="de">' in page
        assert ">Not-Halt</button>" in page
        words = re.search(r'id="words">(.*?)</script>', page)
        assert words is not None
        assert json.loads(words[1]) == words_in("de")

    with_tablets(study, act, None)
    study.protocol.write_text(in_german.replace('"de"', '"xx"'))
    with pytest.raises(MasrelError, match="xx"):
        read_protocol(study.protocol)


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_language_has_all_words_with_the_same_places(language: str) -> None:
    english, words = words_in("en"), words_in(language)
    assert list(words) == list(english)
    for key, text in english.items():
        places = re.findall(r"\{\w+\}", text)
        assert sorted(re.findall(r"\{\w+\}", words[key])) == sorted(places), key
        assert words[key].strip() == words[key] != ""


def test_there_are_words_for_all_that_the_page_says_and_for_nothing_else() -> None:
    files = (HERE / "words").glob("*.toml")
    assert sorted(path.stem for path in files) == sorted(LANGUAGES)
    script = "".join(path.read_text() for path in (HERE / "static").glob("rater*.js"))
    page = (HERE / "templates" / "rater.html").read_text()
    used = {*re.findall(r"\bwords\.(\w+)", page), *re.findall(r'"(\w+)"', script)}
    used |= {"slow", "fast"}  # as the protocol calls them
    for how in ("complete", "stopped", "failed"):
        used |= {f"over_{how}", f"over_{how}_title"}
    assert set(re.findall(r'\bw\("(\w+)"', script)) <= set(words_in("en")) <= used


def test_scripts_make_no_markup_of_texts_and_leave_no_host() -> None:
    unsafe = r"innerHTML|outerHTML|insertAdjacent|document\.write"
    unsafe += r"|https?://|\beval\(|new Function"
    for path in (HERE / "static").glob("*.*"):
        assert not re.search(unsafe, path.read_text()), path.name

"""What is reached by the pages alone: a skip, a number, the next step, the report."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from masrel.lab.protocol import read_protocol
from masrel.lab.run import ScriptGrades, run_session
from tests.lab.serve.browser.conftest import N_RATERS, MakeStage, at_work
from tests.lab.serve.browser.stages import Stage
from tests.lab.serve.browser.test_coordinator_flows import form, now
from tests.lab.serve.browser.visitors import Rater

pytestmark = pytest.mark.slow

YEARS = {
    "id": "work",
    "title": "Your work",
    "when": "presentation",
    "questions": [
        {
            **{"id": "years", "text": "How many years?", "type": "whole"},
            **{"low": 20, "high": 60, "high_label": "or more"},
        }
    ],
}
QUICKLY_PLANNED = {
    **{"id": "kappa", "kind": "inter-rater", "coefficient": "fleiss_kappa"},
    **{"models": "standard", "sessions": ["test"], "target": "items"},
    "interval": "analytic",
}


@pytest.fixture(scope="module")
def asking_stage(make_stage: MakeStage) -> Stage:
    """A study long enough to press something, which asks for a number each time."""
    return make_stage(
        n_raters=N_RATERS,
        n_models=2,
        simulated_raters={"mean_speed_deg_s": 45.0},
        questionnaires=[YEARS],
    )


@pytest.fixture
def asking(asking_stage: Stage, numbers: Iterator[int]) -> Iterator[Stage]:
    """The study that asks for a number, and a rater who has not begun."""
    yield from at_work(asking_stage, f"R{next(numbers)}")


@pytest.fixture(scope="module")
def complete_stage(make_stage: MakeStage) -> Stage:
    """A study whose sessions are complete, with little to report."""
    stage = make_stage(
        n_models=2,
        report={"sections": ["design"]},
        analysis={"estimates": [QUICKLY_PLANNED]},
    )
    protocol = read_protocol(stage.study.protocol)
    for rater in ("R1", "R2"):
        grades = ScriptGrades(["1", "2"])
        run_session(
            stage.study, protocol, rater, "test", grades=grades, clock="simulated"
        )
    return stage


@pytest.fixture
def complete(complete_stage: Stage) -> Iterator[Stage]:
    """The study whose sessions are complete."""
    yield from at_work(complete_stage, "R1")


def stopped(stage: Stage) -> Rater:
    """Stop the first presentation by the emergency stop."""
    rater = stage.session()
    rater.go_until("ready")
    rater.tap("Begin")
    rater.wait_for("presenting")
    rater.page.locator("#stop").tap()
    rater.wait_for("fault")
    return rater


def test_a_rater_leaves_a_model_without_a_grade_after_a_fault(asking: Stage) -> None:
    rater = stopped(asking)
    rater.page.locator("summary", has_text="Leave it without a grade").tap()
    rater.tap("Leave it without a grade")
    expect(rater.page.locator(".refused")).to_have_text("Write a reason first.")
    rater.page.locator("#why").fill("the motor is hot")
    rater.tap("Leave it without a grade")
    rater.wait_for("ready")
    skipped = asking.log()[-1]
    assert (skipped.kind, skipped.fields["position"]) == ("skipped", 1)
    assert skipped.fields["why"] == "the motor is hot"
    expect(asking.coordinator.page.locator("#sessions")).to_contain_text("1 skipped")


def test_a_coordinator_leaves_a_model_without_a_grade_after_a_fault(
    asking: Stage,
) -> None:
    stopped(asking)
    page = asking.coordinator.page
    page.get_by_role("button", name="Stop the session").click()
    expect(now(asking.coordinator)).to_contain_text("No session runs")
    said = form(
        page,
        "Leave a model without a grade, after a fault",
        rater=asking.rater,
        session="test",
        code=str(asking.log()[-2].fields["code"]),
        who="MK",
        why="the motor is hot",
    )
    expect(said).to_contain_text("is left without a grade")
    skipped = asking.log()[-1]
    assert (skipped.kind, skipped.fields["who"]) == ("skipped", "MK")
    # the page itself says what comes next, and does it
    step = page.locator("#next p", has_text=re.compile(r"graded\.$")).inner_text()
    which = re.search(r"session test of (R\d+), \d of 2 graded", step)
    assert which is not None, step
    page.locator("#next button", has_text="Go on with it").click()
    expect(now(asking.coordinator)).to_contain_text(f"Session test: {which[1]} ")
    expect(page.locator("#next")).to_be_empty()


def test_a_number_is_set_by_taps_by_keys_and_by_typing(asking: Stage) -> None:
    rater = asking.session()
    rater.go_until("question")
    number, page = (
        rater.page.get_by_role("spinbutton", name="How many years?"),
        rater.page,
    )
    less, more = (page.get_by_label(words) for words in ("One less", "One more"))
    assert number.input_value() == ""  # nothing is suggested
    rater.tap("Save")
    expect(page.locator(".refused")).to_have_text("A whole number from 20 to 60")
    for button, value in ((more, "20"), (more, "21"), (less, "20"), (less, "20")):
        button.tap()
        expect(number).to_have_value(value)
        expect(page.locator(".unseen")).to_have_text(value)  # said to a screen reader
    more.hover()
    page.mouse.down()  # and held
    page.wait_for_function("it => it.value > 22", arg=number.element_handle())
    page.mouse.up()
    held = number.input_value()
    page.wait_for_timeout(200)
    assert number.input_value() == held
    number.press("ArrowUp")
    expect(number).to_have_value(str(int(held) + 1))
    number.fill("99")
    rater.tap("Save")
    expect(page.locator(".refused")).to_have_text("A whole number from 20 to 60")
    less.tap()
    expect(number).to_have_value("60")
    number.press("Enter")
    rater.wait_for("ready")
    (answer,) = (each for each in asking.log() if each.kind == "answered")
    assert answer.fields["answer"] == 60


def test_the_log_of_a_rehearsal_is_shown_and_called_one(asking: Stage) -> None:
    asking.coordinator.start(asking.rater, rehearsal=True)
    rater = asking.tablet()
    rater.go_until("ready")
    page = asking.coordinator.page
    page.locator("summary", has_text="Log of this rehearsal").click()
    expect(page.locator("#log tbody td:nth-child(2)")).to_have_text("session")
    expect(page.locator("#now .label")).to_have_text("Rehearsal: nothing of it counts")
    asking.coordinator.leave()
    expect(page.locator("#now .label")).to_have_count(0)
    expect(page.locator("#log-title")).to_have_text("Log of this session")


def test_the_report_is_built_by_the_page_and_opened(complete: Stage) -> None:
    page = complete.coordinator.page
    expect(page.locator("#next")).to_contain_text("ratings.csv is not there yet")
    assert "masrel" not in page.locator("#next").inner_text()
    page.locator("#next button", has_text="Write the ratings").click()
    page.locator("#next button", has_text="Build the report").click()
    job = page.locator(".job", has_text="report:")
    expect(job).to_contain_text("report: done", timeout=60_000)
    with page.expect_popup() as opened:
        page.get_by_role("link", name="Open the report").click()
    expect(opened.value.locator("h1")).to_contain_text("small")
    opened.value.close()
    page.locator("#next button", has_text="Verify the record").wait_for()


def test_the_size_is_planned_by_the_page(complete: Stage) -> None:
    page = complete.coordinator.page
    page.get_by_role("button", name="Plan the size").click()
    job = page.locator(".job", has_text="plan:")
    expect(job).to_contain_text(re.compile("plan: done"), timeout=60_000)
    expect(job).to_contain_text("simulated studies")

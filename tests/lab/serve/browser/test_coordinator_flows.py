"""What a coordinator does at the page, in Chromium."""

import re
from datetime import datetime, timedelta

import pytest
from playwright.sync_api import Locator, Page, expect

from masrel.lab._event_log import read_log
from masrel.lab.protocol import read_protocol
from masrel.lab.run.session import run_session
from tests.lab.script import ScriptGrades
from tests.lab.serve.browser.conftest import MakeStage, at_work
from tests.lab.serve.browser.stages import Stage
from tests.lab.serve.browser.test_rater_flows import broken, near_the_stop, tab_to
from tests.lab.serve.browser.visitors import LOST, Coordinator, Rater

pytestmark = pytest.mark.slow

NOTE = "Note, deviation or adverse event"
SKIP = "Leave a model without a grade after a fault"
SIGNED = {"who": "MK", "why": "tapped the wrong line"}


def form(page: Page, title: str, **fields: str) -> Locator:
    """Open a form, fill it in and send it -> where it says what came of it."""
    details = page.locator("details", has=page.get_by_text(title, exact=True))
    if details.get_attribute("open") is None:
        details.locator("summary").click()
    for name, value in fields.items():
        field = details.locator(f"[name={name}]")
        if field.evaluate("it => it.tagName") == "SELECT":
            field.select_option(value)
        else:
            field.fill(value)
    details.locator("button[type=submit]").click()
    return details.locator(".outcome")


def press(page: Page, name: str) -> None:
    """Press a button."""
    page.get_by_role("button", name=name).click()


def sees(coordinator: Coordinator, text: str, at: str = "#now") -> None:
    """Wait until the page says something: of the session, unless elsewhere."""
    expect(coordinator.page.locator(at)).to_contain_text(text)


def start(stage: Stage) -> Rater:
    """Start the session of the flow's rater, by the page's form."""
    page = stage.coordinator.page
    option = page.locator("#which option", has_text=re.compile(f"^{stage.rater}, "))
    page.locator("#which").select_option(option.get_attribute("value"))
    press(page, "Start or resume")
    return stage.tablet()


def test_two_coordinators_see_the_same_loaded_again_too_and_nothing_is_done_twice(
    stage: Stage,
) -> None:
    coordinator = stage.coordinator
    second = stage.second_coordinator(timezone_id="Asia/Kolkata")
    second.tolerated = re.compile("status of 422")
    sees(second, "No session is running")
    rater = start(stage)
    rater.wait_for("instructions")
    for each in (coordinator, second):
        sees(each, "is reading the instructions")
    status, body = second.post(
        "/coordinator/start", rater="R60", session="test", rehearsal=False
    )
    assert (status, "needed no other session running" in body["why"]) == (422, True)
    said = form(second.page, NOTE, text="Seen by two", who="AB")
    expect(said).to_contain_text("Recorded")
    sees(coordinator, "Seen by two", "#events")
    time = second.page.locator("#events time").first
    utc = datetime.fromisoformat(str(time.get_attribute("datetime")))
    expect(time).to_contain_text(f"{utc:%Y-%m-%d %H:%M:%S} UTC")
    local = f"{utc + timedelta(hours=5, minutes=30):%-I:%M}"
    expect(time.locator(".faint")).to_contain_text(local)
    rater.go_until("grade")
    sees(coordinator, f"{stage.rater} is grading practice")
    press(second.page, "Pause the session")
    rater.wait_for("over")
    sees(coordinator, "No session is running")
    sees(coordinator, "begun", "#sessions")
    start(stage)
    rater.go_until("break")
    coordinator.page.reload()
    sees(coordinator, "is having a break")
    sees(coordinator, "practice-grade", "#log")
    rater.go_until("over")
    coordinator.page.reload()
    sees(coordinator, "is complete")
    assert stage.is_complete()


def test_an_emergency_stop_of_the_coordinator(slow_stage: Stage) -> None:
    coordinator, rater = slow_stage.coordinator, start(slow_stage)
    sight = "document.getElementById('live').toDataURL()"
    empty = coordinator.page.evaluate(sight)
    rater.begin()
    # the arm is seen as it moves; only then is it stopped
    coordinator.page.wait_for_function(f"empty => {sight} !== empty", arg=empty)
    press(coordinator.page, "Emergency stop")
    rater.wait_for("fault")
    sees(coordinator, "coordinator's page")
    assert slow_stage.kinds()[-1] == "fault"
    form(coordinator.page, "New address for a tablet")
    coordinator.page.locator("img.qr").wait_for()
    assert broken(coordinator) == []


def test_what_was_refused_is_tried_again_and_what_is_done_is_told(
    stage: Stage,
) -> None:
    page = stage.coordinator.page
    which = {"rater": stage.rater, "session": "test", "code": "99X"}
    said = form(page, SKIP, **which)
    assert said.inner_text() == ""  # the browser itself asks for the name
    stage.coordinator.tolerated = re.compile("status of 422")
    ids = set()
    for _ in range(2):
        with page.expect_request("**/coordinator/skip") as request:
            said = form(page, SKIP, **SIGNED)
        ids.add(request.value.post_data_json["id"])
        expect(said).to_have_class(re.compile("refused"))
        expect(said).to_contain_text(stage.rater)
    assert len(ids) == 2
    start(stage).wait_for("instructions")
    sees(stage.coordinator, "is started", "#controls .outcome")


def test_a_grade_is_corrected_a_code_unblinded_and_what_happens_recorded(
    stage: Stage,
) -> None:
    rater, page = start(stage), stage.coordinator.page
    for _ in range(2):
        rater.go_until("grade")
        rater.answer()
    rater.wait_for("ready")
    code = stage.log()[-1].fields["code"]
    which = {"rater": stage.rater, "session": "test", "code": code}
    said = form(page, "Correct a grade", **which, grade="3", **SIGNED)
    expect(said).to_contain_text(f"{code} is corrected")
    assert stage.log()[-1].fields["grade"] == "3"
    expect(rater.page.locator("#screen")).to_contain_text(f"{code}: 3")
    models = [model.id for model in read_protocol(stage.study.protocol).models]
    assert not any(model in page.content() for model in models)
    said = form(page, "Unblind a code", **which, **SIGNED)
    expect(said).to_contain_text(f"{code} of {stage.rater}, session test, is HM")
    assert not any(model in rater.page.content() for model in models)
    text, of = f"Bruised thumb of {stage.rater}", {"rater": stage.rater}
    event = {"kind": "adverse-event", "severity": "mild", **of}
    said = form(page, NOTE, text=text, who="MK", **event)
    expect(said).to_have_text("Recorded: adverse-event.")
    sees(stage.coordinator, text, "#events")
    fields = read_log(stage.study.conduct_file)[-1].fields
    assert (fields["kind"], fields["severity"]) == ("adverse-event", "mild")
    said = form(page, "A rater has left", **of, **SIGNED)
    expect(said).to_contain_text(f"{stage.rater} is withdrawn")
    press(page, "Pause the session")
    sees(stage.coordinator, "No session is running")
    start(stage)  # which nobody who has left begins
    sees(stage.coordinator, "withdrawn")


def test_a_tablet_is_of_its_address_or_of_whose_session_it_shows_first(
    stage: Stage,
) -> None:
    coordinator, page = stage.coordinator, stage.coordinator.page
    said = form(page, "New address for a tablet", rater=stage.rater)
    expect(said).to_contain_text(stage.rater)
    assert page.locator("img.qr").evaluate("it => it.complete && it.naturalWidth") > 0
    address = page.locator(".address").inner_text()
    assert "/rater?token=" in address
    rater = stage.tablet(address=address)
    rater.wait_for("waiting")
    coordinator.start("R60")
    rater.wait_for("other")  # it is this rater's tablet from the beginning
    coordinator.leave()
    first = stage.tablet()
    first.wait_for("waiting")  # the session before is nothing to it
    start(stage)
    for each in (rater, first):
        each.wait_for("instructions")


def test_a_coordinator_without_network_is_told_and_nothing_is_lost(
    stage: Stage,
) -> None:
    coordinator, page = stage.coordinator, stage.coordinator.page
    coordinator.tolerated = LOST
    page.locator("#which").wait_for()
    coordinator.go_offline("#banner")
    said = form(page, NOTE, text=f"In the dark, {stage.rater}", who="MK")
    page.wait_for_timeout(500)
    assert said.inner_text() == ""
    coordinator.context.set_offline(False)
    expect(said).to_contain_text("Recorded")
    expect(page.locator("#banner")).to_be_empty()
    texts = [event.fields.get("text") for event in read_log(stage.study.conduct_file)]
    assert texts.count(f"In the dark, {stage.rater}") == 1


def test_the_page_fits_on_a_screen_and_needs_no_mouse(stage: Stage) -> None:
    coordinator = stage.second_coordinator()
    page = coordinator.page
    page.locator("#which").wait_for()
    assert broken(coordinator) == []  # all is open now
    assert near_the_stop(coordinator) == []
    wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    for width, height in ((390, 844), (1180, 820), (1920, 1080)):
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate(wide) <= 0
    tab_to(coordinator, "#which")
    page.keyboard.type(f"{stage.rater},")
    tab_to(coordinator, "button.main")
    page.keyboard.press("Enter")
    sees(coordinator, f"Session test: {stage.rater} ")


QUICKLY_PLANNED = {
    **{"id": "kappa", "kind": "inter-rater", "coefficient": "fleiss_kappa"},
    **{"models": "standard", "sessions": ["test"], "target": "items"},
    "interval": "analytic",
}


def test_long_work_is_done_by_the_page_and_the_report_opened(
    make_stage: MakeStage,
) -> None:
    stage = make_stage(
        n_models=2,
        report={"sections": ["design"]},
        analysis={"estimates": [QUICKLY_PLANNED]},
    )
    protocol, page = read_protocol(stage.study.protocol), stage.coordinator.page
    for rater in ("R1", "R2"):
        grades = ScriptGrades(["1", "2"])
        run_session(
            stage.study, protocol, rater, "test", grades=grades, clock="simulated"
        )
    for _ in at_work(stage, "R1"):
        sees(stage.coordinator, "ratings.csv is not there yet", "#next")
        assert "masrel" not in page.locator("#next").inner_text()
        for name in ("Write the ratings", "Build the report"):
            page.locator("#next button", has_text=name).click()
        press(page, "Plan the size")
        for name in ("report", "plan"):
            job = page.locator(".job", has_text=f"{name}:")
            expect(job).to_contain_text(f"{name}: done", timeout=60_000)
        expect(job).to_contain_text("simulated studies")
        with page.expect_popup() as opened:
            page.get_by_role("link", name="Open the report").click()
        expect(opened.value.locator("h1")).to_contain_text("small")
        opened.value.close()
        page.locator("#next button", has_text="Verify the record").wait_for()

"""What a coordinator does at the page, in Chromium."""

import re
from operator import sub
from statistics import quantiles

import pytest
from playwright.sync_api import Locator, Page, expect

from masrel.lab.protocol import read_protocol
from masrel.lab.run import read_log
from tests.lab.serve.browser.stages import Stage
from tests.lab.serve.browser.test_rater_flows import tab_to
from tests.lab.serve.browser.visitors import LOST, Coordinator, Rater

pytestmark = pytest.mark.slow


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


def now(coordinator: Coordinator) -> Locator:
    """Return what the page says of the session."""
    return coordinator.page.locator("#now")


def start(stage: Stage) -> Rater:
    """Start the session of the flow's rater, by the page's form."""
    page = stage.coordinator.page
    option = page.locator("#which option", has_text=re.compile(f"^{stage.rater}, "))
    page.locator("#which").select_option(option.get_attribute("value"))
    page.get_by_role("button", name="Start or go on").click()
    return stage.tablet()


def test_a_session_is_started_followed_and_stopped(stage: Stage) -> None:
    rater = start(stage)
    rater.wait_for("instructions")
    expect(now(stage.coordinator)).to_contain_text("reads the instructions")
    rater.go_until("grade")
    expect(now(stage.coordinator)).to_contain_text(f"{stage.rater} grades practice")
    stage.coordinator.page.get_by_role("button", name="Stop the session").click()
    rater.wait_for("over")
    expect(now(stage.coordinator)).to_contain_text("No session runs")
    expect(stage.coordinator.page.locator("#sessions")).to_contain_text("begun")


FRAMES = """() => new Promise((resolve) => {
    const source = new EventSource("/coordinator/events");
    const moments = [];
    source.addEventListener("live", () => moments.push(performance.now()));
    source.addEventListener("desk", (event) => {
        if (moments.length && JSON.parse(event.data).screen === "grade") {
            source.close();
            resolve(moments);
        }
    });
})"""


def test_the_arm_is_seen_at_twenty_frames_a_second(slow_stage: Stage) -> None:
    rater = start(slow_stage)
    rater.wait_for("ready")
    page = slow_stage.coordinator.page
    page.evaluate(f"void (window.frames_ = ({FRAMES})())")
    empty = page.evaluate("document.getElementById('live').toDataURL()")
    rater.tap("Begin")
    expect(page.locator("#live-text")).to_contain_text("catch", timeout=10_000)
    assert page.evaluate("document.getElementById('live').toDataURL()") != empty
    moments = page.evaluate("window.frames_")
    # A busy machine stalls most of them: what a quarter keeps to, the page can
    shortest, _, _ = quantiles(map(sub, moments[1:], moments))
    assert shortest <= 1000 / 20


def test_an_emergency_stop_of_the_coordinator(slow_stage: Stage) -> None:
    rater = start(slow_stage)
    rater.wait_for("ready")
    rater.tap("Begin")
    rater.wait_for("presenting")
    slow_stage.coordinator.page.get_by_role("button", name="Emergency stop").click()
    rater.wait_for("fault")
    expect(now(slow_stage.coordinator)).to_contain_text("coordinator's page")
    assert slow_stage.log()[-1].kind == "fault"


def test_notes_and_adverse_events_are_recorded(stage: Stage) -> None:
    page = stage.coordinator.page
    said = form(
        page,
        "Note, deviation or adverse event",
        kind="adverse-event",
        text=f"Bruised thumb of {stage.rater}",
        rater=stage.rater,
        severity="mild",
        who="MK",
    )
    expect(said).to_have_text("Recorded: adverse-event.")
    expect(page.locator("#events")).to_contain_text(f"Bruised thumb of {stage.rater}")
    fields = read_log(stage.study.conduct_file)[-1].fields
    assert (fields["kind"], fields["severity"]) == ("adverse-event", "mild")


def test_what_is_sent_without_a_name_is_refused_in_a_sentence(stage: Stage) -> None:
    page = stage.coordinator.page
    said = form(page, "Correct a grade", rater=stage.rater, code="99X", grade="2")
    assert said.inner_text() == ""  # the browser itself asks for the name
    stage.coordinator.tolerated = re.compile("status of 422")
    said = form(page, "Correct a grade", who="MK", why="typed wrongly")
    expect(said).to_have_class(re.compile("refused"))
    assert stage.rater in said.inner_text()


def test_what_was_refused_is_tried_again_and_what_is_done_is_told(
    stage: Stage,
) -> None:
    page = stage.coordinator.page
    stage.coordinator.tolerated = re.compile("status of 422")
    which = {"rater": stage.rater, "session": "test", "code": "99X"}
    title = "Leave a model without a grade, after a fault"
    said = form(page, title, **which, who="MK", why="no arm")
    expect(said).to_have_class(re.compile("refused"))
    with page.expect_request("**/coordinator/skip") as second:
        form(page, title)
    with page.expect_request("**/coordinator/skip") as third:
        form(page, title)
    assert second.value.post_data_json["id"] != third.value.post_data_json["id"]
    start(stage).wait_for("instructions")
    expect(page.locator("#controls .outcome")).to_contain_text("is started")


def test_a_grade_is_corrected_and_a_code_unblinded(stage: Stage) -> None:
    rater = start(stage)
    rater.go_until("grade")
    rater.answer()
    rater.go_until("grade")
    rater.answer()
    rater.wait_for("ready")
    code = stage.log()[-1].fields["code"]
    page = stage.coordinator.page
    which = {"rater": stage.rater, "session": "test", "code": code}
    signed = {"who": "MK", "why": "tapped the wrong line"}
    said = form(page, "Correct a grade", **which, grade="3", **signed)
    expect(said).to_contain_text(f"{code} is corrected")
    assert stage.log()[-1].fields["grade"] == "3"
    expect(rater.page.locator("#screen")).to_contain_text(f"{code}: 3")
    models = [model.id for model in read_protocol(stage.study.protocol).models]
    assert not any(model in page.content() for model in models)
    said = form(page, "Unblind a code", **which, **signed)
    expect(said).to_contain_text(f"{code} of {stage.rater}, session test, is HM")
    assert not any(model in rater.page.content() for model in models)


def test_a_rater_who_has_left_begins_no_session(stage: Stage) -> None:
    page = stage.coordinator.page
    said = form(page, "A rater has left", rater=stage.rater, who="MK", why="moved away")
    expect(said).to_contain_text(f"{stage.rater} is withdrawn")
    start(stage)
    expect(now(stage.coordinator)).to_contain_text("withdrawn")


def test_long_work_shows_how_it_goes(stage: Stage) -> None:
    page = stage.coordinator.page
    page.get_by_role("button", name="Verify the record").click()
    expect(page.locator(".job", has_text="verify")).to_contain_text(
        re.compile("verify: (done|failed)"), timeout=30_000
    )


def test_an_address_for_a_tablet_lets_it_in(stage: Stage) -> None:
    page = stage.coordinator.page
    said = form(page, "New address for a tablet", rater=stage.rater)
    expect(said).to_contain_text(stage.rater)
    assert page.locator("img.qr").evaluate("it => it.complete && it.naturalWidth") > 0
    address = page.locator(".address").inner_text()
    assert "/rater?token=" in address
    rater = stage.tablet(address=address)
    rater.wait_for("waiting")
    stage.coordinator.start("R60")
    rater.wait_for("other")  # it is this rater's tablet from the beginning


def test_a_tablet_is_of_whose_session_it_shows_first(stage: Stage) -> None:
    stage.coordinator.start("R60")
    stage.coordinator.leave()
    rater = stage.tablet()
    rater.wait_for("waiting")  # the session before is nothing to it
    start(stage).wait_for("instructions")
    rater.wait_for("instructions")


def test_two_coordinators_see_the_same_and_nothing_is_done_twice(stage: Stage) -> None:
    first, second = stage.coordinator, stage.second_coordinator()
    second.tolerated = re.compile("status of 422")
    expect(now(second)).to_contain_text("No session runs")
    rater = start(stage)
    rater.wait_for("instructions")
    expect(now(second)).to_contain_text("reads the instructions")
    status, body = second.post(
        "/coordinator/start", rater="R60", session="test", rehearsal=False
    )
    assert (status, "needed none that runs" in body["why"]) == (422, True)
    said = form(
        second.page, "Note, deviation or adverse event", text="Seen by two", who="AB"
    )
    expect(said).to_contain_text("Recorded")
    expect(first.page.locator("#events")).to_contain_text("Seen by two")
    second.page.get_by_role("button", name="Stop the session").click()
    expect(now(first)).to_contain_text("No session runs")


def test_a_coordinator_without_network_is_told_and_nothing_is_lost(
    stage: Stage,
) -> None:
    coordinator, page = stage.coordinator, stage.coordinator.page
    coordinator.tolerated = LOST
    page.locator("#which").wait_for()
    title = "Note, deviation or adverse event"
    coordinator.context.set_offline(True)
    expect(page.locator("#banner")).to_contain_text("No connection")
    said = form(page, title, text=f"In the dark, {stage.rater}", who="MK")
    page.wait_for_timeout(500)
    assert said.inner_text() == ""
    coordinator.context.set_offline(False)
    expect(said).to_contain_text("Recorded")
    expect(page.locator("#banner")).to_be_empty()
    texts = [event.fields.get("text") for event in read_log(stage.study.conduct_file)]
    assert texts.count(f"In the dark, {stage.rater}") == 1


def test_a_page_loaded_again_shows_the_session_that_runs(stage: Stage) -> None:
    rater = start(stage)
    rater.go_until("break")
    stage.coordinator.page.reload()
    expect(now(stage.coordinator)).to_contain_text("has a break")
    expect(stage.coordinator.page.locator("#log")).to_contain_text("practice-grade")
    rater.go_until("over")
    stage.coordinator.page.reload()
    expect(now(stage.coordinator)).to_contain_text("is complete")
    assert stage.is_complete()


def test_a_rehearsal_is_called_one_and_rates_nothing(stage: Stage) -> None:
    stage.coordinator.page.get_by_label("only a rehearsal").check()
    rater = start(stage)
    rater.go_until("ready")
    assert "Rehearsal: nothing of it counts" in rater.text
    expect(now(stage.coordinator)).to_contain_text("Rehearsal of session test")
    rater.go_until("grade")
    rater.answer()
    assert not stage.study.log_file(stage.rater, "test").exists()


@pytest.mark.parametrize(("width", "height"), [(390, 844), (1180, 820), (1920, 1080)])
def test_the_page_fits_on_a_screen(stage: Stage, width: int, height: int) -> None:
    page = stage.second_coordinator(viewport={"width": width, "height": height}).page
    page.locator("#which").wait_for()
    for details in page.locator("details").all():
        details.evaluate("it => { it.removeAttribute('name'); it.open = true; }")
    wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert page.evaluate(wide) <= 0
    expect(page.get_by_role("button", name="Emergency stop")).to_be_in_viewport()


def test_a_session_is_started_by_the_keyboard_alone(stage: Stage) -> None:
    page = stage.coordinator.page
    page.locator("#which").wait_for()
    tab_to(stage.coordinator, "#which")
    page.keyboard.type(f"{stage.rater},")
    tab_to(stage.coordinator, "button.main")
    page.keyboard.press("Enter")
    expect(now(stage.coordinator)).to_contain_text(f"Session test: {stage.rater} ")

"""Sessions at a rater's tablet, in Chromium."""

import re
import signal

import pytest
from playwright.sync_api import expect

from tests.lab.serve.browser.axe import violations
from tests.lab.serve.browser.conftest import MakeStage, at_work
from tests.lab.serve.browser.stages import Stage
from tests.lab.serve.browser.visitors import LOST, REFUSED, Rater, Visitor

pytestmark = pytest.mark.slow

ALL = (*("instructions", "ready", "presenting", "grade", "break", "question", "over"),)
NO_CONNECTION = "No connection to the laptop"


def broken(visitor: Visitor) -> list[str]:
    """Return which rules of axe-core are broken in either scheme of colours."""
    rules = []
    for details in visitor.page.locator("details").all():
        details.evaluate("it => { it.removeAttribute('name'); it.open = true; }")
    for scheme in ("light", "dark"):
        visitor.page.emulate_media(color_scheme=scheme)
        rules += [f"{scheme}: {rule}" for rule in violations(visitor.page)]
    return rules


# Whether anything that can be tapped comes within 8 mm of the emergency stop, and
# whether the stop moves, wherever the page is scrolled and whatever it says
NEAR = """() => {
    const stop = document.getElementById("stop");
    const box = () => stop.getBoundingClientRect();
    const {left, right, top, bottom} = box();
    const far = 8 * 96 / 25.4;
    const problems = new Set();
    const look = () => {
        if (JSON.stringify(box()) !== was) problems.add("the stop has moved");
        for (let x = Math.max(0, left - far); x < right + far; x += 40) {
            for (let y = Math.max(0, top - far); y < bottom + far; y += 10) {
                const other = document.elementFromPoint(x, y)?.closest(
                    "a, button, input, label, select, summary, textarea");
                if (other && other !== stop) problems.add(`near: ${other.textContent}`);
            }
        }
    };
    const was = JSON.stringify(box());
    if (top < 0 || bottom > innerHeight || right > innerWidth) problems.add("no stop");
    const {bottom: under} = stop.closest("header").getBoundingClientRect();
    for (const each of document.querySelectorAll("main button, main label.choice")) {
        if (!each.checkVisibility()) continue;
        for (const edge of [under, bottom]) {  // as near as scrolling brings it
            scrollBy(0, each.getBoundingClientRect().top - edge);
            look();
        }
    }
    for (const each of document.querySelectorAll("#banner, #lost")) {
        const {textContent} = each;
        each.textContent = "A message that takes more than a line. ".repeat(3);
        look();
        each.textContent = textContent;
    }
    scrollTo(0, 0);
    return [[...problems], bottom, under];
}"""

SIZES = ((1280, 800), (768, 1024), (400, 800), (844, 390))


def near_the_stop(visitor: Visitor) -> list[str]:
    """Return what a finger on its way elsewhere could take the emergency stop for."""
    problems: list[str] = []
    for width, height in SIZES:
        low = height  # where what could be tapped began, before a keyboard closed
        for high in (360, height):
            visitor.page.set_viewport_size({"width": width, "height": high})
            found, bottom, under = visitor.page.evaluate(NEAR)
            problems += [f"{width} x {high}: {problem}" for problem in found]
            problems += ["the stop grows into what could be tapped"] * (bottom > low)
            low = under
    return problems


# Wider than the screen, too small for a finger, or hidden below the emergency stop
UNFIT = """() => {
    const problems = [];
    const root = document.documentElement;
    if (root.scrollWidth > root.clientWidth) problems.push("wider than the screen");
    const stop = document.getElementById("stop").getBoundingClientRect();
    if (stop.height > innerHeight / 3) problems.push("the stop fills the screen");
    const targets = "button, label.choice, [type=range], [type=number], textarea";
    for (const each of document.querySelectorAll(`${targets}, summary`)) {
        if (!each.checkVisibility()) continue;
        each.scrollIntoView({block: "center"});
        const {x, y, width, height} = each.getBoundingClientRect();
        const name = `${each.tagName} ${each.textContent.slice(0, 20)}`;
        if (height < 44 || width < 44) problems.push(`small: ${name}`);
        const top = document.elementFromPoint(x + width / 2, y + height / 2);
        const isSeen = each.contains(top) || top?.contains(each);
        if (!isSeen) problems.push(`covered: ${name}`);
    }
    scrollTo(0, 0);
    return problems;
}"""


def unfit(rater: Rater) -> list[str]:
    """Return what does not fit on a phone or tablet, or a finger."""
    problems: list[str] = []
    for size in ((360, 640), (390, 844), (844, 390), (820, 1180), (1180, 820)):
        rater.page.set_viewport_size({"width": size[0], "height": size[1]})
        problems += rater.page.evaluate(UNFIT)
    return problems


def changed_by_loading(rater: Rater) -> list[str]:
    """Load the page again -> what it shows otherwise."""
    shown, title = rater.screen, rater.text.split("\n")[0]
    rater.page.reload()
    if shown == "presenting":  # which may be over meanwhile
        rater.wait_for(shown, "grade")
        return []
    rater.wait_for(shown)
    return [title] if rater.text.split("\n")[0] != title else []


def correct_the_last_grade(rater: Rater) -> None:
    """Do so where the next presentation begins."""
    rater.page.get_by_text("Correct the last grade").tap()
    rater.choose("4")
    rater.page.get_by_label("Why").fill("Tapped the wrong line.")
    rater.tap("Save the correction")
    rater.page.get_by_text("Corrected").wait_for()


def test_every_screen_of_a_session_fits_is_for_all_and_can_be_loaded_again(
    stage: Stage,
) -> None:
    rater = stage.tablet(is_mobile=True)
    rater.wait_for("waiting")
    assert [*unfit(rater), *broken(rater)] == []
    stage.coordinator.start(stage.rater)
    seen: set[tuple[str, ...]] = set()
    while (shown := rater.wait_for(*ALL)) != "over":
        fields = rater.page.locator("#screen input, #screen textarea, #screen details")
        kind = shown, *fields.evaluate_all("all => all.map(it => it.type)")
        if kind not in seen:
            problems = [
                *near_the_stop(rater),
                *unfit(rater),
                *(broken(rater) if shown != "presenting" else []),
            ]
            assert [*problems, *changed_by_loading(rater)] == [], kind
        seen.add(kind)
        if shown == "presenting":
            rater.wait_for("grade")
            continue
        if "Correct the last grade" in rater.text and "correction" not in stage.kinds():
            correct_the_last_grade(rater)
        rater.answer()
    assert [*unfit(rater), *broken(rater), *changed_by_loading(rater)] == []
    assert "Everything is saved" in rater.text
    assert {shown for shown, *_ in seen} == set(ALL) - {"over"}
    assert stage.is_complete()
    (correction,) = (e.fields for e in stage.log() if e.kind == "correction")
    assert (correction["grade"], correction["who"]) == ("4", stage.rater)
    # a rule that is broken is seen
    rater.page.evaluate("document.documentElement.removeAttribute('lang')")
    assert [rule.split(":")[1] for rule in broken(rater)] == [" html-has-lang"] * 2


def test_the_stop_looks_like_no_other_button_and_stays_in_sight(
    stage: Stage,
) -> None:
    rater = stage.session()
    rater.go_until("grade")
    page = rater.page
    edge = "it => parseFloat(getComputedStyle(it).borderTopWidth)"
    for colours in ("none", "active"):
        page.emulate_media(forced_colors=colours)
        stop, save = page.locator("#stop"), page.locator("button.main")
        assert stop.evaluate(edge) > 2 * save.evaluate(edge)
    # as where a keyboard covers the page, and what is seen of it moves
    devtools = rater.context.new_cdp_session(page)
    devtools.send("Emulation.setPageScaleFactor", {"pageScaleFactor": 2})
    page.mouse.wheel(0, 400)
    page.wait_for_function("() => visualViewport.offsetTop > 50")
    page.wait_for_function(
        "() => document.getElementById('stop').getBoundingClientRect().top"
        " >= visualViewport.offsetTop"
    )


def test_of_two_tablets_one_answers_and_the_other_sees_it(stage: Stage) -> None:
    first, second = stage.session(), stage.tablet()
    second.tolerated = re.compile(f"{LOST.pattern}|{REFUSED.pattern}")
    for each in (first, second):
        each.wait_for("instructions")
    first.go_until("grade")
    second.wait_for("grade")
    # both tap before either knows of the other
    second.choose("4")
    first.choose("1")
    second.page.route(
        "**/rater/answer",
        lambda route: (
            first.tap("Save"),
            first.wait_for("ready"),
            route.continue_(),
        ),
    )
    second.tap("Save")
    second.page.get_by_text("This was answered on another screen.").wait_for()
    second.page.unroute_all()
    for each in (first, second):
        each.wait_for("ready")
    second.go_until("grade")
    first.wait_for("grade")
    graded = [each.fields["grade"] for each in stage.log() if "grade" in each.fields]
    assert graded == ["1"]


def test_an_emergency_stop_ends_a_presentation_whose_stretches_are_shown(
    slow_stage: Stage,
) -> None:
    rater = slow_stage.session()
    rater.wait_for("ready")
    cues = rater.page.locator(".cues li").all_inner_texts()
    assert [cue.split(",")[0] for cue in cues] == ["slow", "fast"]
    for press in (
        rater.page.locator("#stop").tap,
        lambda: rater.page.keyboard.press("Escape"),
    ):
        rater.begin()
        press()
        rater.wait_for("fault")
        assert "stopped by the emergency stop" in rater.text
        assert broken(rater) == []
        with rater.shown_anew():
            rater.tap("Present it again")
    rater.begin()
    due = rater.page.locator('.cues li[aria-current="step"]')
    due.filter(has_text="slow").wait_for()
    due.filter(has_text="fast").wait_for()
    assert violations(rater.page) == []
    rater.wait_for("grade")
    rater.tap("Feel it again")
    rater.wait_for("ready")
    assert "once more" in rater.text
    rater.begin()
    rater.wait_for("grade")
    rater.choose("3")
    group = rater.page.get_by_role("group", name="The stretch it is based on")
    group.locator("label").nth(2).tap()
    rater.tap("Save")
    rater.wait_for("ready")
    stopped = ["presented", "fault"]
    rated = ["presented", "presented", "grade"]
    assert slow_stage.kinds() == ["session", *stopped, *stopped, *rated]
    assert "rater's page" in str(slow_stage.log()[2].fields)
    grade = slow_stage.log()[-1].fields
    assert (grade["grade"], grade["stretch"]) == ("3", 2)


def test_a_stop_between_presentations_ends_the_session_and_nobody_sees_anothers(
    stage: Stage,
) -> None:
    rater = stage.session()
    rater.wait_for("instructions")
    rater.page.locator("#stop").tap()
    rater.wait_for("over")
    assert "the session can be resumed" in rater.text
    with rater.shown_anew():
        stage.coordinator.start(stage.rater)
    rater.go_until("grade")
    stage.coordinator.leave()
    rater.wait_for("over")
    stage.coordinator.start("R60")
    rater.wait_for("other")
    assert "Ask the coordinator" in rater.text
    assert not rater.page.locator("#stop").is_visible()


def test_a_session_goes_on_after_its_server_was_stopped_and_killed(
    stage: Stage,
) -> None:
    rater = stage.session()
    rater.tolerated = re.compile(f"{LOST.pattern}|{REFUSED.pattern}")
    stage.coordinator.tolerated = rater.tolerated
    rater.go_until("grade")  # that of practice
    rater.answer()
    rater.go_until("grade")
    stage.server.end()
    rater.wait_for("over")
    assert "the session can be resumed" in rater.text
    stage.start_again()
    rater.wait_for("ready")
    rater.go_until("grade")
    assert stage.grades() == []
    rater.answer()
    assert stage.grades() == ["2"]
    rater.go_until("grade")
    stage.server.end(signal.SIGKILL)
    rater.page.get_by_text(NO_CONNECTION).wait_for()
    rater.choose("3")
    with rater.shown_anew():
        rater.tap("Save")  # which nobody takes
        stage.start_again()
    rater.go_until("over")
    assert stage.is_complete()


@pytest.mark.parametrize(
    "long_at",  # for 10 s; for a moment elsewhere
    [("grade",), pytest.param(ALL, marks=pytest.mark.long)],
    ids=["at one screen", "at every screen"],
)
def test_a_tablet_without_network_says_so_and_goes_on_by_itself(
    stage: Stage, long_at: tuple[str, ...]
) -> None:
    rater = stage.session()
    rater.tolerated = LOST
    seen = []
    while (shown := rater.wait_for(*ALL)) != "over":
        if shown in seen and shown != "question":
            rater.go_until(*set(ALL) - {*seen, "presenting"})
            continue
        seen.append(shown)
        rater.go_offline("#lost")
        with rater.shown_anew():
            heading = rater.page.query_selector("#screen h1")
            if shown != "presenting":
                rater.act()  # what is tapped now is sent when the network is back
            rater.page.wait_for_timeout(10_000 if shown in long_at else 300)
            # a presentation ends by itself, of which Chromium still lets the page hear
            is_shown = heading.evaluate("it => it.isConnected")
            assert is_shown or shown == "presenting", "nobody can have answered"
            rater.context.set_offline(False)
        rater.page.get_by_text(NO_CONNECTION).wait_for(state="detached")
    assert set(seen) == set(ALL) - {"over"}
    assert stage.is_complete()


def test_a_session_by_the_keyboard_alone(stage: Stage) -> None:
    rater = stage.session(has_touch=False)
    while (shown := rater.wait_for(*ALL)) != "over":
        if shown == "presenting":
            rater.wait_for("grade")
            continue
        with rater.shown_anew():
            by_keyboard(rater, shown)
        assert rater.page.evaluate("document.activeElement.tagName") == "H1"
    assert stage.is_complete()
    assert stage.grades() == ["1+", "1+", "1+"]


def by_keyboard(rater: Rater, shown: str) -> None:
    """Answer by keys, from wherever the focus is."""
    press = rater.page.keyboard.press
    if shown == "grade":
        tab_to(rater, "input[type=radio]")
        press("ArrowDown")
        press("ArrowDown")
    elif shown == "question":
        tab_to(rater, "#screen input, #screen textarea")
        match rater.page.evaluate("document.activeElement.type"):
            case "range":
                press("ArrowRight")
            case "radio":
                press("Space")
            case _:
                rater.page.keyboard.type("12")
    tab_to(rater, "button.main:not(:disabled)")
    press("Enter")


def tab_to(visitor: Visitor, selector: str) -> None:
    """Press Tab until the focus is there."""
    for _ in range(20):
        if visitor.page.evaluate("it => document.activeElement.matches(it)", selector):
            return
        visitor.page.keyboard.press("Tab")
    raise AssertionError(f"no key leads to {selector}")


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


def test_a_number_is_set_by_taps_by_keys_and_by_typing(make_stage: MakeStage) -> None:
    for stage in at_work(make_stage(n_models=2, questionnaires=[YEARS]), "R1"):
        rater = stage.session()
        rater.go_until("question")
        page = rater.page
        number = page.get_by_role("spinbutton", name="How many years?")
        less, more = (page.get_by_label(words) for words in ("One less", "One more"))
        refused = page.locator(".refused")
        assert number.input_value() == ""  # nothing is suggested
        rater.tap("Save")
        expect(refused).to_have_text("A whole number from 20 to 60")
        for button, value in ((more, "20"), (more, "21"), (less, "20"), (less, "20")):
            button.tap()
            expect(number).to_have_value(value)
            expect(page.locator(".unseen")).to_have_text(value)  # for screen readers
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
        expect(refused).to_have_text("A whole number from 20 to 60")
        less.tap()
        expect(number).to_have_value("60")
        number.press("Enter")
        rater.wait_for("ready")
        (answer,) = (each for each in stage.log() if each.kind == "answered")
        assert answer.fields["answer"] == 60

"""Sessions at a rater's tablet, in Chromium."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.lab.serve.browser.conftest import MakeStage, at_work
from tests.lab.serve.browser.stages import Stage
from tests.lab.serve.browser.studies import OCCASIONS
from tests.lab.serve.browser.visitors import LOST, REFUSED, Rater, Visitor

pytestmark = pytest.mark.slow

GRADES = ("0", "1", "1+", "2", "3", "4")
ALL = (*("instructions", "ready", "presenting", "grade", "break", "question", "over"),)


def grade_all(rater: Rater, n: int, *, until: str) -> list[str]:
    """Give n grades, of the scale in turn -> them."""
    grades = [GRADES[number % len(GRADES)] for number in range(n)]
    for grade in grades:
        rater.grade = grade
        rater.go_until("grade")
        rater.answer()
    rater.go_until(until)
    return grades


def test_a_whole_session_of_sixteen_models(make_stage: MakeStage) -> None:
    stage = make_stage(
        template="hess2012",
        occasions=OCCASIONS | {"practice": ["HM1", "HM4"], "break_after": 8},
    )
    for _ in at_work(stage, "R1"):
        rater = stage.session()
        rater.go_until("grade")
        assert "Practice 1 of 2" in rater.page.locator("header").inner_text()
        rater.answer()
        rater.go_until("grade")
        rater.answer()
        grades = grade_all(rater, 8, until="break")
        rater.go_until("ready")
        rater.page.get_by_text("Correct the last grade").tap()
        rater.choose("4")
        rater.page.get_by_label("Why").fill("Tapped the wrong line.")
        rater.tap("Save the correction")
        rater.page.get_by_text("Corrected").wait_for()
        grades += grade_all(rater, 8, until="question")
        rater.go_until("over")
        assert "Everything is saved" in rater.text
        assert stage.grades() == grades
        assert stage.is_complete()
        kinds = [event.kind for event in stage.log()]
        n_kinds = {kind: kinds.count(kind) for kind in kinds}
        assert n_kinds == {
            **{"session": 1, "instructed": 1, "practised": 2, "practice-grade": 2},
            **{"presented": 16, "grade": 16, "break": 1, "correction": 1},
            **{"answered": 1, "complete": 1},
        }
        (correction,) = (each for each in stage.log() if each.kind == "correction")
        assert (correction.fields["grade"], correction.fields["who"]) == ("4", "R1")


def test_a_page_that_is_loaded_again_shows_the_same_and_loses_nothing(
    stage: Stage,
) -> None:
    rater = stage.session()
    seen = set()
    while (shown := rater.wait_for(*ALL)) != "over":
        if shown == "presenting":
            rater.page.reload()
            rater.wait_for("presenting", "grade")
            rater.wait_for("grade")
        else:
            text = rater.text
            rater.page.reload()
            rater.wait_for(shown)
            assert rater.text.split("\n")[0] == text.split("\n")[0]
            rater.answer()
        seen.add(shown)
    rater.page.reload()
    rater.wait_for("over")
    assert seen == set(ALL) - {"over"}
    assert stage.is_complete()


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


def test_a_tablet_of_another_rater_sees_nothing_of_a_session(stage: Stage) -> None:
    rater = stage.session()
    rater.wait_for("instructions")
    stage.coordinator.leave()
    rater.wait_for("over")
    stage.coordinator.start("R60")
    rater.wait_for("other")
    assert "Ask the coordinator" in rater.text
    assert not rater.page.locator("#stop").is_visible()


def test_a_model_is_felt_again(stage: Stage) -> None:
    rater = stage.session()
    rater.go_until("grade")
    rater.answer()
    rater.go_until("grade")
    rater.tap("Feel it again")
    rater.wait_for("ready")
    assert "once more" in rater.text
    rater.go_until("grade")
    rater.answer()
    rater.wait_for("ready")
    kinds = [each.kind for each in stage.log()]
    assert kinds[-4:] == ["practice-grade", "presented", "presented", "grade"]


@pytest.mark.parametrize("how", ["touch", "Escape"])
def test_an_emergency_stop_ends_a_presentation_at_once(
    slow_stage: Stage, how: str
) -> None:
    rater = slow_stage.session()
    rater.wait_for("ready")
    rater.tap("Begin")
    rater.wait_for("presenting")
    if how == "touch":
        rater.page.locator("#stop").tap()
    else:
        rater.page.keyboard.press("Escape")
    rater.wait_for("fault")
    assert "stopped by the emergency stop" in rater.text
    with rater.shown_anew():
        rater.tap("Present it again")
    rater.go_until("grade")
    kinds = [each.kind for each in slow_stage.log()]
    assert kinds == ["session", "presented", "fault", "presented"]
    assert "rater's page" in str(slow_stage.log()[2].fields)


def test_an_emergency_stop_between_presentations_ends_the_session(stage: Stage) -> None:
    rater = stage.session()
    rater.wait_for("instructions")
    rater.page.locator("#stop").tap()
    rater.wait_for("over")
    assert "it can go on where it was" in rater.text
    with rater.shown_anew():
        stage.coordinator.start(stage.rater)
    rater.go_until("grade")


def test_each_stretch_that_is_due_is_shown(slow_stage: Stage) -> None:
    rater = slow_stage.session()
    rater.wait_for("ready")
    cues = rater.page.locator(".cues li").all_inner_texts()
    assert [cue.split(",")[0] for cue in cues] == ["slow", "fast"]
    rater.tap("Begin")
    rater.wait_for("presenting")
    due = rater.page.locator('.cues li[aria-current="step"]')
    due.filter(has_text="slow").wait_for()
    due.filter(has_text="fast").wait_for()
    rater.wait_for("grade")
    rater.choose("3")
    rater.page.get_by_role("group", name="The stretch it rests on").locator(
        "label"
    ).nth(2).tap()
    rater.tap("Save")
    rater.wait_for("ready")
    grade = slow_stage.log()[-1].fields
    assert (grade["grade"], grade["stretch"]) == ("3", 2)


def test_a_session_goes_on_after_its_server_was_stopped(stage: Stage) -> None:
    rater = stage.session()
    for visitor in (rater, stage.coordinator):
        visitor.tolerated = LOST
    rater.go_until("grade")
    rater.answer()
    rater.go_until("grade")
    stage.server.stop()
    rater.wait_for("over")
    assert "it can go on where it was" in rater.text
    start_again(stage)
    rater.wait_for("ready")
    rater.go_until("grade")
    assert stage.grades() == []
    rater.answer()
    assert stage.grades() == ["2"]


def test_a_session_goes_on_after_its_server_was_killed(stage: Stage) -> None:
    rater = stage.session()
    for visitor in (rater, stage.coordinator):
        visitor.tolerated = re.compile(f"{LOST.pattern}|{REFUSED.pattern}")
    rater.go_until("grade")
    rater.answer()
    rater.go_until("grade")
    stage.server.kill()
    rater.page.get_by_text("No connection to the laptop").wait_for()
    rater.choose("3")
    with rater.shown_anew():
        rater.tap("Save")  # which nobody takes
        start_again(stage)
    rater.go_until("over")
    assert stage.is_complete()


def start_again(stage: Stage) -> None:
    """Start the server as before, and go on with the session."""
    stage.server.start()
    stage.coordinator.page.reload()
    stage.coordinator.start(stage.rater)


SIZES = {
    "phone": [(360, 640), (390, 844), (844, 390)],
    "tablet": [(820, 1180), (1180, 820)],
}


@pytest.mark.parametrize("device", SIZES)
def test_every_screen_fits(stage: Stage, device: str) -> None:
    rater = stage.session(is_mobile=True)
    seen = set()
    while (shown := rater.wait_for(*ALL)) != "over":
        for width, height in SIZES[device] if shown not in seen else ():
            rater.page.set_viewport_size({"width": width, "height": height})
            assert unfit(rater) == [], (shown, width, height)
        seen.add(shown)
        if shown == "presenting":
            rater.wait_for("grade")
        else:
            rater.answer()
    assert stage.is_complete()


# Wider than the screen, too small for a finger, or hidden below the emergency stop
UNFIT = """() => {
    const problems = [];
    const root = document.documentElement;
    if (root.scrollWidth > root.clientWidth) problems.push("wider than the screen");
    const stop = document.getElementById("stop").getBoundingClientRect();
    if (stop.bottom > innerHeight || stop.top < 0) problems.push("no stop in sight");
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
    """Return what does not fit on the screen, or a finger."""
    problems: list[str] = rater.page.evaluate(UNFIT)
    return problems


def test_a_session_by_the_keyboard_alone(stage: Stage) -> None:
    rater = stage.session(has_touch=False)
    press = rater.page.keyboard.press
    while (shown := rater.wait_for(*ALL)) != "over":
        if shown == "presenting":
            rater.wait_for("grade")
            continue
        with rater.shown_anew():
            by_keyboard(rater, shown)
        assert rater.page.evaluate("document.activeElement.tagName") == "H1"
    press("Tab")
    assert stage.is_complete()
    assert stage.grades() == ["1+", "1+", "1+"]


def by_keyboard(rater: Rater, shown: str) -> None:
    """Answer by keys, from wherever the focus is."""
    press = rater.page.keyboard.press
    if shown == "grade":
        tab_to(rater, "input[type=radio]")
        for _ in range(2):
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


LANGUAGES = {
    "de": ("Anleitung", "Weiter"),
    "fr": ("Consignes", "Continuer"),
    "es": ("Instrucciones", "Continuar"),
}


@pytest.fixture
def protocol(stage: Stage) -> Iterator[Path]:
    """The protocol, which is again what it was when a flow ends, however it ends."""
    text = stage.study.protocol.read_text(encoding="utf-8")
    yield stage.study.protocol
    replace(stage.study.protocol, text)


def replace(path: Path, text: str) -> None:
    """Change a file at once: the server and a session may read it at any time."""
    beside = path.with_suffix(".new")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)


def test_a_page_speaks_the_language_of_its_study(stage: Stage, protocol: Path) -> None:
    english = protocol.read_text(encoding="utf-8")
    rater = stage.session()
    rater.wait_for("instructions")  # the session has read its protocol
    for language, (title, go_on) in LANGUAGES.items():
        replace(
            protocol, english.replace("[study]", f'[study]\nlanguage = "{language}"')
        )
        rater.page.reload()
        rater.wait_for("instructions")
        assert rater.page.locator("html").get_attribute("lang") == language
        assert rater.page.locator("h1").inner_text() == title
        assert rater.page.get_by_role("button", name=go_on, exact=True).is_visible()


def test_an_address_lets_in_one_browser_once(stage: Stage) -> None:
    first = stage.tablet()
    address = first.page.url
    assert "token" not in address, "it stays in no history"
    first.page.wait_for_selector("#screen h1")


def test_the_scheme_is_dark_where_the_tablet_is(stage: Stage) -> None:
    rater = stage.session(color_scheme="dark")
    rater.wait_for("instructions")
    ground = rater.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert max(int(part) for part in re.findall(r"\d+", ground)[:3]) < 60

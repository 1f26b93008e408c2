"""Every screen of both pages is held against the rules of axe-core, light and dark."""

import pytest

from tests.lab.serve.browser.axe import violations
from tests.lab.serve.browser.stages import Stage
from tests.lab.serve.browser.visitors import Rater, Visitor

pytestmark = pytest.mark.slow

ALL = (*("instructions", "ready", "presenting", "grade", "break", "question", "over"),)


def broken(visitor: Visitor) -> list[str]:
    """Return which rules are broken in either scheme of colours."""
    rules = []
    for scheme in ("light", "dark"):
        visitor.page.emulate_media(color_scheme=scheme)
        rules += [f"{scheme}: {rule}" for rule in violations(visitor.page)]
    return rules


def test_screens_of_a_session(stage: Stage) -> None:
    rater = stage.tablet()
    rater.wait_for("waiting")
    assert broken(rater) == []
    stage.coordinator.start(stage.rater)
    seen: set[str] = set()
    while (shown := rater.wait_for(*ALL)) != "over":
        if shown == "presenting":
            rater.wait_for("grade")
            continue
        kind = f"{shown} {stage_of(rater)}"
        if kind not in seen:
            for details in rater.page.locator("details").all():
                details.evaluate("it => { it.open = true; }")
            assert broken(rater) == [], kind
        seen.add(kind)
        rater.answer()
    assert broken(rater) == []
    assert len(seen) > len(ALL)


def stage_of(rater: Rater) -> str:
    """Return what tells screens of one kind apart."""
    fields = rater.page.locator("#screen input, #screen textarea, #screen details")
    return (
        f"{sorted(set(fields.evaluate_all('all => all.map(it => it.type)')), key=str)}"
    )


def test_screens_of_a_stop(slow_stage: Stage) -> None:
    rater = slow_stage.session()
    rater.wait_for("ready")
    assert broken(rater) == []
    rater.tap("Begin")
    rater.wait_for("presenting")
    assert violations(rater.page) == []
    rater.page.locator("#stop").tap()
    rater.wait_for("fault")
    assert broken(rater) == []


def test_a_broken_rule_is_seen(stage: Stage) -> None:
    rater = stage.tablet()
    rater.wait_for("waiting")
    rater.page.evaluate("document.documentElement.removeAttribute('lang')")
    assert [rule.split(":")[1] for rule in broken(rater)] == [" html-has-lang"] * 2


def test_the_coordinators_page(slow_stage: Stage) -> None:
    coordinator = slow_stage.second_coordinator()
    coordinator.page.locator("#which").wait_for()
    assert broken(coordinator) == []
    rater = slow_stage.session()
    rater.wait_for("ready")
    rater.tap("Begin")
    rater.wait_for("presenting")
    coordinator.page.locator("#stop").click()
    rater.wait_for("fault")
    for details in coordinator.page.locator("details").all():
        details.evaluate("it => { it.removeAttribute('name'); it.open = true; }")
    coordinator.page.get_by_role("button", name="Make the address").click()
    coordinator.page.locator("img.qr").wait_for()
    assert broken(coordinator) == []

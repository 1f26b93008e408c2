"""A browser that dies at any moment takes no grade with it, and leaves none twice."""

import os
import random
import signal
import threading

import pytest
from playwright.sync_api import Error, Playwright

from tests.lab.serve.browser.conftest import CHROMIUM, FLAGS, MakeStage
from tests.lab.serve.browser.stages import TABLET, Stage
from tests.lab.serve.browser.visitors import Rater

GRADES = ("0", "1", "1+", "2", "3", "4")


def grade_of(code: str) -> str:
    """Return which grade a code is given, so that a mix-up is seen."""
    return GRADES[sum(code.encode()) % len(GRADES)]


def grade_until_over(rater: Rater, saved: dict[str, str]) -> None:
    """Answer whatever is asked; what the page said is saved is kept, by code."""
    while rater.wait_for("instructions", "ready", "grade", "over") != "over":
        heading = rater.page.locator("h1").inner_text()
        code = heading.split()[-1].strip(",")
        shown, rater.grade = rater.screen, grade_of(code)
        rater.answer()
        if shown == "grade":
            saved[code] = grade_of(code)


def is_over(stage: Stage) -> bool:
    """Return whether the session is complete."""
    file = stage.study.log_file(stage.rater, "test")
    return file.exists() and stage.log()[-1].kind == "complete"


@pytest.mark.parametrize(
    "kills",
    [pytest.param(2, marks=pytest.mark.slow), pytest.param(50, marks=pytest.mark.long)],
)
def test_no_grade_is_lost_or_doubled_where_browsers_are_killed(
    playwright: Playwright, make_stage: MakeStage, kills: int
) -> None:
    stage, moments = make_stage(n_raters=30, n_models=4), random.Random(20)
    raters = iter(f"R{number}" for number in range(1, 31))
    while kills:
        stage.enter(next(raters))
        stage.coordinator.start(stage.rater)
        saved: dict[str, str] = {}
        while not is_over(stage):
            mortal = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            told = mortal.new_browser_cdp_session().send("SystemInfo.getProcessInfo")
            of_type = {each["type"]: each["id"] for each in told["processInfo"]}
            context = mortal.new_context(viewport=TABLET, has_touch=True)
            rater = Rater(context, stage.server.new_address("rater"))
            # as a tablet dies whose battery is empty
            death = threading.Timer(
                moments.uniform(0.0, 2.5), os.kill, (of_type["browser"], signal.SIGKILL)
            )
            if kills:
                death.start()
            try:
                grade_until_over(rater, saved)
            except Error:
                kills -= 1
            finally:
                death.cancel()
                mortal.close()
        graded = [event.fields for event in stage.log() if event.kind == "grade"]
        in_log = {each["code"]: each["grade"] for each in graded}
        assert stage.is_complete()  # each code graded once
        assert in_log == {code: grade_of(code) for code in in_log}
        assert saved.items() <= in_log.items()

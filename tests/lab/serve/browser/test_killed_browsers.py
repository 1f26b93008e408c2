"""A browser that dies at any moment takes no grade with it, and leaves none twice."""

import contextlib
import os
import random
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path

import pytest
from playwright.sync_api import Error, Playwright

from tests.lab.serve.browser.conftest import CHROMIUM, FLAGS, MakeStage
from tests.lab.serve.browser.stages import TABLET, Stage
from tests.lab.serve.browser.visitors import Rater

GRADES = ("0", "1", "1+", "2", "3", "4")


class Mortal:
    """A Chromium of its own, which can be killed with all its processes."""

    def __init__(self, playwright: Playwright, folder: Path) -> None:
        profile = (
            "--headless",
            "--remote-debugging-port=0",
            f"--user-data-dir={folder}",
        )
        self._process = subprocess.Popen(
            [str(CHROMIUM), *FLAGS, *profile],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        port = folder / "DevToolsActivePort"
        while not port.exists() or "\n" not in port.read_text():
            time.sleep(0.02)
        number = port.read_text().split("\n")[0]
        try:
            self.browser = playwright.chromium.connect_over_cdp(
                f"http://127.0.0.1:{number}"
            )
        except Error:
            self.kill()
            raise

    def kill(self) -> None:
        """Kill it as a tablet dies whose battery is empty."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


def grade_of(code: str) -> str:
    """Return which grade a code is given, so that a mix-up is seen."""
    return GRADES[sum(code.encode()) % len(GRADES)]


class Grading:
    """A rater who grades until all is over; what the page said is saved is kept."""

    def __init__(self) -> None:
        self.saved: dict[str, str] = {}  # by code

    def go_on(self, rater: Rater) -> None:
        """Answer whatever is asked, until the session is over."""
        while rater.wait_for("instructions", "ready", "grade", "over") != "over":
            heading = rater.page.locator("h1").inner_text()
            code = heading.split()[-1].strip(",")
            if (shown := rater.screen) == "grade":
                rater.grade = grade_of(code)
            rater.answer()
            if shown == "grade":
                self.saved[code] = grade_of(code)


def go_through(
    playwright: Playwright, stage: Stage, folder: Path, *, kills: int, seed: int
) -> int:
    """Take sessions to their ends while browsers die -> how many sessions."""
    moments, n_sessions, n_kills = random.Random(seed), 0, 0
    while n_kills < kills:
        n_sessions += 1
        stage.enter(f"R{n_sessions}")
        stage.coordinator.start(stage.rater)
        grading = Grading()
        while not is_over(stage):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            try:
                mortal = Mortal(playwright, folder)
            except Error:  # too busy a machine for it to come up
                continue
            context = mortal.browser.new_context(viewport=TABLET, has_touch=True)
            rater = Rater(context, stage.server.new_address("rater"))
            death = threading.Timer(moments.uniform(0.0, 2.5), mortal.kill)
            if n_kills < kills:
                death.start()
            try:
                grading.go_on(rater)
            except Error:
                n_kills += 1
            finally:
                death.cancel()
                mortal.kill()
        in_log = {
            event.fields["code"]: event.fields["grade"]
            for event in stage.log()
            if event.kind == "grade"
        }
        assert stage.is_complete()  # each code graded once
        assert in_log == {code: grade_of(code) for code in in_log}
        assert grading.saved.items() <= in_log.items()
    return n_sessions


def is_over(stage: Stage) -> bool:
    """Return whether the session is complete."""
    file = stage.study.log_file(stage.rater, "test")
    return file.exists() and stage.log()[-1].kind == "complete"


@pytest.mark.parametrize(
    "kills",
    [pytest.param(5, marks=pytest.mark.slow), pytest.param(50, marks=pytest.mark.long)],
)
def test_no_grade_is_lost_or_doubled_where_browsers_are_killed(
    playwright: Playwright, make_stage: MakeStage, tmp_path: Path, kills: int
) -> None:
    stage = make_stage(n_raters=30, n_models=4)
    go_through(playwright, stage, tmp_path / "profile", kills=kills, seed=20)

"""The figures of the page of ``masrel serve``: both sides of a session, in Chromium.

``python -m docs.make.serving`` writes docs/figures/serve_rater.png and
docs/figures/serve_coordinator.png.
"""

import contextlib
import tempfile
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

from docs.make.evidence import FIGURES
from tests.lab.serve.browser.conftest import CHROMIUM, FLAGS
from tests.lab.serve.browser.stages import Stage, make_study


def main() -> None:
    """Play a session and write both figures."""
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        sync_playwright() as playwright,
    ):
        study = make_study(
            Path("study"),
            n_raters=3,
            study={"title": "A small study: four models, three raters"},
            presentation={"stretches": ["slow", "fast"], "slow_speed_deg_s": 60.0},
            stretch={"start_deg": 30.0, "end_deg": 146.0},
            simulated_raters={"mean_speed_deg_s": 85.0},
        )
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        stage = Stage(browser, study)
        try:
            draw(stage)
        finally:
            stage.close()
            browser.close()


def draw(stage: Stage) -> None:
    """Take the pictures while the second model is felt, and while it is graded."""
    size = {"width": 820, "height": 1180}
    stage.coordinator.page.set_viewport_size({"width": 1366, "height": 860})
    rater = stage.session(viewport=size)
    rater.go_until("grade")
    rater.answer()
    rater.wait_for("ready")
    rater.tap("Begin")
    rater.wait_for("presenting")
    fast = rater.page.locator('.cues li[aria-current="step"]', has_text="fast")
    fast.wait_for()
    rater.page.wait_for_timeout(3000)  # until the fast stretch is on its way
    picture(stage.coordinator.page, "coordinator")
    rater.wait_for("grade")
    rater.choose("1+")
    rater.page.wait_for_timeout(7000)  # until the note on the grade before is gone
    picture(rater.page, "rater")


def picture(page: Page, name: str) -> None:
    """Write what is seen of a page."""
    page.screenshot(path=FIGURES / f"serve_{name}.png")


if __name__ == "__main__":
    main()

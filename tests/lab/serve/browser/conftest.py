"""One browser for the flows of a module, and one server for most of them.

None outlives its module: while playwright runs, no other test has an event loop.
"""

import itertools
import shutil
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Playwright, expect, sync_playwright

from tests.lab.serve.browser.stages import OCCASIONS, REALISM, Stage, make_study
from tests.lab.serve.browser.visitors import WITHIN_MS

NAMES = ("chromium", "chromium-browser", "google-chrome")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
FLAGS = [
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update"),
    "--disable-sync",
]
N_RATERS = 60  # each flow has a rater of its own

MakeStage = Callable[..., Stage]


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    if CHROMIUM is None:
        pytest.skip("needs Chromium: apt-get install chromium")
    expect.set_options(timeout=WITHIN_MS)
    with sync_playwright() as started:
        yield started


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
    yield chromium
    chromium.close()


@pytest.fixture(scope="module")
def make_stage(
    browser: Browser, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[MakeStage]:
    """Serve a study, with a coordinator at its page."""
    stages = []

    def make(**settings: object) -> Stage:
        root = tmp_path_factory.mktemp("served") / "study"
        stages.append(Stage(browser, make_study(root, **settings)))
        return stages[-1]

    yield make
    for each in stages:
        each.close()


@pytest.fixture(scope="module")
def stage_of_all(make_stage: MakeStage) -> Stage:
    """A small study with everything that a page can ask."""
    return make_stage(
        n_raters=N_RATERS,
        n_models=3,
        occasions=OCCASIONS,
        questionnaires=[REALISM],
    )


@pytest.fixture(scope="module")
def slow_stage_of_all(make_stage: MakeStage) -> Stage:
    """A study of two stretches a presentation, long enough to press something."""
    return make_stage(
        n_raters=N_RATERS,
        n_models=2,
        presentation={"stretches": ["slow", "fast"], "slow_speed_deg_s": 40.0},
    )


def at_work(stage: Stage, rater: str) -> Iterator[Stage]:
    """Give a flow the stage, and look afterwards at what its browsers noted."""
    stage.enter(rater)
    try:
        yield stage
    finally:
        problems = stage.leave()
    assert problems == []


@pytest.fixture(scope="module")
def numbers() -> Iterator[int]:
    return itertools.count(1)


@pytest.fixture
def stage(stage_of_all: Stage, numbers: Iterator[int]) -> Iterator[Stage]:
    """The study with everything, and a rater who has not begun."""
    yield from at_work(stage_of_all, f"R{next(numbers)}")


@pytest.fixture
def slow_stage(slow_stage_of_all: Stage, numbers: Iterator[int]) -> Iterator[Stage]:
    """The study of slow stretches, and a rater who has not begun."""
    yield from at_work(slow_stage_of_all, f"R{next(numbers)}")

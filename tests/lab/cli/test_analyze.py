"""masrel analyze: the tables a plan asks for, and one sentence when it cannot be."""

from pathlib import Path

import pytest

from tests.architecture.test_imports import loaded_after
from tests.files import published_study

# One estimate with an interval and one the published data do not hold: the rest of
# the published plan only costs time here.
PLAN = """
[[analysis.estimates]]
id = "kappa"
kind = "inter-rater"
coefficient = "fleiss_kappa"
models = "standard"
sessions = ["test"]
target = "raters"
interval = "jackknife"

[[analysis.estimates]]
id = "again"
kind = "test-retest"
coefficient = "stratified_kappa"
models = "standard"
sessions = ["test", "retest"]
target = "items"
interval = "none"

[report]
sections = ["design", "agreement", "test-retest", "intended", "in-person"]
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """The published study with a shorter plan."""
    return published_study(tmp_path / "study", PLAN)


def test_an_analysis_loads_no_library_that_draws(study: Path) -> None:
    shown = f"from masrel.cli import cli\ncli(['analyze', {str(study)!r}])"
    assert loaded_after(shown) & {"matplotlib", "jinja2", "emcee"} == set()
    assert (study / "analysis.json").is_file()

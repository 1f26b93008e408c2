"""masrel analyze: the tables a plan asks for, and one sentence when it cannot be."""

from pathlib import Path

import pytest

from tests.architecture.test_imports import loaded_after
from tests.cli.process import Caller
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


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


HEAD = "session,rater,model,grade,mean_speed_deg_s,source\n"


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("test,R1,HM1,7,80,published\n", ("line 2", "grade", "'7'")),
        ("test,R9,HM1,1,80,published\n", ("rater", "'R9'")),
        ("test,R1,HM9,1,80,published\n", ("model", "'HM9'")),
        ("third,R1,HM1,1,80,published\n", ("session", "'third'")),
        ("test,R1,HM1,3,80,published\n", ("in_person.csv", "line", "'3'")),
    ],
)
def test_wrong_ratings_are_one_sentence_with_their_file(
    masrel: Caller, study: Path, rows: str, said: tuple[str, ...]
) -> None:
    file = write(study / "ratings" / "wrong.csv", HEAD + rows)
    done = masrel("analyze", study, "--ratings", file)
    assert (done.code, done.out) == (2, "")
    assert done.err.count("\n") == 1
    assert done.err.startswith("masrel: ")
    assert str(study / "ratings") in done.err
    assert all(part in done.err for part in said), done.err
    assert not (study / "analysis.json").exists()


def test_an_analysis_loads_no_library_that_draws(study: Path) -> None:
    shown = f"from masrel.cli import cli\ncli(['analyze', {str(study)!r}])"
    assert loaded_after(shown) & {"matplotlib", "jinja2", "emcee"} == set()
    assert (study / "analysis.json").is_file()

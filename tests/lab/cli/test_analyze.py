"""masrel analyze: the tables a plan asks for, and one sentence when it cannot be."""

import csv
import json
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


def test_the_tables_are_printed_and_the_analysis_written(
    masrel: Caller, study: Path
) -> None:
    done = masrel("analyze", study)
    assert done.code == 0
    assert "0.626" in done.out
    assert "[0.320, 0.933]" in done.out
    assert "84.4 %" in done.out
    assert "11 of 11 pairs are equal" in done.out
    assert "retest: there are no ratings of session retest" in done.out
    assert done.err == (
        f"read: 32 ratings from {study / 'ratings' / 'published.csv'}\n"
        f"analysis: {study / 'analysis.json'}\n"
    )
    document = json.loads((study / "analysis.json").read_text(encoding="utf-8"))
    value = document["estimates"][0]["estimate"]["value"]
    assert value == pytest.approx(0.626083678854127, abs=1e-15)


def test_what_is_on_stdout_is_a_document_or_tables_alone(
    masrel: Caller, study: Path
) -> None:
    done = masrel("analyze", study, "--json", "-")
    assert (done.code, done.err) == (0, "")
    document = json.loads(done.out)
    assert [line["id"] for line in document["estimates"]] == ["kappa", "again"]
    assert document["estimates"][1]["estimate"] is None
    assert not (study / "analysis.json").exists()
    done = masrel("analyze", study, "--csv")
    assert done.code == 0
    tables = [part for part in done.out.split("\n\n") if part]
    heads = [next(csv.reader(table.splitlines())) for table in tables]
    assert [head[0] for head in heads] == ["id", "model", "model", "question"]
    assert {head[-1] for head in heads} == {"data"}
    assert "\nagain," in done.out


def test_what_is_to_know_of_an_interval_is_a_note_on_stderr(
    masrel: Caller, study: Path
) -> None:
    rows = (study / "ratings/published.csv").read_text(encoding="utf-8").splitlines()
    few = study / "ratings/few.csv"
    two = [row for row in rows if ",R1," in row or ",R2," in row or ",R3," in row]
    few.write_text("\n".join([rows[0], *two]) + "\n", encoding="utf-8")
    done = masrel("analyze", study, "--ratings", few, "--json", "-")
    assert done.code == 0
    json.loads(done.out)
    assert done.err.startswith("note: 3 raters")
    assert done.err.count("\n") == 1


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

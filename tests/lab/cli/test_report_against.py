"""What has changed since an older report, number by number."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from masrel.cli import cli
from tests.cli.process import Caller
from tests.files import edit, published_study, replan

LINE = """
[[analysis.estimates]]
id = "{name}"
kind = "inter-rater"
coefficient = "percent_agreement"
models = "standard"
sessions = ["test"]
target = "raters"
interval = "none"
"""
REPORT = '[report]\nsections = ["agreement", "intended"]\n'


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The published study with one estimate, and its report."""
    root = tmp_path_factory.mktemp("made") / "study"
    published_study(root, LINE.format(name="percent") + REPORT)
    cli(["report", str(root), "--quiet"], standalone_mode=False)
    return root


@pytest.fixture
def study(made: Path, tmp_path: Path) -> Path:
    """A copy with its report, which a test may change."""
    return Path(shutil.copytree(made, tmp_path / "study"))


def change_a_grade(root: Path) -> None:
    edit(root / "ratings/published.csv", "test,R8,HM2,1,", "test,R8,HM2,1+,")


def compared(masrel: Caller, root: Path, *more: object) -> dict[str, Any]:
    done = masrel("report", root, "--json", "-", "--quiet", *more)
    return dict(json.loads(done.out))


def test_another_input_of_the_same_numbers_is_no_change(
    masrel: Caller, study: Path
) -> None:
    against = ("--against", study / "report", "--no-change")
    done = masrel("report", study, *against)
    assert done.code == 0
    assert f"no number has changed since {study / 'report'}" in done.out
    protocol = study / "protocol.toml"
    edit(protocol, 'title = "', 'title = "New: ', 1)
    document = compared(masrel, study, *against)
    assert document["changes"] == []
    (line,) = document["inputs"]
    assert line.startswith("protocol: SHA-256 ")


def test_a_grade_changes_what_it_enters(masrel: Caller, study: Path) -> None:
    change_a_grade(study)
    document = compared(masrel, study, "--against", study / "report")
    changes = {(each["of"], each["field"]): each for each in document["changes"]}
    # six of eight pairs of raters' grades of HM2 were 1+, now seven: of 28 pairs 21
    # are equal, not 16; the mean is over four models
    value = changes["percent", "value"]
    assert value["difference"] == pytest.approx((21 - 16) / 28 / 4, abs=1e-15)
    assert value["new"] == pytest.approx(value["old"] + 5 / 112, abs=1e-15)
    agreed = changes["intended models HM2", "n agree"]
    assert (agreed["old"], agreed["new"], agreed["difference"]) == (6, 7, 1)
    assert document["inputs"][0].startswith("ratings: SHA-256 ")


@pytest.mark.parametrize("writes", [False, True])
def test_a_change_fails_if_asked_to(
    masrel: Caller, study: Path, tmp_path: Path, writes: bool
) -> None:
    old = Path(shutil.copytree(study / "report", tmp_path / "old"))
    change_a_grade(study)
    before = (study / "report" / "analysis.json").read_bytes()
    check = [] if writes else ["--check"]
    done = masrel("report", study, "--against", old, "--no-change", *check)
    assert done.code == 1
    assert "What has changed since" in done.out
    after = (study / "report" / "analysis.json").read_bytes()
    assert (after != before) is writes


def test_rounding_is_no_change_unless_it_is_asked_for(
    masrel: Caller, study: Path, tmp_path: Path
) -> None:
    old = Path(shutil.copytree(study / "report", tmp_path / "old"))
    numbers = old / "analysis.json"
    analysis = json.loads(numbers.read_text("utf-8"))
    estimate = analysis["estimates"][0]["estimate"]
    against, value = ("--against", old, "--no-change"), estimate["value"]
    for part, codes in ((1e-15, (0, 1)), (0.9e-9, (0, 1)), (1.1e-9, (1, 1))):
        estimate["value"] = value * (1.0 + part)
        numbers.write_text(json.dumps(analysis), "utf-8")
        done = [masrel("report", study, *against, *e).code for e in ((), ("--exact",))]
        assert tuple(done) == codes, part


def test_an_estimate_that_is_new_or_gone_is_a_change(
    masrel: Caller, study: Path
) -> None:
    replan(study, LINE.format(name="other") + REPORT)
    document = compared(masrel, study, "--against", study / "report")
    values = {each["of"]: each for each in document["changes"] if each["field"] == "id"}
    assert values["other"]["old"] is None
    assert values["percent"]["new"] is None

"""The study of docs/coordinating.md, held against a script that reads its logs."""

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from docs.make.pages import read
from masrel.lab.progress import study_status
from masrel.lab.protocol import StudyPaths, read_protocol
from tests.docs.test_pages import TEXTS, hold_page

PAGE = "docs/coordinating.md"
SCRIPT = Path(__file__).with_name("independent.py")

pytestmark = pytest.mark.slow
Said = dict[str, Any]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which every command of the page was called."""
    folder = tmp_path_factory.mktemp("coordinated") / "run"
    hold_page(PAGE, folder)
    return folder


@pytest.fixture(scope="module")
def logs(run: Path) -> Said:
    """What the script says, which cannot import masrel."""
    command = [sys.executable, "-I", "-S", str(SCRIPT), str(run / "both")]
    done = subprocess.run(command, check=True, capture_output=True)
    return dict(json.loads(done.stdout))


@pytest.fixture(scope="module")
def stands(run: Path) -> Said:
    """What ``masrel status --json`` says."""
    study = StudyPaths(run / "both")
    return study_status(study, read_protocol(study.protocol))


def rows(file: Path) -> list[dict[str, str]]:
    lines = file.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def test_the_page_has_no_more_than_forty_commands() -> None:
    lines = [line for block in read(TEXTS[PAGE]) for line in block.lines]
    assert sum(line.startswith("$ ") for line in lines) <= 40


def test_ratings_are_those_in_force_by_the_logs(run: Path, logs: Said) -> None:
    columns = ("session", "rater", "code", "model", "grade", "first_grade")
    table = rows(run / "both/ratings/ratings.csv")
    assert sorted(
        [*(r[c] for c in columns), r["grades_from"]] for r in table
    ) == sorted(
        ["NA" if cell is None else cell for cell in rating]
        for session in logs["sessions"].values()
        for rating in session["ratings"]
    )
    corrected = [r["code"] for r in table if r["grade"] != r["first_grade"]]
    assert (len(table), corrected) == (36, ["41W"])
    second = {name: each["second"] for name, each in logs["sessions"].items()}
    twice = {name: of for name, of in second.items() if of != [0, []]}
    assert twice == {"test_R1": [6, []]}  # settled by the correction


def test_days_and_raters_are_those_of_the_logs(
    run: Path, logs: Said, stands: Said
) -> None:
    held = {
        f"{each['session']}_{each['rater']}": each["held_on"]
        for each in stands["sessions"]
        if each["held_on"]
    }
    assert held == {name: each["day"] for name, each in logs["sessions"].items()}
    assert (held["test_R1"], held["retest_R1"]) == ("2026-05-04", "2026-05-13")
    table = rows(run / "both/ratings/raters.csv")
    late = ["yes" if each["is_late"] else "no" for each in stands["raters"]]
    assert [(r["late"], r["status"]) for r in table] == [
        *zip(late, (each["status"] for each in stands["raters"]), strict=True)
    ]
    assert [r["rater"] for r in table if r["late"] == "yes"] == logs["late"] == ["R5"]
    left = [r["rater"] for r in table if r["status"] == "withdrawn"]
    assert (left, logs["excluded"]) == ([*logs["withdrawn"]], [])


def test_what_happened_is_that_of_the_logs(run: Path, logs: Said, stands: Said) -> None:
    events = {each["event"]: dict(each) for each in stands["events"]}
    assert logs["withdrawn"] == {"R2": events["withdrawn"]["on"]}
    (adverse,) = logs["adverse"]
    assert adverse | events["noted"] == events["noted"] | {"day": adverse["day"]}
    report = " ".join((run / "both/report/report.md").read_text("utf-8").split())
    assert f"relatedness: possible; onset: {adverse['onset']}" in report
    assert "| 2026-05-27 | withdrawn | R2 |" in report
    assert "the session was held on 2026-05-13, as was corrected on" in report


def test_the_plan_and_its_change_are_those_of_the_logs(
    run: Path, logs: Said, stands: Said
) -> None:
    registered = json.loads((run / "registration.json").read_text(encoding="utf-8"))
    assert registered["protocol"] == logs["plan"]  # that of the first draw
    (change,) = stands["plan_changes"]
    named = [change["key"], *map(json.loads, (change["before"], change["after"]))]
    assert logs["changes"] == [[[*named, change["time_utc"][:10]]]] * 2  # at both sites


def test_kappa_is_that_of_the_logs(run: Path, logs: Said) -> None:
    file = run / "both/report/analysis.json"
    kappa = json.loads(file.read_text(encoding="utf-8"))["estimates"][0]
    value, n_pairs = logs["fleiss"]
    assert kappa["estimate"]["value"] == pytest.approx(value, abs=1e-12)
    n_items, n_raters = len(kappa["items"]), len(kappa["raters"])
    assert n_pairs == n_items * n_raters * (n_raters - 1) / 2 == 40

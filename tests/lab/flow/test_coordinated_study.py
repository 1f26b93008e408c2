"""The study at two sites of the handbook, held against a script that reads its logs."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from docs.make.pages import read
from tests.docs.test_pages import TEXTS, hold_page
from tests.files import table_of

PAGE = "docs/howto/laboratory/coordinating.md"
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


def test_ratings_are_those_in_force_by_the_logs(run: Path, logs: Said) -> None:
    columns = ("session", "rater", "code", "model", "grade", "first_grade")
    table = table_of(run / "both/ratings/ratings.csv")
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


def test_kappa_is_that_of_the_logs(run: Path, logs: Said) -> None:
    file = run / "both/report/analysis.json"
    kappa = json.loads(file.read_text(encoding="utf-8"))["estimates"][0]
    value, n_pairs = logs["fleiss"]
    assert kappa["estimate"]["value"] == pytest.approx(value, abs=1e-12)
    n_items, n_raters = len(kappa["items"]), len(kappa["raters"])
    assert n_pairs == n_items * n_raters * (n_raters - 1) / 2 == 40


def test_the_page_has_no_more_than_forty_commands() -> None:
    lines = [line for block in read(TEXTS[PAGE]) for line in block.lines]
    assert sum(line.startswith("$ ") for line in lines) <= 40

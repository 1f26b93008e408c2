"""masrel gstudy: tables, JSON, page and picture of a generalizability study."""

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

from tests.cli.process import Caller

ORACLE = Path(__file__).parents[1] / "oracles" / "generalizability.json"
DATASET = json.loads(ORACLE.read_text(encoding="utf-8"))["datasets"][0]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Brennan's persons by raters in tasks, with a column more than is used."""
    path = tmp_path / "brennan.csv"
    with path.open("w", encoding="utf-8", newline="") as out:
        rows = csv.writer(out)
        rows.writerow(["person", "task", "rater", "score", "day"])
        for (p, t, r), score in np.ndenumerate(np.array(DATASET["scores"])):
            rows.writerow([f"P{p}", f"T{t}", f"{t}{r}", score, p % 2])
    return path


NESTED = ("--facets", "task,rater", "--nested", "rater:task", "--item", "person")


def test_the_tables_have_the_published_numbers(masrel: Caller, file: Path):
    designs = [arg for n in ("3,4", "6,2") for arg in ("--for", n)]
    done = masrel("gstudy", file, *NESTED, *designs, "--grade", "score", "--cut", 4)
    assert (done.code, done.err) == (0, "")
    for text in ("120 ratings", "10.2963", "0.6475", "rater:task", "0.551", "0.542"):
        assert text in done.out


def test_every_form_has_the_same_numbers(masrel: Caller, file: Path, tmp_path: Path):
    names = ("t.json", "t.svg", "t.html")
    paths = [tmp_path / name for name in names]
    options = ("--json", paths[0], "--figure", paths[1], "--html", paths[2], "--csv")
    call = ("gstudy", file, *NESTED, "--grade", "score", "--aim", 0.6, *options)
    done = masrel(*call, "--cost", "50,20,1")
    assert done.code == 0
    document = json.loads(paths[0].read_text(encoding="utf-8"))
    assert document["format"] == "masrel gstudy 1"
    variances = [row["variance"] for row in document["components"]]
    assert variances == pytest.approx(
        [DATASET["components"][of] for of in ("p", "t", "p × t", "r:t", "p × r:t")]
    )
    cheapest = document["d_study"][-1]
    assert cheapest["dependability"] >= 0.6
    n_t, n_r = cheapest["task"], cheapest["rater"]
    assert cheapest["cost"] == 50 * n_t + 20 * n_t * n_r + 10 * n_t * n_r
    rows = list(csv.DictReader(io.StringIO(done.out.partition("\n\n")[0])))
    assert [float(row["variance"]) for row in rows] == variances
    assert "levels of task" in paths[1].read_text(encoding="utf-8")
    page = paths[2].read_text(encoding="utf-8")
    assert "<svg" in page
    assert "Brennan" in page


def test_single_ratings_of_one_file(masrel: Caller, tmp_path: Path):
    rng = np.random.default_rng(2)
    lines = ["patient,rater,occasion,mas"]
    for p, level in enumerate(rng.normal(size=12)):
        for rater, bias in (("Kim", 0.0), ("Lee", 0.4)):
            for occasion in (1, 2):
                place = int(np.clip(2.5 + level + bias + 0.4 * rng.normal(), 0, 5))
                grade = (
                    "" if (p, rater) == (3, "Kim") else "0 1 1+ 2 3 4".split()[place]
                )
                lines.append(f"{p},{rater},{occasion},{grade}")
    path = tmp_path / "mas.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    done = masrel("gstudy", path, "--facets", "rater,occasion", "--json", "-")
    assert done.code == 0
    document = json.loads(done.out)
    assert document["method"] == "REML"
    icc = {row["shared"]: row["dependability"] for row in document["single_ratings"]}
    assert list(icc) == ["the same rater", "the same occasion", "another of each"]
    assert icc["another of each"] <= min(icc.values())
    fixed = masrel("gstudy", path, "--facets", "rater,occasion", "--fixed", "occasion")
    assert fixed.code == 0
    levels = [
        line.split()[:2] for line in fixed.out.splitlines() if line[:6] == "    1 "
    ]
    assert all(occasion == "2" for _, occasion in levels)


def test_nothing_that_varies_is_undefined(masrel: Caller, tmp_path: Path):
    path = tmp_path / "same.csv"
    path.write_text("item,rater,grade\n1,A,2\n1,B,2\n2,A,2\n2,B,2\n", encoding="utf-8")
    done = masrel("gstudy", path, "--facets", "rater")
    assert done.code == 0
    assert "undefined" in done.out


def test_grades_of_text_need_their_order(masrel: Caller, tmp_path: Path) -> None:
    file = tmp_path / "words.csv"
    rows = [
        f"{p},{r},{('low', 'mid', 'high')[(p + r) % 3]}"
        for p in range(6)
        for r in (0, 1)
    ]
    file.write_text("\n".join(["item,rater,grade", *rows]), encoding="utf-8")
    refused = masrel("gstudy", file, "--facets", "rater")
    assert refused.code == 2
    assert "--categories" in refused.err
    done = masrel("gstudy", file, "--facets", "rater", "--categories", "low,mid,high")
    assert done.code == 0, done.err


def test_teeth_are_measured_in_patients(masrel: Caller, tmp_path: Path) -> None:
    rng, path = np.random.default_rng(8), tmp_path / "teeth.csv"
    level = rng.normal(size=(9, 1, 1)) + rng.normal(size=(9, 2, 1))
    grades = level + 0.5 * rng.normal(size=(9, 2, 3))
    rows = [f"{p},{p}{t},{r},{x}" for (p, t, r), x in np.ndenumerate(grades)]
    path.write_text("\n".join(["patient,tooth,rater,grade", *rows]), encoding="utf-8")
    in_patients = ("--facets", "tooth,rater", "--nested", "tooth:patient")
    call = ("gstudy", path, *in_patients, "--fixed", "tooth", "--for", "1,1")
    done = masrel(*call, "--persons", "30,60", "--json", "-")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    parts = {row["source"]: row["variance"] for row in document["components"]}
    (design,) = document["d_study"]
    # what is measured is a tooth of a patient
    universe = sum(max(parts[of], 0.0) for of in ("patient", "tooth:patient"))
    assert design["universe"] == pytest.approx(universe)
    assert design["absolute_error"] == pytest.approx(
        sum(max(part, 0.0) for of, part in parts.items() if "rater" in of)
    )
    plans = document["planned"]
    assert [(of["n_persons"], of["tooth"], of["rater"]) for of in plans] == [
        (30, 1, 1),
        (60, 1, 1),
    ]
    assert plans[0]["low"] < plans[1]["low"] < design["dependability"]
    shown = masrel(*call, "--persons", "30", "--aim", "0.6").out
    assert "Φ low  Φ high  Low ≥ 0.6" in shown

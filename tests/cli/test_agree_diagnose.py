"""masrel diagnose and compare, and --clusters: as computed by the library."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from masrel import intervals
from masrel.ratings import Reading, read_ratings
from tests.cli.process import Caller

Record = dict[str, Any]

NAMES = ("Kim", "Lee", "Ann", "Gold")


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    """Three raters and a reference on two sites."""
    rng = np.random.default_rng(3)
    true = rng.integers(0, 3, 40)
    lines = ["item,site," + ",".join(NAMES)]
    for k, grade in enumerate(true):
        seen = [
            grade if rng.random() < share else rng.integers(0, 3)
            for share in (0.9, 0.8, 0.4, 0.97)
        ]
        site = "north" if k < 20 else "south"
        lines.append(f"i{k},{site}," + ",".join("abc"[g] for g in seen))
    path = tmp_path / "wide.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def record(masrel: Caller, *call: object) -> Record:
    done = masrel(*call, "--json", "-")
    assert done.code in (0, None), done.err
    document: Record = json.loads(done.out)
    return document


def test_a_diagnosis_is_that_of_the_library(masrel: Caller, wide: Path) -> None:
    arguments = (wide, "--ignore", "site", "--target", "items")
    document = record(masrel, "diagnose", *arguments, "--reference", "Gold")
    assert document["format"] == "masrel diagnose 1"
    (part,) = read_ratings(wide, Reading(ignore=["site"], reference="Gold")).parts
    expected = intervals.diagnose(
        part.ratings, target="items", raters=part.raters, reference="Gold"
    )
    raters = document["diagnosis_raters"]
    assert [row["rater"] for row in raters] == ["Kim", "Lee", "Ann"]
    for place, row in enumerate(raters):
        assert row["change"] == expected.changes[place]
        assert row["low"] == expected.change_low[place]
        assert row["with_reference"] == expected.reference_values[place]
    assert document["diagnosis_pairs"][1]["value"] == expected.pair_values[0, 2]
    assert document["diagnosis_pairs"][1]["high"] == expected.pair_high[0, 2]
    categories = document["diagnosis_categories"]
    assert [row["agreement"] for row in categories] == list(expected.category_values)
    cells = document["diagnosis_confusion"]
    assert len(cells) == 3 * 3 * 3
    (cell,) = (
        c for c in cells if (c["rater"], c["of"], c["said"]) == ("Ann", "a", "b")
    )
    assert cell["n"] == expected.confusion[2, 0, 1]
    assert cell["low"] == expected.share_low[2, 0, 1]
    assert document["estimates"]  # the first table is there, too


def test_the_reference_is_in_no_estimate_between_raters(
    masrel: Caller, wide: Path
) -> None:
    ratings = (wide, "--ignore", "site", "--coefficients", "gwet_ac")
    ratings = (*ratings, "--target", "items")
    with_it = record(masrel, "diagnose", *ratings, "--reference", "Gold")
    without = record(masrel, "agree", *ratings, "--ignore", "Gold")
    assert with_it["estimates"] == without["estimates"]
    (estimate,) = with_it["estimates"]
    for row in with_it["diagnosis_raters"]:
        assert row["without"] - row["change"] == pytest.approx(estimate["value"])
    assert with_it["notes"] == []  # not that Gold counts as a rater

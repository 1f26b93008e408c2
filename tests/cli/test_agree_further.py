"""masrel agree and compare: further tables, by hand, published, and as computed."""

import csv
import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from scipy import stats

from masrel import intervals
from masrel.agreement import holm
from tests.cli.process import Caller

Record = dict[str, Any]

# docs/agreement/stratified_kappa.md: pairs of grades of three raters, by item
PAIRS = {
    "R1": [("a", "a"), ("b", "b"), ("a", "b")],
    "R2": [("a", "a"), ("b", "b"), ("b", "b")],
    "R3": [("a", "a"), ("a", "a"), ("a", "a")],
}

# docs/agreement/symmetry.md
THREE = [[10, 5, 1], [1, 10, 2], [3, 4, 8]]


def write(path: Path, header: str, rows: Sequence[Sequence[object]]) -> Path:
    lines = [header, *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def retest_rows(order: int = 1) -> list[tuple[str, ...]]:
    """Return rows of session, rater, item and grade; the second session in an order."""
    rows = [
        (session, rater, f"I{item}", pair[place])
        for place, session in enumerate(("test", "retest"))
        for rater, pairs in PAIRS.items()
        for item, pair in enumerate(pairs)
    ]
    return rows[:9] + rows[9:][::order]


def pairs_of(table: Sequence[Sequence[int]], names: str) -> list[tuple[str, str, str]]:
    """Return an item and two grades for every count of a contingency table."""
    cells = itertools.product(enumerate(table), range(len(table)))
    both = [
        (names[row], names[column])
        for (row, counts), column in cells
        for _ in range(counts[column])
    ]
    return [(f"I{n}", *pair) for n, pair in enumerate(both)]


def record(masrel: Caller, *arguments: object, command: str = "agree") -> Record:
    done = masrel(command, *arguments, "--json", "-")
    assert done.code in (0, None), done.err
    document: Record = json.loads(done.out)
    return document


@pytest.fixture
def clinics(tmp_path: Path) -> Path:
    # three clinics with items of their own, each rated by two
    rows = [
        (clinic, f"{clinic}{n}", *pair)
        for clinic, pairs in (
            ("A", "aa bb ab aa bb aa bb ba aa bb bb aa"),
            ("B", "aa bb aa aa bb bb aa bb aa bb ab"),
            ("C", "ab ba ab bb aa ab ba ab aa bb"),
        )
        for n, pair in enumerate(pairs.split())
    ]
    return write(tmp_path / "clinics.csv", "clinic,item,Kim,Lee", rows)


def grades_of(path: Path, clinic: str) -> list[list[str]]:
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [[row["Kim"], row["Lee"]] for row in rows if row["clinic"] == clinic]


# --- test and retest


@pytest.mark.parametrize("order", [1, -1])
def test_retest_by_hand_whatever_the_order_of_the_rows(
    masrel: Caller, tmp_path: Path, order: int
) -> None:
    # κ of the raters 2/5, 1 and 0/0; of all 2/3, and 10/13 of one table: see the page
    path = write(tmp_path / "r.csv", "session,rater,item,grade", retest_rows(order))
    names = ("--session", "session", "--retest", "--coefficients", "pooled_kappa")
    rows = record(masrel, path, *names)["retest"]
    assert [row["rater"] for row in rows] == ["R1", "R2", "R3", None, None]
    assert [row["coefficient"] for row in rows] == [
        *["cohen_kappa"] * 3,
        "stratified_kappa",
        "pooled_kappa",
    ]
    values = [0.4, 1.0, None, 2 / 3, 10 / 13]
    assert [row["value"] for row in rows] == pytest.approx(values, abs=1e-14)
    assert "0/0" in rows[2]["reason"]
    assert rows[3]["standard_error"] == pytest.approx(0.339, abs=5e-4)
    assert [row["n_raters"] for row in rows] == [1, 1, 1, 3, 3]
    assert {row["n_items"] for row in rows} == {3}


# --- each category


# --- two raters


@pytest.mark.parametrize("as_table", [False, True])
def test_tests_of_symmetry_by_hand(
    masrel: Caller, tmp_path: Path, as_table: bool
) -> None:
    # 13/3 with three degrees; 22/7 and 44/13 with two: see docs/agreement/symmetry.md
    if as_table:
        rows = [(name, *row) for name, row in zip("abc", THREE, strict=True)]
        path = write(tmp_path / "t.csv", ",a,b,c", rows)
    else:
        path = write(tmp_path / "w.csv", "item,Kim,Lee", pairs_of(THREE, "abc"))
    extra = ("--table",) if as_table else ()
    found = record(masrel, path, *extra, "--symmetry")["symmetry"]
    assert [(row["test"], row["kind"], row["df"]) for row in found] == [
        ("bowker", None, [3.0]),
        ("stuart_maxwell", None, [2.0]),
        ("bhapkar", None, [2.0]),
    ]
    statistics = [row["statistic"] for row in found]
    assert statistics == pytest.approx([13 / 3, 22 / 7, 44 / 13], rel=1e-14)
    for row, x in zip(found, statistics, strict=True):
        assert row["p_value"] == pytest.approx(stats.chi2.sf(x, row["df"][0]))
        assert (row["n_items"], row["reason"]) == (44, None)


# --- differences


def test_differences_of_clinics_are_those_of_the_library(
    masrel: Caller, clinics: Path
) -> None:
    document = record(masrel, clinics, "--by", "clinic", command="compare")
    assert document["format"] == "masrel compare 1"
    found = [
        row for row in document["differences"] if row["coefficient"] == "fleiss_kappa"
    ]
    assert [(row["first"], row["second"]) for row in found] == [
        ("A", "B"),
        ("A", "C"),
        ("B", "C"),
    ]
    for row in found:
        both = [grades_of(clinics, row[side]) for side in ("first", "second")]
        expected = intervals.difference(
            "fleiss_kappa", *both, design="independent", categories=["a", "b"]
        )
        assert row["design"] == "independent"
        assert row["value"] == expected.value
        assert row["standard_error"] == expected.standard_error
        assert expected.interval is not None
        assert row["interval"]["low"] == expected.interval.low
        test = intervals.difference_test(
            "fleiss_kappa", *both, design="independent", categories=["a", "b"]
        )
        assert (row["t"], row["df"], row["p_value"]) == (
            test.statistic,
            test.df[0],
            test.p_value,
        )
    assert [row["p_holm"] for row in found] == holm([row["p_value"] for row in found])
    # the least of three times 3
    least = min(found, key=lambda row: row["p_value"])
    assert least["p_holm"] == pytest.approx(3 * least["p_value"], rel=1e-15)
    assert document["options"]["target"] == "items"
    assert {e["interval"]["target"] for e in document["estimates"]} == {"items"}

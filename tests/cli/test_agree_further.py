"""masrel agree: tables below that of agreement, by hand, published, and as computed."""

import csv
import itertools
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from masrel import intervals
from masrel.agreement import holm, strength
from tests.agreement.test_category import DIAGNOSES, PATIENTS, RATINGS
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

# docs/agreement/indices.md
YES_NO = [[20, 5], [10, 15]]


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


def record(masrel: Caller, *arguments: object) -> Record:
    done = masrel("agree", *arguments, "--json", "-")
    assert done.code in (0, None), done.err
    document: Record = json.loads(done.out)
    return document


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    path = tmp_path / "sessions.csv"
    return write(path, "session,rater,item,grade", retest_rows())


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


def test_retest_of_a_wide_file_is_that_of_a_long_one(
    masrel: Caller, tmp_path: Path, sessions: Path
) -> None:
    rows = [
        (session, f"I{item}", *(pairs[item][place] for pairs in PAIRS.values()))
        for place, session in enumerate(("test", "retest"))
        for item in range(3)
    ]
    wide = write(tmp_path / "wide.csv", "session,item,R1,R2,R3", rows)
    both = [
        record(masrel, path, "--session", "session", "--retest")["retest"]
        for path in (sessions, wide)
    ]
    assert both[0] == both[1]


def test_retest_has_intervals_of_the_library(masrel: Caller, sessions: Path) -> None:
    names = ("--session", "session", "--retest", "--target", "items")
    rows = record(masrel, sessions, *names, "--interval", "jackknife")["retest"]
    pairs = [[list(pair) for pair in of] for of in PAIRS.values()]
    with pytest.warns(match="items"):
        expected = intervals.jackknife("stratified_kappa", pairs, target="items")
    with pytest.warns(match="items"):
        first = intervals.jackknife("cohen_kappa", pairs[0], target="items")
    for row, interval in ((rows[3], expected), (rows[0], first)):
        assert (row["interval"]["low"], row["interval"]["high"]) == (
            interval.low,
            interval.high,
        )
        assert row["interval"]["method"] == interval.method


def test_other_raters_have_no_say_in_the_kappa_of_one(
    masrel: Caller, sessions: Path
) -> None:
    rows = record(
        masrel, sessions, "--session", "session", "--retest", "--target", "raters"
    )["retest"]
    assert [row["interval"] is None for row in rows] == [True, True, True, False]
    assert rows[3]["interval"]["target"] == "raters"


def test_a_rater_and_an_item_of_one_session_are_left_out_and_named(
    masrel: Caller, tmp_path: Path, sessions: Path
) -> None:
    expected = record(masrel, sessions, "--session", "session", "--retest")["retest"]
    more = [("test", "R9", "I0", "a"), ("retest", "R1", "I7", "b")]
    rows = [*more[:1], *retest_rows(), *more[1:]]
    path = write(tmp_path / "more.csv", "session,rater,item,grade", rows)
    names = ("--session", "session", "--retest")
    assert record(masrel, path, *names)["retest"] == expected
    out = masrel("agree", path, *names).out
    assert "Left out: rater R9 (test only); item I7 (retest only)." in out


def test_the_first_table_estimates_each_session(masrel: Caller, sessions: Path) -> None:
    found = record(masrel, sessions, "--session", "session", "--retest")
    expected = record(masrel, sessions, "--by", "session")
    assert found["estimates"] == expected["estimates"]
    assert found["options"] == {**expected["options"], "by": None}


def test_one_rater_alone_has_a_retest_and_nothing_between_raters(
    masrel: Caller, tmp_path: Path
) -> None:
    rows = [row for row in retest_rows() if row[1] == "R1"]
    path = write(tmp_path / "one.csv", "session,rater,item,grade", rows)
    document = record(masrel, path, "--session", "session", "--retest")
    assert document["estimates"] == []
    assert [row["value"] for row in document["retest"]] == [0.4, 0.4]
    out = masrel("agree", path, "--session", "session", "--retest").out
    assert out.startswith("Agreement of raters with themselves\nRead CSV")


def test_retest_of_groups_is_one_of_each(masrel: Caller, tmp_path: Path) -> None:
    rows = [(clinic, *row) for clinic in "AB" for row in retest_rows()]
    rows = [row for row in rows if row[0] == "A" or row[2] == "R1"]
    path = write(tmp_path / "g.csv", "clinic,session,rater,item,grade", rows)
    found = record(masrel, path, "--by", "clinic", "--retest")["retest"]
    assert [(row["clinic"], row["rater"]) for row in found] == [
        *[("A", rater) for rater in ("R1", "R2", "R3", None)],
        ("B", "R1"),
        ("B", None),
    ]
    of_both = [found[3]["value"], found[5]["value"]]
    assert of_both == pytest.approx([2 / 3, 0.4], abs=1e-14)


# --- each category


def test_the_kappa_of_each_diagnosis_is_the_published_one(
    masrel: Caller, tmp_path: Path
) -> None:
    # Fleiss (1971), Table 2, from ratings and from their counts
    rows = [(n, *ratings) for n, ratings in enumerate(RATINGS)]
    wide = write(tmp_path / "wide.csv", "patient,R1,R2,R3,R4,R5,R6", rows)
    counted = [(f"P{n}", *patient) for n, patient in enumerate(PATIENTS)]
    counts = write(tmp_path / "n.csv", f"patient,{','.join(DIAGNOSES)}", counted)
    scale = ("--categories", ",".join(DIAGNOSES))
    of_ratings = record(masrel, wide, *scale, "--each-category")["categories"]
    of_counts = record(masrel, counts, "--counts", "--each-category")["categories"]
    for found in (of_ratings, of_counts):
        assert [row["category"] for row in found] == DIAGNOSES
        assert [round(row["value"], 3) for row in found] == [
            *(0.245, 0.245, 0.520, 0.471, 0.566)
        ]
    for one, other in zip(of_ratings, of_counts, strict=True):
        assert other["standard_error"] == pytest.approx(one["standard_error"])


def test_the_interval_of_a_category_is_that_of_the_folded_ratings(
    masrel: Caller, tmp_path: Path
) -> None:
    rows = [(n, *ratings) for n, ratings in enumerate(RATINGS)]
    wide = write(tmp_path / "wide.csv", "patient,R1,R2,R3,R4,R5,R6", rows)
    found = record(masrel, wide, "--each-category", "--target", "items")["categories"]
    for row in found:
        folded = [
            ["no", "yes"][grade == row["category"]] for r in RATINGS for grade in r
        ]
        table = [folded[at : at + 6] for at in range(0, len(folded), 6)]
        expected = intervals.estimate("fleiss_kappa", table, target="items")
        assert row["value"] == pytest.approx(expected.value, rel=1e-14)
        assert expected.interval is not None
        assert row["interval"]["low"] == pytest.approx(expected.interval.low, rel=1e-9)
        assert row["interval"]["high"] == pytest.approx(
            expected.interval.high, rel=1e-9
        )


def test_a_category_that_nobody_used_says_so(masrel: Caller, sessions: Path) -> None:
    found = record(
        masrel,
        *(sessions, "--by", "session", "--categories", "a,b,c", "--each-category"),
        *("--target", "items"),
    )["categories"]
    unused = [row for row in found if row["category"] == "c"]
    assert [row["session"] for row in unused] == ["test", "retest"]
    for row in unused:
        assert (row["value"], row["interval"]) == (None, None)
        assert "0/0" in row["reason"]


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


def test_two_categories_have_mcnemars_test(masrel: Caller, tmp_path: Path) -> None:
    # one change of six the other way: p = 2 (1 + 6)/2⁶; corrected (|1 - 5| - 1)²/6
    path = write(tmp_path / "w.csv", "item,K,L", pairs_of([[10, 5], [1, 10]], "ab"))
    exact, corrected, bowker, *_ = record(masrel, path, "--symmetry")["symmetry"]
    assert (exact["test"], exact["kind"]) == ("mcnemar", "exact")
    assert (exact["statistic"], exact["df"], exact["p_value"]) == (1.0, [6.0], 7 / 32)
    assert (corrected["kind"], corrected["statistic"]) == ("corrected", 9 / 6)
    assert bowker["statistic"] == 16 / 6


def test_indices_by_hand(masrel: Caller, tmp_path: Path) -> None:
    # docs/agreement/indices.md; 40/55 and 30/45 are the agreement on yes and on no
    path = write(
        tmp_path / "w.csv",
        "item,Kim,Lee",
        [
            (item, *({"y": "yes", "n": "no"}[grade] for grade in pair))
            for item, *pair in pairs_of(YES_NO, "yn")
        ],
    )
    found = record(masrel, path, "--indices", "--categories", "yes,no")["indices"]
    assert [(row["index"], row["category"]) for row in found] == [
        ("pabak", None),
        ("prevalence_index", None),
        ("bias_index", None),
        ("kappa_max", None),
        ("specific_agreement", "yes"),
        ("specific_agreement", "no"),
    ]
    assert [row["value"] for row in found] == pytest.approx(
        [0.4, 0.1, 0.1, 0.8, 40 / 55, 30 / 45], rel=1e-15
    )
    # 2 p_o - 1 has twice the error of p_o: 2 √(0.7 · 0.3/49)
    assert found[0]["standard_error"] == pytest.approx(2 * (0.21 / 49) ** 0.5)
    assert {row["n_items"] for row in found} == {50}


# --- differences


def test_differences_of_clinics_are_those_of_the_library(
    masrel: Caller, clinics: Path
) -> None:
    document = record(masrel, clinics, "--by", "clinic", "--compare")
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


def test_clinics_compare_as_welchs_t_test_does(masrel: Caller, clinics: Path) -> None:
    found = record(
        masrel,
        *(clinics, "--by", "clinic", "--compare"),
        *("--coefficients", "percent_agreement"),
    )["differences"]
    for row in found:
        both = [
            [float(a == b) for a, b in grades_of(clinics, row[side])]
            for side in ("first", "second")
        ]
        expected = stats.ttest_ind(*both, equal_var=False)
        assert row["p_value"] == pytest.approx(expected.pvalue, rel=1e-9)


def test_groups_of_the_same_items_are_compared_item_by_item(
    masrel: Caller, tmp_path: Path
) -> None:
    before, after = "aa ab bb ba aa ab bb aa ba bb", "aa aa bb ba aa bb bb aa ba bb"
    rows = [
        (when, f"I{n}", *pair)
        for when, pairs in (("before", before), ("after", after))
        for n, pair in enumerate(pairs.split())
    ]
    rows = rows[:10] + rows[10:][::-1]  # by name, not by place
    path = write(tmp_path / "w.csv", "when,item,Kim,Lee", rows)
    names = ("--by", "when", "--compare", "--coefficients", "percent_agreement")
    (row,) = record(masrel, path, *names)["differences"]
    both = [[float(p[0] == p[1]) for p in of.split()] for of in (before, after)]
    expected = stats.ttest_rel(*both)
    assert row["design"] == "dependent"
    assert row["t"] == pytest.approx(expected.statistic, rel=1e-9)
    assert row["p_value"] == pytest.approx(expected.pvalue, rel=1e-9)
    assert row["p_holm"] == row["p_value"]
    out = masrel("agree", path, *names).out
    assert "Items the same" in out
    assert "Holm" not in out  # of one pair there is nothing to adjust
    assert ",p_holm" in masrel("agree", path, *names, "--csv").out


def test_a_difference_without_spread_is_null_with_its_reason(
    masrel: Caller, tmp_path: Path
) -> None:
    rows = [(g, f"{g}{n}", p, p) for g in "AB" for n, p in enumerate("abab")]
    path = write(tmp_path / "w.csv", "g,item,Kim,Lee", rows)
    for row in record(masrel, path, "--by", "g", "--compare")["differences"]:
        assert (row["value"], row["p_value"], row["p_holm"]) == (0.0, None, None)
        assert row["test_reason"] == row["interval"]["reason"]
        assert "leaves the difference as it is" in row["test_reason"]


def three_groups(folder: Path, *, same_items: bool) -> Path:
    rng = np.random.default_rng(29)
    lines = ["item,when,Kim,Lee"]
    for when, share in (("before", 0.4), ("after", 0.8), ("later", 0.7)):
        for k in range(40):
            true = rng.integers(0, 2)
            pair = [
                true if rng.random() < share else rng.integers(0, 2) for _ in range(2)
            ]
            name = f"m{k}" if same_items else f"{when} {k}"
            lines.append(f"{name},{when},{pair[0]},{pair[1]}")
    path = folder / "three.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_three_groups_of_other_items_are_tested_for_equality(
    masrel: Caller, tmp_path: Path
) -> None:
    path = three_groups(tmp_path, same_items=False)
    names = ("--by", "when", "--compare", "--coefficients", "scott_pi")
    document = record(masrel, path, *names)
    estimates, tests = document["estimates"], document["equality"]
    assert [test["test"] for test in tests] == ["equality_test", "donner_test"]
    precision = np.array([e["standard_error"] for e in estimates]) ** -2.0
    values = np.array([e["value"] for e in estimates])
    away = values - precision @ values / precision.sum()
    assert tests[0]["statistic"] == pytest.approx(precision @ away**2, rel=1e-12)
    assert tests[0]["df"] == [2.0]
    shown = masrel("agree", path, *names).out
    assert "Fleiss' weighted χ²: groups of other items" in shown


def test_three_groups_of_the_same_items_are_tested_by_hotellings_t2(
    masrel: Caller, tmp_path: Path
) -> None:
    path = three_groups(tmp_path, same_items=True)
    rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
    sets = [
        [row[2:] for row in rows if row[1] == when]
        for when in ("before", "after", "later")
    ]
    expected = intervals.differences(
        "cohen_kappa", sets, categories=["0", "1"]
    ).equality
    names = ("--by", "when", "--compare", "--coefficients", "cohen_kappa")
    (test,) = record(masrel, path, *names)["equality"]
    assert test["statistic"] == pytest.approx(expected.statistic, rel=1e-12)
    assert test["df"] == [2.0, 38.0]
    assert test["p_value"] == pytest.approx(expected.p_value, rel=1e-12)


# --- how they are shown

ALL = ("--by", "clinic", "--each-category", "--symmetry", "--indices", "--compare")


def test_text_csv_and_latex_have_every_table(masrel: Caller, clinics: Path) -> None:
    names = ["categories", "symmetry", "indices", "differences", "equality"]
    document = record(masrel, clinics, *ALL)
    assert [key for key in document if key in names] == names
    assert len(masrel("agree", clinics, *ALL).out.split("\n\n")) == 6
    latex = masrel("agree", clinics, *ALL, "--latex").out
    assert [f"\\label{{tab:{name}}}" in latex for name in names] == [True] * 5
    assert latex.count(r"\begin{table}") == latex.count(r"\end{table}") == 6
    tables = [
        list(csv.DictReader(part.splitlines()))
        for part in masrel("agree", clinics, *ALL, "--csv").out.split("\n\n")
    ]
    assert len(tables) == 6
    for name, rows in zip(names, tables[1:], strict=True):
        assert len(rows) == len(document[name])
    for row, found in zip(tables[4], document["differences"], strict=True):
        assert float(row["difference"]) == found["value"]
        assert float(row["p_holm"]) == found["p_holm"]
        assert row["coefficient"] == found["coefficient"]


def test_without_the_options_nothing_of_them_is_loaded(clinics: Path) -> None:
    code = (
        "import sys; from masrel.cli import main\n"
        f"sys.argv = ['masrel', 'agree', {str(clinics)!r}, '--by', 'clinic']\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print([name for name in sys.modules if name.startswith('scipy')\n"
        "       or name.endswith('masrel.intervals')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


def test_words_reach_the_tables_of_estimates(masrel: Caller, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    rows = [
        (session, item, *((item % 3 + (rng.random(2) < 0.3)) % 3).tolist())
        for session in ("test", "retest")
        for item in range(30)
    ]
    path = write(tmp_path / "r.csv", "session,item,A,B", rows)
    call = ("agree", path, "--session", "session", "--retest", "--each-category")
    call = (*call, "--words", "altman", "--json", "-")
    plain = json.loads(masrel(*call).out)
    for key in ("retest", "categories"):
        for one in plain[key]:  # of a normal law without an interval
            reached = one["value"] - stats.norm.ppf(0.95) * one["standard_error"]
            assert one["word"] == strength(reached, scale="altman")
    shown = json.loads(masrel(*call, "--target", "items", "--level", "0.9").out)
    for key in ("retest", "categories"):
        for one in shown[key]:
            low = one["interval"]["low"]
            assert one["word"] == strength(low, scale="altman")

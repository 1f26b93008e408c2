"""masrel judge: judges beside humans, rates, gates, and what is printed of them."""

import csv
import io
import json
from itertools import combinations
from pathlib import Path
from random import Random
from typing import Any

import pytest

from masrel.judges import (
    advantage,
    alternative_annotator_test,
    bradley_terry,
    dawid_skene_intervals,
    effective_number,
    judge_plan,
    labels_needed,
    position_bias,
    rate_estimates,
)
from tests.cli.process import Caller

EXPERT = ("--annotators", "expert")
RIGHT = {"Kim": 0.95, "Lee": 0.9, "Ann": 0.9, "large": 0.92, "small": 0.6}


def made(n_items: int, right: dict[str, float], every: int = 1) -> list[dict[str, str]]:
    """Items passed or failed by raters who are right so often; Kim rates a part."""
    draw = Random(11).random
    rows = []
    for item in range(n_items):
        truth = "pass" if draw() < 0.7 else "fail"
        wrong = "fail" if truth == "pass" else "pass"
        row = {name: truth if draw() < of else wrong for name, of in right.items()}
        row |= {} if item % every == 0 else {"Kim": ""}
        rows.append({"item": f"i{item}", "document": f"d{item // 3}", **row})
    return rows


def written(folder: Path, rows: list[dict[str, str]], name: str = "r.csv") -> Path:
    file = folder / name
    with file.open("w", encoding="utf-8", newline="") as out:
        lines = csv.DictWriter(out, list(rows[0]))
        lines.writeheader()
        lines.writerows(rows)
    return file


def graded(rows: list[dict[str, str]], rater: str) -> dict[str, str]:
    return {row["item"]: row[rater] for row in rows if row[rater]}


ROWS = made(60, RIGHT)
MONITORED = made(400, {"Kim": 0.99, "large": 0.85}, every=5)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return written(tmp_path, ROWS)


@pytest.fixture
def monitored(tmp_path: Path) -> Path:
    return written(tmp_path, MONITORED)


def document(masrel: Caller, *call: object) -> dict[str, Any]:
    columns = ("--item", "item", "--ignore", "document")
    done = masrel("judge", *call, *columns, "--json", "-")
    assert done.code == 0, done.err
    read: dict[str, Any] = json.loads(done.out)
    return read


def test_numbers_are_those_of_the_functions(masrel: Caller, file: Path) -> None:
    call = (file, "--judge", "large", "--judge", "small", *EXPERT, "--target", "items")
    shown = document(masrel, *call)
    humans = {name: graded(ROWS, name) for name in ("Kim", "Lee", "Ann")}
    for row in shown["judges"]:
        judge = graded(ROWS, row["judge"])
        result = alternative_annotator_test(humans, judge, epsilon=0.2)
        estimate = advantage(humans, judge, target="items")
        assert row["winning_rate"] == result.winning_rate
        assert row["advantage"] == result.advantage == estimate.value
        assert estimate.interval is not None
        assert row["interval"]["low"] == estimate.interval.low
        lines = [of for of in shown["humans"] if of["judge"] == row["judge"]]
        assert [(of["human"], of["b"], of["c"], of["p_value"]) for of in lines] == [
            (of.name, of.b, of.c, of.p_value) for of in result.humans
        ]
    assert shown["options"]["epsilon"] == 0.2
    (pair,) = shown["judge_differences"]
    large, small = (row["advantage"] for row in shown["judges"])
    assert pair["value"] == pytest.approx(large - small, abs=1e-12)


def test_a_verdict_says_what_was_shown_and_what_was_not(
    masrel: Caller, file: Path
) -> None:
    call = ("judge", file, "--ignore", "document", *EXPERT, "--sentence")
    passes = masrel(*call, "--judge", "large", "--ignore", "small").out
    fails = masrel(*call, "--judge", "small", "--ignore", "large").out
    assert "large can replace a human" in passes
    assert "small has not been shown" in fails
    assert "does not prove" in fails


def test_a_reference_is_no_human_and_is_enough_for_one(
    masrel: Caller, file: Path
) -> None:
    call = (file, "--judge", "large", "--reference", "Kim", *EXPERT)
    both = document(masrel, *call, "--ignore", "small")
    assert [row["human"] for row in both["humans"]] == ["Lee", "Ann"]
    alone = document(masrel, *call, "--humans", "Lee")
    (row,) = alone["judge_reference"]
    gold, lee, large = (graded(ROWS, name) for name in ("Kim", "Lee", "large"))
    right = {item: (of == large[item], of == lee[item]) for item, of in gold.items()}
    b, c = (list(right.values()).count(of) for of in ((True, False), (False, True)))
    assert (row["judge_right"], row["human_right"]) == (b, c)
    assert row["difference"] == pytest.approx((b - c) / len(gold))


def test_named_humans_are_all_there_are(masrel: Caller, file: Path) -> None:
    call = (file, "--judge", "large", "--humans", "Kim,Lee", *EXPERT)
    assert [row["human"] for row in document(masrel, *call)["humans"]] == ["Kim", "Lee"]


@pytest.mark.parametrize("name", ["model", "judge"])
def test_a_judge_may_be_called_as_other_columns_are(
    masrel: Caller, tmp_path: Path, name: str
) -> None:
    rows = [{name if k == "large" else k: v for k, v in of.items()} for of in ROWS]
    call = (written(tmp_path, rows), "--judge", name, *EXPERT, "--ignore", "small")
    (row,) = document(masrel, *call)["judges"]
    assert (row["judge"], row["n_humans"]) == (name, 3)


def test_a_score_by_weights_of_ordered_grades(masrel: Caller, file: Path) -> None:
    call = (file, "--judge", "large", *EXPERT, "--categories", "fail,pass")
    scores = {
        score: document(masrel, *call, "--score", score)["humans"]
        for score in ("accuracy", "neg_rmse", "linear")
    }
    # of two grades all are the same
    counts = [[(of["b"], of["c"]) for of in rows] for rows in scores.values()]
    assert counts[0] == counts[1] == counts[2]


def test_clusters_leave_as_a_whole(masrel: Caller, file: Path) -> None:
    call = ("judge", file, "--item", "item", "--judge", "large", *EXPERT)
    more = ("--clusters", "document", "--target", "items", "--json", "-")
    done = masrel(*call, *more)
    assert done.code == 0, done.err
    shown = json.loads(done.out)
    assert shown["judges"][0]["n_clusters"] == 20
    assert shown["judges"][0]["interval"]["unit"] == "clusters"
    assert {row["test"] for row in shown["humans"]} == {"clusters"}


def test_rates_are_those_of_the_function(masrel: Caller, monitored: Path) -> None:
    shown = document(masrel, monitored, "--judge", "large", "--rate", "pass")
    labels, judge = graded(MONITORED, "Kim"), graded(MONITORED, "large")
    result = rate_estimates(labels, judge, grade="pass")
    keys = ("method", "value", "low", "high", "n_labels")
    assert [[row[key] for key in keys] for row in shown["rates"]] == [
        [getattr(of, key) for key in keys] for of in result.rows
    ]
    (default,) = (row["method"] for row in shown["rates"] if row["is_default"])
    assert default == result.default


@pytest.mark.parametrize(
    ("gate", "code", "verdict"),
    [
        ("large.winning_rate >= 0.5", 0, "holds"),
        ("small.winning_rate>=0.5", 1, "fails"),
        ("large.low >= 0.99", 1, "fails"),
        ("large.high <= 1", 0, "holds"),
        ("large.advantage > 0.5", 0, "holds"),
    ],
)
def test_a_gate_of_a_judge(
    masrel: Caller, file: Path, gate: str, code: int, verdict: str
) -> None:
    call = ("judge", file, "--judge", "large", "--judge", "small", *EXPERT)
    more = ("--ignore", "document", "--target", "items", "--require", gate)
    done = masrel(*call, *more)
    assert done.code == code
    name = gate.partition(".")[0]
    (line,) = (of for of in done.err.splitlines() if of.startswith("--require"))
    assert line.startswith(f"--require: {name}.")
    assert f" {verdict}: " in line


def test_a_gate_without_its_interval_fails(masrel: Caller, file: Path) -> None:
    call = ("judge", file, "--ignore", "document", "--judge", "large", *EXPERT)
    done = masrel(*call, "--require", "large.low >= 0")
    assert done.code == 1
    assert "--target items" in done.err


def test_gates_of_rates_and_in_the_json(masrel: Caller, monitored: Path) -> None:
    call = ("judge", monitored, "--ignore", "document", "--judge", "large")
    rate = ("--rate", "pass", "--require", "rate.low >= 0.5", "--json", "-")
    done = masrel(*call, *rate, "--require", "large.rate.value > 0.999")
    assert done.code == 1
    gates = json.loads(done.out)["gates"]
    assert [gate["holds"] for gate in gates] == [True, False]
    assert gates[0]["gate"] == "rate.low >= 0.5"


def test_groups_are_judged_each_and_have_gates(masrel: Caller, tmp_path: Path) -> None:
    rows = [{"task": name, **row} for name in ("sums", "law") for row in ROWS]
    file = written(tmp_path, rows)
    call = ("judge", file, "--by", "task", "--ignore", "document,small", *EXPERT)
    done = masrel(
        *call, "--judge", "large", "--require", "law: large.winning_rate >= 0", "--csv"
    )
    assert done.code == 0, done.err
    table = list(csv.DictReader(io.StringIO(done.out.partition("\n\n")[0])))
    assert [row["task"] for row in table] == ["sums", "law"]
    assert table[0]["advantage"] == table[1]["advantage"]


def test_preferences_are_those_of_the_functions(masrel: Caller, tmp_path: Path) -> None:
    draw, names = Random(5).choice, ("a", "b", "c")
    rows = [
        (item, first, second, draw((first, second, second, "tie")))
        for item, (one, two) in enumerate(combinations(names * 8, 2))
        if one != two
        for first, second in ((one, two), (two, one))
    ]
    rows.append((999, "a", "b", "b"))  # and one in one order
    table = [
        {"pair": item, "judge": "large", "first": first, "winner": best}
        for item, first, _, best in rows
    ]
    file = written(tmp_path, table)
    picture = tmp_path / "strengths.svg"
    call = ("judge", file, "--order", "first", "--figure", picture)
    shown = json.loads(masrel(*call, "--json", "-").out)
    assert "<svg" in picture.read_text("utf-8")
    bias, fit = position_bias(rows), bradley_terry(rows)
    (row,) = shown["preferences"]
    for key in ("value", "low", "high", "agreement", "n_pairs", "n_ties", "n_unpaired"):
        assert row[key] == getattr(bias, key), key
    assert row["p_value"] == bias.mcnemar.p_value
    strengths = {row["model"]: row["value"] for row in shown["strengths"]}
    expected = dict(zip(fit.models, fit.strengths.tolist(), strict=True))
    assert strengths == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("form", ["--csv", "--latex", "--sentence"])
def test_forms_are_printed(masrel: Caller, file: Path, form: str) -> None:
    call = ("judge", file, "--ignore", "document", "--judge", "large", *EXPERT)
    done = masrel(*call, "--humans", "Kim,Lee,Ann", form)
    assert done.code == 0, done.err
    assert "large" in done.out


def test_pages_and_pictures_of_both_questions(masrel: Caller, tmp_path: Path) -> None:
    # two humans are needed for ε, one has the labels
    rows = [{**row, "Lee": row["large"], "Ann": row["large"]} for row in MONITORED]
    file = written(tmp_path, rows, "both.csv")
    page, picture = tmp_path / "page.html", tmp_path / "picture.svg"
    call = ("judge", file, "--ignore", "document", "--judge", "large", *EXPERT)
    more = ("--reference", "Kim", "--rate", "pass", "--html", page)
    done = masrel(*call, *more, "--target", "items", "--figure", picture)
    assert done.code == 0, done.err
    text = page.read_text("utf-8")
    assert "Calderon" in text
    assert "Rogan" in text
    assert text.count("<figure") >= 2
    assert "ε" in picture.read_text("utf-8") or picture.stat().st_size > 10_000


def test_items_are_planned_for_a_judge_and_for_a_rate(masrel: Caller) -> None:
    rate = ("--rate", "0.7", "--sensitivity", "0.9", "--specificity", "0.8")
    aim = ("--items", "500", "--half-width", "0.06", "--json", "-")
    labels = json.loads(masrel("plan", "--judge", *rate, *aim).out)["n_labels"]
    share = {"rate": 0.7, "sensitivity": 0.9, "specificity": 0.8}
    assert labels == labels_needed(0.06, n_items=500, **share)
    call = ("plan", "--judge", "--epsilon", "0.2", "--raters", "3", "--accuracy")
    plan = json.loads(masrel(*call, "0.9,0.85", "--items", "40", "--json", "-").out)
    made = judge_plan(
        epsilon=0.2,
        n_humans=3,
        human_accuracy=0.9,
        judge_accuracy=0.85,
        n_items=40,
        rng=0,
    )
    assert (plan["n_items"], plan["power"]) == (40, made.power)


def test_classes_without_labels_are_those_of_the_function(
    masrel: Caller, file: Path
) -> None:
    call = (file, "--judge", "large", "--judge", "small", "--truth")
    shown = document(masrel, *call, "--reference", "Kim")
    raters = ("large", "small", "Lee", "Ann")
    rows = [(row["item"], name, row[name]) for name in raters for row in ROWS]
    result = dawid_skene_intervals(rows, rng=0)
    assert [row["share"] for row in shown["truth"]] == result.fit.shares.tolist()
    assert [row["low"] for row in shown["truth"]] == result.shares_low.tolist()
    classes = {item: row["class"] for row in shown["truth"] for item in row["items"]}
    names = [str(of) for of in result.fit.categories]
    assert classes == {
        item: names[place]
        for item, place in zip(
            result.fit.items, result.fit.posterior.argmax(axis=1), strict=True
        )
    }
    right = {
        (row["rater"], row["class"]): row["right"] for row in shown["truth_confusion"]
    }
    assert (
        right["small", "pass"]
        == result.fit.confusion[
            result.fit.raters.index("small"), names.index("pass"), names.index("pass")
        ]
    )
    errors = [
        [int(row[name] != row["Kim"]) for row in ROWS] for name in ("large", "small")
    ]
    (worth,) = shown["effective_number"]
    assert worth["value"] == effective_number(errors).value
    # of a reference of few items only these count
    rows = [{**row, "Kim": row["Kim"] if i < 57 else ""} for i, row in enumerate(ROWS)]
    written(file.parent, rows)
    (worth,) = document(masrel, *call, "--reference", "Kim")["effective_number"]
    assert worth["value"] == effective_number([of[:57] for of in errors]).value

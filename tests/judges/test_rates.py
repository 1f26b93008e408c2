"""Rates of a judge: published values, another implementation, by hand, properties."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, norm, t

from docs.make.coverage.judge_rates import JUDGES
from docs.make.evidence import EVIDENCE
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.judges import (
    RateEstimate,
    corrected_rate,
    label_allocation,
    labels_needed,
    prediction_powered_mean,
    rate_estimates,
)

ORACLE = json.loads(Path(__file__).with_name("rates.json").read_text("utf-8"))
SAME = {"rel": 1e-9, "abs": 1e-12}


def of_row(row: dict[str, Any]) -> RateEstimate:
    return corrected_rate(
        row["p"],
        row["n"],
        sensitivity=(row["q1"], row["m1"]),
        specificity=(row["q0"], row["m0"]),
        level=row["level"],
    )


def graded(counts: dict[str, int]) -> tuple[dict[int, str], dict[int, str]]:
    # items by what human and judge say, "-" where there is no label
    pairs = [pair for pair, n in counts.items() for _ in range(n)]
    labels = {i: pair[0] for i, pair in enumerate(pairs) if pair[0] != "-"}
    return labels, {i: pair[1] for i, pair in enumerate(pairs)}


def by_method(counts: dict[str, int], grade: str = "p") -> dict[str, RateEstimate]:
    result = rate_estimates(*graded(counts), grade=grade)
    return {row.method: row for row in result.rows}


@pytest.mark.parametrize("row", ORACLE["label_allocation"])
def test_labels_are_allocated_as_published(row: dict[str, Any]) -> None:
    shares = {"sensitivity": row["q1"], "specificity": row["q0"]}
    positives = label_allocation(row["m"], row["p"], pilot=row["m_pilot"], **shares)
    assert positives == pytest.approx(row["m1"], **SAME)


@pytest.mark.parametrize("row", ORACLE["corrected_rate"])
def test_corrected_rates_are_those_of_another_package(row: dict[str, Any]) -> None:
    if row["refused"]:
        with pytest.raises(ParameterError):
            of_row(row)
        return
    if row["high"] < 0.0:
        with pytest.warns(UndefinedStatisticWarning):
            result = of_row(row)
        assert math.isnan(result.low)
        assert math.isnan(result.high)
        assert result.reason is not None
    else:
        result = of_row(row)
        assert result.low == pytest.approx(max(row["low"], 0.0), **SAME)
        assert result.high == pytest.approx(min(row["high"], 1.0), **SAME)
        assert result.reason is None
    assert result.value == pytest.approx(min(max(row["theta"], 0.0), 1.0), **SAME)
    assert result.uncut_low == pytest.approx(row["low"], **SAME)
    assert result.uncut_high == pytest.approx(row["high"], **SAME)
    for end, text in zip(("low", "high"), published(row), strict=False):
        digits = len(text.partition(".")[2])
        assert round(getattr(result, end), digits) == float(text)


def published(row: dict[str, Any]) -> list[str]:
    return row["published"].split("-") if "published" in row else []


@pytest.mark.parametrize("row", ORACLE["ppi"])
def test_prediction_powered_means_are_those_of_another_package(
    row: dict[str, Any],
) -> None:
    data = row["Y"], row["F"], row["F_unlabelled"]
    options = {"power": row["lam_given"], "level": row["level"]}
    result = prediction_powered_mean(*data, **options)
    assert result.value == pytest.approx(row["theta"], **SAME)
    assert result.power == pytest.approx(row["lam"], **SAME)
    assert result.low == pytest.approx(row["low"], **SAME)
    assert result.high == pytest.approx(row["high"], **SAME)
    assert (
        prediction_powered_mean(*data, method="auto", **options).value == result.value
    )


def test_padded_labels_by_hand() -> None:
    # z = 2: four labels are added to 6, of which 3 pass: (3 + 2)/10, variance .025
    level = 1.0 - 2.0 * norm.sf(2.0)
    result = prediction_powered_mean(
        [1, 1, 1, 0, 0, 0],
        [1, 1, 1, 0, 0, 0],
        [1, 0],
        power=0.0,
        level=level,
        method="auto",
    )
    half = t.ppf(norm.cdf(2.0), 5) * math.sqrt(0.025)
    assert (result.value, result.power) == (0.5, 0.0)
    assert result.low == pytest.approx(0.5 - half)
    assert result.high == pytest.approx(0.5 + half)
    # λ = 1: both of 4 labels differ, 2 of 10 of errors of 1: variance of errors .2 / 10
    result = prediction_powered_mean(
        [1, 1, 1, 0, 0, 0],
        [1, 1, 1, 0, 0, 0],
        [1, 0],
        power=1.0,
        level=level,
        method="auto",
    )
    half = t.ppf(norm.cdf(2.0), 5) * math.sqrt(0.25 / 2 + 0.2 / 10)
    assert result.uncut_high == pytest.approx(0.5 + half)


def test_numbers_leave_out_one_item_at_a_time() -> None:
    rng = np.random.default_rng(1)
    y = 1e6 + rng.integers(1, 6, 12)
    f, pool = y + rng.integers(-1, 2, 12), 1e6 + rng.integers(1, 6, 40)
    result = prediction_powered_mean(y, f, pool, method="auto")
    values = [
        prediction_powered_mean(np.delete(y, i), np.delete(f, i), pool).value
        for i in range(12)
    ]
    of_pool = result.power**2 * pool.var() / 40
    half = t.ppf(0.975, 11) * math.sqrt(11 * np.var(values) + of_pool)
    assert result.high - result.value == pytest.approx(half, rel=1e-6)
    assert result.value - result.low == pytest.approx(half, rel=1e-6)
    assert result.notes == ("few_labels",)


@pytest.mark.parametrize("seed", range(30))
def test_properties_of_rates(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = ["pp", "pf", "fp", "ff", "-p", "-f"]
    counts = dict(zip(kinds, map(int, rng.integers(1, 12, 6)), strict=True))
    # the judge does better than chance
    counts["pp"] += counts["pf"] + 10
    counts["ff"] += counts["fp"] + 10
    of_p, of_f = by_method(counts), by_method(counts, "f")
    for method, row in of_p.items():
        assert row.low <= row.value <= row.high
        assert of_f[method].value == pytest.approx(1.0 - row.value)
        assert of_f[method].low == pytest.approx(1.0 - row.high, abs=1e-12)
    labels, judge = graded(counts)
    data = (
        [labels[i] == "p" for i in labels],
        [judge[i] == "p" for i in labels],
        [judge[i] == "p" for i in judge if i not in labels],
    )
    powered, alone = of_p["prediction_powered"], of_p["labels_alone"]
    of_numbers = prediction_powered_mean(*data, method="auto")
    assert (of_numbers.low, of_numbers.high) == (powered.low, powered.high)
    without = prediction_powered_mean(*data, power=0.0, method="auto")
    assert (without.value, without.low) == (alone.value, alone.low)
    assert without.value == np.mean(data[0])
    assert powered.high - powered.low <= alone.high - alone.low


def test_of_a_perfect_judge_all_rates_are_its_own() -> None:
    of = by_method({"pp": 30, "ff": 20, "-p": 300, "-f": 150})
    assert of["naive"].value == pytest.approx(330 / 500)
    assert of["rogan_gladen"].value == pytest.approx(330 / 500)
    labels, judge = graded({"pp": 30, "ff": 20, "-p": 300, "-f": 150})
    y = [judge[item] == "p" for item in labels]
    pool = [True] * 300 + [False] * 150
    powered = prediction_powered_mean(y, y, pool, power=1.0)
    assert powered.value == pytest.approx(300 / 450)
    assert of["prediction_powered"].power > 0.85
    # ten of ten right is no proof that the judge never errs
    few = by_method({"pp": 5, "ff": 5, "-p": 900, "-f": 900})["prediction_powered"]
    assert few.high - few.low > 0.3


def test_rates_side_by_side_are_those_of_their_functions() -> None:
    labels, judge = graded({"pp": 40, "pf": 10, "fp": 6, "ff": 44, "-p": 70, "-f": 80})
    labels |= {"unseen": "p", 3: None}
    judge |= {4: math.nan, "new": pd.NA}
    result = rate_estimates(pd.Series(labels), judge, grade="p")
    corrected = corrected_rate(
        result.rows[0].value, 249, sensitivity=(38 / 48, 48), specificity=(44 / 50, 50)
    )
    assert result.sensitivity == (38 / 48, 48)
    assert result.specificity == (44 / 50, 50)
    assert result.n_left_out == 2
    assert result.rows[1] == corrected
    assert [row.n_labels for row in result.rows] == [0, 98, 98, 98]
    assert {row.n_judged for row in result.rows[:3]} == {248 + 1}
    assert result.default == "prediction_powered"


@pytest.mark.parametrize(
    ("counts", "reason"),
    [
        ({"pp": 12, "-p": 5, "-f": 5}, "all labelled items have the same label"),
        ({"pp": 5, "pf": 5, "fp": 6, "ff": 5, "-f": 5}, "no better than chance"),
        ({"pp": 40, "ff": 55, "fp": 5, "-f": 4000}, None),
    ],
)
def test_a_rate_that_cannot_be_corrected_says_why(
    counts: dict[str, int], reason: str | None
) -> None:
    with pytest.warns(UndefinedStatisticWarning):
        row = by_method(counts)["rogan_gladen"]
    assert math.isnan(row.low)
    assert row.reason is not None
    assert (reason or "false passes") in row.reason


def test_a_judge_near_chance_tells_nothing() -> None:
    near = corrected_rate(0.52, 300, sensitivity=(0.52, 50), specificity=(0.53, 50))
    shrunk = corrected_rate(0.9, 300, sensitivity=(1.0, 1), specificity=(0.2, 1000))
    for result in (near, shrunk):
        assert (result.low, result.high) == (0.0, 1.0)
        assert "whole_range" in result.notes
    assert (near.notes, shrunk.notes[0]) == (("whole_range",), "few_labels")


def test_numbers_without_any_error_have_no_interval() -> None:
    with pytest.warns(UndefinedStatisticWarning):
        result = prediction_powered_mean(
            [3, 4, 5], [3, 4, 5], [5, 4, 3], power=1.0, method="auto"
        )
    assert math.isnan(result.low)
    assert result.reason is not None


def test_so_many_labels_give_the_width() -> None:
    # mean half-widths of studies that are drawn, within 6 % of what was planned
    design = {"rate": 0.7, "sensitivity": 0.9, "specificity": 0.8}
    n = labels_needed(0.1, n_items=1000, **design)
    rng = np.random.default_rng(1)
    kinds = 0.7 * 0.9, 0.7 * 0.1, 0.3 * 0.2, 0.3 * 0.8
    halves = []
    for a, b, c, d in rng.multinomial(n, kinds, 200):
        passed = int(rng.binomial(1000 - n, 0.69))
        others = {"-p": passed, "-f": 1000 - n - passed}
        of = by_method({"pp": a, "pf": b, "fp": c, "ff": d, **others})
        row = of["prediction_powered"]
        halves.append((row.high - row.low) / 2)
    assert np.mean(halves) == pytest.approx(0.1, rel=0.06)


@pytest.mark.parametrize("n", [5, 10, 20, 30, 50, 100, 200])
def test_labels_alone_hold_any_rate_in_94_in_100(n: int) -> None:
    # exactly: every number of labels that pass, with its probability
    passed = np.arange(n + 1)
    rates = np.linspace(0.002, 0.5, 250)
    pool = [0, 1]
    ends = [
        prediction_powered_mean(
            [1] * k + [0] * (n - k), [0] * n, pool, power=0.0, method="auto"
        )
        for k in passed
    ]
    low, high = (
        np.array([getattr(of, name) for of in ends]) for name in ("low", "high")
    )
    holds = (low <= rates[:, None]) & (rates[:, None] <= high)
    coverage = (binom.pmf(passed, n, rates[:, None]) * holds).sum(axis=1)
    assert coverage.min() >= 0.94


ROWS = (EVIDENCE / "judges_rates.csv").read_text("utf-8").splitlines()


def test_the_default_holds_93_in_100_in_every_cell() -> None:
    of_rates = [row for row in csv.DictReader(ROWS) if row["judge"] in JUDGES]
    for method in ("prediction_powered", "labels_alone", "rogan_gladen"):
        cells = [row for row in of_rates if row["interval"] == method]
        assert len(cells) == 40
        for row in cells:
            n = int(row["n_studies"]) - int(row["undefined"])
            assert n < 100 or int(row["held"]) >= 0.93 * n, row

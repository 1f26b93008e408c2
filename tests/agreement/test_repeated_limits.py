"""Limits of agreement with repeats, on a line, of ratios, and with the mean."""

import csv
import json
import math
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import statsmodels.api as sm
from scipy import stats

from docs.make.evidence import EVIDENCE
from masrel.agreement import (
    LimitsWithMean,
    RepeatedLimits,
    limits_by_clusters,
    limits_of_agreement,
    limits_with_mean,
    limits_with_repeats,
    mdc,
    sem,
)
from masrel.errors import MasrelError, UndefinedStatisticWarning
from masrel.estimates import Interval

FILE = Path(__file__).parents[1] / "oracles" / "repeated_limits.json"
ORACLE = json.loads(FILE.read_text("utf-8"))
ZOU = pd.DataFrame(ORACLE["rows"], columns=["item", "x", "y"])


def limits(frame: pd.DataFrame, **options: object) -> RepeatedLimits:
    return limits_with_repeats(frame, item="item", first="x", second="y", **options)  # type: ignore[arg-type]


def ends(interval: Interval | None) -> tuple[float, float]:
    assert interval is not None
    return interval.low, interval.high


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20261130)


@pytest.fixture
def once(rng: np.random.Generator) -> pd.DataFrame:
    """One pair of an item, whose differences grow and fan out."""
    true = rng.uniform(20.0, 80.0, 30)
    noise = true * rng.normal(0.0, 0.05, (2, 30))
    return (
        pd.DataFrame({"item": range(30), "x": 1.1 * true, "y": true})
        + np.vstack([np.zeros(30), noise]).T
    )


@pytest.mark.parametrize("truth", ORACLE["truths"])
def test_twenty_rows_of_zou(truth: str) -> None:
    known, found = ORACLE["truths"][truth], limits(ZOU, truth=truth)
    # z there, t here: it held 95 % with four persons
    half = stats.t.ppf(0.975, 3) * math.sqrt(known["s2_d"] / 4)
    within = [known[key] for key in ("s2_xw", "s2_yw", "s2_dw") if key in known]
    pairs = [
        (known["bias"], found.bias),
        (known["sd"], found.sd),
        (known["lower"], found.low),
        (known["upper"], found.high),
        (known["lower_interval"], ends(found.low_interval)),
        (known["upper_interval"], ends(found.high_interval)),
        (known["s2_d"], found.parts[0][0]),
        (within, found.within),
        ((known["bias"] - half, known["bias"] + half), ends(found.bias_interval)),
    ]
    for expected, value in pairs:
        assert value == pytest.approx(expected, rel=1e-12)


def test_what_moves_both_of_a_pair_changes_nothing_if_the_truth_varies(
    rng: np.random.Generator,
) -> None:
    by = rng.normal(0.0, 50.0, 20)
    moved = ZOU.assign(x=ZOU["x"] + by, y=ZOU["y"] + by)
    one, other = (limits(of, truth="varying") for of in (ZOU, moved))
    assert (other.low, other.sd) == pytest.approx((one.low, one.sd), rel=1e-9)


def test_without_repeats_limits_are_those_of_pairs(once: pd.DataFrame) -> None:
    found, known = limits(once), limits_of_agreement(once[["x", "y"]].to_numpy())
    assert (found.low, found.high) == pytest.approx((known.lower, known.upper))
    assert ends(found.bias_interval) == pytest.approx(ends(known.mean_interval))
    # approximate in place of exact
    exact = ends(known.upper_interval)
    assert ends(found.high_interval) == pytest.approx(exact, rel=0.05)


def test_slope_and_line_are_those_of_statsmodels(once: pd.DataFrame) -> None:
    d, average = once["x"] - once["y"], (once["x"] + once["y"]) / 2
    model = sm.OLS(d, sm.add_constant(average))
    robust, plain = model.fit(cov_type="HC3", use_t=True), model.fit()
    found = limits(once, kind="proportional").at(30.0)
    assert ends(limits(once).slope_interval) == ends(found.slope_interval)
    at = plain.get_prediction([[1.0, 30.0]])
    pairs = [
        (robust.params.iloc[1], found.slope),
        (tuple(robust.conf_int().iloc[1]), ends(found.slope_interval)),
        (at.predicted_mean[0], found.bias),
        (tuple(at.conf_int()[0]), ends(found.bias_interval)),
        (math.sqrt(plain.scale), found.sd),
    ]
    for expected, value in pairs:
        assert value == pytest.approx(expected, rel=1e-9)


def test_a_line_of_pairs_with_repeats_takes_no_slope_for_noise() -> None:
    # differences that are a line of their averages, within items, too
    x = np.array([10.0, 14.0, 20.0, 30.0, 41.0, 44.0])
    frame = pd.DataFrame({"item": [1, 1, 2, 2, 3, 3], "x": x, "y": 0.8 * x})
    found = limits(frame, truth="varying", kind="proportional")
    assert found.slope == pytest.approx(0.2 / 0.9)
    assert found.sd == pytest.approx(0.0, abs=1e-12)
    assert found.at(100.0).high == pytest.approx(100.0 * 0.2 / 0.9)


def test_numbers_of_repeats_that_differ_much_are_noted(
    rng: np.random.Generator,
) -> None:
    item = np.arange(100).repeat(rng.integers(1, 11, 100))
    x, y = rng.normal(size=(2, len(item)))
    (note,) = limits(pd.DataFrame({"item": item, "x": x, "y": y})).low_interval.notes
    assert "the true coverage may be below" in note
    assert limits(ZOU).low_interval.notes == ()


def test_ratios_are_differences_of_logarithms() -> None:
    logs = ZOU.assign(x=np.log(ZOU["x"]), y=np.log(ZOU["y"]))
    found, known = limits(ZOU, kind="ratio"), limits(logs)
    numbers, expected = (
        [of.bias, of.low, of.high, *ends(of.bias_interval), *ends(of.high_interval)]
        for of in (found, known)
    )
    assert np.log(numbers) == pytest.approx(expected)
    assert (found.sd, found.slope) == pytest.approx((known.sd, known.slope))


@pytest.mark.parametrize(
    ("x", "y", "kind", "reason"),
    [
        ([1.0, 2.0], [None, 2.0], "difference", "fewer than 2 items"),
        ([1.0, 2.0], [1.5, 2.0], "proportional", "fewer than 3 items"),
        ([1.0, 3.0, 2.0], [3.0, 1.0, 2.0], "proportional", "the same for all items"),
        (
            [1.0, 1.0, 5.0],
            [1.0, 1.0, 6.0],
            "proportional",
            "the slope depends on a single",
        ),
    ],
)
def test_what_is_undefined_has_its_reason(
    x: list[float], y: list[float], kind: str, reason: str
) -> None:
    frame = pd.DataFrame({"item": range(len(x)), "x": x, "y": y}, dtype=float)
    with pytest.warns(UndefinedStatisticWarning, match=reason):
        found = limits(frame, kind=kind)
    for interval in (found.bias_interval, found.low_interval, found.high_interval):
        assert reason in (interval.reason or "")
        assert all(map(math.isnan, (*ends(interval), found.low, found.bias, found.sd)))
    assert found.at(3.0) is found


# ---- several observers ----


def with_mean(table: np.ndarray, items: Any = None) -> LimitsWithMean:
    names = [f"o{k}" for k in range(table.shape[1])]
    frame = pd.DataFrame(table, columns=names)
    frame["item"] = range(len(table)) if items is None else items
    return limits_with_mean(frame, item="item", observers=names)


# What R's loamr prints of its data: items, observers, SDs of observers and of the
# rest; limit and ends
@pytest.mark.parametrize(
    ("n", "k", "of_observers", "of_rest", "limit", "low", "high"),
    [
        (40, 5, 0.285, 0.579, 1.131, 1.010, 1.816),
        (15, 20, 0.235, 0.687, 1.387, 1.283, 1.549),
    ],
)
def test_limits_with_the_mean_are_those_of_loamr(
    n: int, k: int, of_observers: float, of_rest: float, limit: float, low: float,
    high: float, rng: np.random.Generator,
) -> None:  # fmt: skip
    # a table with just these mean squares
    rest = rng.normal(size=(n, k))
    rest += rest.mean() - rest.mean(axis=0) - rest.mean(axis=1, keepdims=True)
    rest *= of_rest * math.sqrt((n - 1) * (k - 1) / (rest**2).sum())
    own = stats.zscore(rng.normal(size=k), ddof=1)
    table = rest + own * math.sqrt(of_observers**2 + of_rest**2 / n)
    table += rng.normal(size=(n, 1))
    found = with_mean(table)
    printed = found.limit.value, *ends(found.limit.interval)
    assert printed == pytest.approx((limit, low, high), abs=6e-4 * 5)
    # and by hand: squares about the items' means
    squares = ((table - table.mean(axis=1, keepdims=True)) ** 2).mean()
    assert found.limit.value == pytest.approx(1.959963984540054 * math.sqrt(squares))
    assert found.sem.value == pytest.approx(sem(table).value, rel=1e-12)
    assert ends(found.mdc.interval) == pytest.approx(ends(mdc(table).interval))


def test_repeats_are_a_part_of_the_error(rng: np.random.Generator) -> None:
    n, k, m = 12, 4, 3
    cells = rng.normal(0.0, [0.0, 2.0, 1.0, 3.0], (n, k)) + rng.normal(size=(n, 1))
    table = cells + rng.normal(size=(m, n, k))
    found = with_mean(table.reshape(-1, k), np.tile(np.arange(n), m))
    # σ²_observers + σ²_both + σ²_rest by their mean squares
    means = table.mean(axis=0)
    rest = ((table - means) ** 2).sum() / (n * k * (m - 1))
    lone = means - means.mean(axis=0) - means.mean(axis=1, keepdims=True) + means.mean()
    both = m * (lone**2).sum() / ((n - 1) * (k - 1))
    own = m * n * means.mean(axis=0).var(ddof=1)
    total = (own - both) / (n * m) + (both - rest) / m + rest
    assert found.sem.value == pytest.approx(math.sqrt(total), rel=1e-12)
    assert found.within == pytest.approx(rest, rel=1e-12)


def test_gaps_of_observers_and_single_ones() -> None:
    gaps = np.array(
        [[1.0, 2.0, np.nan], [3.0, 3.0, 4.0], [5.0, np.nan, 6.0], [2, 4, 3]]
    )
    assert with_mean(gaps).sem.value == sem(gaps).value
    with pytest.warns(UndefinedStatisticWarning, match="fewer than two raters"):
        assert math.isnan(with_mean(gaps[:, :1]).limit.value)


# ---- clusters ----


def test_items_that_are_clusters_have_the_usual_interval_of_the_bias(
    once: pd.DataFrame,
) -> None:
    usual = limits(once)
    found = limits_by_clusters(once.assign(own=once["item"]), limits, clusters="own")
    assert (found.bias, found.low, found.high) == (usual.bias, usual.low, usual.high)
    assert ends(found.bias_interval) == pytest.approx(ends(usual.bias_interval))


@pytest.mark.parametrize("kind", ["difference", "ratio"])
def test_clusters_are_left_out_by_hand(once: pd.DataFrame, kind: Any) -> None:
    # of differences, or of logarithms: mean and log SD without every cluster of three
    frame = once.assign(site=np.arange(30) % 10)
    found = limits_by_clusters(
        frame, partial(limits, kind=kind), clusters="site", level=0.9
    )
    pairs = frame[["x", "y"]].to_numpy()
    x, y = (np.log(pairs) if kind == "ratio" else pairs).T
    d, site = x - y, frame["site"].to_numpy()
    left = [d[site != k] for k in range(10)]
    numbers = [[np.mean(of) for of in left], [np.log(np.std(of)) for of in left]]
    # √(n - 1) times the SD over the ten, times t
    half, of_log = stats.t.ppf(0.95, 9) * 3.0 * np.std(numbers, axis=1)
    sd = np.std(d, ddof=1)
    up, down = sd * math.exp(of_log) - sd, sd - sd * math.exp(-of_log)
    z = stats.norm.ppf(0.975)
    high = d.mean() + z * sd
    expected = [
        d.mean() - half,
        d.mean() + half,
        high - math.hypot(half, z * down),
        high + math.hypot(half, z * up),
    ]
    shown = np.exp(expected) if kind == "ratio" else expected
    assert [*ends(found.bias_interval), *ends(found.high_interval)] == pytest.approx(
        shown, rel=1e-9
    )
    assert found.low_interval.unit == "clusters"


def test_limits_with_the_mean_follow_their_error(rng: np.random.Generator) -> None:
    table = pd.DataFrame(rng.normal(size=(24, 3)), columns=["a", "b", "c"])
    table = table.assign(item=range(24), site=np.arange(24) // 2)
    measure = partial(limits_with_mean, item="item", observers=["a", "b", "c"])
    found, usual = limits_by_clusters(table, measure, clusters="site"), measure(table)
    ratios = [
        np.array(ends(of.interval)) / of.value
        for of in (found.limit, found.sem, found.mdc)
    ]
    assert ratios[0] == pytest.approx(ratios[1])
    assert ratios[0] == pytest.approx(ratios[2])
    assert ratios[0].prod() == pytest.approx(1.0)  # alike on the logarithm
    assert found.sem.value == usual.sem.value


def test_what_no_cluster_tells_has_its_reason() -> None:
    frame = pd.DataFrame({"item": range(6), "x": 1.0, "y": 0.0, "site": [0, 1] * 3})
    found = limits_by_clusters(frame, limits, clusters="site")
    assert (found.low, found.high) == (1.0, 1.0)
    assert "left out" in str(found.low_interval.reason)
    for wrong, options, name in (
        (frame.assign(site=1), {}, "two or more"),
        (frame.assign(site=None), {}, "site"),
        (frame, {"kind": "proportional"}, "line"),
    ):
        with pytest.warns(UndefinedStatisticWarning) if options else nullcontext():
            with pytest.raises(MasrelError, match=name):
                limits_by_clusters(wrong, partial(limits, **options), clusters="site")


# ---- coverage ----


def test_intervals_hold_93_in_100_in_every_cell() -> None:
    text = (EVIDENCE / "limits_coverage.csv").read_text("utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    assert len(rows) == 152
    for row in rows:
        assert int(row["held"]) >= 0.93 * int(row["n_studies"]), row

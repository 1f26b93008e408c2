"""Jackknife intervals against explicit loops of the public functions."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import (
    COEFFICIENTS,
    Metric,
    krippendorff_alpha,
)
from masrel.errors import (
    UndefinedStatisticWarning,
)
from masrel.intervals import bootstrap, jackknife
from tests.intervals.data import SCALE, TABLE_V, dirichlet_multinomial

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")

METRICS: list[Metric] = ["nominal", "ordinal", "interval", "ratio"]


def variance(replicates: list[float]) -> float:
    # Efron and Stein (1981): (n - 1)/n Σ (value without i - their mean)²
    n, mean = len(replicates), math.fsum(replicates) / len(replicates)
    return (n - 1) / n * math.fsum((r - mean) ** 2 for r in replicates)


def made(n_items: int, n_raters: int, seed: int) -> NDArray[Any]:
    rng = np.random.default_rng(seed)
    return np.array(dirichlet_multinomial(rng, n_items, n_raters, 0.5), dtype=float)


GRADES = np.array([
    [1, 1, 2], [2, 2, 3], [4, 3, 4], [5, 5, 5], [1, 2, 1], [3, 3, np.nan],
    [5, 4, 5], [2, 1, 2], [np.nan, 4, 4], [1, 1, 1], [3, 5, 3],
])  # fmt: skip
PAIRS, HOLED, GAPS = made(24, 2, 3), made(24, 2, 3), made(9, 4, 5)
HOLED[[2, 9], 0] = GAPS[[1, 4, 4], [0, 2, 3]] = np.nan
MEASURED = made(24, 1, 4) + 0.6 * np.random.default_rng(4).normal(size=(24, 3))
RETEST = np.array([
    [["1", "1"], ["2", "2"], ["1", "2"], ["3", "3"]],
    [["1", "1"], ["2", "1"], ["1", "1"], ["3", "3"]],
])  # fmt: skip
PATIENTS = np.arange(24) // 2
CATEGORIES = {"categories": [0, 1, 2]}

# coefficient, ratings, target, options, clusters of items
CASES: dict[str, tuple[str, NDArray[Any], str, dict[str, Any], Any]] = {
    "raters": (
        "fleiss_kappa",
        np.array(TABLE_V),
        "raters",
        {"categories": SCALE},
        None,
    ),
    "both": ("fleiss_kappa", made(12, 6, 8), "both", CATEGORIES, None),
    "gaps": ("conger_kappa", GAPS, "items", CATEGORIES, None),
    "items of a retest": ("stratified_kappa", RETEST, "items", {}, None),
    "raters of a retest": ("stratified_kappa", RETEST, "raters", {}, None),
    **{
        f"{metric} metric": (
            *("krippendorff_alpha", GRADES, "items"),
            *({"metric": metric, "categories": range(1, 6)}, None),
        )
        for metric in METRICS
    },
    **{
        f"{name}, {of}": (name, ratings, "items", CATEGORIES, clusters)
        for name, e in COEFFICIENTS.items()
        if e.formula and e.shape == "ratings" and not e.has_interval
        for of, ratings, clusters in (
            ("items", PAIRS, None),
            ("clusters with gaps", HOLED, PATIENTS),
        )
    },
    **{
        f"{name}, {of}": (name, MEASURED, "items", {}, clusters)
        for name, e in COEFFICIENTS.items()
        if e.formula and e.has_interval
        for of, clusters in (("items", None), ("clusters", PATIENTS))
    },
}


@pytest.mark.parametrize("case", CASES)
def test_it_is_the_loop_that_leaves_out_one_after_the_other(case: str) -> None:
    name, ratings, target, options, clusters = CASES[case]
    entry = COEFFICIENTS[name]
    value = entry.function(ratings, **options).value
    parts, dfs = [], []
    for unit in ("items", "raters") if target == "both" else (target,):
        axis = int((unit == "raters") != (entry.shape == "pairs"))
        units = np.arange(ratings.shape[axis]) if clusters is None else clusters
        without = [
            entry.function(np.compress(units != u, ratings, axis), **options).value
            for u in np.unique(units)
        ]
        parts.append(variance(without))
        dfs.append(len(without) - 1)
    half = stats.t.ppf(0.975, min(dfs)) * math.sqrt(sum(parts))
    found = jackknife(name, ratings, target=target, clusters=clusters, **options)  # type: ignore[arg-type]
    assert found.low == pytest.approx(max(value - half, entry.lowest), rel=1e-9)
    assert found.high == pytest.approx(min(value + half, entry.highest), rel=1e-9)
    what = {"items": "item", "raters": "rater", "both": "two-way"}[target]
    what = what if clusters is None else "cluster"
    assert found.method == f"{what} jackknife, t({min(dfs)})"
    assert (found.target, found.n_resamples) == (target, None)


def test_another_program_found_the_same_for_table_v() -> None:
    found = jackknife("fleiss_kappa", TABLE_V, target="raters", categories=SCALE)
    assert (found.low, found.high) == pytest.approx((0.320, 0.933), abs=5e-4)


@pytest.mark.parametrize(
    ("table", "target", "reason"),
    [
        ([["a", "a", "a"]] * 3, "items", "the estimate itself is undefined"),
        (
            [["a", "a", "a"], ["b", "b", "b"]],
            "items",
            "the estimate is undefined when one",
        ),
        ([["a", "a", "a"], ["b", "b", "b"]], "raters", "the estimate stays the same"),
        # κ of one item is −1/(raters − 1), whatever they say: only rounding moves it
        ([["a"] * 6 + ["b"] * 2], "raters", "the estimate stays the same"),
        ([["a", "b", "c", "a", "b"]], "raters", "the estimate stays the same"),
        # any two of these four agree on a third of the items, as chance does: κ is 0
        (
            [
                list(item)
                for item in "aaaa abbc accb babb bbca bcac cacc cbab ccba".split()
            ],
            "raters",
            "the estimate stays the same",
        ),
        ([["a", "b", "a"]], "items", "the estimate is undefined when one"),
    ],
)
def test_where_it_cannot_say_it_says_why(
    table: list[list[str]], target: str, reason: str
) -> None:
    with pytest.warns(UndefinedStatisticWarning, match="undefined"):
        found = jackknife("fleiss_kappa", table, target=target)  # type: ignore[arg-type]
    assert math.isnan(found.low)
    assert math.isnan(found.high)
    assert reason in (found.reason or "")


@pytest.mark.parametrize("metric", METRICS)
def test_every_resample_has_the_metric_of_its_ratings(metric: Metric) -> None:
    rows = [[1, 2], [3, 3], [2, 4], [4, 4]]
    values = [
        krippendorff_alpha(list(drawn), categories=range(1, 5), metric=metric).value
        for drawn in itertools.product(rows, repeat=4)
    ]
    values = sorted(value for value in values if not math.isnan(value))
    result = bootstrap("krippendorff_alpha", rows, target="items", metric=metric)
    assert result.distribution is not None
    met, weights = result.distribution.values, result.distribution.weights
    assert met @ weights == pytest.approx(np.mean(values), rel=1e-9)
    assert met**2 @ weights == pytest.approx(np.mean(np.square(values)), rel=1e-9)
    assert met[[0, -1]] == pytest.approx([values[0], values[-1]], rel=1e-9)


def _measured(n_items: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(3)
    return rng.normal(size=(n_items, 1)) + 0.5 * rng.normal(size=(n_items, 3))


def test_thousands_of_measurements_are_left_out_item_by_item() -> None:
    # Fleiss' kappa with quadratic weights by moments: D_o is the mean over items of
    # twice the variance (ddof=1), D_e twice that of all ratings (ddof=0)
    x = _measured(3000)
    n, within, s1, s2 = x.size, x.var(axis=1, ddof=1), x.sum(axis=1), (x**2).sum(axis=1)
    left = (n - 3) * (s2.sum() - s2) - (s1.sum() - s1) ** 2
    values = 1.0 - (within.sum() - within) / 2999 * (n - 3) ** 2 / left
    half = stats.t.ppf(0.975, 2999) * math.sqrt(variance(values.tolist()))
    found = jackknife("fleiss_kappa", x, target="items", weights="quadratic")
    assert (found.high - found.low) / 2 == pytest.approx(half, rel=1e-9)
    centre = 1.0 - within.mean() / x.var()
    assert (found.high + found.low) / 2 == pytest.approx(centre, rel=1e-12)
    drawn = bootstrap(
        "fleiss_kappa", x, target="items", weights="quadratic", rng=1, n_resamples=2000
    )
    # ends move by some 4 % of the half width; false alarms below 1e-4
    assert (drawn.low, drawn.high) == pytest.approx(
        (centre - half, centre + half), abs=0.2 * half
    )

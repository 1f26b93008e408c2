"""Jackknife intervals against explicit loops of the public functions."""

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import (
    Metric,
    fleiss_kappa,
    krippendorff_alpha,
    stratified_kappa,
)
from masrel.errors import (
    UndefinedStatisticWarning,
)
from masrel.intervals import bootstrap, jackknife
from tests.intervals.data import SCALE, TABLE_V, dirichlet_multinomial

T7 = 2.364624251592784  # t(7; .975) of any table of Student's t
few = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")


def variance(replicates: list[float]) -> float:
    # Efron and Stein (1981): (n - 1)/n Σ (value without i - their mean)²
    n, mean = len(replicates), math.fsum(replicates) / len(replicates)
    return (n - 1) / n * math.fsum((r - mean) ** 2 for r in replicates)


def without_rater(table: list[list[str]], r: int) -> list[list[str]]:
    return [row[:r] + row[r + 1 :] for row in table]


def without_item(table: list[list[str]], i: int) -> list[list[str]]:
    return table[:i] + table[i + 1 :]


def test_leaving_out_raters_is_the_loop_over_them() -> None:
    values = [fleiss_kappa(without_rater(TABLE_V, r)).value for r in range(8)]
    half = T7 * math.sqrt(variance(values))
    centre = fleiss_kappa(TABLE_V).value
    found = jackknife("fleiss_kappa", TABLE_V, target="raters", categories=SCALE)
    assert found.low == pytest.approx(centre - half, rel=1e-12)
    assert found.high == pytest.approx(centre + half, rel=1e-12)
    # as another program found for Table V
    assert (found.low, found.high) == pytest.approx((0.320, 0.933), abs=5e-4)
    assert (found.unit, found.target, found.method) == (
        "raters",
        "raters",
        "rater jackknife, t(7)",
    )
    assert found.n_resamples is None


@few
def test_leaving_out_items_is_the_loop_over_them() -> None:
    rng = np.random.default_rng(5)
    table = [
        [str(g) if rng.random() > 0.1 else None for g in row]
        for row in dirichlet_multinomial(rng, 8, 4, 0.4)
    ]
    values = [fleiss_kappa(without_item(table, i)).value for i in range(8)]
    half = T7 * math.sqrt(variance(values))
    found = jackknife("fleiss_kappa", table, target="items")
    centre = fleiss_kappa(table).value
    assert found.low == pytest.approx(centre - half, rel=1e-9)
    assert found.high == pytest.approx(min(centre + half, 1.0), rel=1e-9)


@few
def test_for_both_the_variances_add_and_degrees_are_the_fewer() -> None:
    table = dirichlet_multinomial(np.random.default_rng(8), 12, 6, 0.5)
    rows = variance([fleiss_kappa(without_item(table, i)).value for i in range(12)])
    columns = variance([fleiss_kappa(without_rater(table, r)).value for r in range(6)])
    found = jackknife("fleiss_kappa", table, target="both")
    half = (found.high - found.low) / 2
    t5 = 2.570581835636314  # of 11 and 5 degrees
    assert half == pytest.approx(t5 * math.sqrt(rows + columns), rel=1e-12)
    assert found.method == "two-way jackknife, t(5)"


@few
def test_a_retest_item_leaves_with_all_its_raters() -> None:
    pairs = [
        [["1", "1"], ["2", "2"], ["1", "2"], ["3", "3"]],
        [["1", "1"], ["2", "1"], ["1", "1"], ["3", "3"]],
    ]
    values = [
        stratified_kappa([without_item(rater, i) for rater in pairs]).value
        for i in range(4)
    ]
    half = 3.18244630528371 * math.sqrt(variance(values))
    found = jackknife("stratified_kappa", pairs, target="items")
    centre = stratified_kappa(pairs).value
    assert found.low == pytest.approx(centre - half, rel=1e-10)
    raters = [stratified_kappa([rater]).value for rater in pairs[::-1]]
    half = math.tan(0.475 * math.pi) * math.sqrt(variance(raters))  # t(1), Cauchy's
    wide = jackknife("stratified_kappa", pairs, target="raters")
    assert wide.low == pytest.approx(max(centre - half, -1.0), rel=1e-10)


@pytest.mark.parametrize(
    ("table", "target", "reason"),
    [
        ([["a", "a", "a"]] * 3, "items", "the estimate itself is undefined"),
        ([["a", "a", "a"], ["b", "b", "b"]], "items", "left out the estimate is"),
        ([["a", "a", "a"], ["b", "b", "b"]], "raters", "leaves the estimate as it is"),
        # κ of one item is −1/(raters − 1), whatever they say: only rounding moves it
        ([["a"] * 6 + ["b"] * 2], "raters", "leaves the estimate as it is"),
        ([["a", "b", "c", "a", "b"]], "raters", "leaves the estimate as it is"),
        # any two of these four agree on a third of the items, as chance does: κ is 0
        (
            [
                list(item)
                for item in "aaaa abbc accb babb bbca bcac cacc cbab ccba".split()
            ],
            "raters",
            "leaves the estimate as it is",
        ),
        ([["a", "b", "a"]], "items", "left out the estimate is undefined"),
    ],
)
@few
def test_where_it_cannot_say_it_says_why(
    table: list[list[str]], target: str, reason: str
) -> None:
    with pytest.warns(UndefinedStatisticWarning, match="undefined"):
        found = jackknife("fleiss_kappa", table, target=target)  # type: ignore[arg-type]
    assert math.isnan(found.low)
    assert math.isnan(found.high)
    assert reason in (found.reason or "")


pytestmark = pytest.mark.filterwarnings(
    "ignore::masrel.errors.SmallSampleWarning",
    "ignore::masrel.errors.UndefinedStatisticWarning",
)

METRICS: list[Metric] = ["nominal", "ordinal", "interval", "ratio"]

GRADES = [
    [1, 1, 2], [2, 2, 3], [4, 3, 4], [5, 5, 5], [1, 2, 1], [3, 3, None],
    [5, 4, 5], [2, 1, 2], [None, 4, 4], [1, 1, 1], [3, 5, 3],
]  # fmt: skip


@pytest.mark.parametrize("metric", METRICS)
def test_the_jackknife_leaves_items_out_of_the_metric_too(metric: Metric) -> None:
    n = len(GRADES)
    without = [
        krippendorff_alpha(
            GRADES[:i] + GRADES[i + 1 :], categories=range(1, 6), metric=metric
        ).value
        for i in range(n)
    ]
    half = stats.t.ppf(0.975, n - 1) * math.sqrt(
        (n - 1) ** 2 / n * np.var(without, ddof=1)
    )
    result = jackknife("krippendorff_alpha", GRADES, target="items", metric=metric)
    value = krippendorff_alpha(GRADES, metric=metric).value
    assert result.low == pytest.approx(value - half, rel=1e-9)
    assert result.high == pytest.approx(min(value + half, 1.0), rel=1e-9)


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

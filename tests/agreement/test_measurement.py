"""Measurements: SEM, MDC95, limits of agreement, concordance; by hand and by R."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import ErrorKind, limits_of_agreement, lin_ccc, mdc, sem
from masrel.estimates import Estimate

KINDS: tuple[ErrorKind, ...] = ("agreement", "consistency")
FILE = Path(__file__).parents[1] / "oracles" / "measurement.json"
EVERY: list[dict[str, Any]] = json.loads(FILE.read_text("utf-8"))["settings"]
SETTINGS = {s["id"]: s for s in EVERY if s["kind"] == "icc_missing"}
LIMITS = {s["id"]: s for s in EVERY if s["kind"] == "bland_altman"}
(CONCORDANCE,) = (s for s in EVERY if s["kind"] == "lin_ccc")
PAIRS = np.column_stack([CONCORDANCE["data"]["x"], CONCORDANCE["data"]["y"]])


def ends(result: Estimate) -> tuple[float, float]:
    assert result.interval is not None
    assert result.interval.low <= result.value <= result.interval.high
    return result.interval.low, result.interval.high


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", SETTINGS)
def test_values_are_those_of_lme4(name: str, kind: ErrorKind) -> None:
    ratings = SETTINGS[name]["data"]
    expected = SETTINGS[name]
    assert sem(ratings, kind=kind).value == pytest.approx(
        expected["sem"][kind], rel=1e-4
    )
    result = mdc(ratings, kind=kind)
    assert result.value == pytest.approx(expected["mdc95"][kind], rel=1e-4)
    low, high = ends(result)
    of_one = ends(sem(ratings, kind=kind))
    factor = 1.96 * math.sqrt(2.0)
    assert (low, high) == pytest.approx([factor * end for end in of_one], rel=1e-12)


def test_by_hand() -> None:
    # (1, 2), (3, 3), (5, 7): MS_raters 1.5, MS_residual 0.5, MS_within 5/6
    ratings = [[1, 2], [3, 3], [5, 7]]
    assert sem(ratings).value == pytest.approx(math.sqrt(5 / 6), rel=1e-15)
    assert sem(ratings, kind="consistency").value == math.sqrt(0.5)
    low, high = ends(sem(ratings, kind="consistency"))
    assert low == pytest.approx(math.sqrt(1.0 / stats.chi2.ppf(0.975, 2)), rel=1e-12)
    assert high == pytest.approx(math.sqrt(1.0 / stats.chi2.ppf(0.025, 2)), rel=1e-12)
    # Graybill and Wang: 5/6 = 1.5/3 + 2/3 · 0.5, with 1 and 2 degrees of freedom
    up = [
        (df / stats.chi2.ppf(0.025, df) - 1.0) * share
        for df, share in ((1, 0.5), (2, 1 / 3))
    ]
    _, high = ends(sem(ratings))
    assert high == pytest.approx(math.sqrt(5 / 6 + math.hypot(*up)), rel=1e-12)


@pytest.mark.parametrize("name", ["icc_missing-01", "icc_missing-05"])
def test_consistency_of_complete_tables_has_the_interval_of_chi_squared(
    name: str,
) -> None:
    expected = SETTINGS[name]["anova"]["sem_consistency_ci95"]
    result = sem(SETTINGS[name]["data"], kind="consistency")
    assert ends(result) == pytest.approx(expected, rel=1e-8)


def ratings_of(name: str) -> NDArray[np.float64]:
    """Pairs whose differences have the mean and spread of a setting."""
    data = LIMITS[name]["data"]
    if isinstance(data, str):  # those of the concordance
        return PAIRS
    z = np.arange(float(data["n"]))
    z = (z - z.mean()) / z.std(ddof=1) * data["sd"] + data["mean"]
    return np.column_stack([50.0 + z, np.full(len(z), 50.0)])


@pytest.mark.parametrize("name", LIMITS)
def test_limits_and_exact_intervals(name: str) -> None:
    expected = LIMITS[name]["reference"]
    limits = limits_of_agreement(ratings_of(name))
    assert limits.n_items == expected["n"]
    assert limits.mean == pytest.approx(expected["mean_difference"], rel=1e-8)
    assert limits.sd == pytest.approx(expected["sd"], rel=1e-8)
    assert (limits.lower, limits.upper) == pytest.approx(expected["limits"], rel=1e-8)
    alone, pair = expected["exact_ci_individual"], expected["exact_pair"]
    for interval, ends in (
        (limits.mean_interval, expected["ci_mean"]),
        (limits.lower_interval, alone["lower_limit"]),
        (limits.upper_interval, alone["upper_limit"]),
    ):
        assert (interval.low, interval.high) == pytest.approx(ends, rel=1e-8)
    assert limits.inner == pytest.approx(pair["inner"], rel=1e-8)
    assert limits.outer == pytest.approx(pair["outer"], rel=1e-8)


def test_published_factors_of_ten_items() -> None:
    # Tables of tolerance factors for n = 10, 95 % of a population with confidence
    # 95 %: one-sided 2.911, two-sided 3.393 (Carkeet 2015 and the textbooks)
    z = np.arange(10.0)
    z = (z - z.mean()) / z.std(ddof=1)
    pairs = np.column_stack([z, np.zeros(10)])
    both = limits_of_agreement(pairs, level=0.9)
    assert both.outer[1] == pytest.approx(3.393, abs=1e-3)
    one = limits_of_agreement(pairs, share=0.9, level=0.9)
    assert one.upper_interval.high == pytest.approx(2.911, abs=5e-4)


def test_value_error_and_interval_are_those_of_epir() -> None:
    expected = CONCORDANCE["reference"]
    result = lin_ccc(PAIRS)
    assert result.value == pytest.approx(expected["ccc_divisor_n"], rel=1e-8)
    assert result.standard_error == pytest.approx(expected["se"], rel=1e-8)
    assert result.interval is not None
    ends = (result.interval.low, result.interval.high)
    assert ends == pytest.approx(expected["ci_z"], rel=1e-8)
    assert result.interval.target == "items"


def test_interval_of_three_raters_leaves_out_each_item() -> None:
    ratings = np.array([[1.0, 2, 1], [3, 3, 4], [5, 7, 6], [2, 1, 4], [6, 6, 7]])
    z = [math.atanh(lin_ccc(np.delete(ratings, i, axis=0)).value) for i in range(5)]
    width = stats.t.ppf(0.975, 4) * math.sqrt(4 / 5 * np.sum((z - np.mean(z)) ** 2))
    result = lin_ccc(ratings)
    assert result.interval is not None
    ends = np.tanh(math.atanh(result.value) + width * np.array([-1.0, 1.0]))
    assert (result.interval.low, result.interval.high) == pytest.approx(ends, rel=1e-10)
    assert result.interval.method == "item jackknife, t(4) on Fisher's z"

"""Limits of agreement: Carkeet's exact intervals, published factors, coverage."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import limits_of_agreement
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning

FILE = Path(__file__).parents[1] / "oracles" / "measurement.json"
ALL: list[dict[str, Any]] = json.loads(FILE.read_text("utf-8"))["settings"]
SETTINGS = {s["id"]: s for s in ALL if s["kind"] == "bland_altman"}
(LIN,) = (s["data"] for s in ALL if s["kind"] == "lin_ccc")


def ratings_of(name: str) -> NDArray[np.float64]:
    """Pairs whose differences have the mean and spread of a setting."""
    data = SETTINGS[name]["data"]
    if isinstance(data, str):  # those of the concordance
        return np.column_stack([LIN["x"], LIN["y"]])
    z = np.arange(float(data["n"]))
    z = (z - z.mean()) / z.std(ddof=1) * data["sd"] + data["mean"]
    return np.column_stack([50.0 + z, np.full(len(z), 50.0)])


@pytest.mark.parametrize("name", SETTINGS)
def test_limits_and_exact_intervals(name: str) -> None:
    expected = SETTINGS[name]["reference"]
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


def test_by_hand() -> None:
    # differences 1, -2, 0, 1: mean 0, variance 6/3 = 2
    limits = limits_of_agreement([[9, 8], [5, 7], [4, 4], [8, 7]])
    assert limits.mean == 0.0
    assert limits.upper == pytest.approx(
        stats.norm.ppf(0.975) * math.sqrt(2), rel=1e-14
    )
    half = stats.t.ppf(0.975, 3) * math.sqrt(2) / 2
    assert limits.mean_interval.high == pytest.approx(half, rel=1e-12)
    assert limits.averages.tolist() == [8.5, 6.0, 4.0, 7.5]
    assert limits.differences.tolist() == [1.0, -2.0, 0.0, 1.0]


def test_undefined_and_refused() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="fewer than two items"):
        limits = limits_of_agreement([[1, 2], [None, 3]])
    assert math.isnan(limits.lower)
    assert limits.lower_interval.reason == limits.reason
    with pytest.raises(RatingsError, match=r"need the ratings of two raters, got 3"):
        limits_of_agreement([[1, 2, 3], [3, 4, 4]])
    for name in ("share", "level"):
        with pytest.raises(ParameterError, match=rf"{name}: needs \(0, 1\), got 95"):
            limits_of_agreement([[1, 2], [2, 2]], **{name: 95})

"""SEM and MDC95: mean squares by hand, R's values, simulated coverage."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from masrel.agreement import ErrorKind, mdc, sem
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate

KINDS: tuple[ErrorKind, ...] = ("agreement", "consistency")
SETTINGS: dict[str, Any] = {
    setting["id"]: setting
    for setting in json.loads(
        (Path(__file__).parents[1] / "oracles" / "measurement.json").read_text("utf-8")
    )["settings"]
    if setting["kind"] == "icc_missing"
}


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


def test_undefined_with_a_reason() -> None:
    for ratings, why in (
        ([[1, 2]], "fewer than two items"),
        ([[1], [2]], "fewer than two raters"),
        ([[1, 2], [3, None]], "too few ratings to tell raters"),
    ):
        with pytest.warns(UndefinedStatisticWarning, match=why):
            result = mdc(ratings)
        assert math.isnan(result.value)
        assert result.reason is not None
        assert result.interval is None


@pytest.mark.slow
@pytest.mark.parametrize("gaps", [False, True])
def test_coverage_of_the_error_of_agreement(gaps: bool) -> None:
    # 400 studies of 20 items and 4 raters: at 95 % fewer than 364 cover with
    # probability .0005; the method is known to cover more than it says
    rng, covered = np.random.default_rng(4), 0
    for _ in range(400):
        ratings = rng.normal(size=(20, 1)) * 2 + rng.normal(size=(20, 4))
        ratings += rng.normal(size=4) * 0.7
        if gaps:
            ratings[rng.random(ratings.shape) < 0.3] = np.nan
        low, high = ends(sem(ratings))
        covered += low <= math.sqrt(1.49) <= high
    assert covered >= 364

"""Intraclass correlations of tables with gaps: lme4, a dense likelihood, by hand."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize, stats

from masrel.agreement import IccForm, icc, variance_components

Floats = NDArray[np.float64]

SETTINGS: dict[str, Any] = {
    setting["id"]: setting
    for setting in json.loads(
        (Path(__file__).parents[1] / "oracles" / "measurement.json").read_text("utf-8")
    )["settings"]
    if setting["kind"] == "icc_missing"
}
WITH_GAPS = [name for name, s in SETTINGS.items() if "anova" not in s]
SINGLE: tuple[IccForm, ...] = ("ICC(1)", "ICC(A,1)", "ICC(C,1)")


def table(name: str) -> Floats:
    return np.array(SETTINGS[name]["data"], dtype=float)


class Dense:
    """The restricted likelihood from the whole covariance matrix of the ratings."""

    def __init__(self, ratings: Floats, *, has_raters: bool) -> None:
        items, raters = np.nonzero(~np.isnan(ratings))
        self.values = ratings[items, raters]
        self.of_items = (items[:, None] == items).astype(float)
        self.of_raters = (raters[:, None] == raters) * float(has_raters)

    def deviance(self, of_items: float, of_raters: float) -> float:
        """-2 log likelihood at two ratios to the residual, whatever that is."""
        n = len(self.values)
        v = np.eye(n) + of_items * self.of_items + of_raters * self.of_raters
        inverse = np.linalg.inv(v)
        weight = inverse.sum()
        left = self.values - inverse.sum(axis=0) @ self.values / weight
        _, log_det = np.linalg.slogdet(v)
        squares = float(left @ inverse @ left)
        return float(log_det + math.log(weight) + (n - 1) * math.log(squares))

    def best(self) -> tuple[Floats, float]:
        """The ratios of highest likelihood, and the deviance there."""
        results = [
            optimize.minimize(
                lambda z: self.deviance(*np.exp(z)),
                start,
                method="Nelder-Mead",
                options={"xatol": 1e-9, "fatol": 1e-12, "maxiter": 2000},
            )
            for start in ([0.0, -1.0], [1.5, -5.0])
        ]
        result = min(results, key=lambda r: r.fun)
        return np.exp(result.x), float(result.fun)


@pytest.mark.parametrize("name", WITH_GAPS)
def test_values_are_those_of_lme4(name: str) -> None:
    one_way, two_way = (SETTINGS[name][f"reml_{w}_way"] for w in ("one", "two"))
    for form, expected in (
        ("ICC(1)", one_way["icc_1"]),
        ("ICC(A,1)", two_way["icc_agreement_1"]),
        ("ICC(C,1)", two_way["icc_consistency_1"]),
    ):
        result = icc(table(name), form=form)  # type: ignore[arg-type]
        assert result.value == pytest.approx(expected, rel=1e-4)
        assert result.interval is not None
        assert result.interval.low <= result.value <= result.interval.high
        assert result.interval.method == "REML, profile likelihood"
        assert "ratings are missing" in result.interval.notes[0]


@pytest.mark.parametrize("name", WITH_GAPS)
def test_variances_are_those_of_lme4(name: str) -> None:
    result, two_way = variance_components(table(name)), SETTINGS[name]["reml_two_way"]
    assert result.method == "REML"
    parts = [result.items, result.raters, result.residual]
    keys = ("items", "raters", "residual")
    expected = [two_way[f"variance_{key}"] for key in keys]
    assert parts == pytest.approx(expected, rel=1e-3, abs=1e-4)


WHOLE = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6.0]])


@pytest.mark.parametrize(
    ("ratings", "form"),
    [
        # where raters make two valleys
        *((table("icc_missing-03"), form) for form in SINGLE),
        (WHOLE, "ICC(A,1)"),
        (WHOLE + np.arange(4)[:, None] * 4, "ICC(A,1)"),
    ],
)
def test_ends_are_where_the_profile_is_a_quantile_of_chi_squared_higher(
    ratings: Floats, form: IccForm
) -> None:
    dense = Dense(ratings, has_raters=form != "ICC(1)")
    interval = icc(ratings, form=form, level=0.9).interval
    assert interval is not None
    _, least = dense.best()
    for end in (interval.low, interval.high):
        odds = end / (1.0 - end)
        profile = min(
            dense.deviance(odds * (1.0 + r if form == "ICC(A,1)" else 1.0), r)
            for r in (0.0, *np.geomspace(1e-3, 50.0, 180))
        )
        assert profile - least == pytest.approx(stats.chi2.ppf(0.9, 1), abs=2e-3)


def test_without_residual_by_hand() -> None:
    # Items 1, 3 and 5, the second rater 1 higher throughout: the variance of items is
    # 4, that of raters 1/2, and nothing is left.
    ratings = [[1, 2], [3, 4], [5, None]]
    assert icc(ratings, form="ICC(A,1)").value == pytest.approx(4 / 4.5, rel=1e-12)
    assert icc(ratings, form="ICC(A,k)").value == pytest.approx(4 / 4.25, rel=1e-12)
    consistency = icc(ratings, form="ICC(C,1)")
    assert consistency.value == 1.0
    assert consistency.interval is not None
    assert (consistency.interval.low, consistency.interval.high) == (1.0, 1.0)
    # Of two variances with 2 and 1 degrees of freedom the likelihood ratio at odds of
    # 8 t is 2 log t + 3 log((2/t + 1)/3): of t^-1 = y, y^-2 (2 y + 1)³ = 27 exp(χ²).
    interval = icc(ratings, form="ICC(A,1)").interval
    assert interval is not None
    for end in (interval.low, interval.high):
        t = end / (1.0 - end) / 8.0
        ratio = 2.0 * math.log(t) + 3.0 * math.log((2.0 / t + 1.0) / 3.0)
        assert ratio == pytest.approx(stats.chi2.ppf(0.95, 1), rel=1e-9)
    whole = icc([[1, 2], [3, 4], [5, 6]]).interval  # the same variances
    assert whole is not None
    assert (whole.low, whole.high) == pytest.approx((interval.low, interval.high))


def test_a_variance_of_zero_is_said() -> None:
    ratings = [[1, 4, 2], [4, 1, None], [2, 3, 3], [3, 2, 2]]
    result = icc(ratings)
    assert result.value == 0.0
    assert result.interval is not None
    assert result.interval.low == 0.0 < result.interval.high
    assert "items 0 (the least it can be), raters 0 (the" in result.interval.notes[0]


@pytest.mark.parametrize("form", SINGLE)
def test_neither_origin_unit_nor_order_matters(form: IccForm) -> None:
    ratings = table("icc_missing-04")
    value = icc(ratings, form=form).value
    for moved in (
        ratings + 2.0**30,
        ratings * 0.125 - 3.0,
        -ratings,
        ratings * 1e200,
        ratings * 1e-200,
        ratings[::-1],
        ratings[:, [3, 0, 5, 1, 4, 2]],
    ):
        assert icc(moved, form=form).value == pytest.approx(value, rel=1e-10)

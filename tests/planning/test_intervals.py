"""The interval of a simulated study is the one that an analysis of it computes."""

import warnings
from typing import Any

import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.intervals import estimate
from masrel.planning import precision
from masrel.planning._item_models import ItemModel
from masrel.planning._studies import StudyDesign, StudyMaker

SCALE = (0, 1, 3)  # numbers that are not evenly spaced: weights go by them

CASES = [
    (name, target, interval)
    for name in ("fleiss_kappa", "cohen_kappa", "krippendorff_alpha", "pooled_kappa")
    for target, interval in (
        *(("items", each) for each in ("auto", "analytic", "jackknife", "bootstrap")),
        ("items", "posterior"),
        ("raters", "jackknife"),
        ("both", "jackknife"),
    )
    if target == "items" or name in ("fleiss_kappa", "krippendorff_alpha")
    if (name, interval) != ("pooled_kappa", "posterior")
]


@pytest.mark.parametrize(("name", "target", "interval"), CASES)
@pytest.mark.parametrize("p_missing", [0.0, 0.15])
def test_it_is_that_of_masrel_intervals(
    name: str, target: Any, interval: Any, p_missing: float
) -> None:
    model = ItemModel(
        name="mixture",
        prevalences=(0.6, 0.3, 0.1),
        kappa=0.5,
        p_missing=p_missing,
        scale=SCALE,
    )
    n_raters, weights = (2 if name == "cohen_kappa" else 3), "linear"
    maker = StudyMaker(
        StudyDesign(
            coefficient=name,
            weights=weights,
            model=model,
            n_items=14,
            n_raters=n_raters,
            target=target,
            level=0.95,
            interval=interval,
            value=0.5,
        )
    )
    codes = maker._draw(np.random.default_rng(3), 2)
    for study, outcome in zip(codes, maker._of_codes(codes), strict=True):
        grades: Any = [[SCALE[x] if x >= 0 else None for x in row] for row in study]
        if name == "pooled_kappa":
            grades = [[row[2 * k : 2 * k + 2] for row in grades] for k in range(3)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = estimate(
                name,
                grades,
                target=target,
                method=interval,
                weights=weights,
                categories=SCALE,
                rng=0,
            )
        assert result.interval is not None
        ends = (result.value, result.interval.low, result.interval.high)
        np.testing.assert_allclose(outcome[[0, 2, 3]], ends, rtol=0, atol=1e-13)


def test_weights_go_by_the_scale_where_it_is_named() -> None:
    common: dict[str, Any] = {
        "value": 0.6,
        "weights": "quadratic",
        "prevalences": [0.5, 0.3, 0.2],
        "model": "mixture",
        "target": "items",
        "n_items": 40,
        "n_raters": 2,
        "interval": "t",
        "rng": 1,
    }
    by_place = precision("cohen_kappa", **common).expected_half_width
    even = precision("cohen_kappa", **common, categories=[0, 2, 4])
    uneven = precision("cohen_kappa", **common, categories=[0, 1, 10])
    assert even.expected_half_width == pytest.approx(by_place, rel=1e-12)
    assert abs(uneven.expected_half_width - by_place) > 1e-3
    with pytest.raises(ParameterError, match="categories: needs 3 that differ"):
        precision("cohen_kappa", **common, categories=[0, 1, 1])


@pytest.mark.parametrize(
    ("target", "interval"),
    [("raters", "posterior"), ("both", "analytic"), ("raters", "normal")],
)
def test_an_interval_that_no_analysis_computes_is_refused(
    target: Any, interval: str
) -> None:
    with pytest.raises(ParameterError, match=f'interval: "{interval}" is not of'):
        precision(
            "fleiss_kappa",
            value=0.5,
            categories=3,
            model="mixture",
            target=target,
            n_items=20,
            n_raters=4,
            interval=interval,
        )

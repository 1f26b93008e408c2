"""The interval of a simulated study is the one that an analysis of it computes."""

import warnings
from typing import Any

import numpy as np
import pytest

from masrel.intervals import estimate
from masrel.planning import Study
from masrel.planning._studies import draw, outcomes_of
from masrel.planning._truth import design_of

SCALE = (0, 1, 3)  # numbers that are not evenly spaced: weights go by them
MIXTURE: dict[str, Any] = {
    "value": 0.5,
    "weights": "linear",
    "categories": SCALE,
    "prevalences": [0.6, 0.3, 0.1],
    "model": "mixture",
}


@pytest.mark.parametrize("p_missing", [0.0, 0.15])
@pytest.mark.parametrize(
    ("name", "n_raters", "target", "interval"),
    [
        ("fleiss_kappa", 3, "items", "analytic"),
        ("cohen_kappa", 2, "items", "analytic"),
        ("krippendorff_alpha", 3, "items", "analytic"),
        ("conger_kappa", 3, "items", "analytic"),
        ("pooled_kappa", 3, "items", "analytic"),
        ("pooled_kappa", 3, "items", "jackknife"),
        ("fleiss_kappa", 3, "items", "posterior"),
        ("krippendorff_alpha", 3, "raters", "auto"),
        ("fleiss_kappa", 4, "raters", "jackknife"),
        ("fleiss_kappa", 3, "both", "auto"),
    ],
)
def test_it_is_that_of_masrel_intervals(
    name: str, n_raters: int, target: Any, interval: Any, p_missing: float
) -> None:
    study = Study(
        name,
        **MIXTURE,
        n_items=14,
        n_raters=n_raters,
        target=target,
        interval=interval,
        p_missing=p_missing,
    )
    design = design_of(study)
    codes = draw(design, np.random.default_rng(3), 3)
    for drawn, outcome in zip(codes, outcomes_of(design, codes), strict=True):
        grades: Any = [[SCALE[x] if x >= 0 else None for x in row] for row in drawn]
        if name == "pooled_kappa":
            grades = [[row[2 * k : 2 * k + 2] for row in grades] for k in range(3)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = estimate(
                name,
                grades,
                target=target,
                method=interval,
                weights="linear",
                categories=SCALE,
                rng=0,
            ).interval
        assert made is not None
        ends = (made.low, made.high)
        np.testing.assert_allclose(outcome[1:], ends, rtol=0, atol=1e-13)

"""Models are probabilities of ratings, summed and drawn alike; intervals are those of
`masrel.intervals`.
"""

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from masrel.agreement import CodedRatings, coefficient
from masrel.intervals import estimate
from masrel.planning import Study, precision
from masrel.planning._studies import draw, outcomes_of
from masrel.planning._truth import design_of

MODELS = ["mixture", "dirichlet-multinomial", "latent"]


@pytest.mark.parametrize(
    ("name", "n_raters", "p_missing"),
    [
        ("fleiss_kappa", 2, 0.2),
        ("fleiss_kappa", 4, 0.2),
        ("pooled_kappa", 1, 0.0),
        ("stratified_kappa", 3, 0.0),
    ],
)
def test_the_formula_is_near_what_studies_show(
    name: str, n_raters: int, p_missing: float
) -> None:
    study = Study(
        name,
        value=0.5,
        prevalences=[0.5, 0.3, 0.2],
        model="mixture",
        target="items",
        n_items=150,
        n_raters=n_raters,
        p_missing=p_missing,
        interval="normal",
        rng=1,
    )
    shown = precision(study).expected_half_width
    formula = precision(replace(study, method="wald")).expected_half_width
    assert formula == pytest.approx(shown, rel=0.01)


@pytest.mark.parametrize("p_missing", [0.0, 0.2])
@pytest.mark.parametrize("model", MODELS)
def test_drawn_ratings_have_the_prevalences_and_the_kappa(
    model: str, p_missing: float
) -> None:
    # 400 studies of 50 items; four standard errors fail once in 15 000 runs
    study = Study(
        "fleiss_kappa",
        value=0.4,
        prevalences=[0.5, 0.3, 0.2],
        model=model,
        target="items",
        p_missing=p_missing,
        n_items=20_000,
        n_raters=3,
    )
    codes = draw(design_of(study), np.random.default_rng(7), 1)[0]
    result = coefficient("fleiss_kappa")(
        CodedRatings(codes=codes, categories=(0, 1, 2))
    )
    # raters' biases are only three in one study, so that kappa of a latent trait moves
    error = 0.05 if model == "latent" else 4 * result.standard_error
    assert result.value == pytest.approx(0.4, abs=error)
    shares = [(codes == k).sum() / (codes >= 0).sum() for k in range(3)]
    wide = 0.1 if model == "latent" else 0.015
    assert shares == pytest.approx([0.5, 0.3, 0.2], abs=wide)
    assert (codes < 0).mean() == pytest.approx(p_missing, abs=0.01)


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

"""Models are probabilities of ratings, summed and drawn alike."""

from dataclasses import replace

import numpy as np
import pytest

from masrel.agreement import CodedRatings, coefficient
from masrel.planning import Study, precision
from masrel.planning._studies import draw
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

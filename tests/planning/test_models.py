"""Models are probabilities of ratings: summed, drawn and enumerated alike."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from masrel.agreement import CodedRatings, coefficient
from masrel.planning import Study, precision
from masrel.planning._studies import draw
from masrel.planning._truth import design_of

MODELS = ["mixture", "dirichlet-multinomial", "latent"]


def plain_probability(model: str, row: tuple[int, ...], kappa: float) -> float:
    # of one item's ratings by named raters, two categories of prevalence .7 and .3
    pi = (0.7, 0.3)
    if model == "mixture":
        one = pi[row[0]] if len(set(row)) == 1 else 0.0
        return kappa * one + (1 - kappa) * math.prod(pi[k] for k in row)
    scale = (1 - kappa) / kappa  # Pólya's urn
    counts, p = [0, 0], 1.0
    for k in row:
        p *= (pi[k] * scale + counts[k]) / (scale + sum(counts))
        counts[k] += 1
    return p


def enumerated(model: str, n_items: int, n_raters: int, name: str) -> dict[str, float]:
    """Every study, rating by rating, with its probability."""
    rows = list(itertools.product((0, 1), repeat=n_raters))
    p = [plain_probability(model, row, 0.4) for row in rows]
    total = half = narrow = 0.0
    for study in itertools.combinations_with_replacement(range(len(rows)), n_items):
        freq = np.bincount(study, minlength=len(rows))
        weight = math.factorial(n_items) / math.prod(map(math.factorial, freq))
        weight *= math.prod(p[row] for row in study)
        ratings = [list(rows[row]) for row in study]
        result = coefficient(name)(ratings, categories=[0, 1])
        if result.reason is None:
            h = 1.959963984540054 * result.standard_error
            total, half = total + weight, half + weight * h
            narrow += weight * (h <= 0.6)
    return {"defined": total, "half": half / total, "narrow": narrow}


@pytest.mark.filterwarnings("ignore::masrel.errors.UndefinedStatisticWarning")
@pytest.mark.parametrize("model", MODELS[:2])
@pytest.mark.parametrize(
    ("name", "n_items", "n_raters"),
    [("fleiss_kappa", 6, 2), ("gwet_ac", 4, 3), ("cohen_kappa", 5, 2)],
)
def test_the_sum_over_all_studies_is_that_of_an_enumeration(
    model: str, name: str, n_items: int, n_raters: int
) -> None:
    reference = enumerated(model, n_items, n_raters, name)
    kappa = true_value(name)
    plan = precision(
        Study(
            name,
            value=kappa,
            prevalences=[0.7, 0.3],
            model=model,
            target="items",
            n_items=n_items,
            n_raters=n_raters,
            half_width=0.6,
            interval="normal",
            method="exact",
        )
    )
    assert plan.expected_half_width == pytest.approx(reference["half"], abs=1e-9)
    assert plan.assurance == pytest.approx(reference["narrow"], abs=1e-9)
    assert 1.0 - plan.p_undefined == pytest.approx(reference["defined"], abs=1e-9)


def true_value(name: str) -> float:
    # of κ = .4 in the model: .4 but for AC1, 1 - D_o / (2 p (1 - p) + ...) by hand
    if name != "gwet_ac":
        return 0.4
    disagreement = 2 * 0.7 * 0.3 * (1 - 0.4)
    return 1 - disagreement / (1 - 2 * 0.7 * 0.3)


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

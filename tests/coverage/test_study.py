"""Populations have the coefficients that are said of them, and a study repeats."""

import numpy as np
import pandas as pd
import pytest

from docs.make.coverage.defaults import METHODS, deciding, held_out
from docs.make.coverage.populations import Population, latent_trait, some_careless
from docs.make.coverage.study import Study
from masrel.agreement import COEFFICIENTS

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")
CELLS = deciding()


@pytest.mark.parametrize("place", range(7, len(CELLS), 10))
def test_a_large_study_has_the_coefficients_of_its_population(place: int) -> None:
    cell = CELLS[place]
    population = cell.make()
    codes = population.draw(40_000, np.random.Generator(np.random.PCG64(place)))
    ratings = np.where(codes < 0, np.nan, codes)
    grades = range(population.chances.shape[-1])
    for name in cell.coefficients:
        coefficient, _, weights = name.partition(", ")
        entry, weights = COEFFICIENTS[coefficient], weights or "identity"
        found = entry(ratings, categories=grades, weights=weights)  # type: ignore[arg-type]
        off = found.value - population.truth(coefficient, weights)
        assert abs(off) < 5.5 * found.standard_error  # 2e-6 of 40 others fail


SHARES = (0.35, 0.3, 0.2, 0.15)
DRAWN = {
    "careless": some_careless(SHARES, 60),
    "fixed": some_careless(SHARES, 60).with_items_fixed(30),
    "severities": latent_trait(SHARES, 0.6, 100, 1.0, 60).with_items_fixed(9),
}


@pytest.mark.parametrize("population", DRAWN.values(), ids=list(DRAWN))
def test_many_raters_drawn_have_the_coefficients_of_all(population: Population) -> None:
    rng = np.random.Generator(np.random.PCG64(3))
    for name in ("fleiss_kappa", "conger_kappa", "gwet_ac"):
        entry = COEFFICIENTS[name]
        found = [
            entry(population.draw(200, rng), categories=range(4)).value
            for _ in range(20)
        ]
        off = np.mean(found) - population.truth(name)
        # the coefficient of 60 raters is off by some 1 in 60 itself
        assert abs(off) < 5.0 * np.std(found) / 20**0.5 + 0.017


def test_kappa_of_fixed_items_by_hand() -> None:
    # All raters grade the first item 0, and half of them the second. Two differ on 1/4
    # of ratings; shares are 3/4 and 1/4, so by chance on 6/16: κ = 1 - (1/4)/(6/16)
    chances = np.array([[[1.0, 0.0]], [[0.5, 0.5]]])
    of_all = Population(kinds=np.full(2, 0.5), chances=chances, n_drawn=3)
    assert of_all.truth("fleiss_kappa") == pytest.approx(1 / 3)
    fixed = of_all.with_items_fixed(4)
    assert fixed.truth("conger_kappa") == pytest.approx(1 / 3)
    codes = fixed.draw(4, np.random.Generator(np.random.PCG64(1)))
    assert codes.shape == (4, 3)
    assert not codes[:2].any()


def test_a_study_repeats_and_counts_its_studies() -> None:
    study = Study(name="one", cells=CELLS[4:5], methods=METHODS, seed=1)
    rows = study.run(6, quiet=True)
    assert rows.equals(study.run(6, quiet=True))
    assert len(rows) == len(METHODS) * len(CELLS[4].coefficients)
    assert (rows["n_defined"] <= 6).all()
    inside = rows["coverage"] + rows["truth_below"] + rows["truth_above"]
    assert inside.to_numpy() == pytest.approx(rows["answered"].to_numpy())
    assert pd.api.types.is_numeric_dtype(rows["width"])


def test_cells_to_check_are_none_that_decided() -> None:
    assert len(CELLS) == 60
    assert not {repr(cell) for cell in held_out()} & {repr(cell) for cell in CELLS}

"""Populations have the coefficients that are said of them, and a study repeats."""

import numpy as np
import pandas as pd
import pytest

from docs.make.coverage.defaults import METHODS, deciding
from docs.make.coverage.populations import Population
from docs.make.coverage.study import Study
from masrel.agreement import COEFFICIENTS

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")
CELLS = deciding()


@pytest.mark.parametrize("place", range(7, len(CELLS), 20))
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
    rows = study.run(3, quiet=True)
    assert rows.equals(study.run(3, quiet=True))
    assert len(rows) == len(METHODS) * len(CELLS[4].coefficients)
    assert (rows["n_defined"] <= 3).all()
    inside = rows["coverage"] + rows["truth_below"] + rows["truth_above"]
    assert inside.to_numpy() == pytest.approx(rows["answered"].to_numpy())
    assert pd.api.types.is_numeric_dtype(rows["width"])

"""Populations have the coefficients that are said of them, and a study repeats."""

import numpy as np
import pandas as pd
import pytest

from docs.make.coverage.defaults import METHODS, deciding, held_out
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

"""Populations have the coefficients that are said of them, and a study repeats."""

from dataclasses import replace

import numpy as np
import pytest

from docs.make.coverage.populations import Population
from docs.make.coverage.rules import METHODS, deciding
from docs.make.coverage.study import Answer, Cell, rows_of, run
from masrel.agreement import COEFFICIENTS

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")
CELLS = deciding()


@pytest.mark.parametrize("place", range(7, len(CELLS), 40))
def test_a_large_study_has_the_coefficients_of_its_population(place: int) -> None:
    cell = CELLS[place]
    make, _, name, _ = cell.ask.args  # type: ignore[attr-defined]
    population = make()
    codes = population.draw(40_000, np.random.Generator(np.random.PCG64(place)))
    ratings = np.where(codes < 0, np.nan, codes)
    grades = range(population.chances.shape[-1])
    coefficient, _, weights = name.partition(", ")
    entry, weights = COEFFICIENTS[coefficient], weights or "identity"
    found = entry(ratings, categories=grades, weights=weights)
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
    cells = [replace(cell, n_studies=3) for cell in CELLS[20:22]]
    rows = run(cells)
    assert rows == run(cells, processes=2)
    assert len(rows) == 2 * len(METHODS)
    for row in rows:
        assert row["n_studies"] <= 3
        kinds = (row[name] for name in ("held", "below", "above", "undefined"))
        assert sum(kinds) == row["n_studies"]


def test_rows_by_hand() -> None:
    # of four studies one holds the truth, 2, one is below it, one above, one has no end
    ends = np.array([[1.0, 3.0], [0.0, 1.0], [4.0, 6.0], [np.nan, 1.0]]).T
    answer = Answer("t", *ends, 2.0, np.array([True, False, False, False]))
    cell = Cell(at={"n": 5}, ask=lambda *_: [answer], seed=(1,), n_studies=4)
    counts = {"held": 1, "below": 1, "above": 1, "undefined": 1, "warned": 1}
    of_all = {"n": 5, "interval": "t", "truth": 2.0, "n_studies": 4}
    assert rows_of(cell) == [{**of_all, **counts, "width": pytest.approx(5 / 3)}]

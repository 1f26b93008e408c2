"""The page shows its rows and hides no failure, and another run finds the same."""

from dataclasses import replace

import pytest
from scipy.stats import fisher_exact

from docs.make.coverage.__main__ import EVIDENCE, studies
from docs.make.coverage.page import page, read

KEY = ["study", "family", "population", "n_items", "n_raters", "coefficient", "method"]
ROWS = read(EVIDENCE / "coverage.csv")
OTHER_SEED = 7
FALSE_ALARM = 1e-6  # of one of the 220 comparisons of the long test: 2 in 10^4 runs


def test_the_page_is_made_from_its_rows() -> None:
    text = (EVIDENCE / "coverage.md").read_text(encoding="utf-8")
    assert page(text, EVIDENCE) == text


def test_every_cell_has_a_row() -> None:
    asked = [
        (of.name, c.family, c.population, c.n_items, c.n_raters, coefficient, method)
        for of in studies()
        for c in of.cells
        for coefficient in c.coefficients
        for method in of.methods
    ]
    assert sorted(asked) == sorted(ROWS[KEY].itertuples(index=False, name=None))
    assert len({key[:5] for key in asked}) <= 60


@pytest.mark.parametrize(
    ("every", "size"),
    [
        pytest.param(28, 40, marks=pytest.mark.slow),
        pytest.param(3, 300, marks=pytest.mark.long),
    ],
)
def test_other_studies_are_covered_as_often(every: int, size: int) -> None:
    known = ROWS.set_index(KEY)
    for study in studies():
        part = replace(study, cells=study.cells[::every], seed=OTHER_SEED)
        found = part.run(size, quiet=True).assign(study=study.name).set_index(KEY)
        assert len(found)
        for key, row in found.iterrows():
            both = [
                [round(of.coverage * of.n_defined), of.n_defined]
                for of in (row, known.loc[key])
            ]
            counts = [[covered, n - covered] for covered, n in both]
            # given how many are missed in all, exact
            assert fisher_exact(counts).pvalue > FALSE_ALARM, key

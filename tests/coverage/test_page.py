"""Pages show their rows and hide no failure, and other studies find the same."""

import csv
from dataclasses import replace

import pytest
from scipy.stats import fisher_exact

from docs.make.coverage.__main__ import STUDIES
from docs.make.coverage.kappas_page import page
from docs.make.coverage.study import run
from docs.make.evidence import EVIDENCE

OTHER_SEED = 7
FALSE_ALARM = 1e-6  # of one of the 800 comparisons of the long test: 1 in 10^3 runs
LONG = pytest.mark.long
PUBLISHED = [name for name in STUDIES if (EVIDENCE / f"{name}.csv").exists()]


def rows_of(name: str) -> dict[tuple[str, ...], dict[str, str]]:
    """Return the published rows of a study by their cell and interval."""
    text = (EVIDENCE / f"{name}.csv").read_text(encoding="utf-8")
    keys = [*STUDIES[name][0]()[0].at, "interval"]
    rows = csv.DictReader(text.splitlines())
    return {tuple(row[key] for key in keys): row for row in rows}


def test_the_page_is_made_from_its_rows() -> None:
    text = (EVIDENCE / "coverage.md").read_text(encoding="utf-8")
    assert page(text) == text


@pytest.mark.parametrize("name", PUBLISHED)
def test_every_cell_has_a_row(name: str) -> None:
    asked = {tuple(map(str, cell.at.values())) for cell in STUDIES[name][0]()}
    assert asked == {key[:-1] for key in rows_of(name)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "every", "size"),
    [
        ("coverage", 90, 40),
        ("limits_coverage", 9, 100),
        ("judges_rates", 9, 4000),
        ("resampling", 6, 20),
        pytest.param("coverage", 9, 300, marks=LONG),
        pytest.param("resampling", 1, 200, marks=LONG),
    ],
)
def test_other_studies_are_covered_as_often(name: str, every: int, size: int) -> None:
    known = rows_of(name)
    cells = [
        replace(cell, n_studies=size, seed=(OTHER_SEED, *cell.seed))
        for cell in STUDIES[name][0]()[::every]
    ]
    for row in run(cells):
        key = tuple(map(str, (*cells[0].at, "interval")))
        old = known[tuple(str(row[of]) for of in key)]
        both = [(int(of["held"]), int(of["n_studies"])) for of in (row, old)]
        # given how many are missed in all, exact
        counts = [[held, n - held] for held, n in both]
        assert fisher_exact(counts).pvalue > FALSE_ALARM, row

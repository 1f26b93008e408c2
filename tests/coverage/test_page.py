"""The page shows its rows and hides no failure, and another run finds the same."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from scipy.stats import fisher_exact

from docs.make.coverage.__main__ import DOCS, studies
from docs.make.coverage.page import AFTER, BEFORE, marked, page, read, write_page

KEY = ["study", "family", "population", "n_items", "n_raters", "coefficient", "method"]
ROWS = read(DOCS / "coverage.csv")
OTHER_SEED = 7
FALSE_ALARM = 1e-6  # of one of the 220 comparisons of the long test: 2 in 10^4 runs


def test_the_page_is_made_from_its_rows() -> None:
    assert page(DOCS) == (DOCS / "coverage.md").read_text(encoding="utf-8")


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


def test_coverages_are_judged_before_they_are_rounded() -> None:
    found = [marked(share) for share in (0.9249, 0.925, 0.985, 0.9851)]
    assert found == ["**92**", "92", "98", "*99*"]


def test_a_cell_that_fails_is_named(tmp_path: Path) -> None:
    rows = ROWS.assign(coverage=0.95, answered=1.0)
    fails = (rows["population"] == "κ 0.6") & (rows["size"] == "30 × 3")
    fails &= (rows["study"] == "both") & (rows["coefficient"] == "gwet_ac")
    shares = {"coverage": 0.874, "truth_below": 0.1, "truth_above": 0.02}
    rows.loc[fails, list(shares)] = list(shares.values())
    rows.loc[fails, "answered"] = 0.994
    rows.to_csv(tmp_path / "coverage.csv", index=False)
    text = page(tmp_path)
    line = "both | strong biases | κ 0.6 | 30 × 3 | gwet_ac | 87 | 10 | 2 | 1 |"
    assert text.count(line) == 1
    assert "| 95 / **87** / 95 |" in text
    assert "1 are too low, and 0 higher" in text


def test_rules_of_the_default_are_compared_where_there_are_rows(tmp_path: Path) -> None:
    cell = {"family": "latent class", "population": "2 %", "n_items": 50, "n_raters": 3}
    cell |= {"n_studies": 100, "width": 0.4, "answered": 1.0}
    rows = pd.DataFrame([
        {**cell, "coefficient": name, "method": method, "coverage": coverage}
        for name, before, after in (("gwet_ac", 0.6, 0.91), ("fleiss_kappa", 0.7, 0.97))
        for method, coverage in ((BEFORE, before), (AFTER, after))
    ])  # fmt: skip
    ROWS.to_csv(tmp_path / "coverage.csv", index=False)
    rows.to_csv(tmp_path / "coverage_defaults.csv", index=False)
    rows.assign(coverage=0.95).to_csv(tmp_path / "coverage_held_out.csv", index=False)
    write_page(tmp_path)
    text = (tmp_path / "coverage.md").read_text(encoding="utf-8")
    assert f"| latent class | {AFTER} | 2 | 1 | 91 | 94 | 97 | 0.40 | 0.0 |" in text
    assert "| latent class | 2 % | 50 × 3 | **60** | **91** |" in text
    assert text.count(f"`{AFTER}` is nowhere too low.") == 1
    assert (tmp_path / "figures" / "coverage_defaults.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("every", "size"),
    [
        pytest.param(7, 60, marks=pytest.mark.slow),
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

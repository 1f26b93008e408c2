"""The page says which cells are outside, and marks them."""

from pathlib import Path

from docs.make.coverage.careless import count_careless
from docs.make.coverage.figure import draw
from docs.make.coverage.methods import DEFAULT, METHODS
from docs.make.coverage.page import Rare, is_within, page
from docs.make.coverage.rare import RareQuestion, count_rare
from docs.make.coverage.simulate import (
    DESIGNS,
    OTHERS,
    Cell,
    Counted,
    Question,
    all_cells,
)


def cell(question: Question, coverage: float) -> Cell:
    target, model, design, kappa = question
    counted = Counted(coverage=coverage, width=0.25, answered=1.0)
    return Cell(
        target=target,
        model=model,
        design=design,
        kappa=kappa,
        n_studies=1_000,
        methods=dict.fromkeys(METHODS[target], counted),
        spreadless=0.4,
        single=0.0,
        truth=kappa,
    )


def test_coverages_are_judged_as_they_are_shown() -> None:
    found = [is_within(share) for share in (0.924, 0.926, 0.984, 0.986)]
    assert found == [False, True, True, False]


def test_a_page_names_the_cells_that_are_outside() -> None:
    first, *rest = all_cells(DESIGNS)
    cells = [cell(first, 0.874), *(cell(question, 0.951) for question in rest)]
    others = [cell(question, 0.999) for question in all_cells(OTHERS)]
    rare = count_rare(RareQuestion("alike", (0.96, 0.04), 2, 20, 0.6), 100)
    skewed = count_rare(RareQuestion("unlike", (0.8, 0.15, 0.05), 2, 20, 0.6), 50)
    few = [next(iter(count_careless(20)))]
    text = page(cells, others, Rare(chosen=rare, checked=skewed, careless=few))
    assert "all but 1; cells where no candidate does: 1." in text
    assert (
        "| items | Dirichlet-multinomial | 4 × 8 | 0.2 | **87** | none | 40 % |" in text
    )
    assert f"| {DEFAULT} | 87 | 95 | 35 | 0.25 |" in text
    assert "*100* / *100* / *100*" in text
    assert "$" not in text
    fleiss = rare[0]
    assert fleiss.verdict("jackknife") == "low"
    assert "| Fleiss' κ | 1 | 1 |" in text


def test_a_figure_is_drawn(tmp_path: Path) -> None:
    draw([cell(q, 0.3) for q in all_cells(DESIGNS)], tmp_path / "coverage.png")
    assert (tmp_path / "coverage.png").stat().st_size > 10_000


def test_two_raters_are_asked_for_other_items_only() -> None:
    asked = {(t, d.n_raters) for t, _, d, _ in all_cells(OTHERS)}
    assert ("items", 2) in asked
    assert not {("raters", 2), ("both", 2)} & asked

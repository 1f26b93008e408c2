"""How often intervals of coefficients of two raters hold what they ask for.

``python -m docs.make.coverage.two_raters`` writes ``docs/coverage_two_raters.md``.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from string import Template
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from docs.make.coverage.bounds import Bounds
from docs.make.coverage.methods import FEW
from docs.make.coverage.page import markdown_table, marked
from docs.make.coverage.rare_methods import RareStudies
from docs.make.coverage.rare_methods import held as holding
from docs.make.coverage.rare_studies import Table
from docs.make.coverage.simulate import KAPPAS, Counted
from docs.make.coverage.studies import Truths
from docs.make.coverage.tables import (
    COEFFICIENTS,
    MODELS,
    SHARES,
    Tables,
    cohen,
    gwet,
    on_scale,
)
from masrel.intervals._two_raters import table_prior

DOCS = Path(__file__).parents[2]
SEED, SIZE, QUICK = 20_261, 2_000, 100
SIZES = (5, 8, 16, 30, 100)
METHODS = ("default", "posterior", "even prior", "jackknife, logit", "jackknife")
_TEMPLATE = Path(__file__).with_name("two_raters_template.md")


class Question(NamedTuple):
    """One cell of the study."""

    coefficient: str
    n_grades: int
    model: str
    n_items: int
    kappa: float


def all_questions() -> Iterator[Question]:
    """Yield all cells; with two grades quadratic weights are no others."""
    for coefficient in COEFFICIENTS:
        for n_grades in SHARES:
            if n_grades > 2 or "quadratic" not in coefficient:
                for model in MODELS:
                    for n_items in SIZES:
                        for kappa in KAPPAS:
                            yield Question(coefficient, n_grades, model, n_items, kappa)


def draw(question: Question, size: int) -> tuple[Tables, float]:
    """Draw the studies of a cell, the same ones in every run, with the truth."""
    place = [list(COEFFICIENTS).index(question.coefficient), question.n_grades]
    place += [list(MODELS).index(question.model), question.n_items]
    seed = (SEED, *place, round(1000 * question.kappa))
    rng = np.random.Generator(np.random.PCG64(seed))
    population = MODELS[question.model](question.kappa, question.n_grades)
    population = population / population.sum()
    counts = rng.multinomial(question.n_items, population.ravel(), size=size)
    formula = COEFFICIENTS[question.coefficient]
    shaped = counts.reshape(size, *population.shape).astype(np.float64)
    return Tables(shaped, formula, rng), float(formula(population))


def intervals(tables: Tables) -> dict[str, Bounds]:
    """Compute all candidates."""
    q = tables.counts.shape[-1]
    posterior = tables.posterior(table_prior(None, q)[0])
    held = Bounds(
        low=np.fmin(posterior.low, tables.value),
        high=np.fmax(posterior.high, tables.value),
    )
    logit = on_scale(tables, logit=True)
    default = held
    if tables.n_items >= FEW:
        rare, ends = _where_rare(tables, held)
        default = ends.where(rare, logit.where(logit.exist > 0.0, held))
    return {
        "default": default,
        "posterior": posterior,
        "even prior": tables.posterior(np.full((q, q), q**-2.0)),
        "jackknife, logit": logit,
        "jackknife": on_scale(tables, logit=False),
    }


def _where_rare(tables: Tables, held: Bounds) -> tuple[Truths, Bounds]:
    """Return where categories are rare, and the intervals there."""
    q = tables.counts.shape[-1]
    pairs = Table(
        patterns=np.indices((q, q)).reshape(2, -1).T,
        shares=np.full(q * q, q**-2.0),
        n_categories=q,
    )
    freq = tables.counts.reshape(-1, q * q).astype(np.int64)
    studies = RareStudies(pairs, freq, tables.rng)
    if tables.formula is cohen:
        return studies.rare, holding(studies.rho, tables.value)
    if tables.formula is gwet and q == 2:
        return studies.rare, holding(studies.grid[1], tables.value)
    return studies.rare, held  # with four grades hardly any study is


def count(question: Question, size: int) -> dict[str, Counted]:
    """Count a cell."""
    tables, truth = draw(question, size)
    methods = {}
    for name, bounds in intervals(tables).items():
        width = np.where(bounds.exist, bounds.high - bounds.low, np.nan)
        methods[name] = Counted(
            coverage=float(bounds.cover(np.full(size, truth)).mean()),
            width=float(np.nanmean(width)),
            answered=float(bounds.exist.mean()),
        )
    return methods


def page(cells: dict[Question, dict[str, Counted]], size: int) -> str:
    """Write the page in Markdown."""
    text = _TEMPLATE.read_text(encoding="utf-8")
    shares = [of_cell["default"].coverage for of_cell in cells.values()]
    return Template(text).substitute(
        n_studies=f"{size:,}".replace(",", " "),
        few=FEW,
        n_cells=len(cells),
        least=f"{100 * min(shares):.0f}",
        most=f"{100 * max(shares):.0f}",
        n_within=sum(93 <= round(100 * share) <= 98 for share in shares),
        tables="\n\n".join(_tables(cells)),
    )


def _tables(cells: dict[Question, dict[str, Counted]]) -> Iterator[str]:
    for coefficient in COEFFICIENTS:
        rows = []
        for question in cells:
            if question.coefficient != coefficient or question.kappa != KAPPAS[0]:
                continue
            of_kappas = [cells[question._replace(kappa=kappa)] for kappa in KAPPAS]
            covers = [
                " / ".join(marked(c[name]) for c in of_kappas) for name in METHODS
            ]
            widths = [
                " / ".join(f"{c[name].width:.2f}" for c in of_kappas)
                for name in ("default", "posterior")
            ]
            place = [question.model, str(question.n_grades), str(question.n_items)]
            rows.append([*place, *covers, *widths])
        head = ["model", "grades", "items", *METHODS]
        head += ["width, default", "width, posterior"]
        yield f"## `{coefficient}`"
        yield markdown_table(head, rows, n_text=1)


def main() -> None:
    """Simulate, and write the page."""
    parser = argparse.ArgumentParser(description="Coverage for two raters.")
    parser.add_argument("--quick", action="store_true", help=f"{QUICK} studies a cell")
    parser.add_argument("--quiet", action="store_true", help="say nothing")
    parser.add_argument("--into", type=Path, default=DOCS, help="folder of the page")
    options = parser.parse_args()
    size = QUICK if options.quick else SIZE
    questions = tqdm(list(all_questions()), disable=options.quiet, unit="cell")
    cells = {question: count(question, size) for question in questions}
    path = options.into / "coverage_two_raters.md"
    path.write_text(page(cells, size), encoding="utf-8")


if __name__ == "__main__":
    main()

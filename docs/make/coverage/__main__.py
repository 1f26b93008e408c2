"""How often 95 % intervals hold what they ask for, by question, size and coefficient.

``python -m docs.make.coverage`` writes ``docs/evidence/coverage.csv``,
``docs/evidence/coverage.md`` and its figures; with ``--page`` only the page and the
figures, from the rows there are.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import pandas as pd

from docs.make.coverage.page import write_page
from docs.make.coverage.populations import (
    Population,
    dirichlet_multinomial,
    latent_trait,
    some_careless,
)
from docs.make.coverage.study import Cell, Method, Study
from masrel.agreement import CodedRatings
from masrel.estimates import Estimate, Interval, Target
from masrel.intervals import analytic, bootstrap, estimate, jackknife

EVIDENCE = Path(__file__).parents[2] / "evidence"
SEED, N_STUDIES = 20_261, 1_000

SHARES = (0.35, 0.3, 0.2, 0.15)
KAPPAS = (0.2, 0.6, 0.9)
SIZES = ((4, 8), (16, 8), (30, 3), (100, 5))
N_POOL = 100  # raters, of whom those of a study are drawn
ALIKE, TRAIT, BIASED = "Dirichlet-multinomial", "latent trait", "strong biases"
SOME_CARELESS = "one rater in five careless"

SEVERAL = (
    "fleiss_kappa", "conger_kappa", "krippendorff_alpha", "gwet_ac",
    "percent_agreement", "fleiss_kappa, quadratic",
)  # fmt: skip
TWO = ("cohen_kappa", "scott_pi", "cohen_kappa, quadratic")


def _ask(
    name: str,
    ratings: CodedRatings,
    weights: str,
    *,
    of: Callable[..., Estimate | Interval],
    **options: object,
) -> Interval | None:
    found = of(name, ratings, weights=weights, **options)
    return found.interval if isinstance(found, Estimate) else found


def _default(target: Target) -> dict[str, Method]:
    return {"default": partial(_ask, of=estimate, target=target)}


def _others(target: Target) -> dict[str, Method]:
    # what is printed is of other items, whatever is asked
    printed = partial(_ask, of=analytic, target="items")
    drawn = {"n_resamples": 1_000, "exact": False, "rng": 1}
    return {
        "jackknife": partial(_ask, of=jackknife, target=target),
        "bootstrap": partial(_ask, of=bootstrap, target=target, **drawn),
        "normal": partial(printed, distribution="normal"),
        "irrCAC": partial(printed, convention="irrcac"),
        "SPSS": partial(printed, convention="spss", distribution="normal"),
    }


def studies() -> Iterator[Study]:
    """Yield the studies, by what is asked."""
    for target in ("items", "raters", "both"):
        yield from _two(target, target, list(_cells(target)))
    cells = [_cell("items", TRAIT, k, (n, 2)) for n in (5, 16, 50) for k in KAPPAS]
    yield from _two("two raters", "items", cells)
    cells = [_cell("raters", SOME_CARELESS, 0.5, (30, r)) for r in (3, 5, 12)]
    yield from _two("careless raters", "raters", cells)


def _two(name: str, target: Target, cells: Sequence[Cell]) -> Iterator[Study]:
    """Yield the default of all coefficients, and other intervals of the first."""
    yield Study(name=name, cells=cells, methods=_default(target), seed=SEED)
    first = [replace(cell, coefficients=cell.coefficients[:1]) for cell in cells]
    yield Study(name=name, cells=first, methods=_others(target), seed=SEED)


def _cells(target: Target) -> Iterator[Cell]:
    for family in (ALIKE, TRAIT) if target == "items" else (BIASED,):
        for size in SIZES:
            for kappa in KAPPAS:
                yield _cell(target, family, kappa, size)


def _cell(target: Target, family: str, kappa: float, size: tuple[int, int]) -> Cell:
    n_items, n_raters = size
    return Cell(
        family=family,
        population=f"κ {kappa:g}",
        make=partial(_population, target, family, kappa, size),
        n_items=n_items,
        n_raters=n_raters,
        coefficients=SEVERAL if n_raters > 2 else TWO,
    )


def _population(
    target: Target, family: str, kappa: float, size: tuple[int, int]
) -> Population:
    n_items, n_raters = size
    if family == ALIKE:
        return dirichlet_multinomial(SHARES, kappa, n_raters)
    if family == TRAIT:
        return latent_trait(SHARES, kappa, n_raters)
    drawn = some_careless(SHARES, n_raters)
    if family == BIASED:
        drawn = latent_trait(SHARES, kappa, N_POOL, 1.0, n_drawn=n_raters)
    return drawn.with_items_fixed(n_items) if target == "raters" else drawn


def run(n_studies: int, *, processes: int = 1, quiet: bool) -> pd.DataFrame:
    """Run all, and return the rows with the name of their study."""
    found = [
        (of.name, of.run(n_studies, processes=processes, quiet=quiet))
        for of in studies()
    ]
    rows = pd.concat([rows.assign(study=name) for name, rows in found])
    return rows[["study", *rows.columns.drop("study")]].reset_index(drop=True)


def main() -> None:
    """Draw, count, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--studies", type=int, default=N_STUDIES, help="in every cell")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--page", action="store_true", help="from the rows there are")
    parser.add_argument("--quiet", action="store_true", help="say nothing")
    parser.add_argument(
        "--into", type=Path, default=EVIDENCE, help="folder of the page"
    )
    options = parser.parse_args()
    if not options.page:
        rows = run(options.studies, processes=options.processes, quiet=options.quiet)
        rows.to_csv(options.into / "coverage.csv", index=False, float_format="%.4g")
    write_page(options.into)


if __name__ == "__main__":
    main()

"""The study by which the default interval for other items is chosen, and checked.

``python -m docs.make.coverage.defaults`` writes
``docs/evidence/coverage_defaults.csv``.
"""

import argparse
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np

from docs.make.coverage.populations import (
    CLASSES,
    Population,
    Shares,
    dirichlet_multinomial,
    latent_class,
    latent_trait,
)
from docs.make.coverage.study import Cell, Method, Study
from masrel.agreement import CodedRatings
from masrel.estimates import Interval, IntervalMethod
from masrel.intervals import estimate, jackknife, posterior

EVIDENCE = Path(__file__).parents[2] / "evidence"
SEED = 20_264

FAMILIES = ("Dirichlet-multinomial", "latent trait", "latent class")
SKEWED: dict[int, Shares] = {
    3: (0.9, 0.07, 0.03),
    4: (0.8, 0.12, 0.05, 0.03),
    5: (0.7, 0.15, 0.08, 0.05, 0.02),
}
"""Shares of more than two grades."""

Design = tuple[float, int, int, float]
"""Prevalence of the second grade, or a number of grades; items, raters; missing."""

DECIDING: tuple[Design, ...] = (
    (0.02, 100, 12, 0.0),
    (0.02, 300, 5, 0.0),
    (0.02, 100, 3, 0.0),
    (0.05, 50, 8, 0.0),
    (0.05, 20, 5, 0.0),
    (0.05, 100, 2, 0.0),
    (0.05, 100, 5, 0.3),
    (0.1, 50, 3, 0.0),
    (0.1, 50, 5, 0.0),
    (0.1, 30, 12, 0.0),
    (0.1, 50, 4, 0.1),
    (0.2, 20, 8, 0.0),
    (0.2, 100, 5, 0.0),
    (0.5, 20, 5, 0.0),
    (0.5, 50, 2, 0.0),
    (0.5, 20, 12, 0.0),
    (3, 50, 5, 0.0),
    (4, 20, 4, 0.0),
    (5, 50, 3, 0.0),
    (5, 100, 8, 0.0),
)
"""Of each family, which makes 60 cells, by which the rule is chosen."""

KAPPAS = (0.6, 0.4, 0.8)
# Brennan and Prediger's is percent agreement on another scale: the same coverage
BINARY = (
    "fleiss_kappa", "conger_kappa", "krippendorff_alpha", "gwet_ac",
    "percent_agreement",
)  # fmt: skip
ORDERED = (*BINARY, "fleiss_kappa, quadratic", "gwet_ac, quadratic")


def deciding() -> list[Cell]:
    """Return the cells by which the rule is chosen."""
    return list(_cells(DECIDING))


def held_out(seed: int = SEED, n: int = 20) -> list[Cell]:
    """Return others, drawn by a seed after the rule was fixed."""
    rng = np.random.Generator(np.random.PCG64(seed))
    cells = []
    for _ in range(n):
        q = int(rng.choice([2, 2, 2, 3, 4, 5]))
        prevalence = float(np.round(np.exp(rng.uniform(np.log(0.02), np.log(0.5))), 3))
        design = (
            prevalence if q == 2 else q,
            int(np.round(np.exp(rng.uniform(np.log(20), np.log(300))))),
            int(rng.integers(2, 13)) if q == 2 else int(rng.integers(2, 9)),
            float(rng.choice([0.0, 0.0, 0.0, 0.2])),
        )
        family = FAMILIES[int(rng.integers(3))]
        kappa = float(np.round(rng.uniform(0.3, 0.9), 2))
        raters = list(CLASSES)[int(rng.integers(len(CLASSES)))]
        cells.append(_cell(family, design, kappa, raters))
    return cells


def _cells(designs: Sequence[Design]) -> Iterator[Cell]:
    for family in FAMILIES:
        turns = zip(cycle(KAPPAS), cycle(CLASSES), strict=False)
        for design, (kappa, raters) in zip(designs, turns, strict=False):
            yield _cell(family, design, kappa, raters)


def _cell(family: str, design: Design, kappa: float, raters: str) -> Cell:
    first, n_items, n_raters, p_missing = design
    shares = SKEWED[int(first)] if first >= 2 else (1.0 - first, first)
    about = raters if family == FAMILIES[2] else f"κ {kappa:g}"
    grades = f"{len(shares)} grades" if first >= 2 else f"{100 * first:g} %"
    gaps = f", {100 * p_missing:g} % missing" if p_missing else ""
    return Cell(
        family=family,
        population=f"{grades}, {about}{gaps}",
        make=partial(_population, family, shares, kappa, raters, n_raters, p_missing),
        n_items=n_items,
        n_raters=n_raters,
        coefficients=BINARY if len(shares) == 2 else ORDERED,
    )


def _population(
    family: str,
    shares: Shares,
    kappa: float,
    raters: str,
    n_raters: int,
    p_missing: float,
) -> Population:
    if family == FAMILIES[0]:
        made = dirichlet_multinomial(shares, kappa, n_raters)
    elif family == FAMILIES[1]:
        made = latent_trait(shares, kappa, n_raters)
    else:
        made = latent_class(shares, raters, n_raters)
    return Population(kinds=made.kinds, chances=made.chances, p_missing=p_missing)


def _chosen(
    rule: IntervalMethod, name: str, ratings: CodedRatings, weights: str
) -> Interval | None:
    asked = estimate(name, ratings, target="items", method=rule, weights=weights)
    return asked.interval


def _posterior(
    model: str, name: str, ratings: CodedRatings, weights: str
) -> Interval | None:
    return posterior(
        name,
        ratings,
        target="items",
        weights=weights,
        model=model,  # type: ignore[arg-type]
        n_draws=2_000,
        rng=1,
    )


def _jackknife(name: str, ratings: CodedRatings, weights: str) -> Interval | None:
    return jackknife(name, ratings, target="items", weights=weights)


METHODS: dict[str, Method] = {
    "auto-2026.1": partial(_chosen, "auto-2026.1"),
    "auto-2026.2": partial(_chosen, "auto-2026.2"),
    "alike": partial(_posterior, "dirichlet-multinomial"),
    "patterns": partial(_posterior, "patterns"),
    "jackknife": _jackknife,
}


def main() -> None:
    """Draw, count, and write the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--studies", type=int, default=1_000, help="in every cell")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--held-out", action="store_true", help="the other 20 cells")
    parser.add_argument("--quiet", action="store_true", help="say nothing")
    parser.add_argument("--into", type=Path, default=EVIDENCE)
    options = parser.parse_args()
    cells = held_out() if options.held_out else deciding()
    study = Study(name="defaults", cells=cells, methods=METHODS, seed=SEED)
    rows = study.run(options.studies, processes=options.processes, quiet=options.quiet)
    name = "coverage_held_out.csv" if options.held_out else "coverage_defaults.csv"
    rows.to_csv(options.into / name, index=False, float_format="%.6g")


if __name__ == "__main__":
    main()

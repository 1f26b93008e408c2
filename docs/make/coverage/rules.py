"""The study by which the default interval for other items is chosen, and checked."""

from dataclasses import replace
from functools import cache, partial
from itertools import cycle

import numpy as np

from docs.make.coverage.kappas import Method, ask, cell_of
from docs.make.coverage.populations import (
    CLASSES,
    Population,
    Shares,
    dirichlet_multinomial,
    latent_class,
    latent_trait,
)
from docs.make.coverage.study import Cell
from masrel.intervals import estimate, jackknife, posterior

SEED, N_STUDIES = 20_264, 500

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
    every = []
    for family in FAMILIES:
        turns = zip(cycle(KAPPAS), cycle(CLASSES), strict=False)
        for design, (kappa, raters) in zip(DECIDING, turns, strict=False):
            every += _cells(family, design, kappa, raters)
    return every


def held_out(seed: int = SEED, n: int = 20) -> list[Cell]:
    """Return others, drawn by a seed after the rule was fixed."""
    rng = np.random.default_rng(seed)
    every = []
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
        every += _cells(family, design, kappa, raters)
    return every


def _cells(family: str, design: Design, kappa: float, raters: str) -> list[Cell]:
    first, n_items, n_raters, p_missing = design
    shares = SKEWED[int(first)] if first >= 2 else (1.0 - first, first)
    about = raters if family == FAMILIES[2] else f"κ {kappa:g}"
    grades = f"{len(shares)} grades" if first >= 2 else f"{100 * first:g} %"
    gaps = f", {100 * p_missing:g} % missing" if p_missing else ""
    at = {"family": family, "population": f"{grades}, {about}{gaps}"}
    make = partial(_population, family, shares, kappa, raters, n_raters, p_missing)
    size = n_items, n_raters
    return [
        cell_of(at, size, coefficient, make, METHODS, SEED, N_STUDIES)
        for coefficient in (BINARY if len(shares) == 2 else ORDERED)
    ]


@cache
def _population(
    family: str,
    shares: Shares,
    kappa: float,
    raters: str,
    n_raters: int,
    p_missing: float,
) -> Population:
    if family == FAMILIES[2]:
        made = latent_class(shares, raters, n_raters)
    else:
        alike = dirichlet_multinomial if family == FAMILIES[0] else latent_trait
        made = alike(shares, kappa, n_raters)
    return replace(made, p_missing=p_missing)


_estimate = partial(ask, of=estimate, target="items")
_posterior = partial(ask, of=posterior, target="items", n_draws=2_000, rng=1)
METHODS: dict[str, Method] = {
    "auto-2026.1": partial(_estimate, method="auto-2026.1"),
    "auto-2026.2": partial(_estimate, method="auto-2026.2"),
    "alike": partial(_posterior, model="dirichlet-multinomial"),
    "patterns": partial(_posterior, model="patterns"),
    "jackknife": partial(ask, of=jackknife, target="items"),
}

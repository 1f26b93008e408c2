"""How often intervals hold what they ask for where most ratings are of one category."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from docs.make.coverage.bounds import Bounds
from docs.make.coverage.rare_methods import (
    RareStudies,
    held,
    jackknife,
    lifted,
    on_logit,
)
from docs.make.coverage.rare_studies import Formula, Population, Shares, population
from docs.make.coverage.studies import Floats

SEED, SIZE = 20_262, 5_000
SKEWED: Mapping[str, Shares] = {
    "four categories": (0.86, 0.08, 0.04, 0.02),
    "five categories": (0.7, 0.15, 0.08, 0.05, 0.02),
}
_OF_ALL = ("fleiss_kappa", "conger_kappa")
"""Coefficients to which an item of one rating tells of chance."""

_RHO = ("fleiss_kappa", "krippendorff_alpha", "cohen_kappa", "conger_kappa")


class RareQuestion(NamedTuple):
    """One population and design: all coefficients are asked of the same studies."""

    kind: Population
    shares: Shares
    n_raters: int
    n_items: int
    kappa: float


class Held(NamedTuple):
    """How a method did in the studies with an estimate."""

    coverage: float
    width: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RareCell:
    """What came of one coefficient."""

    question: RareQuestion
    coefficient: str  # "fleiss_kappa" or "fleiss_kappa, quadratic"
    truth: float
    n_defined: int  # studies with an estimate
    methods: Mapping[str, Held]
    by_posterior: float  # share of studies that the rule gives the posterior
    n_studies: int

    def verdict(self, name: str = "default") -> str:
        """Return "low", "high" or "", by a 99 % Monte Carlo interval and 93-98 %."""
        share = self.methods[name].coverage
        error = 2.576 * (share * (1.0 - share) / max(self.n_defined, 1)) ** 0.5
        if share + error < 0.93:
            return "low"
        return "high" if share - error > 0.98 else ""


def chosen_on() -> Iterator[RareQuestion]:
    """Yield the populations on which the rule was chosen."""
    yield from _binary((0.01, 0.02, 0.04, 0.08), (20, 50, 100, 300), (0.4, 0.6, 0.8))
    for shares, r, n, kappa in product(
        SKEWED.values(), (2, 3), (20, 50, 100, 300), (0.4, 0.8)
    ):
        for kind in ("alike", "unlike"):
            yield RareQuestion(kind, shares, r, n, kappa)
    for rare, n, kappa in product(
        (0.02, 0.04, 0.08, 0.2), (100, 300, 1000), (0.4, 0.8)
    ):
        yield RareQuestion("double coding", (1.0 - rare, rare), 2, n, kappa)


def checked_on() -> Iterator[RareQuestion]:
    """Yield others, drawn after the rule was fixed."""
    yield from _binary((0.015, 0.03, 0.06), (30, 75, 150), (0.5, 0.7))
    for r, n, kappa in product((2, 3), (30, 75, 150), (0.5, 0.7)):
        for kind in ("alike", "unlike"):
            yield RareQuestion(kind, (0.8, 0.12, 0.05, 0.03), r, n, kappa)
    for rare, n, kappa in product((0.03, 0.06, 0.12), (150, 500), (0.5, 0.7)):
        yield RareQuestion("double coding", (1.0 - rare, rare), 2, n, kappa)


def _binary(
    rare: tuple[float, ...], sizes: tuple[int, ...], kappas: tuple[float, ...]
) -> Iterator[RareQuestion]:
    for share, r, n, kappa in product(rare, (2, 3, 5), sizes, kappas):
        for kind in ("alike", "unlike"):
            yield RareQuestion(kind, (1.0 - share, share), r, n, kappa)


def coefficients(question: RareQuestion) -> list[tuple[str, str]]:
    """Return names and weights; of two categories all weights are the same."""
    named = "cohen_kappa" if question.n_raters == 2 else "conger_kappa"
    names = ["fleiss_kappa", "krippendorff_alpha", named, "gwet_ac"]
    if len(question.shares) == 2:
        return [(name, "identity") for name in names]
    both = [(name, "identity") for name in names[:3]]
    return [*both, *((name, "quadratic") for name in (names[0], *names[2:]))]


def count_rare(question: RareQuestion, size: int = SIZE) -> list[RareCell]:
    """Draw the studies of a cell, the same ones in every run, and count."""
    place = [round(10_000 * share) for share in question.shares]
    place += [question.n_raters, question.n_items, round(1_000 * question.kappa)]
    place.append(("alike", "unlike", "double coding").index(question.kind))
    rng = np.random.Generator(np.random.PCG64((SEED, *place)))
    table = population(
        question.kind, question.shares, question.kappa, question.n_raters
    )
    drawn = rng.multinomial(question.n_items, table.shares, size=size)
    freq, times = np.unique(drawn, axis=0, return_counts=True)
    studies = RareStudies(table, freq, rng)
    asked = coefficients(question)
    formulas = [Formula.of(*names, table) for names in asked]
    weighted = [f for f, (_, w) in zip(formulas, asked, strict=True) if w != "identity"]
    drawn_ends = iter(studies.drawn(weighted) if weighted else [])
    return [
        _cell(question, names, studies, formula, times, drawn_ends)
        for names, formula in zip(asked, formulas, strict=True)
    ]


def _cell(
    question: RareQuestion,
    names: tuple[str, str],
    studies: RareStudies,
    formula: Formula,
    times: "np.ndarray[tuple[int, ...], np.dtype[np.int64]]",
    drawn_ends: Iterator[Floats],
) -> RareCell:
    name, weights = names
    if weights != "identity":
        ends = next(drawn_ends)
    elif name == "gwet_ac":
        ends = studies.grid[1]
    else:
        ends = (studies if name in _OF_ALL else studies.of_pairs).rho
    value, variance = jackknife(studies, formula)
    of_rho = name in _RHO[:2] and weights == "identity"
    least = -1.0 / (question.n_raters - 1) if of_rho else -1.0
    plain = on_logit(studies, value, variance, least)
    model = held(ends, value)
    use = studies.rare | ~(variance > 0.0)
    truth = formula.truth(studies.table)
    defined = np.isfinite(value)
    methods = {
        "default": model.where(
            use & np.isfinite(model.low), lifted(studies, plain) if of_rho else plain
        ),
        "jackknife": plain,
    }
    return RareCell(
        question=question,
        coefficient=name if weights == "identity" else f"{name}, {weights}",
        truth=truth,
        n_studies=int(times.sum()),
        n_defined=int(times[defined].sum()),
        methods={
            key: _counted(ends, truth, np.where(defined, times, 0))
            for key, ends in methods.items()
        },
        by_posterior=float(np.average(studies.rare, weights=times)),
    )


def _counted(ends: Bounds, truth: float, times: Floats) -> Held:
    total = times.sum()
    if not total:
        return Held(np.nan, np.nan)
    inside = ends.cover(np.full(len(times), truth))
    there = times * ends.exist
    width = np.where(ends.exist > 0.0, ends.high - ends.low, 0.0)
    return Held(
        float(inside @ times / total), float(width @ there / max(there.sum(), 1.0))
    )

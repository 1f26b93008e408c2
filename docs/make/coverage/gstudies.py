"""How often intervals of a generalizability study hold the truth."""

import math
from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np
import pandas as pd

from docs.make.coverage.study import Answer, Cell, answer, crossed, one_by_one, percent
from docs.make.evidence import DOCS, write_part
from masrel.agreement import d_study, g_study

PAGE = DOCS / "reference" / "coefficients" / "generalizability.md"

Design = tuple[dict[str, int], float, int]
"""Levels of facets, the share of ratings that are missing, persons."""

SEED = 20261130
# studies by how many facets there are and which share is missing
N_STUDIES = {(1, 0.0): 2000, (1, 0.4): 500, (2, 0.0): 2000, (2, 0.4): 250}
PERSONS = (10, 20, 50, 100)
ONE, TWO = ({"rater": 3}, {"rater": 6}), ({"rater": 3, "occasion": 2},)
DESIGNS: list[Design] = [
    *product(ONE, (0.0, 0.4), PERSONS),
    *product(TWO, (0.0,), PERSONS),
    *product(TWO, (0.4,), PERSONS[:1]),
]
CUT = 1.0  # a standard deviation of persons above their mean
# of persons, of each facet, of each effect of two, and what is left
VARIANCES = (1.0, 0.2, 0.2, 0.5)


def simulated(
    design: Design, rng: np.random.Generator
) -> tuple[pd.DataFrame, dict[str, float]]:
    """Return ratings with normal effects, and the true component of each effect."""
    facets, gap, n = design
    sizes = {"person": n, **facets}
    places = np.indices(tuple(sizes.values())).reshape(len(sizes), -1)
    frame = pd.DataFrame(dict(zip(sizes, places, strict=True)))
    grade, truth = np.zeros(len(frame)), {}
    for which in product((0, 1), repeat=len(sizes)):
        names = [name for name, is_in in zip(sizes, which, strict=True) if is_in]
        if not names:
            continue
        variance = VARIANCES[-1] if all(which) else VARIANCES[len(names)]
        truth[" × ".join(names)] = variance if names != ["person"] else VARIANCES[0]
        draws = rng.normal(size=[sizes[name] for name in names])
        deviation = math.sqrt(truth[" × ".join(names)])
        grade += deviation * draws[tuple(frame[name] for name in names)]
    return frame.assign(grade=grade)[rng.random(len(frame)) >= gap], truth


def cells() -> list[Cell]:
    """Return the cells: facets, missing ratings, persons."""
    return [
        Cell(
            at={
                "facets": " × ".join(f"{k} {name}s" for name, k in facets.items()),
                "missing": f"{gap:.0%}",
                "n_persons": n,
            },
            ask=partial(one_by_one, partial(study, (facets, gap, n))),
            seed=(SEED, n, *facets.values(), round(10 * gap)),
            n_studies=N_STUDIES[len(facets), gap],
        )
        for facets, gap, n in DESIGNS
    ]


def study(design: Design, rng: np.random.Generator) -> Iterator[Answer]:
    """Draw a study: its components, and Eρ², Φ, and Φ at a cut for the same numbers."""
    facets = design[0]
    ratings, truth = simulated(design, rng)
    found = g_study(ratings, of="person", facets=[*facets])
    for source, part in truth.items():
        yield answer(source, found.intervals[source], part)
    error = {
        source: part / math.prod(facets.get(of, 1) for of in found.effects[source])
        for source, part in truth.items()
        if source != "person"
    }
    relative = sum(part for of, part in error.items() if "person" in of)
    absolute, persons = sum(error.values()), truth["person"]
    at_cut = persons + CUT**2
    same = d_study(found, facets, cut=CUT)
    yield answer("Eρ²", same.generalizability_interval, persons / (persons + relative))
    yield answer("Φ", same.dependability_interval, persons / (persons + absolute))
    yield answer("Φ(λ)", same.cut_interval, at_cut / (at_cut + absolute))


def write_page(rows: pd.DataFrame) -> None:
    """Write the table, which has the component held least often."""
    lines = {"facets": "facets", "missing": "missing", "n_persons": "persons"}
    is_coefficient = rows["interval"].isin(["Eρ²", "Φ", "Φ(λ)"])
    names = rows["interval"].where(is_coefficient, "components")
    covers = percent(rows).groupby([*(rows[of] for of in lines), names], sort=False)
    shown = covers.min().map("{:.1f}".format).rename("shown").reset_index()
    write_part(PAGE, "coverage", crossed(shown, lines))

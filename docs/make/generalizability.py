"""How often intervals of a generalizability study hold the truth, and its picture.

``python -m docs.make.generalizability`` writes a section of
``docs/reference/coefficients/generalizability.md`` and ``docs/figures/gstudy.png``.
"""

import json
import math
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from masrel.agreement import GStudy, d_study, g_study
from masrel.plots import draw
from masrel.tables._decision_tables import study_curves

DOCS = Path(__file__).parents[1]
PAGE = DOCS / "reference" / "coefficients" / "generalizability.md"
FIGURE = DOCS / "figures" / "gstudy.png"
ORACLE = DOCS.parent / "tests" / "oracles" / "generalizability.json"
BEGIN, END = "<!-- coverage -->\n", "<!-- end of the coverage -->\n"

Cell = tuple[dict[str, int], float, int]

SEED = 20261130
# studies by how many facets there are and which share is missing
N_STUDIES = {(1, 0.0): 2000, (1, 0.4): 500, (2, 0.0): 2000, (2, 0.4): 250}
PERSONS = (10, 20, 50, 100)
ONE, TWO = ({"rater": 3}, {"rater": 6}), ({"rater": 3, "occasion": 2},)
# facets, shares of ratings that are missing, persons
CELLS: list[Cell] = [
    *product(ONE, (0.0, 0.4), PERSONS),
    *product(TWO, (0.0,), PERSONS),
    *product(TWO, (0.4,), PERSONS[:1]),
]
CUT = 1.0  # a standard deviation of persons above their mean
# of persons, of each facet, of each effect of two, and what is left
VARIANCES = (1.0, 0.2, 0.2, 0.5)


def simulated(cell: Cell, rng: np.random.Generator) -> tuple[GStudy, dict[str, float]]:
    """Return a study of normal effects, and the true component of each effect."""
    facets, gap, n = cell
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
    kept = frame.assign(grade=grade)[rng.random(len(frame)) >= gap]
    return g_study(kept, of="person", facets=[*facets]), truth


def coverage(cell: Cell, n_studies: int) -> list[float]:
    """Return percentages: the component held least often, Eρ², Φ, and Φ at a cut."""
    facets, gap, n = cell
    rng = np.random.default_rng([SEED, n, *facets.values(), round(10 * gap)])
    held = []
    for _ in range(n_studies):
        study, truth = simulated(cell, rng)
        error = {
            source: part / math.prod(facets.get(of, 1) for of in study.effects[source])
            for source, part in truth.items()
            if source != "person"
        }
        relative = sum(part for of, part in error.items() if "person" in of)
        true = truth["person"] / (
            truth["person"] + np.array([relative, sum(error.values())])
        )
        at_cut = truth["person"] + CUT**2
        design = d_study(study, facets, cut=CUT)
        pairs = [(study.intervals[source], part) for source, part in truth.items()]
        pairs += [
            (design.generalizability_interval, true[0]),
            (design.dependability_interval, true[1]),
            (design.cut_interval, at_cut / (at_cut + sum(error.values()))),
        ]
        held.append(
            [interval.low <= value <= interval.high for interval, value in pairs]
        )
    *parts, relative, absolute, cut = 100.0 * np.mean(held, axis=0)
    return [min(parts), relative, absolute, cut]


def rows() -> Iterator[Sequence[object]]:
    """Yield the lines of the table."""
    for facets, gap, n in CELLS:
        design = " × ".join(f"{k} {name}s" for name, k in facets.items())
        n_studies = N_STUDIES[len(facets), gap]
        shares = [f"{x:.1f}" for x in coverage((facets, gap, n), n_studies)]
        print(design, gap, n, *shares, flush=True)
        yield [design, f"{gap:.0%}", n, *shares]


def main() -> None:
    """Simulate, draw, and write the section."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    scores = json.loads(ORACLE.read_text("utf-8"))["datasets"][0]["scores"]
    cells = [(*place, score) for place, score in np.ndenumerate(np.array(scores))]
    frame = pd.DataFrame(cells, columns=["person", "task", "rater", "grade"])
    facets, nested = ["task", "rater"], {"rater": "task"}
    study = g_study(frame, of="person", facets=facets, nested=nested)
    FIGURE.write_bytes(draw(study_curves(study, 0.7), stamp="", forms=["png"])["png"])
    heads = ["facets", "missing", "persons", "components", "Eρ²", "Φ", "Φ(λ)"]
    lines = [heads, ["---"] * len(heads), *rows()]
    text = "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)
    PAGE.write_text(before + BEGIN + text + END + rest.partition(END)[2], "utf-8")


if __name__ == "__main__":
    main()

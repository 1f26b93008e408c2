"""A million simulated studies beside a loop over ``fleiss_kappa``."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from docs.make.benchmarks.rows import Benchmark, Row
from masrel.agreement import fleiss_kappa
from masrel.planning import Study
from masrel.planning._studies import simulated
from masrel.planning._truth import design_of

STUDY = Study(
    "fleiss_kappa",
    value=0.5,
    prevalences=(0.4, 0.3, 0.2, 0.1),
    model="dirichlet-multinomial",
    target="items",
    n_items=30,
    n_raters=5,
    interval="t",
)


def looped(tables: list[np.ndarray]) -> None:
    """Call `fleiss_kappa` study by study, tables ready."""
    for table in tables:
        _ = fleiss_kappa(table, categories=range(4)).standard_error


def rows(quick: bool, _: Path) -> Iterator[Row]:
    """Yield Fleiss' kappa with its standard error, study by study, in one process."""
    n, n_looped = (10_000, 200) if quick else (1_000_000, 2_000)
    design = design_of(STUDY)
    freq = np.random.default_rng(1).multinomial(30, design.p, size=n_looped)
    tables = [design.rows.repeat(of_study, axis=0) for of_study in freq]
    yield Row(
        what="a study of 30 items by 5 raters",
        works={
            "masrel, whole studies in arrays": lambda: simulated(
                design, np.random.default_rng(1), n
            ),
            "masrel, a call a study": partial(looped, tables),
        },
        parts={
            "masrel, whole studies in arrays": n,
            "masrel, a call a study": n_looped,
        },
        turns=3,
    )


BENCHMARK = Benchmark(rows=rows)

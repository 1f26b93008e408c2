"""A million simulated studies beside a loop over ``fleiss_kappa``.

``python -m docs.make.benchmarks.plans`` writes its part of
``docs/evidence/benchmarks.md``: Fleiss' kappa with its standard error in 1e6 studies of
30 items by 5 raters, in one process, and by calling `fleiss_kappa` study by study on 2
000 of them, in one run.
"""

import time

import numpy as np

from docs.make.evidence import write_tables
from masrel.agreement import fleiss_kappa
from masrel.planning import Study
from masrel.planning import _studies as masrel_studies
from masrel.planning._truth import Design, design_of

N_STUDIES, N_LOOPED = 1_000_000, 2_000


def maker() -> Design:
    """Return studies of 30 items by 5 raters, four categories."""
    study = Study(
        "fleiss_kappa",
        value=0.5,
        prevalences=(0.4, 0.3, 0.2, 0.1),
        model="dirichlet-multinomial",
        target="items",
        n_items=30,
        n_raters=5,
        interval="t",
    )
    return design_of(study)


def simulated(n_studies: int) -> tuple[float, float]:
    """Return seconds of the clock and of the processor."""
    studies = maker()
    clock, processor = time.perf_counter(), time.process_time()
    masrel_studies.simulated(studies, np.random.default_rng(1), n_studies)
    return time.perf_counter() - clock, time.process_time() - processor


def looped(n_studies: int) -> tuple[float, float]:
    """Return the same of one call a study, tables ready."""
    studies = maker()
    freq = np.random.default_rng(1).multinomial(30, studies.p, size=n_studies)
    tables = [studies.rows.repeat(of_study, axis=0) for of_study in freq]
    clock, processor = time.perf_counter(), time.process_time()
    for table in tables:
        _ = fleiss_kappa(table, categories=range(4)).standard_error
    return time.perf_counter() - clock, time.process_time() - processor


def main() -> None:
    """Write the part."""
    first = looped(N_LOOPED)
    clock, processor = simulated(N_STUDIES)
    second = looped(N_LOOPED)
    each = 0.5 * (first[1] + second[1]) / N_LOOPED
    lines = [
        "| how | clock | processor | a study |",
        "|---|---|---|---|",
        f"| whole studies in arrays | {clock:.1f} s | {processor:.1f} s "
        f"| {1e6 * processor / N_STUDIES:.1f} µs |",
        f"| a call a study | – | – | {1e6 * each:.0f} µs |",
    ]
    write_tables(["plans"], lines)


if __name__ == "__main__":
    main()

"""Bootstrap intervals beside scipy's: time and memory."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from docs.make.benchmarks.rows import Benchmark, Row
from masrel.intervals import bootstrap
from tests.benchmarks.bootstrap import (
    FORMULAS,
    counted,
    made,
    scipy_loop,
    scipy_vectorized,
)

N_RESAMPLES = 10_000
EXACT = {  # raters, categories and seed, and what is resampled
    "4 × 8, 4 categories": ((4, 8, 4, 2), "items"),
    "8 × 8, 4 categories": ((8, 8, 4), "items"),
    "8 raters of 16 items": ((16, 8, 3), "raters"),
    "10 raters of 16 items": ((16, 10, 3), "raters"),
    "16 × 8, 2 categories": ((16, 8, 2), "items"),
    "12 × 8, 3 categories": ((12, 8, 3), "items"),
    "100 × 3, 2 categories": ((100, 3, 2), "items"),
}


def rows(quick: bool, _: Path) -> Iterator[Row]:
    """Yield resamples of each coefficient and size, exact distributions, memory."""
    for n, r, q in ((16, 8, 3), (100, 5, 4), (10_000, 5, 4))[: 2 if quick else None]:
        codes = made(n, r, q)
        counts = counted(codes, q)
        n_theirs = N_RESAMPLES if n < 1000 else N_RESAMPLES // 20
        options = {"target": "items", "categories": range(q), "rng": 1, "exact": False}
        for name, formula in FORMULAS.items():
            loop = partial(scipy_loop, counts, formula, n_theirs)
            yield Row(
                what=f"{name}, {n:,} × {r}",
                works={
                    "masrel": partial(bootstrap, name, codes, **options),
                    "scipy, a Python statistic": loop,
                    "scipy, vectorized": partial(
                        scipy_vectorized, counts, name, n_theirs
                    ),
                },
                parts={
                    "scipy, a Python statistic": n_theirs / N_RESAMPLES,
                    "scipy, vectorized": n_theirs / N_RESAMPLES,
                },
                turns=9,
            )
    for study, (size, target) in EXACT.items():
        options = {"target": target, "categories": range(size[2]), "exact": True}
        work = partial(bootstrap, "fleiss_kappa", made(*size), **options)
        found = work().distribution.words
        yield Row(what=f"{study}: {found}", works={"masrel": work}, turns=15)
    n = 100_000 if quick else 1_000_000
    codes = made(n, 5, 5).astype(np.int8)
    options = {"target": "items", "categories": range(5), "rng": 1}
    for kind in ("percentile", "bca", "studentized"):
        work = partial(bootstrap, "fleiss_kappa", codes, kind=kind, **options)
        what = f"{kind}, {n:,} × 5"
        yield Row(what=what, works={"masrel": work}, turns=1, has_memory=True)


BENCHMARK = Benchmark(rows=rows)

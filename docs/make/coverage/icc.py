"""How often intervals of ICC(A,1) of complete tables hold it: F and profile."""

from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np
import pandas as pd

from docs.make.coverage.study import Answer, Cell, answer, crossed, one_by_one, percent
from docs.make.evidence import DOCS, write_part
from masrel.agreement import icc

SIZES = ((20, 3), (50, 3), (50, 5), (100, 10), (30, 2))  # items, raters
RATERS = (0.05, 0.5, 2.0)  # variances; that of items is 1
RESIDUAL, SEED, N_STUDIES = 0.2, 7, 1_000


def cells() -> list[Cell]:
    """Return the cells: items, raters, and the variance of raters."""
    return [
        Cell(
            at={"n_items": n, "n_raters": k, "variance_of_raters": raters},
            ask=partial(one_by_one, partial(study, n, k, raters)),
            seed=(SEED, n, k),
            n_studies=N_STUDIES,
        )
        for (n, k), raters in product(SIZES, RATERS)
    ]


def study(n: int, k: int, raters: float, rng: np.random.Generator) -> Iterator[Answer]:
    """Draw a table, and yield both intervals."""
    ratings = rng.normal(size=(n, 1)) + raters**0.5 * rng.normal(size=k)
    ratings += RESIDUAL**0.5 * rng.normal(size=(n, k))
    for name, asked in (("F", "F"), ("profile", "auto")):
        interval = icc(ratings, interval=asked).interval  # type: ignore[arg-type]
        yield answer(name, interval, 1.0 / (1.0 + raters + RESIDUAL))


def write_page(rows: pd.DataFrame) -> None:
    """Write the table of coverages and widths."""
    covers = rows.assign(
        shown=percent(rows).map("{:.1f}".format),
        interval=rows["interval"] + ": covers %",
    )
    widths = rows.assign(
        shown=rows["width"].map("{:.3f}".format), interval=rows["interval"] + ": width"
    )
    lines = {
        "n_items": "items",
        "n_raters": "raters",
        "variance_of_raters": "variance of raters",
    }
    page = DOCS / "reference" / "coefficients" / "icc.md"
    write_part(page, "coverage", crossed(pd.concat([covers, widths]), lines))

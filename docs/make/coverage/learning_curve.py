"""How often the interval of one point of a learning curve holds the trainee's kappa."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import pandas as pd

from docs.make.coverage.study import Answer, Cell, answer, crossed, percent
from docs.make.evidence import EVIDENCE, write_part
from docs.make.training import GRADES, criterion, drawn_with
from masrel.intervals import estimate

SEED, N_STUDIES = 2012, 1_000


def cells() -> list[Cell]:
    """Return the cells, by kappa."""
    return [
        Cell(
            at={"kappa": kappa},
            ask=partial(trainees, kappa),
            seed=(SEED, place),
            n_studies=N_STUDIES,
        )
        for place, kappa in enumerate((0.4, 0.6, 0.8, 0.9))
    ]


def trainees(
    kappa: float, rng: np.random.Generator, n_studies: int
) -> Iterator[Answer]:
    """Draw trainees who give only grades that models have; yield their intervals."""
    rule = criterion()
    for size in (8, 16):
        drawn = drawn_with(rule, kappa, n_studies, size, rng)["range"]
        known: dict[tuple[tuple[str, str], ...], Answer] = {}
        for one, other in zip(*drawn[:2], strict=True):
            pairs = [(GRADES[i], GRADES[j]) for i, j in zip(one, other, strict=True)]
            if (key := tuple(sorted(pairs))) not in known:
                asked = {"target": "items", "categories": GRADES}
                found = estimate("cohen_kappa", key, weights=rule.weights, **asked)
                known[key] = answer(f"{size} presentations", found.interval, kappa)
            yield known[key]


def write_page(rows: pd.DataFrame) -> None:
    """Write the table."""
    shown = rows.assign(shown=percent(rows).map("{:.1f} %".format))
    text = crossed(shown, {"kappa": "κ"})
    write_part(EVIDENCE / "training.md", "learning curve", text)

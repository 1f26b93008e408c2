"""How often the interval of one point of a learning curve holds the trainee's kappa."""

from collections.abc import Iterator
from functools import cache, partial

import numpy as np
import pandas as pd

from docs.make.coverage.study import Answer, Cell, answer, crossed, percent
from docs.make.evidence import EVIDENCE, write_part
from docs.make.training import GRADES, criterion, drawn_with
from masrel.estimates import Interval
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

    @cache  # equal trainings are computed once
    def interval(pairs: tuple[tuple[str, str], ...]) -> Interval | None:
        asked = {"target": "items", "categories": GRADES, "weights": rule.weights}
        return estimate("cohen_kappa", pairs, **asked).interval

    for size in (8, 16):
        drawn = drawn_with(rule, kappa, n_studies, size, rng)["range"]
        for training in np.array(GRADES)[np.stack(drawn[:2], axis=-1)].tolist():
            pairs = tuple(sorted(map(tuple, training)))
            yield answer(f"{size} presentations", interval(pairs), kappa)


def write_page(rows: pd.DataFrame) -> None:
    """Write the table."""
    shown = rows.assign(shown=percent(rows).map("{:.1f} %".format))
    text = crossed(shown, {"kappa": "κ"})
    write_part(EVIDENCE / "training.md", "learning curve", text)

"""How often intervals of a judge's rates hold the true one."""

from collections.abc import Iterator
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from docs.make.coverage.figure import draw
from docs.make.coverage.kappas_page import RULES
from docs.make.coverage.study import Answer, Cell, Floats
from masrel.judges import prediction_powered_mean
from masrel.judges.rates import (
    _ENOUGH,
    _lang_reiczigel,
    _Moments,
    _quantile,
    _share_moments,
)

Ends = tuple[Floats, Floats]

JUDGES = {  # sensitivity, specificity
    "good": (0.9, 0.9),
    "middling": (0.8, 0.7),
    "poor": (0.65, 0.6),
    "lenient": (0.98, 0.6),
}
RATES, LABELS, JUDGED = (0.05, 0.2, 0.5, 0.9), (10, 20, 50, 100, 200), (200, 2000)
# every judge meets every rate and every number of labels
DESIGNS = [
    (n, n_judged, rate, list(JUDGES)[(i + j + 2 * k) % 4])
    for (j, n), (k, n_judged), (i, rate) in product(
        enumerate(LABELS), enumerate(JUDGED), enumerate(RATES)
    )
]
GRADES = {  # of 1 to 5: shares of each
    "as many of each": (0.2, 0.2, 0.2, 0.2, 0.2),
    "most are 5": (0.02, 0.03, 0.05, 0.2, 0.7),
}
LEVEL, SEED, N_STUDIES, N_OF_GRADES = 0.95, 20261130, 20_000, 2000
N_GRADES = 500  # items of a study of grades


def cells() -> list[Cell]:
    """Return the cells: labels, judged items, judge; of rates, then of grades."""
    of_rates = [
        Cell(
            at={"n_labels": n, "n_judged": n_judged, "judge": judge},
            ask=partial(of_rate, n, n_judged, rate, judge),
            seed=(SEED, n, n_judged, round(100 * rate)),
            n_studies=N_STUDIES,
        )
        for n, n_judged, rate, judge in DESIGNS
    ]
    return of_rates + [
        Cell(
            at={"n_labels": n, "n_judged": N_GRADES, "judge": name},
            ask=partial(of_grades, n, shares),
            seed=(SEED, n),
            n_studies=N_OF_GRADES,
        )
        for (name, shares), n in product(GRADES.items(), LABELS)
    ]


def of_rate(
    n: int,
    n_judged: int,
    rate: float,
    judge: str,
    rng: np.random.Generator,
    n_studies: int,
) -> Iterator[Answer]:
    """Draw studies of a rate, and yield the ends of every method."""
    q1, q0 = JUDGES[judge]
    kinds = (q1 * rate, (1 - q1) * rate, (1 - q0) * (1 - rate), q0 * (1 - rate))
    counts = rng.multinomial(n, kinds, n_studies).astype(float)
    pool = rng.binomial(n_judged - n, kinds[0] + kinds[2], n_studies)
    for method, ends in intervals(counts, pool, n_judged).items():
        low, high = np.clip(ends, 0.0, 1.0)
        yield Answer(method, low, high, rate)


def of_grades(
    n: int, shares: tuple[float, ...], rng: np.random.Generator, n_studies: int
) -> Iterator[Answer]:
    """Draw studies of a mean grade, which a judge sees with some noise."""
    grades = np.arange(1.0, 6.0)
    y = rng.choice(grades, (n_studies, N_GRADES), p=shares)
    f = np.clip(np.round(y + rng.normal(0.0, 0.6, y.shape)), 1.0, 5.0)
    for (a, b), method in product(zip(y, f, strict=True), ("auto", "z")):
        of = prediction_powered_mean(a[:n], b[:n], b[n:], method=method)  # type: ignore[arg-type]
        yield Answer(method, of.low, of.high, float(grades @ shares))


def intervals(counts: Floats, pool: NDArray[Any], n_judged: int) -> dict[str, Ends]:
    """Return the ends of every method; ``nan`` where it has none.

    Labelled items are counted (n_studies, 4) as right passes, wrong fails, wrong passes
    and right fails; of the others those that pass (n_studies,).
    """
    n = counts[0].sum()
    moments = _moments(counts, pool, n_judged - n)
    _, power = moments.mean()
    z, t = _quantile(LEVEL), _quantile(LEVEL, n - 1.0)
    judged = (pool + counts[:, 0] + counts[:, 2]) / n_judged
    naive = _share_moments(n_judged, 0.0, judged, judged, judged, 0.0)
    return {
        "prediction_powered": moments.padded_ends(None, LEVEL),
        "z": moments.ends(power, z),
        "t": moments.ends(power, t),
        "labels_alone": moments.padded_ends(0.0, LEVEL),
        "rogan_gladen": _corrected(counts, judged, n_judged),
        "naive": naive.padded_ends(0.0, LEVEL),
    }


def _moments(counts: Floats, pool: NDArray[Any], m: float) -> _Moments:
    n = counts.sum(axis=1)
    a, b, c, _ = counts.T
    return _share_moments(n, m, (a + b) / n, (a + c) / n, a / n, pool / max(m, 1.0))


def _corrected(counts: Floats, judged: Floats, n_judged: int) -> Ends:
    # no answer where it is undefined, or where a note says that labels are few
    a, b, c, d = counts.T
    m1, m0 = a + b, c + d
    q1, q0 = a / np.maximum(m1, 1.0), d / np.maximum(m0, 1.0)
    ends = _lang_reiczigel(judged, n_judged, (q1, m1), (q0, m0), _quantile(LEVEL))
    are_enough = np.minimum(m1, m0) >= _ENOUGH["of_a_kind"]
    is_answer = are_enough & (m1 + m0 >= _ENOUGH["of_both_kinds"]) & (q1 + q0 > 1.0)
    low, high = (np.where(is_answer, end, np.nan) for end in ends)
    return low, high


def write_figure(rows: pd.DataFrame) -> None:
    """Draw the coverage of two methods by the number of labels."""
    names = {"prediction_powered": "PPI++, padded: the default", "z": "PPI++, z"}
    of_rates = rows[rows["judge"].isin(JUDGES)].replace({"interval": names})
    cells = of_rates["n_labels"].astype(str) + " labels"
    looks = dict(zip(names.values(), RULES.values(), strict=False))
    draw(of_rates.assign(panel="", cell=cells), "judges_rates", looks)

"""How often intervals of a judge's rates hold the true one.

``python -m docs.make.judge_rates`` draws studies and writes
``docs/evidence/judges_rates.csv`` and ``docs/figures/judges_rates.png``.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from docs.make.evidence import EVIDENCE, FIGURES, write_rows
from masrel.judges import prediction_powered_mean
from masrel.judges.rates import (
    _ENOUGH,
    _lang_reiczigel,
    _Moments,
    _quantile,
    _share_moments,
)

Floats = NDArray[np.float64]
Ends = tuple[Floats, Floats]
Cell = tuple[Any, ...]
Row = dict[str, Any]

ROWS, FIGURE = EVIDENCE / "judges_rates.csv", FIGURES / "judges_rates.png"

JUDGES = {  # sensitivity, specificity
    "good": (0.9, 0.9),
    "middling": (0.8, 0.7),
    "poor": (0.65, 0.6),
    "lenient": (0.98, 0.6),
}
RATES, LABELS, JUDGED = (0.05, 0.2, 0.5, 0.9), (10, 20, 50, 100, 200), (200, 2000)
# every judge meets every rate and every number of labels
CELLS = [
    (n, n_judged, rate, list(JUDGES)[(i + j + 2 * k) % 4])
    for (j, n), (k, n_judged), (i, rate) in product(
        enumerate(LABELS), enumerate(JUDGED), enumerate(RATES)
    )
]
METHODS = {
    "prediction_powered": "PPI++, padded: the default",
    "z": "PPI++, z",
    "t": "PPI++, t",
    "jackknife": "PPI++, jackknife",
    "labels_alone": "labels alone",
    "rogan_gladen": "Rogan-Gladen",
    "naive": "naive",
}
METHODS_OF_GRADES = {"auto": "PPI++, jackknife: the default", "z": "PPI++, z"}
COLUMNS = (
    *("n_labels", "n_judged", "true", "judge", "method"),
    *("n_answers", "n_held", "width"),
)
GRADES = {  # of 1 to 5: shares of each
    "as many of each": (0.2, 0.2, 0.2, 0.2, 0.2),
    "most are 5": (0.02, 0.03, 0.05, 0.2, 0.7),
}
LEVEL, SEED, N_STUDIES, N_OF_GRADES = 0.95, 20261130, 20_000, 2000


def intervals(counts: Floats, pool: NDArray[Any], n_judged: int) -> dict[str, Ends]:
    """Return the ends of every method; ``nan`` where it has none.

    Labelled items are counted (n_studies, 4) as right passes, wrong fails, wrong passes
    and right fails; of the others those that pass (n_studies,).
    """
    n = counts[0].sum()
    moments, m = _moments(counts, pool, n_judged - n), n_judged - n
    value, power = moments.mean()
    z, t = _quantile(LEVEL), _quantile(LEVEL, n - 1.0)
    # the jackknife: items of a kind are alike, so that one of each is left out
    without = [np.maximum(counts - kind, 0.0) for kind in np.eye(4)]
    values = np.array([_moments(of, pool, m).mean()[0] for of in without]).T
    middle = (counts / n * values).sum(axis=1, keepdims=True)
    squares = (counts / n * (values - middle) ** 2).sum(axis=1) * (n - 1.0)
    of_pool = power**2 * moments.pool * (1.0 - moments.pool) / max(m, 1.0)
    half = t * np.sqrt(squares + of_pool)
    judged = (pool + counts[:, 0] + counts[:, 2]) / n_judged
    naive = _share_moments(n_judged, 0.0, judged, judged, judged, 0.0)
    return {
        "prediction_powered": moments.padded_ends(None, LEVEL),
        "z": moments.ends(power, z),
        "t": moments.ends(power, t),
        "jackknife": (value - half, value + half),
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


def rows(n_studies: int = N_STUDIES, seed: int = SEED, every: int = 1) -> list[Row]:
    """Return how often every method holds the rate, and its mean width, by cell."""
    rows = []
    for cell in CELLS[::every]:
        n, n_judged, rate, judge = cell
        rng = np.random.default_rng([seed, n, n_judged, round(100 * rate)])
        q1, q0 = JUDGES[judge]
        kinds = (q1 * rate, (1 - q1) * rate, (1 - q0) * (1 - rate), q0 * (1 - rate))
        counts = rng.multinomial(n, kinds, n_studies).astype(float)
        pool = rng.binomial(n_judged - n, kinds[0] + kinds[2], n_studies)
        for method, (low, high) in intervals(counts, pool, n_judged).items():
            ends = np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)
            rows.append(_row(cell, method, rate, *ends))
    return rows


def of_grades(n_studies: int = N_OF_GRADES, seed: int = SEED) -> list[Row]:
    """Return the same of mean grades that a judge sees with some noise."""
    grades, n_judged, rows = np.arange(1.0, 6.0), 500, []
    for (name, shares), n in product(GRADES.items(), LABELS):
        rng = np.random.default_rng([seed, n])
        y = rng.choice(grades, (n_studies, n_judged), p=shares)
        f = np.clip(np.round(y + rng.normal(0.0, 0.6, y.shape)), 1.0, 5.0)
        for method in METHODS_OF_GRADES:
            of = [
                prediction_powered_mean(a[:n], b[:n], b[n:], method=method)  # type: ignore[arg-type]
                for a, b in zip(y, f, strict=True)
            ]
            ends = (np.array([getattr(o, end) for o in of]) for end in ("low", "high"))
            mean = round(float(grades @ shares), 4)
            rows.append(_row((n, n_judged, mean, name), method, mean, *ends))
    return rows


def _row(cell: Cell, method: str, true: float, low: Floats, high: Floats) -> Row:
    n_held, n_answers = ((low <= true) & (true <= high)).sum(), (~np.isnan(low)).sum()
    width = np.nansum(high - low) / max(n_answers, 1)
    numbers = int(n_answers), int(n_held), round(float(width), 4)
    return dict(zip(COLUMNS, (*cell, method, *numbers), strict=True))


def draw(rows: Sequence[Row]) -> None:
    """Draw the coverage of each method by the number of labels, a mark a cell."""
    from matplotlib.figure import Figure

    from masrel.plots._style import BLUE, VERMILLION, finished, house_style

    looks = {"prediction_powered": (BLUE, "o"), "z": (VERMILLION, "x")}
    with house_style():
        figure = Figure(figsize=(5.6, 3.4))
        axes = figure.subplots()
        for place, (method, (colour, mark)) in enumerate(looks.items()):
            of = [
                row
                for row in rows
                if row["method"] == method and row["judge"] in JUDGES
            ]
            at = [LABELS.index(int(row["n_labels"])) + 0.2 * place - 0.1 for row in of]
            shares = [100 * int(row["n_held"]) / int(row["n_answers"]) for row in of]
            axes.plot(at, shares, mark, color=colour, label=METHODS[method])
        axes.axhline(100 * LEVEL, color="0.5", linewidth=0.8)
        axes.set_xticks(range(len(LABELS)), map(str, LABELS))
        axes.set(xlabel="labelled items", ylabel="intervals that hold the rate (%)")
        axes.legend(loc="lower right")
        FIGURE.write_bytes(finished(figure, stamp="", forms=("png",))["png"])


def main() -> None:
    """Draw the studies; write rows and figure."""
    found = rows() + of_grades()
    write_rows("judges_rates", found)
    draw(found)


if __name__ == "__main__":
    main()

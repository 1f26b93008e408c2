"""Dawid and Skene's model on simulated ratings: coverage of its intervals, recovery.

``python -m docs.make.judge_truth`` writes ``docs/evidence/judges_truth.csv``; it takes
some ten minutes.
"""

import warnings
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from docs.make.evidence import write_rows
from masrel.judges import dawid_skene_intervals

N_SETS, N_RESAMPLES, SEED = 500, 640, 39
# items of which a share is hard: raters are wrong there in 7 of 10 grades, together
HARD, WRONG_ON_HARD = 0.2, 0.7

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Cell:
    """What is simulated."""

    n_items: int
    n_raters: int
    accuracy: float
    shares: tuple[float, ...]
    errors: str = "independent"


# fixed before anything was simulated
CELLS = (
    Cell(50, 3, 0.8, (0.5, 0.5)),
    Cell(200, 3, 0.8, (0.5, 0.5)),
    Cell(50, 3, 0.95, (0.5, 0.5)),
    Cell(200, 5, 0.6, (0.5, 0.5)),
    Cell(1000, 3, 0.7, (0.7, 0.3)),
    Cell(50, 5, 0.8, (0.4, 0.3, 0.3)),
    Cell(200, 5, 0.8, (0.6, 0.3, 0.1)),
    Cell(200, 5, 0.6, (0.5, 0.3, 0.2)),
    Cell(100, 10, 0.7, (0.4, 0.3, 0.3)),
    Cell(100, 5, 0.8, (0.4, 0.3, 0.2, 0.1)),
    Cell(50, 3, 0.95, (0.25, 0.25, 0.25, 0.25)),
    Cell(1000, 5, 0.8, (0.5, 0.3, 0.2)),
    Cell(200, 5, 0.8, (0.5, 0.5), "together"),
)
HEAD = (
    *("n_items", "n_raters", "accuracy", "shares", "errors", "n_sets"),
    *("coverage_shares", "coverage_right", "coverage_wrong", "width_shares"),
    *("width_right", "items_right", "votes_right", "warned"),
)


def simulate(cell: Cell, rng: np.random.Generator) -> tuple[Integers, Integers]:
    """Return classes of items (n_items,) and grades (n_items, n_raters)."""
    k = len(cell.shares)
    truth = rng.choice(k, cell.n_items, p=cell.shares)
    wrong = np.full((cell.n_items, 1), 1.0 - cell.accuracy)
    if cell.errors == "together":
        is_hard = rng.random((cell.n_items, 1)) < HARD
        on_easy = (1.0 - cell.accuracy - HARD * WRONG_ON_HARD) / (1.0 - HARD)
        wrong = np.where(is_hard, WRONG_ON_HARD, on_easy)
    size = cell.n_items, cell.n_raters
    errs = rng.random(size) < wrong
    return truth, (truth[:, None] + errs * rng.integers(1, k, size=size)) % k


def measure(cell: Cell, rng: np.random.Generator) -> list[float]:
    """Return what one simulated set says of each column of the table."""
    truth, grades = simulate(cell, rng)
    places = np.ndindex(grades.shape)
    rows = [(i, j, int(grades[i, j])) for i, j in places]
    intervals = dawid_skene_intervals(rows, n_resamples=N_RESAMPLES, rng=rng)
    shares, right = np.array(cell.shares), np.eye(len(cell.shares), dtype=bool)
    votes = (grades[:, :, None] == np.arange(len(shares))).sum(axis=1)
    best = votes == votes.max(axis=1, keepdims=True)  # a tie is split
    of_votes = (best / best.sum(axis=1, keepdims=True))[np.arange(len(truth)), truth]
    theta = np.where(right, cell.accuracy, (1.0 - cell.accuracy) / (len(shares) - 1))
    holds = (intervals.confusion_low <= theta) & (theta <= intervals.confusion_high)
    width = intervals.confusion_high - intervals.confusion_low
    return [
        np.mean((intervals.shares_low <= shares) & (shares <= intervals.shares_high)),
        holds[:, right].mean(),
        holds[:, ~right].mean(),
        (intervals.shares_high - intervals.shares_low).mean(),
        width[:, right].mean(),
        (intervals.fit.posterior.argmax(axis=1) == truth).mean(),
        of_votes.mean(),
        len(intervals.notes) > len(intervals.fit.notes),
    ]


def row(number: int) -> dict[str, str]:
    """Return the row of a cell, which depends on nothing but its number."""
    cell, rng = CELLS[number], np.random.default_rng([SEED, number])
    with warnings.catch_warnings(action="ignore"):
        sets = [measure(cell, rng) for _ in range(N_SETS)]
    size = *astuple(cell)[:3], " ".join(map(str, cell.shares)), cell.errors, N_SETS
    means = (f"{mean:.3f}" for mean in np.mean(sets, axis=0))
    return dict(zip(HEAD, (*map(str, size), *means), strict=True))


if __name__ == "__main__":
    write_rows("judges_truth", [row(number) for number in range(len(CELLS))])

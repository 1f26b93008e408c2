"""A study of coverage: cells, and how often the intervals of each hold the truth.

A cell draws studies from its own seed and asks each for intervals. What comes of them
are rows of one kind, which go to a CSV; tables and figures are made from that.
"""

import warnings
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from tqdm import tqdm

from docs.make.evidence import table
from masrel.estimates import Interval

Floats = NDArray[np.float64]
Row = dict[str, Any]

SLACK = 1e-12  # an end at the truth itself, rounded


class Answer(NamedTuple):
    """An interval by name, the truth, and whether there was a warning.

    Numbers are of one study, or arrays of many; ends are ``nan`` without an interval.
    """

    name: str
    low: float | Floats
    high: float | Floats
    truth: float | Floats
    warned: bool | NDArray[np.bool_] = False


def answer(
    name: str, interval: Interval | None, truth: float, *, warned: bool = False
) -> Answer:
    """Return the answer of one study, which may have no interval."""
    if interval is None or interval.reason is not None:
        return Answer(name, np.nan, np.nan, truth, warned)
    return Answer(name, interval.low, interval.high, truth, warned)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """What is in the first columns of its rows, and how its studies are drawn."""

    at: Mapping[str, object]
    ask: Callable[[np.random.Generator, int], Iterable[Answer]]
    seed: Sequence[int]
    n_studies: int


def one_by_one(
    study: Callable[[np.random.Generator], Iterable[Answer]],
    rng: np.random.Generator,
    n_studies: int,
) -> Iterator[Answer]:
    """Yield the answers of studies that are drawn one after the other."""
    for _ in range(n_studies):
        yield from study(rng)


def run(cells: Sequence[Cell], *, processes: int = 1, quiet: bool = True) -> list[Row]:
    """Return a row per cell and interval."""
    with ProcessPoolExecutor(processes, mp_context=get_context("fork")) as pool:
        parts = pool.map(rows_of, cells)
        bar = tqdm(parts, total=len(cells), disable=quiet, unit="cell")
        return [row for rows in bar for row in rows]


def rows_of(cell: Cell) -> list[Row]:
    """Return the rows of a cell, the same ones in every run."""
    rng = np.random.default_rng(cell.seed)
    parts = defaultdict[str, list[Floats]](list)
    with warnings.catch_warnings(action="ignore"):
        for name, *numbers in cell.ask(rng, cell.n_studies):
            parts[name].append(np.array(np.broadcast_arrays(*numbers)).reshape(4, -1))
    return [
        {**cell.at, "interval": name, **_counted(*np.hstack(of))}
        for name, of in parts.items()
    ]


def _counted(low: Floats, high: Floats, truth: Floats, warned: Floats) -> Row:
    is_given = ~(np.isnan(low) | np.isnan(high))
    below = is_given & (truth < low - SLACK)
    above = is_given & (truth > high + SLACK)
    return {
        "truth": float(truth.mean()),
        "n_studies": len(truth),
        "held": int((is_given & ~below & ~above).sum()),
        "below": int(below.sum()),
        "above": int(above.sum()),
        "undefined": int((~is_given).sum()),
        "warned": int(warned.sum()),
        "width": float((high - low)[is_given].sum() / max(is_given.sum(), 1)),
    }


def percent(rows: pd.DataFrame) -> pd.Series:
    """Return coverages in per cent; a study without an interval misses."""
    return 100.0 * rows["held"] / rows["n_studies"]


def crossed(rows: pd.DataFrame, lines: Mapping[str, str]) -> str:
    """Return what rows show in Markdown, a line a cell and a column an interval.

    `lines` has the columns by which lines differ, with their heads.
    """
    keys = [*lines, "interval"]
    shown = rows.set_index(keys)["shown"].unstack(sort=False).fillna("–")
    return table(
        [*lines.values(), *shown.columns],
        shown.reset_index().astype(object).to_numpy().tolist(),
        n_text=len(lines),
    )


def monte_carlo_error(coverage: float, n: int) -> float:
    """Return the standard error of a coverage, which is not 0 at 100 %."""
    share = (coverage * n + 1.0) / (n + 2.0)
    return float(np.sqrt(share * (1.0 - share) / max(n, 1)))

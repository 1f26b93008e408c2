"""A study of coverage: cells, methods, and what came of them as rows, table and figure.

A cell is a population, a number of items and some coefficients; a method is a call of
the package. Rows go to a CSV, from which all else is made.
"""

import warnings
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context

import numpy as np
import pandas as pd
from tqdm import tqdm

from docs.make.coverage.populations import Population
from masrel.agreement import COEFFICIENTS, CodedRatings
from masrel.errors import MasrelError, MasrelWarning
from masrel.estimates import Interval

Method = Callable[[str, CodedRatings, str], Interval | None]
"""From a coefficient, ratings and weights to an interval for other items."""

SLACK = 1e-12  # an end at the truth itself, rounded


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """Where studies come from, and what they are asked.

    `coefficients` are names, with ", quadratic" where they are weighted so.
    """

    family: str
    population: str  # in words
    make: Callable[[], Population] = field(repr=False)
    n_items: int
    n_raters: int
    coefficients: Sequence[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Cells by methods, so many studies each, the same ones in every run."""

    name: str
    cells: Sequence[Cell]
    methods: Mapping[str, Method]
    seed: int

    def run(
        self, n_studies: int, *, processes: int = 1, quiet: bool = False
    ) -> pd.DataFrame:
        """Return a row per cell, coefficient and method."""
        parts = [(self, place, n_studies) for place in range(len(self.cells))]
        bar = tqdm(total=len(parts), disable=quiet, unit="cell")
        rows: list[dict[str, object]] = []
        with ProcessPoolExecutor(processes, mp_context=get_context("fork")) as pool:
            for found in pool.map(_rows_of_cell, parts):
                rows += found
                bar.update()
        return pd.DataFrame(rows)


def _rows_of_cell(part: tuple[Study, int, int]) -> list[dict[str, object]]:
    study, place, n_studies = part
    cell = study.cells[place]
    population = cell.make()
    key = f"{cell.family} {cell.population} {cell.n_items} {cell.n_raters}"
    rng = np.random.Generator(np.random.PCG64((study.seed, zlib.crc32(key.encode()))))
    studies, times = _distinct(
        population.draw(cell.n_items, rng) for _ in range(n_studies)
    )
    scale = tuple(range(population.chances.shape[-1]))
    rows = []
    for name in cell.coefficients:
        coefficient, _, weights = name.partition(", ")
        weights = weights or "identity"
        truth = population.truth(coefficient, weights)
        coded = [CodedRatings(codes=codes, categories=scale) for codes in studies]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MasrelWarning)
            values = [
                COEFFICIENTS[coefficient](of, weights=weights).value for of in coded
            ]
        defined = np.isfinite(values)
        for method_name, method in study.methods.items():
            ends = [
                _ends(method, coefficient, of, weights) if ok else (np.nan,) * 3
                for of, ok in zip(coded, defined, strict=True)
            ]
            rows.append({
                "family": cell.family,
                "population": cell.population,
                "n_items": cell.n_items,
                "n_raters": cell.n_raters,
                "coefficient": name,
                "truth": truth,
                "method": method_name,
                "n_studies": n_studies,
                **_counted(np.array(ends), truth, times * defined),
            })  # fmt: skip
    return rows


def _distinct(
    studies: Iterable[np.ndarray],
) -> tuple[list[np.ndarray], np.ndarray]:
    # the order of items says nothing, and equal studies are computed once
    times: dict[bytes, int] = {}
    first: dict[bytes, np.ndarray] = {}
    for codes in studies:
        codes = codes[np.lexsort(codes.T[::-1])]
        key = codes.tobytes()
        times[key] = times.get(key, 0) + 1
        first.setdefault(key, codes)
    return list(first.values()), np.array(list(times.values()))


def _ends(
    method: Method, coefficient: str, ratings: CodedRatings, weights: str
) -> tuple[float, float, float]:
    """Return both ends, and whether a warning says that they rest on little."""
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        try:
            interval = method(coefficient, ratings, weights)
        except MasrelError:
            interval = None
    if interval is None or interval.reason is not None:
        return np.nan, np.nan, 1.0
    warned = any(issubclass(of.category, MasrelWarning) for of in noted)
    return interval.low, interval.high, float(warned)


def _counted(ends: np.ndarray, truth: float, times: np.ndarray) -> dict[str, float]:
    """Return shares of the studies with an estimate, and the mean width."""
    low, high, warned = ends.T
    n = int(times.sum())
    exist = np.isfinite(low + high)
    below, above = truth < low - SLACK, truth > high + SLACK
    width = np.where(exist, high - low, 0.0)
    answered = max(int(times @ exist), 1)
    return {
        "n_defined": n,
        "coverage": float(times @ (exist & ~below & ~above)) / max(n, 1),
        "truth_below": float(times @ below) / max(n, 1),
        "truth_above": float(times @ above) / max(n, 1),
        "width": float(times @ width) / answered,
        "answered": float(times @ exist) / max(n, 1),
        "warned": float(times @ np.nan_to_num(warned)) / max(n, 1),
    }


def monte_carlo_error(coverage: float, n: int) -> float:
    """Return the standard error of a coverage, which is not 0 at 100 %."""
    share = (coverage * n + 1.0) / (n + 2.0)
    return float(np.sqrt(share * (1.0 - share) / max(n, 1)))

"""A benchmark is rows: one thing done by masrel and by others, in turn."""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.benchmarks.sidebyside import (
    Command,
    Sample,
    Work,
    middle,
    peak_megabytes,
    side_by_side,
)

Result = dict[str, Any]  # a line of the table: what one program took


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What is done, and who does it, by a function or a command; the first is ours."""

    what: str
    works: Mapping[str, Work]
    turns: int = 7
    n_ratings: int | None = None
    parts: Mapping[str, float] = field(default_factory=dict)  # of it that a call does
    value: Callable[[Any], object] | None = None  # what is noted of a function's result
    has_memory: bool = False  # of functions; that of a command is always known


@dataclass(frozen=True, slots=True, kw_only=True)
class Benchmark:
    """A table of the page: its rows, what the last column has, and its figures."""

    rows: Callable[[bool, Path], Iterable[Row]]  # few and small?, folder for files
    value: str = ""
    draw: Callable[[list[Result]], None] | None = None


def measured(benchmark: Benchmark, folder: Path, *, quick: bool) -> Iterator[Result]:
    """Yield a line per row and program; a ratio is our time over theirs."""
    for row in benchmark.rows(quick, folder):
        samples = side_by_side(row.works, turns=1 if quick else row.turns)
        seconds = {
            name: [sample.seconds / row.parts.get(name, 1.0) for sample in of]
            for name, of in samples.items()
        }
        ours = next(iter(seconds.values()))
        for name, theirs in seconds.items():
            ratios = [a / b for a, b in zip(ours, theirs, strict=True)]
            took, spread = middle(theirs)
            ratio, of_ratio = (None, None) if theirs is ours else middle(ratios)
            line = {
                "what": row.what,
                "ratings": row.n_ratings,
                "program": name,
                "seconds": took,
                "± %": spread,
                "MB": _megabytes(row, name, samples[name]),
                "ratio": ratio,
                "± % of it": of_ratio,
            }
            if benchmark.value:
                line[benchmark.value] = _value(row, samples[name])
            yield line


def _megabytes(row: Row, name: str, samples: list[Sample]) -> float | None:
    work = row.works[name]
    if isinstance(work, list):
        return max(sample.megabytes for sample in samples)
    return peak_megabytes(work) if row.has_memory else None


def _value(row: Row, samples: list[Sample]) -> object:
    return None if row.value is None else row.value(samples[-1].result)


def agree(path: Path, *options: str) -> Command:
    """Return the command that is compared."""
    return [sys.executable, "-m", "masrel", "agree", str(path), *options]


def python(program: str, path: Path) -> Command:
    """Return the command of a program in Python that reads the same file."""
    return [sys.executable, "-c", program, str(path)]

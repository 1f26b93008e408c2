"""Figures of benchmarks: logarithmic axes, and a look for each program."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.make.benchmarks.rows import Result
from docs.make.evidence import FIGURES

LOOKS: dict[str, dict[str, Any]] = {
    "masrel": {"color": "#0072B2", "marker": "o"},
    "masrel, with errors": {"color": "#56B4E9", "marker": "v"},
    "statsmodels": {"color": "#D55E00", "marker": "s"},
    "krippendorff": {"color": "#009E73", "marker": "^"},
    "irrCAC": {"color": "#CC79A7", "marker": "D"},
}


def plain_figure(width: float, height: float) -> Figure:
    """Return a figure in inches, with small letters and two sides of a frame."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False})
    mpl.rcParams.update({"axes.spines.right": False, "savefig.dpi": 200})
    return Figure(figsize=(width, height), layout="constrained")


@contextmanager
def chart(
    name: str, *, x: str, y: str, height: float = 3.8, **legend: Any
) -> Iterator[Axes]:
    """Give axes to draw on, with labels and a legend when that is done."""
    figure = plain_figure(5.6, height)
    axes = figure.add_subplot()
    yield axes
    axes.set(xlabel=x, ylabel=y)
    axes.legend(frameon=False, **legend)
    figure.savefig(FIGURES / f"{name}.png")


def series(lines: Iterable[Result], column: str) -> dict[str, list[Result]]:
    """Return lines by what a column has."""
    groups = defaultdict(list)
    for line in lines:
        groups[line[column]].append(line)
    return groups

"""Estimates with their intervals, one below the other."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from masrel.report.figures.style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    Drawn,
    finish,
    house_style,
)

__all__ = ["ForestRow", "draw_forest"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ForestRow:
    """One estimate with its interval.

    Attributes
    ----------
    label, detail : str
        What is estimated; how and for whom.
    value, low, high : float or None
        The numbers; None or ``nan`` is not drawn.
    text : str
        The numbers, or why there are none, as shown at the right.
    """

    label: str
    detail: str
    value: float | None
    low: float | None
    high: float | None
    text: str


def draw_forest(rows: Sequence[ForestRow], *, axis_label: str, stamp: str) -> Drawn:
    """Draw estimates with their intervals, one below the other.

    Parameters
    ----------
    rows : sequence of ForestRow
        The estimates, first on top.
    axis_label : str
        What the axis shows.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    Drawn
        The figure's files.
    """
    with house_style():
        figure = Figure(figsize=(7.6, 0.95 + 0.44 * len(rows)))
        axes = figure.add_subplot()
        for y, row in enumerate(rows):
            _row(axes, y, row)
        axes.axvline(0.0, color=GREY, linewidth=0.8, linestyle=DASHES)
        axes.set_xlim(min(_least(rows), 0.0) - 0.05, 1.03)
        axes.set_ylim(len(rows) - 0.45, -0.55)
        labels = [f"{row.label}\n{row.detail}" for row in rows]
        axes.set_yticks(range(len(rows)), labels)
        axes.tick_params(axis="y", length=0, labelsize=8.5)
        axes.spines["left"].set_visible(False)
        axes.grid(axis="x")
        axes.set_xlabel(axis_label)
        return finish(figure, stamp)


def _least(rows: Sequence[ForestRow]) -> float:
    numbers = (_known(number) for row in rows for number in (row.value, row.low))
    return min((number for number in numbers if number is not None), default=0.0)


def _known(number: float | None) -> float | None:
    return None if number is None or not math.isfinite(number) else number


def _row(axes: Axes, y: int, row: ForestRow) -> None:
    value, low, high = _known(row.value), _known(row.low), _known(row.high)
    if low is not None and high is not None:
        axes.plot(
            [low, high],
            [y, y],
            color=BLUE,
            linewidth=2.0,
            marker="|",
            markersize=8,
            markeredgewidth=2.0,
        )
    if value is not None:
        axes.plot([value], [y], "D", color=BLACK, markersize=6)
    axes.annotate(
        row.text,
        (1.0, y),
        xycoords=("axes fraction", "data"),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        color=GREY if value is None else BLACK,
        style="italic" if value is None else "normal",
    )

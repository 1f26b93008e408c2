"""Estimates with their intervals and distributions, one below the other."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from masrel.estimates import Interval
from masrel.report.figures.forest_marks import (
    DOT,
    LOOKS,
    ZERO,
    handles_of,
    put_legend,
)
from masrel.report.figures.forest_row import (
    LINE,
    RIDGE,
    ForestRow,
    below,
    least,
    placed,
    zeros,
)
from masrel.report.figures.ridge import draw_ridge
from masrel.report.figures.style import (
    BLACK,
    GREY,
    Drawn,
    Form,
    as_bytes,
    finish,
    house_style,
    put_stamp,
)

__all__ = ["ForestRow", "draw_forest", "forest_file"]

_LEAST = -1.0  # the axis goes no further: what does is an arrow at its end
_RIGHT = 1.03


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
        return finish(_figure(rows, axis_label), stamp)


def forest_file(
    rows: Sequence[ForestRow], *, axis_label: str, stamp: str, form: Form
) -> bytes:
    """Draw the same as one file.

    Parameters
    ----------
    rows : sequence of ForestRow
        The estimates, first on top.
    axis_label : str
        What the axis shows.
    stamp : str
        The line that says where the data come from.
    form : {"png", "svg", "pdf"}
        What file.

    Returns
    -------
    bytes
        The file.
    """
    with house_style():
        figure = _figure(rows, axis_label)
        put_stamp(figure, stamp)
        return as_bytes(figure, form)


def _figure(rows: Sequence[ForestRow], axis_label: str) -> Figure:
    places = list(placed(rows))
    bottom = places[-1][1] + below(rows[-1]) + 0.05
    handles = handles_of(rows)
    figure = Figure(figsize=(7.2, bottom + 0.6 + 0.17 * len(handles)))
    axes = figure.add_subplot()
    left = max(least(rows), _LEAST) - 0.05
    axes.set_xlim(left, _RIGHT)
    axes.set_ylim(bottom, 0.0)
    for start, end in zeros(places):
        axes.plot([0.0, 0.0], [start, end], **ZERO, zorder=1.0)
    for row, y, heading in places:
        if heading is not None:
            _at_left(axes, heading, row.group, weight="bold")
        _row(axes, y, row, left)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x")
    axes.set_xlabel(axis_label)
    put_legend(figure, handles)
    return figure


def _row(axes: Axes, y: float, row: ForestRow, left: float) -> None:
    if row.distribution is not None:
        base = y - 0.3 * LINE
        draw_ridge(axes, row.distribution, base=base, top=base - 0.95 * RIDGE)
    if row.drawn is not None:
        _interval(axes, y, row.drawn, left)
    if row.value is not None and row.is_known:
        _dot(axes, y, row.value, left)
    _words(axes, y, row)


def _dot(axes: Axes, y: float, value: float, left: float) -> None:
    inside = min(max(value, left), _RIGHT)
    marker = "o" if inside == value else "<" if value < left else ">"
    axes.plot([inside], [y], clip_on=False, **{**DOT, "marker": marker})


def _interval(axes: Axes, y: float, interval: Interval, left: float) -> None:
    look = LOOKS[interval.kind]
    axes.plot([max(interval.low, left), interval.high], [y, y], **look)
    if interval.low < left:
        arrow = {"marker": "<", "markersize": 7, "color": look["color"]}
        axes.plot([left], [y], clip_on=False, **arrow)


def _words(axes: Axes, y: float, row: ForestRow) -> None:
    _at_left(axes, y, row.label, lifted=5.0 if row.detail else 0.0)
    if row.detail:
        _at_left(axes, y, row.detail, lifted=-5.5, color=GREY, fontsize=7.5)
    axes.annotate(
        row.text,
        (1.0, y),
        xycoords=("axes fraction", "data"),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        color=BLACK if row.is_known else GREY,
        style="normal" if row.is_known else "italic",
    )


def _at_left(
    axes: Axes, y: float, text: str, *, lifted: float = 0.0, **look: Any
) -> None:
    axes.annotate(
        text,
        (0.0, y),
        xycoords=("axes fraction", "data"),
        xytext=(-8, lifted),
        textcoords="offset points",
        ha="right",
        va="center",
        **look,
    )

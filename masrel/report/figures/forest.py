"""Estimates with their intervals and distributions, one below the other."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerLine2D
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from masrel.estimates import Distribution, Interval
from masrel.report.figures.ridge import (
    RIDGE_ALPHA,
    RIDGE_COLOURS,
    Part,
    draw_ridge,
    least_shown,
    parts,
)
from masrel.report.figures.style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    Drawn,
    Form,
    as_bytes,
    finish,
    house_style,
    put_stamp,
)
from masrel.report.rounding import percent

__all__ = ["ForestRow", "draw_forest", "forest_file"]

# Heights in inches: of a line of text, of a line below it, of a ridge and a heading.
_LINE, _DETAIL, _RIDGE, _GROUP = 0.25, 0.14, 0.34, 0.28
_LEAST = -1.0  # the axis goes no further: what does is an arrow at its end
_RIGHT = 1.03

_LOOKS: dict[str, dict[str, Any]] = {
    "confidence": {
        "color": BLUE,
        "linewidth": 1.8,
        "marker": "|",
        "markersize": 8,
        "markeredgewidth": 1.8,
    },
    "credible": {"color": ORANGE, "linewidth": 5.0, "solid_capstyle": "butt"},
}
_DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "markersize": 5}
_ZERO: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHES}

_PARTS: dict[Part, str] = {
    "density": "posterior density, each to its own height",
    "stems": "resamples of one value, each row to its own height",
    "bars": "resamples together in bars, each row to its own height",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ForestRow:
    """One estimate with its interval.

    Attributes
    ----------
    label, detail : str
        What is estimated; how and for whom, or nothing.
    value : float or None
        The estimate; None or ``nan`` is not drawn.
    interval : Interval or None
        Its interval, drawn with its distribution if it has one.
    text : str
        The numbers, or why there are none, as shown at the right.
    has_zero : bool
        Whether 0 is what chance gives, so that it is marked.
    group : str
        Heading above the first row of those that share it; none if empty.
    """

    label: str
    detail: str = ""
    value: float | None
    interval: Interval | None
    text: str
    has_zero: bool = True
    group: str = ""

    @property
    def drawn(self) -> Interval | None:
        """The interval, if its ends are known."""
        if self.interval is None:
            return None
        known = map(math.isfinite, (self.interval.low, self.interval.high))
        return self.interval if all(known) else None

    @property
    def distribution(self) -> Distribution | None:
        """The distribution of the interval, if there is one to draw."""
        return None if self.drawn is None else self.drawn.distribution

    @property
    def is_known(self) -> bool:
        """Whether there is a value to draw."""
        return self.value is not None and math.isfinite(self.value)

    @property
    def height(self) -> float:
        """How much room it takes, in inches."""
        room = _LINE + (_DETAIL if self.detail else 0.0)
        return room + (0.0 if self.distribution is None else _RIDGE)


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
    placed = list(_placed(rows))
    bottom = placed[-1][1] + _below(rows[-1]) + 0.05
    handles = _legend(rows)
    figure = Figure(figsize=(7.2, bottom + 0.6 + 0.17 * len(handles)))
    axes = figure.add_subplot()
    left = max(_least(rows), _LEAST) - 0.05
    axes.set_xlim(left, _RIGHT)
    axes.set_ylim(bottom, 0.0)
    for above, below in _zeros(placed):
        axes.plot([0.0, 0.0], [above, below], **_ZERO, zorder=1.0)
    for row, y, heading in placed:
        if heading is not None:
            _at_left(axes, heading, row.group, weight="bold")
        _row(axes, y, row, left)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x")
    axes.set_xlabel(axis_label)
    dots = [
        handle
        for handle in handles
        if isinstance(handle, Line2D) and handle.get_linestyle() == "None"
    ]
    figure.legend(
        handles=handles,
        loc="outside lower center",
        fontsize=8,
        borderaxespad=0.2,
        numpoints=2,
        handler_map={dot: HandlerLine2D(numpoints=1) for dot in dots},
    )
    return figure


Placed = tuple[ForestRow, float, float | None]
"""A row, where its interval's line is, and its heading if it has one."""


def _placed(rows: Sequence[ForestRow]) -> Iterator[Placed]:
    top, group = 0.0, ""
    for row in rows:
        heading = None
        if row.group and row.group != group:
            heading = top + 0.6 * _GROUP
            top += _GROUP
        group = row.group
        top += row.height
        yield row, top - _below(row), heading


def _below(row: ForestRow) -> float:
    # from the line of its interval to the end of its room
    return 0.5 * (_LINE + (_DETAIL if row.detail else 0.0))


def _zeros(placed: Sequence[Placed]) -> list[tuple[float, float]]:
    # where rows next to each other have a zero: one line for all of them
    lines: list[tuple[float, float]] = []
    above = 0.0
    for row, y, _ in placed:
        below = y + _below(row)
        if row.has_zero and lines and lines[-1][1] == above:
            lines[-1] = (lines[-1][0], below)
        elif row.has_zero:
            lines.append((above, below))
        above = below
    return lines


def _least(rows: Sequence[ForestRow]) -> float:
    numbers = [0.0]
    for row in rows:
        if row.value is not None and row.is_known:
            numbers.append(row.value)
        if row.drawn is not None:
            numbers.append(row.drawn.low)
        if row.distribution is not None:
            numbers.append(least_shown(row.distribution))
    return min(numbers)


def _row(axes: Axes, y: float, row: ForestRow, left: float) -> None:
    if row.distribution is not None:
        base = y - 0.3 * _LINE
        draw_ridge(axes, row.distribution, base=base, top=base - 0.95 * _RIDGE)
    if row.drawn is not None:
        _interval(axes, y, row.drawn, left)
    if row.value is not None and row.is_known:
        _dot(axes, y, row.value, left)
    _words(axes, y, row)


def _dot(axes: Axes, y: float, value: float, left: float) -> None:
    inside = min(max(value, left), _RIGHT)
    marker = "o" if inside == value else "<" if value < left else ">"
    axes.plot([inside], [y], clip_on=False, **{**_DOT, "marker": marker})


def _interval(axes: Axes, y: float, interval: Interval, left: float) -> None:
    look = _LOOKS[interval.kind]
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


def _legend(rows: Sequence[ForestRow]) -> list[Artist]:
    # what each mark is, each once
    handles: dict[str, Artist] = {}
    if any(row.is_known for row in rows):
        handles["estimate"] = Line2D([], [], linestyle="none", **_DOT)
    for interval in (row.drawn for row in rows if row.drawn is not None):
        words = f"{percent(interval.level)} % {interval.kind} interval"
        handles[words] = Line2D([], [], **_LOOKS[interval.kind])
        if interval.distribution is not None:
            for part in parts(interval.distribution):
                handles[_PARTS[part]] = _handle(part)
    for words, handle in handles.items():
        handle.set_label(words)
    return list(handles.values())


def _handle(part: Part) -> Artist:
    if part == "stems":
        look: dict[str, Any] = {"marker": "|", "markersize": 9, "markeredgewidth": 1.4}
        return Line2D([], [], color=RIDGE_COLOURS[part], linestyle="none", **look)
    colour = RIDGE_COLOURS[part]
    return Patch(facecolor=(colour, RIDGE_ALPHA), edgecolor=colour, linewidth=0.8)

"""Figures of stretches: torque and angle of models and as measured, and catches."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import compress
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from masrel.lab.elbow import Outline
from masrel.lab.report._trace_section import MeasuredPanel
from masrel.plots._style import (
    BANDS,
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    SHADES,
    VERMILLION,
)
from masrel.plots._traces import (
    Against,
    Floats,
    Stretch,
    draw_traces,
    name_traces,
    phase_handles,
)

_SMALL_IN_A_ROW = 4
_GRADED = 2.2  # times as wide is a line of a stretch that a grade rests on
# of where most of many stretches are: the outer pair of ends, and the inner one
_BAND = dict(zip(("middle 90 %", "middle 50 %"), BANDS, strict=True))

TracePanel = tuple[
    str, Sequence[Stretch], Sequence[bool], Sequence[str], Mapping[str, Floats] | None
]
"""A title; lines, whether each is wider, and what is written at it, if anything; and
where most of many are: "time", and the ends of "angle", deg, and of "torque"."""

View = Literal["time", "angle", "small"]

_ROWS: dict[View, tuple[Against, ...]] = {
    "time": ("torque", "angle"),
    "angle": ("torque over angle",),
    "small": ("torque",),
}


def trace_figure(panels: Sequence[TracePanel], view: View) -> Figure:
    """Return torque and angle against time, torque against angle, or torque alone."""
    rows = _ROWS[view]
    if view == "small":
        figure, grid = _small_panels(panels)
    else:
        figure, grid = _grid(len(panels), len(rows))
        for column, panel in zip(grid.T, panels, strict=True):
            for axes, quantity in zip(column, rows, strict=True):
                _draw_panel(axes, panel, quantity)
            column[0].set_title(panel[0])
        _finish(figure, grid, "model torque (N·m)")
    for axes, (_, lines, _, names, _) in zip(grid.flat, panels, strict=False):
        if names:
            name_traces(axes, lines, rows[0], names)
    handles: list[Any] = phase_handles([of for panel in panels for of in panel[1]])
    if any(band is not None for *_, band in panels):
        handles += [Patch(facecolor=of, label=name) for name, of in _BAND.items()]
    _explain(figure, handles)
    return figure


def _draw_panel(axes: Axes, panel: TracePanel, quantity: Against) -> None:
    _, lines, are_wide, _, band = panel
    if band is not None:
        ends = band[quantity]
        for place, shade in enumerate(_BAND.values()):
            between = band["time"], ends[place], ends[-1 - place]
            axes.fill_between(*between, color=shade, linewidth=0.0, zorder=0.5)
    for is_wide, factor in ((False, 1.0), (True, _GRADED)):
        chosen = [is_wide == of for of in are_wide]
        draw_traces(axes, list(compress(lines, chosen)), quantity, factor)
    axes.margins(y=0.1)  # for names above the highest


def _small_panels(panels: Sequence[TracePanel]) -> tuple[Figure, NDArray[Any]]:
    # torque alone, all on one scale; axes are not shared, as that doubles the time
    n_columns = min(_SMALL_IN_A_ROW, len(panels))
    n_rows = -(-len(panels) // n_columns)
    figure = Figure(figsize=(8.7, 0.6 + 1.75 * n_rows))
    grid = figure.subplots(n_rows, n_columns, squeeze=False)
    shown, others = grid.ravel()[: len(panels)], grid.ravel()[len(panels) :]
    for axes, panel in zip(shown, panels, strict=True):
        _draw_panel(axes, panel, "torque")
    last = max(axes.get_xlim()[1] for axes in shown)
    ends = _bottom(shown), max(axes.get_ylim()[1] for axes in shown)
    for place, (axes, (title, *_)) in enumerate(zip(shown, panels, strict=True)):
        axes.set(xlim=(0.0, last), ylim=ends)
        axes.set_title(title, fontsize=8)
        axes.grid(axis="y")
        is_first, is_lowest = place % n_columns == 0, place + n_columns >= len(panels)
        axes.tick_params(labelleft=is_first, labelbottom=is_lowest)
        axes.set(xlabel="time (s)" * is_lowest, ylabel="torque (N·m)" * is_first)
    for axes in others:
        axes.set_visible(False)
    return figure, grid


def measured_figure(panels: Sequence[MeasuredPanel]) -> Figure:
    """Return the torque that was sent and that was measured, above the angle."""
    figure, grid = _grid(len(panels), 2)
    looks: dict[str, dict[str, Any]] = {
        "measured": {"color": BLUE, "linewidth": 0.8},
        "sent": {"color": BLACK, "linewidth": 1.0, "dashes": (3, 1.5)},
    }
    for (top, bottom), panel in zip(grid.T, panels, strict=True):
        title, time, angle, sent, measured = panel
        top.plot(time, measured, **looks["measured"])
        top.plot(time, sent, **looks["sent"])
        bottom.plot(time, angle, color=GREY, linewidth=1.0)
        top.set_title(title)
    _finish(figure, grid, "torque (N·m)")
    _explain(figure, [Line2D([], [], label=of, **look) for of, look in looks.items()])
    return figure


def _explain(figure: Figure, handles: Sequence[Any]) -> None:
    if handles:
        where: dict[str, Any] = {"loc": "outside lower center", "ncols": len(handles)}
        figure.legend(handles=handles, handlelength=3.0, **where)


def _grid(n_panels: int, n_rows: int) -> tuple[Figure, NDArray[Any]]:
    # -> the figure, and its axes (n_rows, n_panels)
    figure = Figure(figsize=(max(3.4, 0.5 + 2.05 * n_panels), 1.5 + 1.6 * n_rows))
    grid = figure.subplots(
        n_rows,
        n_panels,
        sharex=True,
        sharey="row",
        squeeze=False,
        height_ratios=(1.5, 1.0)[:n_rows],
    )
    return figure, grid


def _finish(figure: Figure, grid: NDArray[Any], torque_label: str) -> None:
    over_time = len(grid) == 2
    for axes in grid.flat:
        axes.grid(axis="y")
    for axes in grid[-1]:
        axes.set_xlabel("time (s)" if over_time else "angle (deg)")
    # limits come last: set before the last stretch they would cut it off
    grid[0, 0].set(ylim=(_bottom(grid[0]), None))
    grid[0, 0].set_ylabel(torque_label)
    if over_time:
        grid[0, 0].set(xlim=(0.0, None))
        grid[1, 0].set_ylabel("elbow angle (deg)")
        figure.align_ylabels(grid[:, 0])


def _bottom(row: Iterable[Axes]) -> float:
    # where an axis of torque begins: at 0, or below what is less
    return 1.05 * min(0.0, *(float(axes.dataLim.y0) for axes in row))


_MARKERS = ((BLUE, "o"), (VERMILLION, "s"), (BLACK, "^"), (ORANGE, "D"), (GREY, "v"))

Catches = tuple[str, Floats, Floats, Floats, Floats, tuple[float, float]]
"""A model; for each motion the mean speed before its catch, deg/s, the angle of it,
deg, the mean speed during it, deg/s, and how long it lasts, s, ``nan`` where the motion
ends within it; and ν_L and ν_H of (6), deg/s."""


def catch_figure(curves: Sequence[Catches]) -> Figure:
    """Return angle, duration, and duration times speed, against mean speed."""
    figure = Figure(figsize=(7.2, 3.1))
    angle, duration, travel = figure.subplots(1, 3)
    for curve, (colour, marker) in zip(curves, _MARKERS, strict=False):
        label, mean, angles, during, durations, clamps = curve
        look: dict[str, Any] = {
            "color": colour,
            "linewidth": 1.0,
            "label": label,
            "marker": marker,
            "markersize": 3.2,
            "markevery": max(1, mean.size // 8),
        }
        angle.plot(mean, angles, **look)
        duration.plot(during, durations, **look)
        travel.plot(during, durations * during, **look)
        for at in clamps:  # as rings on the line
            if mean.min() < at < mean.max():
                height = float(np.interp(at, mean, angles))
                angle.plot(
                    at, height, "o", markersize=6.5, markerfacecolor="none",
                    markeredgecolor=colour, markeredgewidth=0.8,
                )  # fmt: skip
    angle.set(xlabel="mean speed before\nthe catch (deg/s)", ylabel="catch angle (deg)")
    for axes, text in (
        (duration, "catch duration (s)"),
        (travel, "duration × speed (deg)"),
    ):
        axes.set(xlabel="mean speed during\nthe catch (deg/s)", ylabel=text)
        axes.set_ylim(bottom=0.0)
    ring: dict[str, Any] = {"marker": "o", "markerfacecolor": "none", "ls": "none"}
    handles = [*travel.get_lines(), Line2D([], [], color=GREY, **ring)]
    labels = [*(curve[0] for curve in curves), "ν$_L$ and ν$_H$ of (6)"]
    legend = figure.legend(handles, labels, loc="outside lower center", ncols=6)
    legend.get_texts()[-1].set_parse_math(True)
    return figure


_NUMERALS = ("i", "ii", "iii", "iv")


def schematic_figure(
    title: str, line: Outline, levels: tuple[float, float, float], name: str
) -> Figure:
    """Return the torque of a stretch against time, the parts of its catch named."""
    # levels: torque before, at and after the peak, N·m; name: what the last is above
    # the first, in matplotlib's TeX
    figure = Figure(figsize=(5.4, 3.5))
    axes = figure.subplots()
    (pre_end, peak, residual), events = levels, line.events
    highest = max(float(line.torque.max()), peak)
    axes.set_ylim(min(0.0, float(line.torque.min())), 1.22 * highest)
    for span, numeral in zip(events.phases, _NUMERALS, strict=False):
        axes.axvspan(
            span.start, span.end, color=SHADES[span.name], linewidth=0, zorder=0
        )
        axes.text(
            0.5 * (span.start + span.end), 1.19 * highest, f"({numeral})\n{span.name}",
            ha="center", va="top", fontsize=8,
        )  # fmt: skip
    axes.plot(line.time, line.torque, color=BLUE, linewidth=1.6)
    begin, top = events.catch or 0.0, events.peak_end or 0.0
    end = events.end if events.catch_end is None else events.catch_end
    axes.plot([begin, end], [pre_end] * 2, color=GREY, linewidth=0.8, linestyle=DASHES)
    # H·v_c beside the peak, Q·H·v_c in the residual, and how long each lasts
    middle, rest, gap = 0.5 * (begin + top), 0.5 * (top + end), 0.04 * peak
    beside, above = {"va": "center"}, {"ha": "center", "va": "bottom"}
    low = 0.55 * pre_end
    arrows = [
        ((middle, pre_end), (middle, peak), " $H\\,v_c$", 0.0, beside),
        (
            (begin, peak + gap),
            (top, peak + gap),
            r"$\Delta T_{peak}$",
            0.3 * gap,
            above,
        ),
        ((begin, low), (end, low), r"$\Delta T_c$", 0.3 * gap, above),
        ((end, pre_end), (end, pre_end), r" $\tau_{\mathrm{pre\_end}}$", 0.0, beside),
    ]
    if end > top:
        arrows.append(((rest, pre_end), (rest, residual), f" {name}", 0.0, beside))
    ends = {"arrowstyle": "<->", "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
    for one, other, text, up, how in arrows:
        if one != other:
            axes.annotate("", one, other, arrowprops=ends)
        x, y = 0.5 * (one[0] + other[0]), 0.5 * (one[1] + other[1]) + up
        axes.text(x, y, text, fontsize=9, parse_math=True, **how)  # type: ignore[arg-type]
    axes.set_xlim(line.time[0], line.time[-1])
    axes.set(xlabel="time (s)", ylabel="torque (N·m)")
    axes.set_title(title, loc="left")
    return figure

"""Figures of torque and angle against time, of the model and as it was measured."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from masrel.lab.report._figure_data import MeasuredTorque, TraceColumns, TracePanel
from masrel.plots._style import BLACK, BLUE, GREY, VERMILLION, short_name

_GRADED_WIDTH = 2.2  # of the line of a stretch that a grade rests on, of the others

_TORQUE, _ANGLE = 2, 1  # their columns in a stretch
_CATCH = 1  # position in _PHASES
_SMALL_IN_A_ROW = 4
_BAND_SHADES = ("#E9EFF5", "#C9D9E8")  # of the middle 90 % and of the middle 50 %

# Name of each phase, and how its line looks.
_PHASES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("pre-catch", {"color": GREY, "linewidth": 0.8}),
    ("catch", {"color": VERMILLION, "linewidth": 1.5}),
    ("post-catch", {"color": BLUE, "linewidth": 1.0, "linestyle": (0, (4, 1.2))}),
)

_Values = NDArray[np.generic]


def trace_figure(columns: TraceColumns) -> Figure:
    """Return torque and angle against time, one column a model, or torque alone."""
    if columns.has_angle:
        figure, grid = _torque_above_angle(len(columns.panels))
        for (top, bottom), panel in zip(grid.T, columns.panels, strict=True):
            _draw_panel(top, panel, _TORQUE)
            _draw_panel(bottom, panel, _ANGLE)
            top.set_title(panel.title)
        _finish(figure, grid, "model torque (N·m)")
    else:
        figure = _small_panels(columns.panels)
    handles: list[Any] = [
        Line2D([], [], solid_capstyle="butt", **look) for _, look in _PHASES
    ]
    for handle in handles:
        handle.set_linewidth(handle.get_linewidth() + 0.5)
    names = [name for name, _ in _PHASES]
    if any(panel.band is not None for panel in columns.panels):
        handles += [Patch(facecolor=shade) for shade in _BAND_SHADES]
        names += ["middle 90 %", "middle 50 %"]
    figure.legend(
        handles, names, loc="outside lower center", ncols=len(names), handlelength=3.0
    )
    return figure


def _small_panels(panels: Sequence[TracePanel]) -> Figure:
    # torque alone, all on the same axes
    n_columns = min(_SMALL_IN_A_ROW, len(panels))
    n_rows = -(-len(panels) // n_columns)
    figure = Figure(figsize=(8.7, 0.6 + 1.75 * n_rows))
    grid = figure.subplots(n_rows, n_columns, sharex=True, sharey=True, squeeze=False)
    for axes, panel in zip(grid.flat, panels, strict=False):
        _draw_panel(axes, panel, _TORQUE)
        axes.set_title(panel.title, fontsize=8)
        axes.grid(axis="y")
    for axes in grid.ravel()[len(panels) :]:
        axes.set_visible(False)
    grid[0, 0].set_xlim(left=0)
    grid[0, 0].set_ylim(bottom=min(0.0, grid[0, 0].get_ylim()[0]))
    for place in range(n_columns):  # the last panel of each column has the label
        last = n_rows - 1 if (n_rows - 1) * n_columns + place < len(panels) else -2
        axes = grid[last, place]
        axes.set_xlabel("time (s)")
        axes.tick_params(labelbottom=True)
    for axes in grid[:, 0]:
        axes.set_ylabel("torque (N·m)")
    return figure


def measured_figure(content: MeasuredTorque) -> Figure:
    """Return the torque that was sent and that was measured, above the angle."""
    figure, grid = _torque_above_angle(len(content.panels))
    for (top, bottom), panel in zip(grid.T, content.panels, strict=True):
        top.plot(panel.time, panel.measured, color=BLUE, linewidth=0.8)
        top.plot(panel.time, panel.sent, color=BLACK, linewidth=1.0, dashes=(3, 1.5))
        bottom.plot(panel.time, panel.angle, color=GREY, linewidth=1.0)
        top.set_title(panel.title)
    _finish(figure, grid, "torque (N·m)")
    figure.legend(
        handles=[
            Line2D([], [], color=BLUE, linewidth=1.3, label="measured"),
            Line2D([], [], color=BLACK, linewidth=1.3, dashes=(3, 1.5), label="sent"),
        ],
        loc="outside lower center",
        ncols=2,
        handlelength=3.0,
    )
    return figure


def _torque_above_angle(n_panels: int) -> tuple[Figure, NDArray[Any]]:
    # -> the figure, and its axes (2, n_panels)
    figure = Figure(figsize=(max(3.4, 0.5 + 2.05 * n_panels), 4.7))
    grid = figure.subplots(
        2,
        n_panels,
        sharex=True,
        sharey="row",
        squeeze=False,
        height_ratios=(1.5, 1.0),
    )
    return figure, grid


def _finish(figure: Figure, grid: NDArray[Any], torque_label: str) -> None:
    for axes in grid.flat:
        axes.grid(axis="y")
    for axes in grid[1]:
        axes.set_xlabel("time (s)")
    # Limits come last: set before the last stretch they would cut it off.
    grid[0, 0].set_xlim(left=0)
    grid[0, 0].set_ylim(bottom=min(0.0, grid[0, 0].get_ylim()[0]))
    grid[0, 0].set_ylabel(torque_label)
    grid[1, 0].set_ylabel("elbow angle (deg)")
    figure.align_ylabels(grid[:, 0])


def _draw_panel(axes: Axes, panel: TracePanel, which: int) -> None:
    # which: the column of a stretch that is drawn against its time
    if panel.band is not None:
        _draw_band(axes, panel, which)
    graded = panel.graded or (False,) * len(panel.stretches)
    for is_graded, factor in ((False, 1.0), (True, _GRADED_WIDTH)):
        shown = [
            (stretch[0], stretch[which], _runs(stretch[3]))
            for stretch, of_grade in zip(panel.stretches, graded, strict=True)
            if of_grade == is_graded
        ]
        for code in range(len(_PHASES)) if shown else ():
            _draw_phase(axes, shown, code, factor)


def _draw_band(axes: Axes, panel: TracePanel, which: int) -> None:
    # the outer pair of ends, and the inner one before it
    if panel.band is None:
        return
    ends = panel.band.torque if which == _TORQUE else panel.band.angle
    for place, shade in enumerate(_BAND_SHADES):
        low, high = ends[place], ends[-1 - place]
        axes.fill_between(
            panel.band.time, low, high, color=shade, linewidth=0, zorder=0.5
        )
    if which == _TORQUE:
        _name_stretches(axes, panel)


def _name_stretches(axes: Axes, panel: TracePanel) -> None:
    # where the catch is, or at the end without one; out of each other's way
    places = []
    for name, (time, _, torque, phase) in zip(
        panel.names, panel.stretches, strict=True
    ):
        at = int(np.argmax(phase == _CATCH)) or -1
        places.append((time[at], torque[at], short_name(name)))
    sides = ["right", *["center"] * len(places[1:-1]), "left"]
    for (time, torque, name), side in zip(sorted(places), sides, strict=False):
        axes.annotate(
            name, (time, torque), (0, 3), textcoords="offset points", ha=side,
            fontsize=6, color=GREY, zorder=5,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.3},
        )  # fmt: skip


def _draw_phase(
    axes: Axes,
    stretches: Sequence[tuple[_Values, _Values, list[tuple[int, slice]]]],
    code: int,
    factor: float,
) -> None:
    # One line for all stretches, with a gap wherever a run of the phase ends; a dot
    # where a run begins, but for the first of a stretch.
    pieces: list[_Values] = []
    dots: list[_Values] = []
    for time, values, runs in stretches:
        for of_run, run in runs:
            if of_run == code:
                pieces += [np.array([time[run], values[run]]), _GAP]
                if run.start:
                    dots.append(np.array([time[run.start], values[run.start]]))
    look = _PHASES[code][1]
    if pieces:
        wide = {"linewidth": factor * look["linewidth"]}
        line = np.concatenate(pieces, axis=1)
        axes.plot(*line, solid_capstyle="butt", **{**look, **wide})
    if dots:
        axes.plot(*np.array(dots).T, "o", color=look["color"], markersize=2.4)


_GAP = np.full((2, 1), np.nan)


def _runs(phase: _Values) -> list[tuple[int, slice]]:
    # code and place of each run of a phase; each begins where the one before ended
    codes = np.asarray(phase, dtype=np.intp)
    starts = np.flatnonzero(np.diff(codes, prepend=-1))
    ends = np.append(starts[1:] + 1, codes.size)
    return [
        (int(codes[start]), slice(start, end))
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True)
    ]

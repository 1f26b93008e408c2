"""Figures of a study's report: grades, speeds, and traces of torque and angle."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from masrel.report._figure_data import (
    GradeGrid,
    MeasuredTorque,
    SpeedDots,
    TraceColumns,
)
from masrel.report.figures._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    VERMILLION,
)

_INTENDED_X = -1.3  # where intended grades stand; raters are at 0, 1, 2, ...
_SHADES = LinearSegmentedColormap.from_list("grades", ["#F2F6FA", "#7FB6DA", "#003A5D"])

_MODELS_IN_A_ROW = 8  # more go into further rows: a page is no wider
_SESSION_LOOKS = (("o", BLUE), ("s", ORANGE), ("^", VERMILLION), ("v", GREY))

_GRADED_WIDTH = 2.2  # of the line of a stretch that a grade rests on, of the others

# Name of each phase, and how its line looks.
_PHASES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("pre-catch", {"color": GREY, "linewidth": 0.8}),
    ("catch", {"color": VERMILLION, "linewidth": 1.5}),
    ("post-catch", {"color": BLUE, "linewidth": 1.0, "linestyle": (0, (4, 1.2))}),
)


def grade_figure(grid: GradeGrid) -> Figure:
    """Return grades as shaded cells, with the grade written in each."""
    n_rows, n_columns = len(grid.models), len(grid.raters)
    size = (1.3 + 0.56 * (n_columns + 1.3), 1.15 + 0.34 * n_rows)
    figure = Figure(figsize=size)
    axes = figure.add_subplot()
    for row, aim in enumerate(grid.intended):
        _cell(axes, _INTENDED_X, row, () if aim is None else (aim,), grid.scale, None)
        for column, grades in enumerate(grid.grades[row]):
            _cell(axes, column, row, grades, grid.scale, aim)
    axes.set_xlim(_INTENDED_X - 0.55, n_columns - 0.45)
    axes.set_ylim(n_rows - 0.4, -0.6)
    axes.set_xticks([_INTENDED_X, *range(n_columns)], ["intended", *grid.raters])
    axes.set_yticks(range(n_rows), grid.models)
    axes.tick_params(length=0)
    axes.xaxis.tick_top()
    if n_columns > 12:
        axes.tick_params(axis="x", rotation=90)
    for spine in axes.spines.values():
        spine.set_visible(False)
    has_aim = any(intended is not None for intended in grid.intended)
    axes.set_xlabel("framed: not the intended grade" if has_aim else "rater")
    return figure


def _cell(
    axes: Axes,
    x: float,
    y: float,
    grades: tuple[str, ...],
    scale: tuple[str, ...],
    intended: str | None,
) -> None:
    # Repeated presentations share the cell, each a part of its width.
    if not grades:
        axes.text(x, y, "–", ha="center", va="center", color=GREY)
        return
    width = 0.88 / len(grades)
    for part, grade in enumerate(grades):
        left = x - 0.44 + part * width
        shade = _SHADES(scale.index(grade) / max(len(scale) - 1, 1))
        differs = intended is not None and grade != intended
        corner = (left, y - 0.42)
        axes.add_patch(
            Rectangle(corner, width, 0.84, facecolor=shade, edgecolor="none")
        )
        if differs:
            frame: dict[str, Any] = {"edgecolor": VERMILLION, "linewidth": 2.2}
            axes.add_patch(Rectangle(corner, width, 0.84, facecolor="none", **frame))
        # relative luminance (ITU-R BT.709) decides black or white letters
        luminance = float(np.dot(shade[:3], (0.2126, 0.7152, 0.0722)))
        axes.text(
            left + width / 2,
            y,
            grade,
            ha="center",
            va="center",
            color=BLACK if luminance > 0.45 else "white",
            weight="bold" if differs else "normal",
        )


def speed_figure(dots: SpeedDots) -> Figure:
    """Return every rater's mean speed, one column a model."""
    models = list(dict.fromkeys(column.model for column in dots.columns))
    sessions = list(dict.fromkeys(column.session for column in dots.columns))
    starts = range(0, len(models), _MODELS_IN_A_ROW)
    width = min(8.8, max(4.6, 1.4 + 1.25 * len(models[:_MODELS_IN_A_ROW])))
    figure = Figure(figsize=(width, 0.6 + 2.6 * len(starts)))
    rows = figure.subplots(len(starts), 1, sharey=True, squeeze=False)[:, 0]
    for axes, start in zip(rows, starts, strict=True):
        _speed_row(axes, dots, models[start : start + _MODELS_IN_A_ROW], sessions)
    rows[0].set_ylim(bottom=0)
    label = "haptic model"
    if len(dots.raters) > 1:
        label += f"; in each, raters {dots.raters[0]} to {dots.raters[-1]} from left"
    rows[-1].set_xlabel(label)
    figure.supylabel("mean speed before the catch (deg/s)", fontsize=9)
    looks = zip(sessions, _SESSION_LOOKS * len(sessions), strict=False)
    marks = [
        Line2D([], [], marker=marker, color=colour, linestyle="none", label=session)
        for session, (marker, colour) in looks
    ]
    marks.append(Line2D([], [], color=BLACK, linewidth=1.6, label="mean"))
    figure.legend(handles=marks, ncols=5, loc="outside lower center")
    return figure


def _speed_row(
    axes: Axes, dots: SpeedDots, models: Sequence[str], sessions: Sequence[str]
) -> None:
    width = 0.76 / len(sessions)
    for column in dots.columns:
        if column.model not in models:
            continue
        session = sessions.index(column.session)
        middle = models.index(column.model) - 0.38 + width * (session + 0.5)
        marker, colour = _SESSION_LOOKS[session % len(_SESSION_LOOKS)]
        n_raters = len(column.speeds)
        for rater, speeds in enumerate(column.speeds):
            place = middle + 0.9 * width * ((rater + 0.5) / n_raters - 0.5)
            places = [place] * len(speeds)
            axes.plot(places, speeds, marker, color=colour, markersize=5, alpha=0.9)
            graded = column.graded[rater] if column.graded else ()
            places = [place] * len(graded)
            axes.plot(places, graded, "o", color=BLACK, markersize=8, fillstyle="none")
        ends = [middle - 0.45 * width, middle + 0.45 * width]
        axes.plot(ends, [column.mean, column.mean], color=BLACK, linewidth=1.6)
    axes.axhline(dots.slowest, color=GREY, linewidth=0.8, linestyle=DASHES)
    axes.annotate(
        r"$\nu_L$",
        (1.0, dots.slowest),
        xycoords=("axes fraction", "data"),
        xytext=(3, 0),
        textcoords="offset points",
        va="center",
        color=GREY,
        parse_math=True,
    )
    axes.set_xticks(range(len(models)), models)
    axes.set_xlim(-0.55, len(models) - 0.45)
    axes.grid(axis="y")


def trace_figure(columns: TraceColumns) -> Figure:
    """Return torque and angle against time, one column a model."""
    figure, grid = _torque_above_angle(len(columns.panels))
    for (top, bottom), panel in zip(grid.T, columns.panels, strict=True):
        graded = panel.graded or (False,) * len(panel.stretches)
        for is_graded, lines in zip(graded, panel.stretches, strict=True):
            time, angle, torque, phase = lines
            width = _GRADED_WIDTH if is_graded else 1.0
            _by_phase(top, time, torque, phase, width)
            _by_phase(bottom, time, angle, phase, width)
        top.set_title(panel.title)
    _finish(figure, grid, "model torque (N·m)")
    handles = [Line2D([], [], solid_capstyle="butt", **look) for _, look in _PHASES]
    for handle in handles:
        handle.set_linewidth(handle.get_linewidth() + 0.5)
    figure.legend(
        handles,
        [name for name, _ in _PHASES],
        loc="outside lower center",
        ncols=3,
        handlelength=3.0,
    )
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


def _by_phase(
    axes: Axes,
    time: NDArray[np.generic],
    values: NDArray[np.generic],
    phase: NDArray[np.generic],
    width: float,
) -> None:
    # One line per run of a phase; each begins where the one before ended.
    codes = np.asarray(phase, dtype=np.intp)
    starts = np.flatnonzero(np.diff(codes, prepend=-1))
    ends = np.append(starts[1:] + 1, codes.size)
    for start, end in zip(starts, ends, strict=True):
        _, look = _PHASES[codes[start]]
        run = slice(start, end)
        line = Line2D(time[run], values[run], solid_capstyle="butt", **look)
        line.set_linewidth(width * line.get_linewidth())
        axes.add_line(line)
    for start in starts[1:]:
        colour = _PHASES[codes[start]][1]["color"]
        axes.plot(time[start], values[start], "o", color=colour, markersize=2.4)
    axes.autoscale_view()

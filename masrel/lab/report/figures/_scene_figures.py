"""Figures of `masrel joint trace`: torque of stretches, catches, one catch."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from masrel.lab.report._figure_data import (
    CatchCurve,
    CatchSchematic,
    StretchLine,
    StretchPanel,
)
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    SHADES,
    VERMILLION,
)

_SOLID: tuple[float, ...] = (1.0, 0.0)
_LINES: tuple[tuple[str, tuple[float, ...]], ...] = (
    (BLUE, _SOLID),
    (VERMILLION, (5, 1.5)),
    (BLACK, (1, 1.2)),
    (ORANGE, (5, 1.5, 1, 1.5)),
    (GREY, (6, 1.2, 1.2, 1.2, 1.2, 1.2)),
)

_MARKERS = ((BLUE, "o"), (VERMILLION, "s"), (BLACK, "^"), (ORANGE, "D"), (GREY, "v"))

_NUMERALS = ("i", "ii", "iii", "iv")


def stretch_figure(
    panels: Sequence[StretchPanel], against: Literal["angle", "time"]
) -> Figure:
    """Return torque against angle, or torque and angle against time."""
    n_rows = 1 if against == "angle" else 2
    figure = Figure(figsize=(max(4.4, 0.6 + 2.1 * len(panels)), 2.2 + 1.3 * n_rows))
    grid = figure.subplots(
        n_rows,
        len(panels),
        sharex=True,
        sharey="row",
        squeeze=False,
        height_ratios=(1.6, 1.0)[:n_rows],
    )
    shaded = _shaded(panels)
    for column, panel in enumerate(panels):
        _panel(list(grid[:, column]), panel, shaded, against)
    grid[0, 0].set_ylabel("torque (N·m)")
    grid[0, 0].set_ylim(bottom=min(0.0, grid[0, 0].get_ylim()[0]))
    if n_rows == 2:
        grid[1, 0].set_ylabel("angle (deg)")
        figure.align_ylabels(grid[:, 0])
    _stretch_legend(figure, panels, shaded)
    return figure


def _shaded(panels: Sequence[StretchPanel]) -> int:
    # which line has its phases shaded: the first that catches in any panel
    for place in range(min(len(panel.lines) for panel in panels)):
        if any(len(panel.lines[place].phases) > 1 for panel in panels):
            return place
    return 0


def _panel(
    rows: Sequence[Axes],
    panel: StretchPanel,
    shaded: int,
    against: Literal["angle", "time"],
) -> None:
    _shade(rows, panel.lines[shaded], against)
    for line, (colour, dashes) in zip(panel.lines, _styles(panel), strict=True):
        across = line.angle if against == "angle" else line.time
        columns = [line.torque] if against == "angle" else [line.torque, line.angle]
        for axes, values in zip(rows, columns, strict=True):
            axes.plot(across, values, color=colour, dashes=dashes, linewidth=1.1)
    rows[0].set_title(panel.title)
    rows[-1].set_xlabel("angle (deg)" if against == "angle" else "time (s)")
    rows[-1].margins(x=0.02)


def _styles(panel: StretchPanel) -> list[tuple[str, tuple[float, ...]]]:
    return [_LINES[i % len(_LINES)] for i in range(len(panel.lines))]


def _shade(
    rows: Sequence[Axes], line: StretchLine, against: Literal["angle", "time"]
) -> None:
    for name, start, end in line.phases:
        if against == "angle":
            inside = (line.time >= start) & (line.time <= end)
            start, end = line.angle[inside].min(), line.angle[inside].max()
        for axes in rows:
            axes.axvspan(start, end, color=SHADES[name], linewidth=0, zorder=0)
    if len({name for name, _, _ in line.phases}) > 1:
        for axes in rows:
            for _, start, _ in line.phases[1:]:
                at = start
                if against == "angle":
                    at = line.angle[int(np.searchsorted(line.time, start))]
                axes.axvline(at, color=GREY, linewidth=0.5, zorder=0.5)


def _stretch_legend(
    figure: Figure, panels: Sequence[StretchPanel], shaded: int
) -> None:
    # names of the lines if they are the same in every panel, and of the shades
    longest = max(panels, key=lambda panel: len(panel.lines))
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=colour, dashes=dashes, linewidth=1.3, label=line.label)
        for line, (colour, dashes) in zip(longest.lines, _styles(longest), strict=True)
    ]
    shades = {name for panel in panels for name, _, _ in panel.lines[shaded].phases}
    which = longest.lines[shaded].label
    handles += [
        Patch(facecolor=SHADES[name], edgecolor=GREY, lw=0.4, label=f"{name}, {which}")
        for name in ("catch", "post-catch")
        if name in shades
    ]
    n_columns = max(2, min(len(handles), 1 + 2 * len(panels)))
    figure.legend(
        handles=handles, loc="outside lower center", ncols=n_columns, fontsize=7.5
    )


def catch_figure(curves: Sequence[CatchCurve]) -> Figure:
    """Return angle, duration, and duration times speed, against mean speed."""
    figure = Figure(figsize=(7.2, 3.1))
    angle, duration, travel = figure.subplots(1, 3)
    for i, curve in enumerate(curves):
        look = _MARKERS[i % len(_MARKERS)]
        _catch_angles(angle, curve, look)
        _marks(duration, curve.catch_speed, curve.duration, curve.label, look)
        travelled = curve.duration * curve.catch_speed
        _marks(travel, curve.catch_speed, travelled, curve.label, look)
    angle.set_xlabel("mean speed before\nthe catch (deg/s)")
    angle.set_ylabel("catch angle (deg)")
    for axes in (duration, travel):
        axes.set_xlabel("mean speed during\nthe catch (deg/s)")
        axes.set_ylim(bottom=0.0)
    duration.set_ylabel("catch duration (s)")
    travel.set_ylabel("duration × speed (deg)")
    handles, labels = travel.get_legend_handles_labels()
    ring = Line2D(
        [], [], color=GREY, marker="o", markerfacecolor="none", linestyle="none"
    )
    handles.append(ring)
    labels.append("ν$_L$ and ν$_H$ of (6)")
    legend = figure.legend(handles, labels, loc="outside lower center", ncols=6)
    legend.get_texts()[-1].set_parse_math(True)
    return figure


def _catch_angles(axes: Axes, curve: CatchCurve, look: tuple[str, str]) -> None:
    # the clamps of (6) as rings on the line
    _marks(axes, curve.mean_speed, curve.catch_angle, curve.label, look)
    speeds = curve.mean_speed
    for at in curve.clamps:
        if speeds.size and speeds.min() < at < speeds.max():
            height = float(np.interp(at, speeds, curve.catch_angle))
            axes.plot(
                at, height, "o", markersize=6.5, markerfacecolor="none",
                markeredgecolor=look[0], markeredgewidth=0.8,
            )  # fmt: skip


def _marks(
    axes: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    label: str,
    look: tuple[str, str],
) -> None:
    colour, marker = look
    every = max(1, x.size // 8)
    axes.plot(
        x,
        y,
        color=colour,
        linewidth=1.0,
        marker=marker,
        markersize=3.2,
        markevery=every,
        label=label,
    )


def schematic_figure(stretch: CatchSchematic) -> Figure:
    """Return the torque of a stretch against time, the parts of its catch named."""
    figure = Figure(figsize=(5.4, 3.5))
    axes = figure.subplots()
    highest = max(float(stretch.torque.max()), stretch.peak)
    axes.set_ylim(min(0.0, float(stretch.torque.min())), 1.22 * highest)
    for (name, start, end), numeral in zip(stretch.phases, _NUMERALS, strict=False):
        axes.axvspan(start, end, color=SHADES[name], linewidth=0, zorder=0)
        axes.text(
            0.5 * (start + end), 1.19 * highest, f"({numeral})\n{name}",
            ha="center", va="top", fontsize=8,
        )  # fmt: skip
    axes.plot(stretch.time, stretch.torque, color=BLUE, linewidth=1.6)
    _levels(axes, stretch)
    _durations(axes, stretch)
    axes.set_xlim(stretch.time[0], stretch.time[-1])
    axes.set_xlabel("time (s)")
    axes.set_ylabel("torque (N·m)")
    axes.set_title(stretch.title, loc="left")
    return figure


def _levels(axes: Axes, stretch: CatchSchematic) -> None:
    # arrows from τ_pre_end up: H·v_c beside the peak, Q·H·v_c in the residual
    rest = 0.5 * (stretch.peak_end + stretch.catch_end)
    axes.plot(
        [stretch.catch, stretch.catch_end], [stretch.pre_end] * 2,
        color=GREY, linewidth=0.8, linestyle=DASHES,
    )  # fmt: skip
    places = [(0.5 * (stretch.catch + stretch.peak_end), stretch.peak, "$H\\,v_c$")]
    if stretch.catch_end > stretch.peak_end:
        places.append((rest, stretch.residual, stretch.residual_name))
    for at, top, text in places:
        _arrow(axes, (at, stretch.pre_end), (at, top))
        axes.text(
            at,
            0.5 * (stretch.pre_end + top),
            f" {text}",
            va="center",
            fontsize=9,
            parse_math=True,
        )
    axes.text(
        stretch.catch_end, stretch.pre_end, r" $\tau_{\mathrm{pre\_end}}$",
        va="center", fontsize=9, parse_math=True,
    )  # fmt: skip


def _durations(axes: Axes, stretch: CatchSchematic) -> None:
    gap = 0.04 * stretch.peak
    rows = [
        (stretch.catch, stretch.peak_end, stretch.peak + gap, r"$\Delta T_{peak}$"),
        (stretch.catch, stretch.catch_end, 0.55 * stretch.pre_end, r"$\Delta T_c$"),
    ]
    for start, end, height, text in rows:
        _arrow(axes, (start, height), (end, height))
        axes.text(0.5 * (start + end), height + 0.3 * gap, text, ha="center",
                  va="bottom", fontsize=9, parse_math=True)  # fmt: skip


def _arrow(axes: Axes, one: tuple[float, float], other: tuple[float, float]) -> None:
    axes.annotate(
        "",
        one,
        other,
        arrowprops={"arrowstyle": "<->", "lw": 0.8, "shrinkA": 0, "shrinkB": 0},
    )

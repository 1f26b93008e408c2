"""Figures of torque and angle against time, of the model and as it was measured."""

from collections.abc import Iterable, Sequence
from itertools import compress
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from masrel.lab.report._figure_data import MeasuredPanel, TracePanel
from masrel.plots._style import BLACK, BLUE, GREY
from masrel.plots._traces import (
    Quantity,
    draw_traces,
    name_traces,
    phase_handles,
)

_SMALL_IN_A_ROW = 4
_GRADED = 2.2  # times as wide is a line of a stretch that a grade rests on
# of where most of many stretches are: the outer pair of ends, and the inner one
_BAND = {"middle 90 %": "#E9EFF5", "middle 50 %": "#C9D9E8"}


def trace_figure(panels: Sequence[TracePanel], has_angle: bool) -> Figure:
    """Return torque and angle against time, one column a model, or torque alone."""
    if has_angle:
        figure, grid = _torque_above_angle(len(panels))
        for (top, bottom), panel in zip(grid.T, panels, strict=True):
            _draw_panel(top, panel, "torque")
            _draw_panel(bottom, panel, "angle")
            top.set_title(panel.title)
        _finish(figure, grid, "model torque (N·m)")
    else:
        figure, grid = _small_panels(panels)
    for axes, panel in zip(grid.flat, panels, strict=False):
        if panel.band is not None:
            name_traces(axes, panel.traces, "torque", panel.names)
    handles: list[Any] = phase_handles([of for panel in panels for of in panel.traces])
    if any(panel.band is not None for panel in panels):
        handles += [Patch(facecolor=of, label=name) for name, of in _BAND.items()]
    _explain(figure, handles)
    return figure


def _draw_panel(axes: Axes, panel: TracePanel, quantity: Quantity) -> None:
    if panel.band is not None:
        ends = getattr(panel.band, quantity)
        for place, shade in enumerate(_BAND.values()):
            between = panel.band.time, ends[place], ends[-1 - place]
            axes.fill_between(*between, color=shade, linewidth=0.0, zorder=0.5)
    for is_graded, factor in ((False, 1.0), (True, _GRADED)):
        chosen = [is_graded == of for of in panel.graded]
        draw_traces(axes, list(compress(panel.traces, chosen)), quantity, factor)
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
    for place, (axes, panel) in enumerate(zip(shown, panels, strict=True)):
        axes.set(xlim=(0.0, last), ylim=ends)
        axes.set_title(panel.title, fontsize=8)
        axes.grid(axis="y")
        is_first, is_lowest = place % n_columns == 0, place + n_columns >= len(panels)
        axes.tick_params(labelleft=is_first, labelbottom=is_lowest)
        axes.set_xlabel("time (s)" if is_lowest else "")
        axes.set_ylabel("torque (N·m)" if is_first else "")
    for axes in others:
        axes.set_visible(False)
    return figure, grid


def measured_figure(panels: Sequence[MeasuredPanel]) -> Figure:
    """Return the torque that was sent and that was measured, above the angle."""
    figure, grid = _torque_above_angle(len(panels))
    measured: dict[str, Any] = {"color": BLUE, "linewidth": 0.8}
    sent: dict[str, Any] = {"color": BLACK, "linewidth": 1.0, "dashes": (3, 1.5)}
    for (top, bottom), panel in zip(grid.T, panels, strict=True):
        top.plot(panel.time, panel.measured, **measured)
        top.plot(panel.time, panel.sent, **sent)
        bottom.plot(panel.time, panel.angle, color=GREY, linewidth=1.0)
        top.set_title(panel.title)
    _finish(figure, grid, "torque (N·m)")
    looks = {"measured": measured, "sent": sent}
    _explain(figure, [Line2D([], [], label=of, **look) for of, look in looks.items()])
    return figure


def _explain(figure: Figure, handles: Sequence[Any]) -> None:
    if handles:
        where: dict[str, Any] = {"loc": "outside lower center", "ncols": len(handles)}
        figure.legend(handles=handles, handlelength=3.0, **where)


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
    # limits come last: set before the last stretch they would cut it off
    grid[0, 0].set(xlim=(0.0, None), ylim=(_bottom(grid[0]), None))
    grid[0, 0].set_ylabel(torque_label)
    grid[1, 0].set_ylabel("elbow angle (deg)")
    figure.align_ylabels(grid[:, 0])


def _bottom(row: Iterable[Axes]) -> float:
    # where an axis of torque begins: at 0, or below what is less
    return 1.05 * min(0.0, *(float(axes.dataLim.y0) for axes in row))

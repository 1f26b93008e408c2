"""Torque and angle against time, one column a model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from masrel.report.figures.style import (
    BLUE,
    GREY,
    VERMILLION,
    Drawn,
    finish,
    house_style,
)

__all__ = ["TracePanel", "draw_traces"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    name: str
    colour: str
    width: float
    is_dashed: bool = False

    def line(self, *, extra_width: float = 0.0) -> Line2D:
        line = Line2D([], [], color=self.colour, linewidth=self.width + extra_width)
        if self.is_dashed:
            line.set_linestyle((0, (4, 1.2)))
        line.set_solid_capstyle("butt")
        return line


_PHASES = (
    _Look(name="pre-catch", colour=GREY, width=0.8),
    _Look(name="catch", colour=VERMILLION, width=1.5),
    _Look(name="post-catch", colour=BLUE, width=1.0, is_dashed=True),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TracePanel:
    """All stretches of one model.

    Attributes
    ----------
    title : str
        The model, its intended grade, and the range of speeds.
    stretches : tuple of tuple of ndarray
        Per rater: time (s), angle (deg), torque (N·m), phase code.
    """

    title: str
    stretches: tuple[tuple[NDArray[np.float64], ...], ...]


def draw_traces(panels: Sequence[TracePanel], *, stamp: str) -> Drawn:
    """Draw torque and angle against time, one column a model.

    Parameters
    ----------
    panels : sequence of TracePanel
        The models, at most as many as fit beside each other.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    Drawn
        The figure's files.
    """
    with house_style():
        figure = Figure(figsize=(max(3.4, 0.5 + 2.05 * len(panels)), 4.7))
        grid = figure.subplots(
            2,
            len(panels),
            sharex=True,
            sharey="row",
            squeeze=False,
            height_ratios=(1.5, 1.0),
        )
        for column, panel in enumerate(panels):
            _panel(grid[0, column], grid[1, column], panel)
        # Limits come last: set before the last stretch they would cut it off.
        grid[0, 0].set_xlim(left=0)
        grid[0, 0].set_ylim(bottom=min(0.0, grid[0, 0].get_ylim()[0]))
        grid[0, 0].set_ylabel("model torque (N·m)")
        grid[1, 0].set_ylabel("elbow angle (deg)")
        figure.align_ylabels(grid[:, 0])
        figure.legend(
            [look.line(extra_width=0.5) for look in _PHASES],
            [look.name for look in _PHASES],
            loc="outside lower center",
            ncols=3,
            handlelength=3.0,
        )
        return finish(figure, stamp)


def _panel(torque_axes: Axes, angle_axes: Axes, panel: TracePanel) -> None:
    for time, angle, torque, phase in panel.stretches:
        _by_phase(torque_axes, time, torque, phase)
        _by_phase(angle_axes, time, angle, phase)
    torque_axes.set_title(panel.title)
    torque_axes.grid(axis="y")
    angle_axes.grid(axis="y")
    angle_axes.set_xlabel("time (s)")


def _by_phase(
    axes: Axes,
    time: NDArray[np.float64],
    values: NDArray[np.float64],
    phase: NDArray[np.float64],
) -> None:
    # One line per run of a phase; each begins where the one before ended.
    codes = np.asarray(phase, dtype=np.intp)
    starts = np.flatnonzero(np.diff(codes, prepend=-1))
    ends = np.append(starts[1:] + 1, codes.size)
    for start, end in zip(starts, ends, strict=True):
        line = _PHASES[codes[start]].line()
        line.set_data(time[start:end], values[start:end])
        axes.add_line(line)
    for start in starts[1:]:
        colour = _PHASES[codes[start]].colour
        axes.plot(time[start], values[start], "o", color=colour, markersize=2.4)
    axes.autoscale_view()

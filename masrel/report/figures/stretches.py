"""Torque of stretches against angle or time, phases shaded, one panel a model."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from masrel.report.figures.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SHADES,
    VERMILLION,
    Form,
    as_bytes,
    house_style,
    put_stamp,
)

__all__ = ["StretchLine", "StretchPanel", "draw_stretches"]

_SOLID: tuple[float, ...] = (1.0, 0.0)
_LINES: tuple[tuple[str, tuple[float, ...]], ...] = (
    (BLUE, _SOLID),
    (VERMILLION, (5, 1.5)),
    (BLACK, (1, 1.2)),
    (ORANGE, (5, 1.5, 1, 1.5)),
    (GREY, (6, 1.2, 1.2, 1.2, 1.2, 1.2)),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchLine:
    """One motion of one model.

    Attributes
    ----------
    label : str
        What tells it from the others, such as its speed.
    time, angle, torque : ndarray, shape (n_points,)
        s, deg, N·m; where the torque jumps, two points have the same time.
    phases : tuple of (str, float, float)
        Name, first and last time of each phase, s.
    """

    label: str
    time: NDArray[np.float64] = field(compare=False, repr=False)
    angle: NDArray[np.float64] = field(compare=False, repr=False)
    torque: NDArray[np.float64] = field(compare=False, repr=False)
    phases: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchPanel:
    """The motions of one model.

    Attributes
    ----------
    title : str
        The model.
    lines : tuple of StretchLine
        Its motions; the phases of one are shaded.
    """

    title: str
    lines: tuple[StretchLine, ...]


def draw_stretches(
    panels: Sequence[StretchPanel],
    *,
    against: Literal["angle", "time"],
    form: Form,
    stamp: str,
) -> bytes:
    """Draw torque against angle, or torque and angle against time.

    Parameters
    ----------
    panels : sequence of StretchPanel
        The models; four stand beside each other at most.
    against : {"angle", "time"}
        What is on the horizontal axis.
    form : {"png", "svg", "pdf"}
        What file.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    bytes
        The file; the same panels give the same bytes.
    """
    n_rows = 1 if against == "angle" else 2
    with house_style():
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
        _legend(figure, panels, shaded)
        put_stamp(figure, stamp)
        return as_bytes(figure, form)


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


def _legend(figure: Figure, panels: Sequence[StretchPanel], shaded: int) -> None:
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

"""The figure of a law of tone: torque against angle, and torque and angle in time."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from masrel.plots._style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SHADES,
    VERMILLION,
    finished,
    house_style,
)

_COLOURS = (BLUE, VERMILLION, ORANGE, GREY)
_BACK = (0, (4, 1.6))  # line style of the way back
_LETTERS = "abcdefgh"


@dataclass(frozen=True, slots=True, kw_only=True)
class ToneLine:
    """One joint along a motion."""

    label: str  # what tells it from the others, such as its grade
    # (n_points,): s, deg, N·m; where the torque jumps, two points are near
    time: NDArray[np.float64] = field(compare=False, repr=False)
    angle: NDArray[np.float64] = field(compare=False, repr=False)
    torque: NDArray[np.float64] = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class ToneView:
    """A law of tone along one motion: torque against angle, and both against time."""

    lines: tuple[ToneLine, ...]  # at most four, of one motion
    shown: int  # which of them has its events marked
    parts: tuple[tuple[str, float, float], ...]  # name, first and last time, s
    events: tuple[tuple[str, float], ...]  # name, time, s
    rendered: ToneLine  # that line as a device made it, its angle the arm's


def draw(view: ToneView) -> bytes:
    """Return the figure of one law as a PNG."""
    with house_style():
        files = finished(_figure(view), stamp="SIMULATED DATA", forms=("png",))
    return files["png"]


def _figure(view: ToneView) -> Figure:
    figure = Figure(figsize=(7.2, 4.0))
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.15), height_ratios=(1.9, 1.0))
    across, torque = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
    angle = figure.add_subplot(grid[1, 1], sharex=torque)
    torque.tick_params(labelbottom=False)
    _against_angle(across, view)
    _against_time(torque, angle, view)
    low = min(torque.get_ylim()[0], across.get_ylim()[0])
    high = max(torque.get_ylim()[1], across.get_ylim()[1])
    for axes in (across, torque):
        axes.set_ylim(low, high)
        axes.axhline(0.0, color=GREY, linewidth=0.5, zorder=0.5)
    figure.align_ylabels([torque, angle])
    handles = _line_handles(view) + _event_handles(view)
    figure.legend(
        handles=handles, loc="outside lower center", ncols=5, fontsize=7.5,
        handlelength=2.2, columnspacing=1.4,
    )  # fmt: skip
    return figure


def _against_angle(axes: Axes, view: ToneView) -> None:
    for line, colour in zip(view.lines, _COLOURS, strict=False):
        for name, start, end in view.parts:
            mine = (line.time >= start) & (line.time <= end)
            axes.plot(
                line.angle[mine], line.torque[mine], color=colour, linewidth=1.2,
                linestyle=_BACK if name == "back" else "-",
            )  # fmt: skip
    axes.set(xlabel="angle (deg)", ylabel="torque (N·m)")


def _against_time(torque: Axes, angle: Axes, view: ToneView) -> None:
    for axes in (torque, angle):
        for name, start, end in view.parts:
            if name == "hold":
                shade = SHADES["post-catch"]
                axes.axvspan(start, end, color=shade, linewidth=0, zorder=0)
    for i, (line, colour) in enumerate(zip(view.lines, _COLOURS, strict=False)):
        # wide and pale below the thin line of the device
        width, alpha = (3.0, 0.45) if i == view.shown else (1.2, 1.0)
        torque.plot(line.time, line.torque, color=colour, lw=width, alpha=alpha)
    shown, made = view.lines[view.shown], view.rendered
    torque.plot(made.time, made.torque, color=BLACK, linewidth=0.8)
    _event_letters(torque, view)
    colour = _COLOURS[view.shown]
    angle.plot(shown.time, shown.angle, color=colour, linewidth=3.0, alpha=0.45)
    angle.plot(made.time, made.angle, color=BLACK, linewidth=0.8)
    for name, start, end in view.parts:
        angle.text(
            0.5 * (start + end), 1.03, name, transform=angle.get_xaxis_transform(),
            ha="center", va="bottom", fontsize=7.5, color=GREY,
        )  # fmt: skip
    angle.set(xlabel="time (s)", ylabel="angle (deg)")
    torque.set_ylabel("torque (N·m)")
    angle.margins(x=0.01)


def _event_letters(axes: Axes, view: ToneView) -> None:
    line = view.lines[view.shown]
    for letter, (_, time) in zip(_LETTERS, view.events, strict=False):
        # just after it, where a jump is over
        at = int(np.searchsorted(line.time, time + 1e-7))
        height = float(line.torque[min(at, line.torque.size - 1)])
        axes.plot(time, height, zorder=4, **_EVENT)
        axes.annotate(
            letter, (time, height), (-3, 4), textcoords="offset points", ha="right",
            va="bottom", fontsize=8, zorder=5,
            path_effects=[withStroke(linewidth=2.0, foreground="white")],
        )  # fmt: skip


_EVENT: dict[str, Any] = {
    "color": BLACK, "marker": "o", "markersize": 3.6, "markerfacecolor": "white",
    "markeredgewidth": 0.9, "linestyle": "none",
}  # fmt: skip


def _line_handles(view: ToneView) -> list[Line2D]:
    handles = [
        Line2D([], [], color=colour, linewidth=1.4, label=line.label)
        for line, colour in zip(view.lines, _COLOURS, strict=False)
    ]
    shown = view.lines[view.shown].label
    made = f"{shown}, simulated device"
    return [
        *handles,
        Line2D([], [], color=GREY, linewidth=1.2, linestyle=_BACK, label="way back"),
        Line2D([], [], color=BLACK, linewidth=0.8, label=made),
    ]


def _event_handles(view: ToneView) -> list[Line2D]:
    return [
        Line2D([], [], label=f"{letter}: {name}", **_EVENT)
        for letter, (name, _) in zip(_LETTERS, view.events, strict=False)
    ]

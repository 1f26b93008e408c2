"""Figures of the report: the only place that draws.

Colours are Okabe and Ito's, which colour-blind readers tell apart; shapes, line
styles and text repeat what the colours say, so that a grey print loses nothing.
"""

import io
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

__all__ = [
    "Drawn",
    "ForestRow",
    "GradeGrid",
    "SpeedColumn",
    "TracePanel",
    "draw_forest",
    "draw_grades",
    "draw_speeds",
    "draw_traces",
]

BLACK = "#000000"
GREY = "#767676"
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILLION = "#D55E00"

_STYLE: dict[str, object] = {
    "font.family": "DejaVu Sans",  # ships with matplotlib: the same everywhere
    "font.size": 8.5,
    "axes.labelsize": 8.5,
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "svg.hashsalt": "masrel",  # ids of an SVG are otherwise random
    "svg.fonttype": "path",
    "figure.constrained_layout.use": True,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A finished figure.

    Attributes
    ----------
    png, svg : bytes
        Its two files; the same data give the same bytes.
    """

    png: bytes = field(repr=False)
    svg: bytes = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeGrid:
    """Grades of one session, one row a model and one column a rater.

    Attributes
    ----------
    models, raters : tuple of str
        Names of the rows and columns.
    intended : tuple of str or None
        Intended grade of every model.
    grades : tuple of tuple of str or None
        The grades; None is missing.
    scale : tuple of str
        Every grade of the scale, least first.
    """

    models: tuple[str, ...]
    raters: tuple[str, ...]
    intended: tuple[str | None, ...]
    grades: tuple[tuple[str | None, ...], ...]
    scale: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ForestRow:
    """One estimate with its interval.

    Attributes
    ----------
    label, detail : str
        What is estimated; how and for whom.
    value, low, high : float or None
        The numbers; None or ``nan`` is not drawn.
    text : str
        The numbers, or why there are none, as shown at the right.
    """

    label: str
    detail: str
    value: float | None
    low: float | None
    high: float | None
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedColumn:
    """Speeds of one model in one session, deg/s.

    Attributes
    ----------
    model, session : str
        Where they were made.
    speeds : tuple of float
        One per rater, in the raters' order; ``nan`` is missing.
    mean : float
        Their mean.
    """

    model: str
    session: str
    speeds: tuple[float, ...]
    mean: float


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


def draw_grades(grid: GradeGrid, *, stamp: str) -> Drawn:
    """Draw grades as shaded cells with the grade written in each.

    Parameters
    ----------
    grid : GradeGrid
        The grades.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    Drawn
        The figure's files.
    """
    n_rows, n_columns = len(grid.models), len(grid.raters)
    size = (1.9 + 0.52 * (n_columns + 1.3), 1.25 + 0.36 * n_rows)
    with _style():
        figure = Figure(figsize=size)
        axes = figure.add_subplot()
        for row in range(n_rows):
            _cell(axes, -1.3, row, grid.intended[row], grid, None)
            for column, grade in enumerate(grid.grades[row]):
                _cell(axes, column, row, grade, grid, grid.intended[row])
        axes.set_xlim(-1.85, n_columns - 0.45)
        axes.set_ylim(n_rows - 0.4, -0.6)
        axes.set_xticks([-1.3, *range(n_columns)], ["intended", *grid.raters])
        axes.set_yticks(range(n_rows), grid.models)
        axes.tick_params(length=0)
        axes.xaxis.tick_top()
        if n_columns > 12:
            axes.tick_params(axis="x", rotation=90)
        for spine in axes.spines.values():
            spine.set_visible(False)
        axes.set_xlabel(
            "framed: not the intended grade"
            if any(intended is not None for intended in grid.intended)
            else "rater"
        )
        return _finish(figure, stamp)


def _cell(
    axes: Axes,
    x: float,
    y: float,
    grade: str | None,
    grid: GradeGrid,
    intended: str | None,
) -> None:
    if grade is None:
        axes.text(x, y, "–", ha="center", va="center", color=GREY)
        return
    shade = _shades(grid.scale.index(grade) / max(len(grid.scale) - 1, 1))
    box = Rectangle((x - 0.44, y - 0.42), 0.88, 0.84, facecolor=shade, edgecolor="none")
    axes.add_patch(box)
    differs = intended is not None and grade != intended
    if differs:
        frame = Rectangle((x - 0.44, y - 0.42), 0.88, 0.84)
        frame.set(facecolor="none", edgecolor=VERMILLION, linewidth=2.2)
        axes.add_patch(frame)
    # relative luminance (ITU-R BT.709) decides black or white letters
    luminance = float(np.dot(shade[:3], (0.2126, 0.7152, 0.0722)))
    axes.text(
        x,
        y,
        grade,
        ha="center",
        va="center",
        color=BLACK if luminance > 0.45 else "white",
        weight="bold" if differs else "normal",
    )


_shades = LinearSegmentedColormap.from_list("grades", ["#F2F6FA", "#7FB6DA", "#003A5D"])


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
    known = [
        number
        for row in rows
        for number in (row.value, row.low, row.high)
        if number is not None and np.isfinite(number)
    ]
    with _style():
        figure = Figure(figsize=(7.2, 0.95 + 0.44 * len(rows)))
        axes = figure.add_subplot()
        for y, row in enumerate(rows):
            _forest_row(axes, y, row)
        axes.axvline(0.0, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.set_xlim(min([-0.05, *(number - 0.05 for number in known)]), 1.03)
        axes.set_ylim(len(rows) - 0.45, -0.55)
        axes.set_yticks(
            range(len(rows)), [f"{row.label}\n{row.detail}" for row in rows]
        )
        axes.tick_params(axis="y", length=0, labelsize=8)
        axes.spines["left"].set_visible(False)
        axes.grid(axis="x")
        axes.set_xlabel(axis_label)
        return _finish(figure, stamp)


def _forest_row(axes: Axes, y: int, row: ForestRow) -> None:
    has_interval = (
        row.low is not None
        and row.high is not None
        and np.isfinite(row.low)
        and np.isfinite(row.high)
    )
    if has_interval:
        axes.plot(
            [row.low, row.high],
            [y, y],
            color=BLUE,
            linewidth=2.0,
            marker="|",
            markersize=8,
            markeredgewidth=2.0,
        )
    has_value = row.value is not None and np.isfinite(row.value)
    if has_value:
        axes.plot(row.value, y, "D", color=BLACK, markersize=6)
    axes.annotate(
        row.text,
        (1.0, y),
        xycoords=("axes fraction", "data"),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        color=BLACK if has_value else GREY,
        style="normal" if has_value else "italic",
    )


def draw_speeds(
    columns: Sequence[SpeedColumn],
    *,
    raters: Sequence[str],
    slowest: float,
    stamp: str,
) -> Drawn:
    """Draw every rater's mean speed, one column a model.

    Parameters
    ----------
    columns : sequence of SpeedColumn
        The speeds, by session and model.
    raters : sequence of str
        The raters, in the order of the speeds.
    slowest : float
        Speed below which the catch angle stays the same, deg/s.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    Drawn
        The figure's files.
    """
    models = list(dict.fromkeys(column.model for column in columns))
    sessions = list(dict.fromkeys(column.session for column in columns))
    with _style():
        figure = Figure(figsize=(max(4.6, 1.4 + 1.25 * len(models)), 3.3))
        axes = figure.add_subplot()
        for column in columns:
            look = sessions.index(column.session)
            centre = models.index(column.model)
            _speed_column(axes, column, centre, look, len(sessions))
        axes.axhline(slowest, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.annotate(
            r"$\nu_L$",
            (1.0, slowest),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            color=GREY,
        )
        axes.set_xticks(range(len(models)), models)
        axes.set_xlim(-0.55, len(models) - 0.45)
        axes.set_ylim(bottom=0)
        axes.grid(axis="y")
        axes.set_xlabel(
            f"haptic model; in each, raters {raters[0]} to {raters[-1]} from left"
            if len(raters) > 1
            else "haptic model"
        )
        axes.set_ylabel("mean speed before the catch (deg/s)")
        axes.legend(handles=_speed_legend(sessions), ncols=3, loc="lower right")
        return _finish(figure, stamp)


_SESSION_LOOKS = (("o", BLUE), ("s", ORANGE), ("^", VERMILLION), ("v", GREY))


def _speed_column(
    axes: Axes, column: SpeedColumn, centre: int, session: int, n_sessions: int
) -> None:
    marker, colour = _SESSION_LOOKS[session % len(_SESSION_LOOKS)]
    width = 0.76 / n_sessions
    middle = centre - 0.38 + width * (session + 0.5)
    n_raters = len(column.speeds)
    offsets = (np.arange(n_raters) + 0.5) / n_raters - 0.5
    axes.plot(
        middle + 0.9 * width * offsets,
        column.speeds,
        marker,
        color=colour,
        markersize=5,
        alpha=0.9,
    )
    axes.plot(
        [middle - 0.45 * width, middle + 0.45 * width],
        [column.mean, column.mean],
        color=BLACK,
        linewidth=1.6,
    )


def _speed_legend(sessions: Sequence[str]) -> list[Line2D]:
    looks = zip(sessions, _SESSION_LOOKS * len(sessions), strict=False)
    marks = [
        Line2D([], [], marker=marker, color=colour, linestyle="none", label=session)
        for session, (marker, colour) in looks
    ]
    return [*marks, Line2D([], [], color=BLACK, linewidth=1.6, label="mean")]


_PHASE_LOOKS = (
    ("pre-catch", GREY, 0.8, "-"),
    ("catch", VERMILLION, 1.5, "-"),
    ("post-catch", BLUE, 1.0, (0, (4, 1.2))),
)


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
    with _style():
        figure = Figure(figsize=(max(3.4, 0.5 + 2.0 * len(panels)), 4.6))
        grid = figure.subplots(
            2,
            len(panels),
            sharex=True,
            sharey="row",
            squeeze=False,
            height_ratios=(1.5, 1.0),
        )
        for column, panel in enumerate(panels):
            torque_axes, angle_axes = grid[0, column], grid[1, column]
            for time, angle, torque, phase in panel.stretches:
                _by_phase(torque_axes, time, torque, phase)
                _by_phase(angle_axes, time, angle, phase)
            torque_axes.set_title(panel.title)
            torque_axes.grid(axis="y")
            angle_axes.grid(axis="y")
            angle_axes.set_xlabel("time (s)")
        # Limits come last: set before the last stretch they would cut it off.
        grid[0, 0].set_xlim(left=0)
        grid[0, 0].set_ylim(bottom=min(0.0, grid[0, 0].get_ylim()[0]))
        grid[0, 0].set_ylabel("model torque (N·m)")
        grid[1, 0].set_ylabel("elbow angle (deg)")
        figure.align_ylabels(grid[:, 0])
        figure.legend(
            handles=[
                Line2D([], [], color=colour, linewidth=width + 0.5, linestyle=line)
                for _, colour, width, line in _PHASE_LOOKS
            ],
            labels=[name for name, *_ in _PHASE_LOOKS],
            loc="outside lower center",
            ncols=3,
            handlelength=3.0,
        )
        return _finish(figure, stamp)


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
        _, colour, width, line = _PHASE_LOOKS[codes[start]]
        axes.plot(
            time[start:end],
            values[start:end],
            color=colour,
            linewidth=width,
            linestyle=line,
            solid_capstyle="butt",
        )
    for start in starts[1:]:
        _, colour, _, _ = _PHASE_LOOKS[codes[start]]
        axes.plot(time[start], values[start], "o", color=colour, markersize=2.4)


class _style:  # noqa: N801 - used as a context, like a function
    """House style alone: a reader's own matplotlibrc changes nothing."""

    def __enter__(self) -> None:
        self._context = mpl.rc_context()
        self._context.__enter__()
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)

    def __exit__(self, *exception: object) -> None:
        self._context.__exit__(*exception)  # type: ignore[arg-type]


def _finish(figure: Figure, stamp: str) -> Drawn:
    if stamp:
        loud = stamp.isupper()
        # 6.5 pt letters are about 0.05 in wide; a long source goes on two lines
        n_letters = int(figure.get_figwidth() / 0.05) - 2
        figure.suptitle(
            textwrap.fill(stamp, n_letters),
            x=0.995,
            ha="right",
            fontsize=9 if loud else 6.5,
            color=VERMILLION if loud else GREY,
            weight="bold" if loud else "normal",
        )
    png, svg = io.BytesIO(), io.BytesIO()
    FigureCanvasAgg(figure).print_figure(
        png, format="png", dpi=200, metadata={"Software": None}
    )
    FigureCanvasSVG(figure).print_figure(svg, format="svg", metadata={"Date": None})
    return Drawn(png=png.getvalue(), svg=svg.getvalue())

"""Torque or angle against time, of one stretch or of several.

The phases of a stretch are told apart by colour and by style of the line; a dot marks
where one begins that is not the first.
"""

from collections.abc import Sequence
from typing import Any, Literal, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from masrel._input import check_option, refuse
from masrel.plots._style import (
    BLUE,
    GREY,
    PAGE,
    VERMILLION,
    Picture,
    legend_below,
    short_name,
    shown,
)

Quantity = Literal["torque", "angle"]
"""What is drawn against time."""

Against = Quantity | Literal["torque over angle"]
"""What is drawn against time, or against the angle."""
# How far up and across, in points; the point that is named, and its name
_NamePlace = tuple[float, float, tuple[float, float], str]

_LABELS: dict[Quantity, str] = {"torque": "torque (N·m)", "angle": "angle (deg)"}
_CATCH = 1  # position in _PHASES
_LETTERS, _LETTER, _LINE = 6.5, 4.2, 8.5  # points: of a name, its letters, its height

# by code of the phase
_PHASES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("pre-catch", {"color": GREY, "linewidth": 0.8}),
    ("catch", {"color": VERMILLION, "linewidth": 1.5}),
    ("post-catch", {"color": BLUE, "linewidth": 1.0, "linestyle": (0, (4, 1.2))}),
)

Floats = NDArray[np.float64]


class Stretch(Protocol):
    """Columns of one stretch, as `masrel.lab.elbow.trace` returns them."""

    @property
    def time(self) -> Floats: ...  # s
    @property
    def angle(self) -> Floats: ...  # rad
    @property
    def torque(self) -> Floats: ...  # N·m
    @property
    def phase(self) -> NDArray[np.int8]: ...  # code: pre-catch, catch, post-catch


def traces(
    traces: Stretch | Sequence[Stretch],
    *,
    labels: Sequence[str] | None = None,
    quantity: Quantity = "torque",
    ax: Axes | None = None,
) -> Axes:
    """Draw the torque or the angle of stretches against time, phase by phase.

    Parameters
    ----------
    traces : Trace, or sequence of Trace
        What `masrel.lab.elbow.trace` or `masrel.lab.elbow.outline` returns, or anything
        with its ``time`` (s), ``angle`` (rad), ``torque`` (N·m) and ``phase``.
    labels : sequence of str, optional
        What each is called; written at its catch, or at its end without one.
    quantity : {"torque", "angle"}, optional
        What is drawn.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Raises
    ------
    ParameterError
        If there is no trace, or not a label for each.

    Examples
    --------
    >>> from math import radians
    >>> from matplotlib.figure import Figure
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed, trace
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> made = trace(STANDARD_MODELS["HM3"], stretch)
    >>> ax = traces(made, ax=Figure().add_subplot())
    >>> [text.get_text() for text in ax.get_legend().get_texts()]
    ['pre-catch', 'catch', 'post-catch']
    """
    check_option("quantity", quantity, _LABELS)
    several = list(traces) if isinstance(traces, Sequence) else [traces]
    names = list(labels or [])
    refuse(
        (not several, "traces: needs at least one, got none"),
        (
            labels is not None and len(names) != len(several),
            f"labels: needs one for each of {len(several)} traces, got {len(names)}",
        ),
    )
    return shown(traces_picture(several, names, quantity), ax)


def traces_picture(
    stretches: Sequence[Stretch], names: Sequence[str], quantity: Quantity
) -> Picture:
    """Return stretches against time, with their names if they have any."""

    def draw(axes: Axes) -> None:
        draw_traces(axes, stretches, quantity)
        axes.margins(x=0.02, y=0.1)
        if quantity == "torque":
            axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        axes.set_xlabel("time (s)")
        axes.set_ylabel(_LABELS[quantity])
        axes.grid(axis="y")
        name_traces(axes, stretches, quantity, names)
        legend_below(axes, phase_handles(stretches), ncols=3, handlelength=3.0)

    return Picture(5.2, 3.4, draw)


def draw_traces(
    axes: Axes, stretches: Sequence[Stretch], quantity: Against, factor: float = 1.0
) -> None:
    """Draw stretches by lines of a multiple of the usual width."""
    for code, (_, look) in enumerate(_PHASES):
        # One line for all, with a gap wherever a run of the phase ends; a dot where a
        # run begins, but for the first of a stretch.
        runs = [
            (_points(stretch, quantity)[:, run], run.start)
            for stretch in stretches
            for of_run, run in _runs(stretch.phase)
            if of_run == code
        ]
        if runs:
            gap = np.full((2, 1), np.nan)
            line = np.hstack([part for points, _ in runs for part in (points, gap)])
            wide = {**look, "linewidth": factor * look["linewidth"]}
            axes.plot(*line, solid_capstyle="butt", **wide)
            dots = np.hstack([points[:, : bool(start)] for points, start in runs])
            axes.plot(*dots, "o", color=look["color"], markersize=2.4)


def _points(stretch: Stretch, quantity: Against) -> Floats:
    # (2, n_samples): s or deg, and N·m or deg
    angle, is_over_angle = np.degrees(stretch.angle), quantity == "torque over angle"
    values = angle if quantity == "angle" else stretch.torque
    return np.stack([angle if is_over_angle else stretch.time, values])


def _runs(phase: NDArray[np.int8]) -> list[tuple[int, slice]]:
    # code and place of each run of a phase; each begins where the one before ended
    starts = np.flatnonzero(np.diff(phase, prepend=-1)).tolist()
    ends = [start + 1 for start in starts[1:]] + [len(phase)]
    return [
        (int(phase[start]), slice(start, end))
        for start, end in zip(starts, ends, strict=True)
    ]


def phase_handles(stretches: Sequence[Stretch]) -> list[Line2D]:
    """Return what a legend explains; nothing where no phase but the first is met."""
    met = {int(code) for stretch in stretches for code in np.unique(stretch.phase)}
    return [
        Line2D([], [], label=name, **{**look, "linewidth": look["linewidth"] + 0.5})
        for code, (name, look) in enumerate(_PHASES)
        if code in met and met != {0}
    ]


def name_traces(
    axes: Axes, stretches: Sequence[Stretch], quantity: Against, names: Sequence[str]
) -> None:
    """Write names above catches, or beside ends, where none covers another."""
    axes.autoscale_view()  # otherwise done only when it is drawn
    point = axes.figure.dpi / 72.0
    places: list[_NamePlace] = []
    for name, stretch in zip(names, stretches, strict=False):
        # over the angle at the ends: the catches of a model are side by side
        begins = int(np.argmax(stretch.phase == _CATCH)) * (quantity in _LABELS)
        x, y = _points(stretch, quantity)[:, begins or -1]
        across, up = axes.transData.transform((x, y)) / point
        places.append((up, across, (x, y), short_name(name)))
    places.sort(key=lambda place: place[0])
    (_above_catches if quantity in _LABELS else _beside_ends)(axes, places)


def _beside_ends(axes: Axes, places: Sequence[_NamePlace]) -> None:
    lowest = -np.inf
    for up, _, end, name in places:
        lowest = max(up, lowest + _LINE)
        axes.annotate(
            name, end, (4.0, lowest - up), textcoords="offset points",
            ha="left", va="center", fontsize=_LETTERS, color=GREY,
        )  # fmt: skip


def _above_catches(axes: Axes, places: Sequence[_NamePlace]) -> None:
    point = axes.figure.dpi / 72.0
    left, right = axes.bbox.x0 / point, axes.bbox.x1 / point
    taken: list[tuple[float, float, float]] = []  # ends, and bottom, in points
    for up, across, catch, name in places:
        half = 0.5 * _LETTER * len(name) + 1.0
        middle, bottom = min(max(across, left + half), right - half), up + 3.0
        for low, high, other in sorted(taken, key=lambda of: of[2]):
            if (
                low < middle + half
                and middle - half < high
                and abs(other - bottom) < _LINE
            ):
                bottom = other + _LINE
        taken.append((middle - half, middle + half, bottom))
        axes.annotate(
            name, catch, (middle - across, bottom - up), textcoords="offset points",
            ha="center", va="bottom", fontsize=_LETTERS, color=GREY, zorder=5,
            bbox={"facecolor": PAGE, "edgecolor": "none", "alpha": 0.8, "pad": 0.3},
        )  # fmt: skip

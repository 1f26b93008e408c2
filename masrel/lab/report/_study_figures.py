"""Figures of a study: its raters, schedules, grades and speeds, and its trainings."""

import math
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from masrel.lab.analysis import Speed, Speeds
from masrel.lab.report._material import MANY_RATERS
from masrel.lab.schedule.sheets import _OrderBalance
from masrel.plots._grades import counts_picture
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    VERMILLION,
    Picture,
    short_names,
)
from masrel.tables._tables import counted, percent

_UPRIGHT_LETTERS = 7  # of a model's name that fits below a column
_MODELS_IN_A_ROW = 8  # more go into further rows: a page is no wider
_SPREADS = ((0.9, 1.4), (0.5, 6.0))  # share of the speeds, width of its line
_SESSION_LOOKS = (("o", BLUE), ("s", ORANGE), ("^", VERMILLION), ("v", GREY))


def speed_figure(speeds: Speeds, raters: Sequence[str], slowest: float) -> Figure:
    """Return every rater's mean speed, one column a model."""
    # slowest: below it the catch angle stays the same
    models = list(dict.fromkeys(column.name for column in speeds.by_model))
    sessions = list(dict.fromkeys(column.session for column in speeds.by_model))
    is_many = len(raters) > MANY_RATERS
    in_a_row = -(-len(models) // -(-len(models) // _MODELS_IN_A_ROW))  # even rows
    starts = range(0, len(models), in_a_row)
    width = min(8.8, max(4.6, 1.4 + 1.25 * in_a_row))
    figure = Figure(figsize=(width, 0.6 + 2.6 * len(starts)))
    rows = figure.subplots(len(starts), 1, sharey=True, squeeze=False)[:, 0]
    for axes, start in zip(rows, starts, strict=True):
        _speed_row(axes, speeds, raters, models[start : start + in_a_row], sessions)
        _mark_slowest(axes, slowest)
    rows[0].set_ylim(bottom=0)
    label = "haptic model"
    if len(raters) > 1 and not is_many:
        label += f"; in each, raters {raters[0]} to {raters[-1]} from left"
    rows[-1].set_xlabel(label)
    for axes in rows:
        axes.set_ylabel("mean speed before\nthe catch (deg/s)")
    marks = _speed_marks(sessions, is_many=is_many)
    figure.legend(handles=marks, ncols=5, loc="outside lower center")
    return figure


def _speed_marks(sessions: Sequence[str], *, is_many: bool) -> list[Line2D]:
    looks: list[dict[str, Any]] = [
        {"color": colour, "linewidth": 6.0, "label": session}
        if is_many
        else {"marker": marker, "color": colour, "ls": "none", "label": session}
        for session, (marker, colour) in zip(
            sessions, _SESSION_LOOKS * len(sessions), strict=False
        )
    ]
    looks += [
        {"color": GREY, "linewidth": wide, "label": f"middle {percent(share)} %"}
        for share, wide in _SPREADS * is_many
    ]
    looks.append({"color": BLACK, "linewidth": 1.6, "label": "mean"})
    return [Line2D([], [], **look) for look in looks]


def _speed_row(
    axes: Axes,
    speeds: Speeds,
    raters: Sequence[str],
    models: Sequence[str],
    sessions: Sequence[str],
) -> None:
    width = 0.76 / len(sessions)
    for column in (of for of in speeds.by_model if of.name in models):
        place = sessions.index(column.session)
        middle = models.index(column.name) - 0.38 + width * (place + 0.5)
        ends = [middle - 0.45 * width, middle + 0.45 * width]
        axes.plot(ends, [column.mean] * 2, color=BLACK, linewidth=1.6, zorder=2.5)
        key = column.session, column.name
        values = [of for of in speeds.values if (of.session, of.model) == key]
        look = _SESSION_LOOKS[place % len(_SESSION_LOOKS)]
        _draw_speeds(axes, values, raters, (middle, 0.9 * width), look)
    names = short_names(models)
    is_long = max(map(len, names)) > _UPRIGHT_LETTERS
    slanted: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"}
    axes.set_xticks(range(len(models)), names, **slanted if is_long else {})
    axes.set_xlim(-0.55, len(models) - 0.45)
    axes.grid(axis="y")


def _draw_speeds(
    axes: Axes,
    speeds: Sequence[Speed],
    raters: Sequence[str],
    place: tuple[float, float],
    look: tuple[str, str],
) -> None:
    # every rater's above each other, raters from left to right; where most are of many
    (middle, width), (marker, colour) = place, look
    values = [speed.mean_speed_deg_s for speed in speeds]
    if len(raters) > MANY_RATERS:
        for share, wide in _SPREADS:
            ends = np.quantile(values, [0.5 - 0.5 * share, 0.5 + 0.5 * share])
            axes.plot(
                [middle, middle], ends, color=colour, linewidth=wide,
                solid_capstyle="butt", zorder=1.5,
            )  # fmt: skip
        return
    shares = [(raters.index(speed.rater) + 0.5) / len(raters) for speed in speeds]
    places = [middle + width * (share - 0.5) for share in shares]
    axes.plot(places, values, marker, color=colour, markersize=5, alpha=0.9)
    graded = [i for i, speed in enumerate(speeds) if speed.is_graded]
    if graded:
        ringed = [places[i] for i in graded], [values[i] for i in graded]
        axes.plot(*ringed, "o", color=BLACK, markersize=8, fillstyle="none")


def _mark_slowest(axes: Axes, slowest: float) -> None:
    axes.axhline(slowest, color=GREY, linewidth=0.8, linestyle=DASHES)
    # ν_L as two texts: to parse it as mathematics takes as long as to draw the rest
    for letter, size, offset in (("ν", 9.0, (3.0, 0.0)), ("L", 6.5, (8.5, -3.0))):
        axes.annotate(
            letter,
            (1.0, slowest),
            xycoords=("axes fraction", "data"),
            xytext=offset,
            textcoords="offset points",
            va="center",
            color=GREY,
            fontsize=size,
            style="italic",
        )


_WIDTH_IN, _STEP_IN, _LINE_IN = 6.2, 0.62, 0.16
_N_LETTERS = 52  # in a line of the others
# the middle of the boxes on the way, and the left edge of the others
_BOXES: tuple[dict[str, Any], ...] = (
    {"x": 0.2, "ha": "center", "fontsize": 9},
    {"x": 0.45, "ha": "left", "fontsize": 8},
)


def flow_figure(steps: Sequence[tuple[str, Sequence[str]]]) -> Figure:
    """Return a box for every step, and beside it what became of the others."""
    texts = [
        [line for text in others for line in textwrap.wrap(text, _N_LETTERS)]
        for _, others in steps
    ]
    heights = [max(_STEP_IN, 0.3 + _LINE_IN * len(lines)) for lines in texts]
    figure = Figure(figsize=(_WIDTH_IN, sum(heights) + 0.2))
    axes = figure.add_subplot()
    axes.set_axis_off()
    axes.set(xlim=(0.0, 1.0), ylim=(sum(heights), 0.0))
    top, before = 0.0, None
    for (label, _), lines, height in zip(steps, texts, heights, strict=True):
        middle = top + height / 2
        shown = ((label, BLACK), ("\n".join(lines), GREY))
        for place, (text, colour) in zip(_BOXES, shown, strict=True):
            box: dict[str, Any] = {"boxstyle": "square,pad=0.4", "facecolor": "white"}
            box |= {"edgecolor": colour, "linewidth": 0.8}
            if text:
                axes.text(y=middle, s=text, va="center", bbox=box, **place)
        if before is not None:
            axes.annotate(
                "",
                xy=(0.2, middle - 0.17),
                xytext=(0.2, before + 0.17),
                arrowprops={"arrowstyle": "->", "color": BLACK, "linewidth": 0.8},
            )
        top, before = top + height, middle
    return figure


def order_pictures(panels: Sequence[_OrderBalance]) -> list[tuple[str, Picture]]:
    """Return two tables a session: models by places, and by what came right after."""
    pictures = []
    for panel in panels:
        of = ", ".join(filter(None, (panel.session, panel.site)))
        title = f"{of}: {counted(panel.n_schedules, 'schedule')}"
        places = [str(place) for place in range(1, panel.n_places + 1)]
        for text, columns, freqs, name in (
            (title, places, panel.places, "place"),
            ("", panel.models, panel.pairs, "model right after"),
        ):
            counts = np.array(freqs, dtype=np.int64)
            rows = (counts, panel.models, columns, np.zeros_like(counts))
            pictures.append((text, counts_picture(*rows, ("model", name))))
    return pictures


def learning_figure(
    title: str,
    kappas: Sequence[tuple[float, float, float, float]],
    level: float,
    bounds: tuple[float, float],
    differences: Sequence[int],
) -> Figure:
    """Return kappa time and again, and below it how far each grade was off."""
    # kappas: number of the last presentation, kappa, and the ends of its interval at
    # the level; bounds: insufficient and sufficient kappa; differences: by how many
    # grades each grade is too high
    figure = Figure(figsize=(6.0, 4.2))
    upper, lower = figure.subplots(2, sharex=True, height_ratios=(2.2, 1.0))
    upper.set_title(title, loc="left")
    for bound, word in zip(bounds, ("insufficient", "sufficient"), strict=True):
        upper.axhline(bound, color=GREY, linewidth=0.8, linestyle=DASHES, zorder=1.0)
        upper.annotate(
            word, (1.0, bound), xycoords=("axes fraction", "data"), xytext=(4, 0),
            textcoords="offset points", va="center", fontsize=7.5, color=GREY,
        )  # fmt: skip
    position, value, low, high = np.array(kappas, dtype=np.float64).reshape(-1, 4).T
    label = f"{percent(level)} % interval"
    upper.vlines(position, low, high, color=BLUE, linewidth=1.8, label=label)
    upper.plot(position, value, "o-", color=BLACK, markersize=5, label="weighted κ")
    lowest = np.nanmin([0.0, *low, *value])
    upper.set_ylim(max(-1.0, math.floor(10.0 * lowest) / 10.0) - 0.02, 1.03)
    upper.set_ylabel("κ with the intended grades")
    upper.grid(axis="y")
    _draw_differences(lower, np.array(differences, dtype=np.int64))
    figure.legend(loc="outside lower center", ncols=5, fontsize=8)
    return figure


def _draw_differences(axes: Axes, differences: Any) -> None:
    places = np.arange(1, len(differences) + 1)
    for at, colour, marker, label in (
        (differences == 0, BLUE, "o", "right"),
        (differences != 0, VERMILLION, "X", "wrong"),
    ):
        if at.any():
            axes.plot(
                places[at], differences[at], linestyle="none", marker=marker,
                markersize=4.5, color=colour, label=label,
            )  # fmt: skip
    axes.axhline(0.0, color=GREY, linewidth=0.7, zorder=1.0)
    axes.set(xlabel="presentation", ylabel="grades too high")
    axes.set_xlim(0.0, len(differences) + 1.0)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
    axes.margins(y=0.2)

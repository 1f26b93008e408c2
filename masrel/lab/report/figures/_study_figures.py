"""Figures of a study's report: grades and speeds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from masrel.lab.analysis._given_grades import GivenGrades
from masrel.lab.report._figure_data import MANY_RATERS, SpeedColumn
from masrel.plots._grades import categories_picture, counts_picture
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    VERMILLION,
    Picture,
    short_name,
)
from masrel.tables._tables import percent

_UPRIGHT_LETTERS = 7  # of a model's name that fits below a column

_MODELS_IN_A_ROW = 8  # more go into further rows: a page is no wider
_SPREADS = ((0.9, 1.4), (0.5, 6.0))  # share of the speeds, width of its line
_SESSION_LOOKS = (("o", BLUE), ("s", ORANGE), ("^", VERMILLION), ("v", GREY))


def aim_pictures(
    rows: Sequence[GivenGrades], grades: Sequence[str], level: float
) -> list[tuple[str, Picture]]:
    """Return grades by intended ones, and below them the part as intended."""
    aims = [row.intended for row in rows]
    counts = np.array([row.counts for row in rows])
    framed = np.array([[grade == aim for grade in grades] for aim in aims])
    names = "intended grade", "grade given"
    value, low, high = np.array([(row.share, row.low, row.high) for row in rows]).T
    shares = value, low, high, counts.sum(axis=1), aims, level
    label = "part of the grades that is the intended one"
    return [
        ("", counts_picture(counts, aims, grades, framed, names)),
        ("", categories_picture(*shares, label)),
    ]


def speed_figure(
    columns: Sequence[SpeedColumn], raters: Sequence[str], slowest: float
) -> Figure:
    """Return every rater's mean speed, one column a model."""
    # columns by session and model; slowest: below it the catch angle stays the same
    models = list(dict.fromkeys(column.model for column in columns))
    sessions = list(dict.fromkeys(column.session for column in columns))
    is_many = len(raters) > MANY_RATERS
    in_a_row = -(-len(models) // -(-len(models) // _MODELS_IN_A_ROW))  # even rows
    starts = range(0, len(models), in_a_row)
    width = min(8.8, max(4.6, 1.4 + 1.25 * in_a_row))
    figure = Figure(figsize=(width, 0.6 + 2.6 * len(starts)))
    rows = figure.subplots(len(starts), 1, sharey=True, squeeze=False)[:, 0]
    for axes, start in zip(rows, starts, strict=True):
        shown = models[start : start + in_a_row]
        _speed_row(axes, columns, shown, sessions, is_many=is_many)
        _mark_slowest(axes, slowest)
    rows[0].set_ylim(bottom=0)
    label = "haptic model"
    if len(raters) > 1 and not is_many:
        label += f"; in each, raters {raters[0]} to {raters[-1]} from left"
    rows[-1].set_xlabel(label)
    for axes in rows:
        axes.set_ylabel("mean speed before\nthe catch (deg/s)")
    marks = _speed_marks(sessions, has_many=is_many)
    figure.legend(handles=marks, ncols=5, loc="outside lower center")
    return figure


def _speed_marks(sessions: Sequence[str], *, has_many: bool) -> list[Line2D]:
    looks = zip(sessions, _SESSION_LOOKS * len(sessions), strict=False)
    marks = [
        Line2D([], [], color=colour, linewidth=6.0, label=session)
        if has_many
        else Line2D([], [], marker=marker, color=colour, ls="none", label=session)
        for session, (marker, colour) in looks
    ]
    if has_many:
        marks += [
            Line2D(
                [], [], color=GREY, linewidth=wide, label=f"middle {percent(share)} %"
            )
            for share, wide in _SPREADS
        ]
    return [*marks, Line2D([], [], color=BLACK, linewidth=1.6, label="mean")]


def _speed_row(
    axes: Axes,
    columns: Sequence[SpeedColumn],
    models: Sequence[str],
    sessions: Sequence[str],
    *,
    is_many: bool,
) -> None:
    width = 0.76 / len(sessions)
    for column in columns:
        if column.model not in models:
            continue
        session = sessions.index(column.session)
        middle = models.index(column.model) - 0.38 + width * (session + 0.5)
        marker, colour = _SESSION_LOOKS[session % len(_SESSION_LOOKS)]
        ends = [middle - 0.45 * width, middle + 0.45 * width]
        axes.plot(ends, [column.mean] * 2, color=BLACK, linewidth=1.6, zorder=2.5)
        if is_many:
            _draw_spread(axes, column, middle, colour)
            continue
        axes.plot(
            *_strip(column.speeds, middle, width), marker, color=colour, markersize=5,
            alpha=0.9,
        )  # fmt: skip
        if any(column.graded):
            axes.plot(
                *_strip(column.graded, middle, width), "o", color=BLACK, markersize=8,
                fillstyle="none",
            )  # fmt: skip
    names = [short_name(model) for model in models]
    is_long = max(map(len, names)) > _UPRIGHT_LETTERS
    slanted: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"}
    axes.set_xticks(range(len(models)), names, **slanted if is_long else {})
    axes.set_xlim(-0.55, len(models) - 0.45)
    axes.grid(axis="y")


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


def _draw_spread(axes: Axes, column: SpeedColumn, middle: float, colour: str) -> None:
    # where most of many speeds are
    every = [speed for of_rater in column.speeds for speed in of_rater]
    for share, wide in _SPREADS:
        ends = np.quantile(every, [0.5 - 0.5 * share, 0.5 + 0.5 * share])
        axes.plot(
            [middle, middle], ends, color=colour, linewidth=wide,
            solid_capstyle="butt", zorder=1.5,
        )  # fmt: skip


def _strip(
    speeds: Sequence[Sequence[float]], middle: float, width: float
) -> tuple[list[float], list[float]]:
    # every rater's speeds above each other, raters from left to right
    n_raters = len(speeds)
    places = [
        middle + 0.9 * width * ((rater + 0.5) / n_raters - 0.5)
        for rater, of_rater in enumerate(speeds)
        for _ in of_rater
    ]
    return places, [speed for of_rater in speeds for speed in of_rater]

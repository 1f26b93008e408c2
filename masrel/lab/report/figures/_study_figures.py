"""Figures of a study's report: grades and speeds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from masrel.lab.report._figure_data import (
    MANY_RATERS,
    GradeCounts,
    GradeGrid,
    GradesByAim,
    SpeedColumn,
)
from masrel.plots._cells import cells, name_columns
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    SEQUENTIAL,
    VERMILLION,
    short_name,
)
from masrel.tables._tables import percent

_INTENDED_X = -1.3  # where intended grades stand; raters are at 0, 1, 2, ...
_SHADES = LinearSegmentedColormap.from_list("grades", ["#F2F6FA", "#7FB6DA", "#003A5D"])

_UPRIGHT_LETTERS = 7  # of a rater's name, or a grade's, that fits above a column

_MOST_NUMBERS = 20  # grades up to which counts are written in the cells

_MODELS_IN_A_ROW = 8  # more go into further rows: a page is no wider
_SPREADS = ((0.9, 1.4), (0.5, 6.0))  # share of the speeds, width of its line
_SESSION_LOOKS = (("o", BLUE), ("s", ORANGE), ("^", VERMILLION), ("v", GREY))


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
    raters = [short_name(rater) for rater in grid.raters]
    axes.set_xticks([_INTENDED_X, *range(n_columns)], ["intended", *raters])
    axes.set_yticks(range(n_rows), [short_name(model) for model in grid.models])
    axes.tick_params(length=0)
    axes.xaxis.tick_top()
    if n_columns > 12 or max(map(len, raters)) > _UPRIGHT_LETTERS:
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


def count_figure(content: GradeCounts) -> Figure:
    """Return how often each model was given each grade, as shaded cells."""
    n_rows, n_columns = len(content.models), len(content.scale)
    size = (1.3 + min(7.4, 0.62 * n_columns), 0.9 + 0.3 * n_rows)
    figure = Figure(figsize=size)
    axes = figure.add_subplot()
    _draw_counts(axes, content.counts, content.intended, content.scale)
    axes.set_yticks(range(n_rows), [short_name(model) for model in content.models])
    axes.set_xlabel("grade given; framed: the intended grade")
    return figure


def aim_figure(content: GradesByAim) -> Figure:
    """Return grades by intended ones, and beside each row the part as intended."""
    n_rows, n_columns = len(content.intended), len(content.scale)
    across = min(5.4, 0.6 * n_columns)
    figure = Figure(figsize=(1.2 + across + 2.4, 0.95 + 0.36 * n_rows))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(across, 2.2))
    _draw_counts(left, content.counts, content.intended, content.scale)
    left.set_yticks(range(n_rows), content.intended)
    left.set_ylabel("intended grade")
    left.set_xlabel("grade given; framed: as intended")
    for row, share in enumerate(content.shares):
        value, *ends = (100.0 * part for part in share)
        right.plot(ends, [row, row], color=BLUE, linewidth=1.8, marker="|")
        right.plot([value], [row], "o", color=BLACK, markersize=5)
    right.set_xlim(-3.0, 103.0)
    right.set_xticks([0, 25, 50, 75, 100])
    right.set_xlabel("as intended (%)")
    right.tick_params(axis="y", length=0, labelleft=False)
    right.spines["left"].set_visible(False)
    right.grid(axis="x")
    return figure


def _draw_counts(
    axes: Axes,
    rows: Sequence[Sequence[int]],
    intended: Sequence[str | None],
    scale: Sequence[str],
) -> None:
    # rows: how often each grade of the scale was given
    n_rows, n_columns = len(rows), len(scale)
    counts = np.array(rows, dtype=np.int64).reshape(n_rows, n_columns)
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    is_few = n_columns <= _MOST_NUMBERS
    letters = np.where(is_few & (counts > 0), counts.astype(str), "")
    framed = np.array([[grade == aim for grade in scale] for aim in intended])
    look: dict[str, Any] = {"cmap": SEQUENTIAL, "vmin": 0.0, "vmax": 1.0}
    cells(axes, shares, letters, framed=framed, **look)
    name_columns(axes, scale, min(0.6, 7.0 / n_columns), range(n_columns))
    axes.tick_params(axis="y", length=0)


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

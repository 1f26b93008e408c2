"""Every rater's mean speed for every model."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from masrel.report.figures.style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    VERMILLION,
    Drawn,
    finish,
    house_style,
)

__all__ = ["SpeedColumn", "draw_speeds"]

MODELS_IN_A_ROW = 8
"""More models go into further rows: a page is no wider."""

_SESSION_LOOKS = (("o", BLUE), ("s", ORANGE), ("^", VERMILLION), ("v", GREY))


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedColumn:
    """Speeds of one model in one session, deg/s.

    Attributes
    ----------
    model, session : str
        Where they were made.
    speeds : tuple of tuple of float
        Those of every rater, in the raters' order; none is missing.
    mean : float
        Their mean.
    """

    model: str
    session: str
    speeds: tuple[tuple[float, ...], ...]
    mean: float


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
    starts = range(0, len(models), MODELS_IN_A_ROW)
    width = min(8.8, max(4.6, 1.4 + 1.25 * len(models[:MODELS_IN_A_ROW])))
    with house_style():
        figure = Figure(figsize=(width, 0.6 + 2.6 * len(starts)))
        rows = figure.subplots(len(starts), 1, sharey=True, squeeze=False)[:, 0]
        for axes, start in zip(rows, starts, strict=True):
            here = models[start : start + MODELS_IN_A_ROW]
            shown = [column for column in columns if column.model in here]
            _row(axes, shown, here, sessions, slowest)
        rows[0].set_ylim(bottom=0)
        rows[-1].set_xlabel(_axis_label(raters))
        figure.supylabel("mean speed before the catch (deg/s)", fontsize=9)
        handles = _legend(sessions)
        figure.legend(handles=handles, ncols=5, loc="outside lower center")
        return finish(figure, stamp)


def _axis_label(raters: Sequence[str]) -> str:
    if len(raters) < 2:
        return "haptic model"
    return f"haptic model; in each, raters {raters[0]} to {raters[-1]} from left"


def _row(
    axes: Axes,
    columns: Sequence[SpeedColumn],
    models: Sequence[str],
    sessions: Sequence[str],
    slowest: float,
) -> None:
    for column in columns:
        look = sessions.index(column.session)
        _column(axes, column, models.index(column.model), look, len(sessions))
    axes.axhline(slowest, color=GREY, linewidth=0.8, linestyle=DASHES)
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
    axes.grid(axis="y")


def _column(
    axes: Axes, column: SpeedColumn, centre: int, session: int, n_sessions: int
) -> None:
    marker, colour = _SESSION_LOOKS[session % len(_SESSION_LOOKS)]
    width = 0.76 / n_sessions
    middle = centre - 0.38 + width * (session + 0.5)
    n_raters = len(column.speeds)
    for rater, speeds in enumerate(column.speeds):
        place = middle + 0.9 * width * ((rater + 0.5) / n_raters - 0.5)
        places = [place] * len(speeds)
        axes.plot(places, speeds, marker, color=colour, markersize=5, alpha=0.9)
    ends = [middle - 0.45 * width, middle + 0.45 * width]
    axes.plot(ends, [column.mean, column.mean], color=BLACK, linewidth=1.6)


def _legend(sessions: Sequence[str]) -> list[Line2D]:
    looks = zip(sessions, _SESSION_LOOKS * len(sessions), strict=False)
    marks = [
        Line2D([], [], marker=marker, color=colour, linestyle="none", label=session)
        for session, (marker, colour) in looks
    ]
    return [*marks, Line2D([], [], color=BLACK, linewidth=1.6, label="mean")]

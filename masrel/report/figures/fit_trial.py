"""Fast trials with their phases and the law, in the manner of Figs. 2 and 4."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.results import ElbowFit
from masrel.elbow.identification.trials import Trial
from masrel.report._tables import number
from masrel.report.figures.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    Drawn,
    finish,
    house_style,
)

__all__ = ["draw_fast_trials"]

MOST_COLUMNS = 3


def draw_fast_trials(fit: ElbowFit, *, stamp: str) -> Drawn:
    """Draw torque, angle and speed of fast trials: slowest, middle and fastest."""
    fast = [
        (trial.catch.mean_speed, i)
        for i, trial in enumerate(fit.trials)
        if trial.catch is not None and trial.after is not None
    ]
    ordered = [place for _, place in sorted(fast)]
    picked = sorted({0, len(ordered) // 2, len(ordered) - 1})
    with house_style():
        figure = Figure(figsize=(0.8 + 2.15 * max(2, len(picked)), 4.9))
        grid = figure.subplots(
            3,
            len(picked),
            sharex=True,
            sharey="row",
            squeeze=False,
            height_ratios=(1.8, 1.0, 1.0),
        )
        for column, pick in enumerate(picked):
            _trial(grid[:, column].tolist(), fit, ordered[pick])
        for axes, label in zip(
            grid[:, 0], ("torque (N·m)", "angle (deg)", "speed (deg/s)"), strict=True
        ):
            axes.set_ylabel(label)
        for axes in grid[2]:
            axes.set_xlabel("time in the stretch (s)")
            axes.set_ylim(bottom=0.0)
        _legend(figure, grid[0].tolist())
        return finish(figure, stamp)


def _legend(figure: Figure, row: list[Axes]) -> None:
    shown: dict[str, Artist] = {}  # not every trial has every phase
    for axes in row:
        handles, labels = axes.get_legend_handles_labels()
        shown.update(zip(labels, handles, strict=True))
    figure.legend(
        list(shown.values()), list(shown), loc="outside lower center", ncols=4
    )


def _trial(column: list[Axes], fit: ElbowFit, place: int) -> None:
    trial = fit.trials[place]
    catch, after, pre = trial.catch, trial.after, trial.pre_catch
    if catch is None or after is None:
        return
    top, middle, bottom = column
    time = np.concatenate([pre.time, after.time]) - trial.start
    measured = np.concatenate([pre.measured, after.measured])
    torques = np.stack([measured, fit.fitted_torque[place]])
    _torque(top, np.split(time, [pre.time.size]), np.split(torques, [pre.time.size], 1))
    angle = np.concatenate([pre.angle, after.angle])
    speed = np.concatenate([pre.velocity, after.velocity])
    middle.plot(time, np.degrees(angle), color=BLACK, linewidth=1.0)
    bottom.plot(time, np.degrees(speed), color=BLACK, linewidth=1.0)
    for axes in column:
        _shade(axes, trial, catch, float(time[-1]))
    top.set_title(f"mean speed {number(math.degrees(catch.mean_speed), 0)} deg/s")


def _torque(
    axes: Axes,
    times: Sequence[NDArray[np.float64]],
    torques: Sequence[NDArray[np.float64]],
) -> None:
    # measured and fitted, before the catch and from it on: no line joins the two
    for first, time, (measured, law) in zip((True, False), times, torques, strict=True):
        axes.plot(
            time,
            measured,
            color=GREY,
            linewidth=0.6,
            label="measured" if first else None,
        )
        axes.plot(
            time,
            law,
            color=BLACK,
            linewidth=1.3,
            linestyle=(0, (5, 1.5)),
            label="law, fitted" if first else None,
        )


def _shade(axes: Axes, trial: Trial, catch: Catch, last: float) -> None:
    begin = catch.time - trial.start
    end = last if catch.end is None else catch.end - trial.start
    axes.axvspan(begin, end, color=ORANGE, alpha=0.35, linewidth=0.0, label="catch")
    if catch.end is not None:
        axes.axvspan(
            end, last, color=BLUE, alpha=0.15, linewidth=0.0, label="post-catch"
        )
        axes.axvline(end, color=GREY, linewidth=0.7)
    axes.axvline(begin, color=GREY, linewidth=0.7)

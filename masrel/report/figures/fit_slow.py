"""Slow trials beside the law of (1), in the manner of the source's Fig. 3."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from masrel.elbow.identification.results import ElbowFit
from masrel.report._tables import number
from masrel.report.figures.style import (
    BLACK,
    GREY,
    Drawn,
    finish,
    house_style,
)

__all__ = ["draw_slow_trials"]

MOST_COLUMNS = 4


def draw_slow_trials(fit: ElbowFit, *, stamp: str) -> Drawn:
    """Draw measured torque and (1) against time, one column a slow trial."""
    slow = [i for i, trial in enumerate(fit.trials) if trial.pace == "slow"]
    sizes = {i: fit.trials[i].pre_catch.time.size for i in slow}
    shown = sorted(sorted(slow, key=lambda i: -sizes[i])[:MOST_COLUMNS])
    with house_style():
        figure = Figure(figsize=(max(3.4, 0.6 + 1.7 * len(shown)), 3.7))
        grid = figure.subplots(
            2,
            len(shown),
            sharex=True,
            sharey="row",
            squeeze=False,
            height_ratios=(1.6, 1.0),
        )
        for column, place in enumerate(shown):
            _trial(grid[0, column], grid[1, column], fit, place)
        grid[0, 0].set_ylabel("torque (N·m)")
        grid[1, 0].set_ylabel("speed (deg/s)")
        for axes in grid[1]:
            axes.set_xlabel("time (s)")
            axes.set_ylim(bottom=0.0)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        return finish(figure, stamp)


def _trial(top: Axes, bottom: Axes, fit: ElbowFit, place: int) -> None:
    trial = fit.trials[place]
    part = trial.pre_catch
    time = part.time - part.time[0]
    law = fit.fitted_torque[place]
    top.plot(time, part.measured, color=GREY, linewidth=0.5, label="measured")
    top.plot(
        time,
        law,
        color=BLACK,
        linewidth=1.5,
        linestyle=(0, (5, 1.5)),
        label="b·θ̇ + k·θ, fitted",
    )
    size = float(np.abs(part.measured).mean())
    error = float(np.abs(part.measured - law).mean()) / size
    top.set_title(f"mean error {number(100.0 * error, 1)} %")
    bottom.plot(time, np.degrees(part.velocity), color=BLACK, linewidth=1.0)

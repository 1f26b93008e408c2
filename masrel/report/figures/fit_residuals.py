"""What a fit leaves over: torque of slow and of fast trials, and catch angles."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from masrel.elbow.identification.results import ElbowFit
from masrel.report.figures.style import (
    BLACK,
    GREY,
    Drawn,
    finish,
    house_style,
)

__all__ = ["draw_residuals"]

BINS = 40


def draw_residuals(fit: ElbowFit, *, stamp: str) -> Drawn:
    """Draw residual torque against angle and time, and residual catch angles."""
    has_line = not math.isnan(fit["catch_slope"].value)
    n_panels = 1 + any(t.after is not None for t in fit.trials) + has_line
    with house_style():
        figure = Figure(figsize=(0.4 + 2.3 * max(n_panels, 1.5), 2.7))
        grid = figure.subplots(1, n_panels, squeeze=False)[0].tolist()
        _slow(grid.pop(0), fit)
        if any(trial.after is not None for trial in fit.trials):
            _fast(grid.pop(0), fit)
        if has_line:
            _angles(grid.pop(0), fit)
        return finish(figure, stamp)


def _slow(axes: Axes, fit: ElbowFit) -> None:
    x, y = [], []
    for trial, law in zip(fit.trials, fit.fitted_torque, strict=True):
        if trial.pace == "slow":
            x.append(np.degrees(trial.pre_catch.angle))
            y.append(trial.pre_catch.measured - law)
    _cloud(axes, np.concatenate(x), np.concatenate(y))
    axes.set_title("slow trials")
    axes.set_xlabel("angle (deg)")
    axes.set_ylabel("measured − fitted (N·m)")


def _fast(axes: Axes, fit: ElbowFit) -> None:
    x, y = [], []
    for trial, law in zip(fit.trials, fit.fitted_torque, strict=True):
        if trial.catch is not None and trial.after is not None:
            pre, after = trial.pre_catch, trial.after
            time = np.concatenate([pre.time, after.time])
            x.append(time - trial.catch.time)
            y.append(np.concatenate([pre.measured, after.measured]) - law)
    _cloud(axes, np.concatenate(x), np.concatenate(y))
    axes.axvline(0.0, color=BLACK, linewidth=0.7, linestyle=(0, (1, 1.5)))
    axes.set_title("fast trials")
    axes.set_xlabel("time since the catch (s)")
    axes.set_ylabel("measured − fitted (N·m)")


def _cloud(
    axes: Axes,
    x: "np.ndarray[tuple[int], np.dtype[np.float64]]",
    y: "np.ndarray[tuple[int], np.dtype[np.float64]]",
) -> None:
    every = max(1, x.size // 6000)  # more points than a print resolves say nothing
    axes.plot(
        x[::every],
        y[::every],
        linestyle="none",
        marker=".",
        markersize=1.2,
        color=GREY,
        alpha=0.35,
        rasterized=True,
    )
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    count = np.bincount(which, minlength=BINS)
    total = np.bincount(which, weights=y, minlength=BINS)
    full = count >= 20
    middle = 0.5 * (edges[1:] + edges[:-1])
    mean = np.where(full, total / np.maximum(count, 1), np.nan)  # a gap stays one
    axes.plot(middle, mean, color=BLACK, linewidth=1.4)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    reach = 1.05 * float(np.quantile(np.abs(y), 0.999))
    axes.set_ylim(-reach, reach)


def _angles(axes: Axes, fit: ElbowFit) -> None:
    line, slope = fit["catch_angle_constant"].value, fit["catch_slope"].value
    catches = [trial.catch for trial in fit.trials if trial.catch is not None]
    speeds = np.array([catch.mean_speed for catch in catches])
    held = np.maximum(speeds, fit.constants.slowest_mean_speed)
    law = np.maximum(line - slope * held, fit.constants.smallest_catch_angle)
    left = np.degrees(np.array([catch.angle for catch in catches]) - law)
    axes.plot(np.degrees(speeds), left, "o", color=BLACK, markersize=3.5)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    reach = 1.2 * float(np.abs(left).max()) or 1.0
    axes.set_ylim(-reach, reach)
    axes.set_title("catch angles")
    axes.set_xlabel("mean speed (deg/s)")
    axes.set_ylabel("measured − fitted (deg)")

"""What a fitted joint leaves over of its recordings, and what they say of its laws.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1) to (6).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.lab.elbow.identification import ElbowFit
from masrel.lab.elbow.identification._catches import (
    Catch,
    CatchLevels,
    Law,
    catch_levels,
)

Floats = NDArray[np.float64]

_BEFORE_CATCH = ("damping", "stiffness", "inertia")


def slow_error(fit: ElbowFit, place: int) -> float:
    """Return the mean distance of a slow trial from (1), over its mean torque."""
    measured = fit.trials[place].pre_catch.measured
    size = float(np.abs(measured).mean())
    return float(np.abs(measured - fit.fitted_torque[place]).mean()) / size


def slow_residuals(fit: ElbowFit) -> tuple[Floats, Floats]:
    """Return the angles (rad) of all slow samples, and measured - fitted torque."""
    x, y = [], []
    for trial, law in zip(fit.trials, fit.fitted_torque, strict=True):
        if trial.pace == "slow":
            x.append(trial.pre_catch.angle)
            y.append(trial.pre_catch.measured - law)
    return np.concatenate(x), np.concatenate(y)


def fast_residuals(fit: ElbowFit) -> tuple[Floats, Floats]:
    """Return times since the catch of all fast samples, and measured - fitted."""
    x, y = [], []
    for trial, law in zip(fit.trials, fit.fitted_torque, strict=True):
        if trial.catch is not None and trial.after is not None:
            pre, after = trial.pre_catch, trial.after
            x.append(np.concatenate([pre.time, after.time]) - trial.catch.time)
            y.append(np.concatenate([pre.measured, after.measured]) - law)
    return np.concatenate(x), np.concatenate(y)


def binned_means(
    x: Floats, y: Floats, n_bins: int, min_count: int
) -> tuple[Floats, Floats]:
    """Return middles of bins of x and the means of y in them, each (n_bins,)."""
    edges = np.linspace(x.min(), x.max(), n_bins + 1)
    bins = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, n_bins - 1)
    count = np.bincount(bins, minlength=n_bins)
    total = np.bincount(bins, weights=y, minlength=n_bins)
    means = np.where(count >= min_count, total / np.maximum(count, 1), np.nan)
    return 0.5 * (edges[1:] + edges[:-1]), means  # a bin of too few has no mean


def catch_angle_law(fit: ElbowFit, mean_speed: Floats) -> Floats:
    """Return the fitted catch angles (rad) of mean speeds (rad/s)."""
    constant, slope = fit["catch_angle_constant"].value, fit["catch_slope"].value
    constants = fit.constants
    law = constant - slope * np.maximum(mean_speed, constants.slowest_mean_speed)  # (2)
    return np.maximum(law, constants.smallest_catch_angle)  # (6)


def catches(fit: ElbowFit) -> list[Catch]:
    """Return the catches of all trials that have one."""
    return [trial.catch for trial in fit.trials if trial.catch is not None]


def catch_readings(fit: ElbowFit) -> list[tuple[Catch, CatchLevels]]:
    """Return the catches whose peak and residual of (3) can be read off the torque."""
    values = {e.name: e.value for e in fit.estimates}
    held: dict[str, Any] = {
        name: values[name] if term == "fitted" else term
        for name, term in fit.arm.items()
        if name not in ("offset", "drift") and term != "off"
    }
    joint: dict[str, Any] = {n: values[n] for n in _BEFORE_CATCH if n in values}
    names = [trial.name for trial in fit.trials]
    drifts = dict(zip(names, fit.drifts, strict=True))
    law = Law(**joint, **held, drifts=drifts)
    readings = []
    for trial in fit.trials:
        levels = catch_levels(trial, law, fit.constants)
        if trial.catch is not None and levels is not None:
            readings.append((trial.catch, levels))
    return readings

"""What the catches of all trials say of L and α, D, H and Q, as in Fig. 5."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.law import PreCatchLaw
from masrel.elbow.identification.levels import CatchLevels, catch_levels
from masrel.elbow.identification.quantities import QUANTITIES
from masrel.elbow.identification.results import ElbowFit
from masrel.report._tables import interval_text, number
from masrel.report.figures.style import (
    BLACK,
    BLUE,
    GREY,
    Drawn,
    finish,
    house_style,
)

__all__ = ["draw_catches"]

_DOT: dict[str, Any] = {
    "marker": "o",
    "linestyle": "none",
    "color": BLACK,
    "markersize": 3.5,
}
_OPEN: dict[str, Any] = {
    "marker": "^",
    "linestyle": "none",
    "color": GREY,
    "markersize": 4.5,
    "fillstyle": "none",
}


def draw_catches(fit: ElbowFit, *, stamp: str) -> Drawn:
    """Draw catch angle, travel, peak and residual of every trial with their laws.

    Parameters
    ----------
    fit : ElbowFit
        A fit with at least one catch.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    Drawn
        The figure's files.
    """
    catches = [trial.catch for trial in fit.trials if trial.catch is not None]
    pairs = _levels(fit)
    with house_style():
        figure = Figure(figsize=(6.7, 5.4))
        grid = figure.subplots(2, 2)
        _angles(grid[0, 0], fit, catches)
        _travels(grid[0, 1], fit, catches)
        _peaks(grid[1, 0], fit, pairs)
        _residuals(grid[1, 1], fit, pairs)
        for letter, axes in zip("abcd", grid.flat, strict=True):
            axes.annotate(
                letter,
                (0.0, 1.0),
                (-30, 8),
                xycoords="axes fraction",
                textcoords="offset points",
                weight="bold",
            )
        return finish(figure, stamp)


def _levels(fit: ElbowFit) -> list[tuple[Catch, CatchLevels]]:
    values = {e.name: e.value for e in fit.estimates}
    law = PreCatchLaw(
        damping=values["damping"],
        stiffness=values["stiffness"],
        inertia=values.get("inertia", 0.0),
    )
    made = []
    for trial in fit.trials:
        levels = catch_levels(trial, law, fit.constants)
        if trial.catch is not None and levels is not None:
            made.append((trial.catch, levels))
    return made


def _said(fit: ElbowFit, name: str, digits: int) -> str:
    estimate, quantity = fit[name], QUANTITIES[name]
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    if math.isnan(estimate.value):
        return f"{quantity.symbol} not determined"
    value = estimate.value * quantity.factor
    said = f"{quantity.symbol} = {number(value, digits)}"
    above, below = estimate.high - estimate.value, estimate.value - estimate.low
    if math.isclose(above, below, rel_tol=1e-9):
        return f"{said} ± {number(above * quantity.factor, digits)}{unit}"
    said += unit
    if not math.isnan(estimate.standard_error):
        ends = estimate.low * quantity.factor, estimate.high * quantity.factor
        said += f" {interval_text(*ends, digits)}"
    return said


def _angles(axes: Axes, fit: ElbowFit, catches: list[Catch]) -> None:
    speeds = np.degrees([catch.mean_speed for catch in catches])
    angles = np.degrees([catch.angle for catch in catches])
    axes.plot(speeds, angles, **_DOT)
    line, slope = fit["catch_angle_constant"], fit["catch_slope"]
    title = _said(fit, "catch_angle_constant", 1)
    if not math.isnan(line.value + slope.value):
        low, high = speeds.min() - 5.0, speeds.max() + 5.0
        at = np.linspace(low, high, 400)
        held = math.degrees(fit.constants.slowest_mean_speed)
        law = math.degrees(line.value) - slope.value * np.maximum(at, held)
        law = np.maximum(law, math.degrees(fit.constants.smallest_catch_angle))
        axes.plot(at, law, color=BLUE, linewidth=1.4)
        title += f"\n{_said(fit, 'catch_slope', 3)}"
    axes.set_title(title)
    axes.set_xlabel("mean speed before the catch (deg/s)")
    axes.set_ylabel("catch angle (deg)")


def _travels(axes: Axes, fit: ElbowFit, catches: list[Catch]) -> None:
    for ended, look, label in (
        (True, _DOT, "catch ended"),
        (False, _OPEN, "stretch ended first"),
    ):
        own = [catch for catch in catches if (catch.end is not None) == ended]
        if own:
            speeds = np.degrees([catch.mean_catch_speed for catch in own])
            travels = np.degrees([catch.travel for catch in own])
            axes.plot(speeds, travels, label=label, **look)
    travel = fit["catch_travel"]
    if not math.isnan(travel.value):
        axes.axhline(math.degrees(travel.value), color=BLUE, linewidth=1.4)
        if not math.isnan(travel.low):
            axes.axhspan(
                math.degrees(travel.low),
                math.degrees(travel.high),
                color=BLUE,
                alpha=0.15,
                linewidth=0.0,
            )
    longest = max(math.degrees(catch.travel) for catch in catches)
    axes.set_ylim(0.0, 1.25 * longest)
    if any(catch.end is None for catch in catches):
        axes.legend(loc="lower right")
    axes.set_title(_said(fit, "catch_travel", 2))
    axes.set_xlabel("mean speed during the catch (deg/s)")
    axes.set_ylabel("ΔT$_c$ · mean speed (deg)")


def _peaks(axes: Axes, fit: ElbowFit, pairs: list[tuple[Catch, CatchLevels]]) -> None:
    speeds = np.array([catch.speed for catch, _ in pairs])
    peaks = np.array([levels.peak for _, levels in pairs])
    axes.plot(np.degrees(speeds), peaks, **_DOT)
    _through_zero(axes, np.degrees(speeds), fit["catch_torque_constant"].value, 180.0)
    axes.set_title(_said(fit, "catch_torque_constant", 3))
    axes.set_xlabel("speed at the catch (deg/s)")
    axes.set_ylabel("peak\nabove pre-catch (N·m)")


def _residuals(
    axes: Axes, fit: ElbowFit, pairs: list[tuple[Catch, CatchLevels]]
) -> None:
    peaks = np.array([levels.peak for _, levels in pairs])
    residuals = np.array([levels.residual for _, levels in pairs])
    axes.plot(peaks, residuals, **_DOT)
    _through_zero(axes, peaks, fit["residual_ratio"].value, math.pi)
    axes.set_title(_said(fit, "residual_ratio", 3))
    axes.set_xlabel("peak above pre-catch (N·m)")
    axes.set_ylabel("residual\nabove pre-catch (N·m)")


def _through_zero(
    axes: Axes,
    x: "np.ndarray[tuple[int], np.dtype[np.float64]]",
    slope: float,
    per: float,
) -> None:
    # a line through the origin; its slope is per π/`per` of the axis' unit
    if not math.isnan(slope) and x.size:
        end = 1.08 * float(x.max())
        axes.plot([0.0, end], [0.0, slope * end * math.pi / per], color=BLUE, lw=1.4)
        axes.set_xlim(0.0, end)
        axes.set_ylim(bottom=0.0)

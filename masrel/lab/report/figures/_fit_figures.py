"""Figures of an identified joint or device, in the manner of the source's.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, Figs. 2 to 5 and 8.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from masrel.lab.analysis import _fit_residuals as residuals
from masrel.lab.elbow.identification import ElbowFit, FrictionFit
from masrel.lab.elbow.identification._catches import Catch, Trial
from masrel.lab.elbow.identification._model_file import QUANTITIES
from masrel.lab.report._fits import FRICTION
from masrel.plots._style import BLACK, BLUE, GREY, ORANGE
from masrel.tables._tables import interval_text, number

_MAX_SLOW_COLUMNS = 4
_BINS, _MIN_IN_BIN = 40, 20
_MAX_POINTS = 6000  # more than a print resolves say nothing

_DASHES = (0, (5, 1.5))
_MEASURED: dict[str, Any] = {"color": GREY, "label": "measured"}
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

_Floats = NDArray[np.float64]


def slow_figure(fit: ElbowFit) -> Figure:
    """Return measured torque and (1) against time, one column a trial: the longest."""
    slow = [i for i, trial in enumerate(fit.trials) if trial.pace == "slow"]
    sizes = {i: fit.trials[i].pre_catch.time.size for i in slow}
    shown = sorted(sorted(slow, key=lambda i: -sizes[i])[:_MAX_SLOW_COLUMNS])
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
        _slow_trial(grid[0, column], grid[1, column], fit, place)
    grid[0, 0].set_ylabel("torque (N·m)")
    grid[1, 0].set_ylabel("speed (deg/s)")
    for axes in grid[1]:
        axes.set_xlabel("time (s)")
        axes.set_ylim(bottom=0.0)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure


def _slow_trial(top: Axes, bottom: Axes, fit: ElbowFit, place: int) -> None:
    part, law = fit.trials[place].pre_catch, fit.fitted_torque[place]
    time = part.time - part.time[0]
    top.plot(time, part.measured, linewidth=0.5, **_MEASURED)
    top.plot(
        time, law, color=BLACK, linewidth=1.5, linestyle=_DASHES, label=_slow_law(fit)
    )
    error = 100.0 * residuals.slow_error(fit, place)
    top.set_title(f"mean error {number(error, 1)} %")
    bottom.plot(time, np.degrees(part.velocity), color=BLACK, linewidth=1.0)


def _slow_law(fit: ElbowFit) -> str:
    # (1), and what is fitted or held of an arm beside it
    has_mass = any(estimate.name == "inertia" for estimate in fit.estimates)
    terms = ["b·θ̇", "k·θ", *(["m·θ̈"] if has_mass else [])]
    of_arm = {"gravity": "G·sin(θ − θ_g)", "arm_inertia": "J·θ̈", "drift": "drift"}
    there = [name for name, term in fit.arm.items() if term not in ("off", 0.0)]
    terms += [text for name, text in of_arm.items() if name in there]
    return f"{' + '.join(terms)}{' with a lag' if 'lag' in there else ''}, fitted"


def fast_figure(fit: ElbowFit) -> Figure:
    """Return torque, angle and speed of the slowest, the middle and the fastest."""
    fast = [
        (trial.catch.mean_speed, i)
        for i, trial in enumerate(fit.trials)
        if trial.catch is not None and trial.after is not None
    ]
    ordered = [place for _, place in sorted(fast)]
    picked = sorted({0, len(ordered) // 2, len(ordered) - 1})
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
        _fast_trial(grid[:, column].tolist(), fit, ordered[pick])
    for axes, label in zip(
        grid[:, 0], ("torque (N·m)", "angle (deg)", "speed (deg/s)"), strict=True
    ):
        axes.set_ylabel(label)
    for axes in grid[2]:
        axes.set_xlabel("time in the stretch (s)")
        axes.set_ylim(bottom=0.0)
    shown: dict[str, Artist] = {}  # not every trial has every phase
    for axes in grid[0]:
        handles, labels = axes.get_legend_handles_labels()
        shown.update(zip(labels, handles, strict=True))
    figure.legend(
        list(shown.values()), list(shown), loc="outside lower center", ncols=4
    )
    return figure


def _fast_trial(column: list[Axes], fit: ElbowFit, place: int) -> None:
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
    times: Sequence[_Floats],
    torques: Sequence[_Floats],
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


def catches_figure(fit: ElbowFit) -> Figure:
    """Return what all catches say of L and α, D, H and Q."""
    catches, readings = residuals.catches(fit), residuals.catch_readings(fit)
    peaks = np.array([levels.peak for _, levels in readings])
    levels = np.array([levels.residual for _, levels in readings])
    speeds = np.degrees(np.array([catch.speed for catch, _ in readings]))
    figure = Figure(figsize=(6.7, 5.4))
    grid = figure.subplots(2, 2)
    _catch_angles(grid[0, 0], fit, catches)
    _catch_travels(grid[0, 1], fit, catches)
    _through_zero(grid[1, 0], speeds, peaks, fit, "catch_torque_constant", 180.0)
    grid[1, 0].set_xlabel("speed at the catch (deg/s)")
    grid[1, 0].set_ylabel("peak\nabove pre-catch (N·m)")
    _through_zero(grid[1, 1], peaks, levels, fit, "residual_ratio", math.pi)
    grid[1, 1].set_xlabel("peak above pre-catch (N·m)")
    grid[1, 1].set_ylabel("residual\nabove pre-catch (N·m)")
    for letter, axes in zip("abcd", grid.flat, strict=True):
        axes.annotate(
            letter,
            (0.0, 1.0),
            (-30, 8),
            xycoords="axes fraction",
            textcoords="offset points",
            weight="bold",
        )
    return figure


def _parameter_text(fit: ElbowFit, name: str, digits: int) -> str:
    estimate, quantity = fit[name], QUANTITIES[name]
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    if math.isnan(estimate.value):
        return f"{quantity.symbol} not determined"
    value = estimate.value * quantity.factor
    text = f"{quantity.symbol} = {number(value, digits)}"
    to_high, to_low = estimate.high - estimate.value, estimate.value - estimate.low
    if math.isclose(to_high, to_low, rel_tol=1e-9):
        return f"{text} ± {number(to_high * quantity.factor, digits)}{unit}"
    text += unit
    if not math.isnan(estimate.standard_error):
        ends = estimate.low * quantity.factor, estimate.high * quantity.factor
        text += f" {interval_text(*ends, digits)}"
    return text


def _catch_angles(axes: Axes, fit: ElbowFit, catches: Sequence[Catch]) -> None:
    speeds = np.degrees([catch.mean_speed for catch in catches])
    angles = np.degrees([catch.angle for catch in catches])
    axes.plot(speeds, angles, **_DOT)
    title = _parameter_text(fit, "catch_angle_constant", 1)
    if not math.isnan(fit["catch_angle_constant"].value + fit["catch_slope"].value):
        at = np.linspace(speeds.min() - 5.0, speeds.max() + 5.0, 400)
        law = np.degrees(residuals.catch_angle_law(fit, np.radians(at)))
        axes.plot(at, law, color=BLUE, linewidth=1.4)
        title += f"\n{_parameter_text(fit, 'catch_slope', 3)}"
    axes.set_title(title)
    axes.set_xlabel("mean speed before the catch (deg/s)")
    axes.set_ylabel("catch angle (deg)")


def _catch_travels(axes: Axes, fit: ElbowFit, catches: Sequence[Catch]) -> None:
    for ended, look, label in (
        (True, _DOT, "catch ended"),
        (False, _OPEN, "stretch ended first"),
    ):
        shown = [catch for catch in catches if (catch.end is not None) == ended]
        if shown:
            speeds = np.degrees([catch.mean_catch_speed for catch in shown])
            travels = np.degrees([catch.travel for catch in shown])
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
    axes.set_title(_parameter_text(fit, "catch_travel", 2))
    axes.set_xlabel("mean speed during the catch (deg/s)")
    axes.set_ylabel("ΔT$_c$ · mean speed (deg)", parse_math=True)


def _through_zero(
    axes: Axes, x: _Floats, y: _Floats, fit: ElbowFit, name: str, per: float
) -> None:
    # dots and a line through the origin; its slope is per π/`per` of the axis' unit
    axes.plot(x, y, **_DOT)
    slope = fit[name].value
    if not math.isnan(slope) and x.size:
        end = 1.08 * float(x.max())
        axes.plot([0.0, end], [0.0, slope * end * math.pi / per], color=BLUE, lw=1.4)
        axes.set_xlim(0.0, end)
        axes.set_ylim(bottom=0.0)
    axes.set_title(_parameter_text(fit, name, 3))


def residuals_figure(fit: ElbowFit) -> Figure:
    """Return residual torque against angle and time, and residual catch angles."""
    has_fast = any(trial.after is not None for trial in fit.trials)
    has_line = not math.isnan(fit["catch_slope"].value)
    n_panels = 1 + has_fast + has_line
    figure = Figure(figsize=(0.4 + 2.3 * max(n_panels, 1.5), 2.7))
    grid = figure.subplots(1, n_panels, squeeze=False)[0].tolist()
    angle, torque = residuals.slow_residuals(fit)
    _cloud(grid[0], np.degrees(angle), torque)
    grid[0].set_title("slow trials")
    grid[0].set_xlabel("angle (deg)")
    if has_fast:
        _cloud(grid[1], *residuals.fast_residuals(fit))
        grid[1].axvline(0.0, color=BLACK, linewidth=0.7, linestyle=(0, (1, 1.5)))
        grid[1].set_title("fast trials")
        grid[1].set_xlabel("time since the catch (s)")
    if has_line:
        _angle_residuals(grid[-1], fit)
    return figure


def _cloud(axes: Axes, x: _Floats, y: _Floats) -> None:
    every = max(1, x.size // _MAX_POINTS)
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
    middles, means = residuals.binned_means(x, y, _BINS, _MIN_IN_BIN)
    axes.plot(middles, means, color=BLACK, linewidth=1.4)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    reach = 1.05 * float(np.quantile(np.abs(y), 0.999))
    axes.set_ylim(-reach, reach)
    axes.set_ylabel("measured − fitted (N·m)")


def _angle_residuals(axes: Axes, fit: ElbowFit) -> None:
    catches = residuals.catches(fit)
    speeds = np.array([catch.mean_speed for catch in catches])
    angles = np.array([catch.angle for catch in catches])
    left = np.degrees(angles - residuals.catch_angle_law(fit, speeds))
    axes.plot(np.degrees(speeds), left, "o", color=BLACK, markersize=3.5)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    reach = 1.2 * float(np.abs(left).max()) or 1.0
    axes.set_ylim(-reach, reach)
    axes.set_title("catch angles")
    axes.set_xlabel("mean speed (deg/s)")
    axes.set_ylabel("measured − fitted (deg)")


def friction_figure(fit: FrictionFit) -> Figure:
    """Return backdriving torque beside (7), against time and against speed."""
    figure = Figure(figsize=(6.7, 2.9))
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1.0), sharey=True)
    first = fit.strokes[0]
    start = float(first.time[0])
    law = {"color": BLACK, "lw": 1.0, "linestyle": _DASHES}
    for i, stroke in enumerate(fit.strokes):
        speed = np.degrees(stroke.velocity)
        right.plot(speed, stroke.torque, color=GREY, lw=0.9)
        right.plot(speed, stroke.fitted, **law)
        if stroke.recording == first.recording:
            labels = ("measured", "(7), fitted") if i == 0 else (None, None)
            time = stroke.time - start
            left.plot(time, stroke.torque, color=GREY, lw=1.8, label=labels[0])
            left.plot(time, stroke.fitted, label=labels[1], **law)
    left.axhline(0.0, color=BLACK, linewidth=0.6)
    right.axhline(0.0, color=BLACK, linewidth=0.6)
    left.set_xlabel("time (s)")
    left.set_ylabel("backdriving torque (N·m)")
    right.set_xlabel("speed (deg/s)")
    figure.legend(loc="outside lower center", ncols=2)
    right.set_title(_friction_text(fit), fontsize=8)
    return figure


def _friction_text(fit: FrictionFit) -> str:
    lines = []
    for name, quantity in FRICTION.items():
        estimate = fit[name]
        text = f"{quantity.symbol} = {number(estimate.value, 4)}"
        if not math.isnan(estimate.high):
            text += f" ± {number(estimate.high - estimate.value, 4)}"
        lines.append(f"{text} {quantity.unit}")
    return "\n".join(lines)

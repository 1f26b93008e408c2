"""Figures of an identified joint or device, in the manner of the source's.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, Figs. 2 to 5 and 8.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from masrel.lab.elbow._model_file import QUANTITIES, Quantity
from masrel.lab.elbow.identification import ElbowFit, FittedParameter, FrictionFit
from masrel.lab.elbow.identification._catches import Catch
from masrel.lab.report._fits import FRICTION
from masrel.plots._style import BLACK, BLUE, GREY, ORANGE
from masrel.tables._tables import interval_text, number

_MAX_SLOW_COLUMNS = 4
_BINS, _MIN_IN_BIN = 40, 20
_MAX_POINTS = 6000  # more than a print resolves say nothing

_DASHES = (0, (5, 1.5))
_MEASURED: dict[str, Any] = {"color": GREY, "label": "measured"}
_THIN: dict[str, Any] = {"color": BLACK, "linewidth": 1.0}
_LAW: dict[str, Any] = {"color": BLUE, "linewidth": 1.4}
_ZERO: dict[str, Any] = {"color": BLACK, "linewidth": 0.6}
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


def _columns(
    n: int, size: tuple[float, float], heights: Sequence[float], labels: Sequence[str]
) -> tuple[Figure, NDArray[Any]]:
    # a figure of trials, one column each, -> and its axes (n_rows, n); speeds lowest
    figure = Figure(figsize=size)
    grid = figure.subplots(
        len(heights), n, sharex=True, sharey="row", squeeze=False, height_ratios=heights
    )
    for axes, label in zip(grid[:, 0], labels, strict=True):
        axes.set_ylabel(label)
    return figure, grid


def slow_figure(fit: ElbowFit) -> Figure:
    """Return measured torque and (1) against time, one column a trial: the longest."""
    slow = [i for i, trial in enumerate(fit.trials) if trial.stretch.pace == "slow"]
    slow.sort(key=lambda i: -fit.trials[i].pre_catch.time.size)
    shown = sorted(slow[:_MAX_SLOW_COLUMNS])
    size = max(3.4, 0.6 + 1.7 * len(shown)), 3.7
    labels = ("torque (N·m)", "speed (deg/s)")
    figure, grid = _columns(len(shown), size, (1.6, 1.0), labels)
    law: dict[str, Any] = {"linestyle": _DASHES, "label": _slow_law(fit)}
    for (top, bottom), place in zip(grid.T, shown, strict=True):
        part = fit.trials[place].pre_catch
        time = part.time - part.time[0]
        top.plot(time, part.measured, linewidth=0.5, **_MEASURED)
        top.plot(time, fit.fitted_torque[place], color=BLACK, linewidth=1.5, **law)
        error = np.abs(part.measured - fit.fitted_torque[place]).mean()
        percent = number(100.0 * float(error) / float(np.abs(part.measured).mean()), 1)
        top.set_title(f"mean error {percent} %")
        bottom.plot(time, np.degrees(part.velocity), **_THIN)
        bottom.set_xlabel("time (s)")
    grid[1, 0].set_ylim(bottom=0.0)  # last: else what comes later is cut off
    handles, texts = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside lower center", ncols=2)
    return figure


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
    size = 0.8 + 2.15 * max(2, len(picked)), 4.9
    labels = ("torque (N·m)", "angle (deg)", "speed (deg/s)")
    figure, grid = _columns(len(picked), size, (1.8, 1.0, 1.0), labels)
    shown: dict[str, Any] = {}  # not every trial has every phase
    for column, pick in zip(grid.T, picked, strict=True):
        _fast_trial(column, fit, ordered[pick])
        handles, texts = column[0].get_legend_handles_labels()
        shown.update(zip(texts, handles, strict=True))
    for axes in grid[2]:
        axes.set_xlabel("time in the stretch (s)")
    grid[2, 0].set_ylim(bottom=0.0)
    figure.legend(
        list(shown.values()), list(shown), loc="outside lower center", ncols=4
    )
    return figure


def _fast_trial(column: Sequence[Axes], fit: ElbowFit, place: int) -> None:
    trial = fit.trials[place]
    catch, after, pre = trial.catch, trial.after, trial.pre_catch
    start = float(trial.stretch.samples.time[0])
    if catch is None or after is None:
        return
    top, middle, bottom = column
    law, last = fit.fitted_torque[place], float(after.time[-1] - start)
    # before the catch and from it on: no line joins the two
    time = _separated([pre.time, after.time]) - start
    measured = _separated([pre.measured, after.measured])
    top.plot(time, measured, linewidth=0.6, **_MEASURED)
    top.plot(
        time, _separated(np.split(law, [pre.time.size])), color=BLACK, linewidth=1.3,
        linestyle=_DASHES, label="law, fitted",
    )  # fmt: skip
    time = np.concatenate([pre.time, after.time]) - start
    middle.plot(time, np.degrees(np.concatenate([pre.angle, after.angle])), **_THIN)
    speed = np.degrees(np.concatenate([pre.velocity, after.velocity]))
    bottom.plot(time, speed, **_THIN)
    begin = catch.time - start
    end = last if catch.end is None else catch.end - start
    line: dict[str, Any] = {"color": GREY, "linewidth": 0.7}
    for axes in column:
        axes.axvspan(begin, end, color=ORANGE, alpha=0.35, lw=0.0, label="catch")
        if catch.end is not None:
            axes.axvspan(end, last, color=BLUE, alpha=0.15, lw=0.0, label="post-catch")
            axes.axvline(end, **line)
        axes.axvline(begin, **line)
    top.set_title(f"mean speed {number(math.degrees(catch.mean_speed), 0)} deg/s")


def _separated(pieces: Iterable[_Floats]) -> _Floats:
    # drawn as lines that nothing joins
    return np.concatenate([np.append(piece, math.nan) for piece in pieces])


def catches_figure(fit: ElbowFit) -> Figure:
    """Return what all catches say of L and α, D, H and Q."""
    catches = _catches(fit)
    peaks = np.array([read.peak for read in fit.levels])
    residuals = np.array([read.residual for read in fit.levels])
    speeds = np.degrees(np.array([read.catch.speed for read in fit.levels]))
    figure = Figure(figsize=(6.7, 5.4))
    grid = figure.subplots(2, 2)
    _catch_angles(grid[0, 0], fit, catches)
    _catch_travels(grid[0, 1], fit, catches)
    _through_zero(grid[1, 0], speeds, peaks, fit, "catch_torque_constant", 180.0)
    _through_zero(grid[1, 1], peaks, residuals, fit, "residual_ratio", math.pi)
    texts = (
        ("mean speed before the catch (deg/s)", "catch angle (deg)"),
        ("mean speed during the catch (deg/s)", "ΔT$_c$ · mean speed (deg)"),
        ("speed at the catch (deg/s)", "peak\nabove pre-catch (N·m)"),
        ("peak above pre-catch (N·m)", "residual\nabove pre-catch (N·m)"),
    )
    for letter, axes, (across, up) in zip("abcd", grid.flat, texts, strict=True):
        axes.set_xlabel(across)
        axes.set_ylabel(up, parse_math="$" in up)
        axes.annotate(
            letter,
            (0.0, 1.0),
            (-30, 8),
            xycoords="axes fraction",
            textcoords="offset points",
            weight="bold",
        )
    return figure


def _parameter_text(estimate: FittedParameter, quantity: Quantity, digits: int) -> str:
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    if math.isnan(estimate.value):
        return f"{quantity.symbol} not determined"
    value, low, high = (
        end * quantity.factor for end in (estimate.value, estimate.low, estimate.high)
    )
    text = f"{quantity.symbol} = {number(value, digits)}"
    if math.isnan(estimate.standard_error):
        return text + unit
    if math.isclose(high - value, value - low, rel_tol=1e-9):
        return f"{text} ± {number(high - value, digits)}{unit}"
    return f"{text}{unit} {interval_text(low, high, digits)}"


def _fitted(fit: ElbowFit, name: str, digits: int) -> str:
    return _parameter_text(fit[name], QUANTITIES[name], digits)


def _catch_angles(axes: Axes, fit: ElbowFit, catches: Sequence[Catch]) -> None:
    speeds = np.degrees([catch.mean_speed for catch in catches])
    axes.plot(speeds, np.degrees([catch.angle for catch in catches]), **_DOT)
    title = _fitted(fit, "catch_angle_constant", 1)
    if not math.isnan(fit["catch_angle_constant"].value + fit["catch_slope"].value):
        at = np.linspace(speeds.min() - 5.0, speeds.max() + 5.0, 400)
        law = np.degrees(_catch_angle_law(fit, np.radians(at)))
        axes.plot(at, law, **_LAW)
        title += f"\n{_fitted(fit, 'catch_slope', 3)}"
    axes.set_title(title)


def _catch_travels(axes: Axes, fit: ElbowFit, catches: Sequence[Catch]) -> None:
    longest = max(math.degrees(catch.travel) for catch in catches)
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
        axes.axhline(math.degrees(travel.value), **_LAW)
    if not math.isnan(travel.low):
        ends = math.degrees(travel.low), math.degrees(travel.high)
        axes.axhspan(*ends, color=BLUE, alpha=0.15, linewidth=0.0)
    axes.set_ylim(0.0, 1.25 * longest)
    if any(catch.end is None for catch in catches):
        axes.legend(loc="lower right")
    axes.set_title(_fitted(fit, "catch_travel", 2))


def _through_zero(
    axes: Axes, x: _Floats, y: _Floats, fit: ElbowFit, name: str, per: float
) -> None:
    # dots and a line through the origin; its slope is per π/`per` of the axis' unit
    axes.plot(x, y, **_DOT)
    slope = fit[name].value
    if not math.isnan(slope) and x.size:
        end = 1.08 * float(x.max())
        axes.plot([0.0, end], [0.0, slope * end * math.pi / per], **_LAW)
        axes.set_xlim(0.0, end)
        axes.set_ylim(bottom=0.0)
    axes.set_title(_fitted(fit, name, 3))


def residuals_figure(fit: ElbowFit) -> Figure:
    """Return residual torque against angle and time, and residual catch angles."""
    angle, torque = _slow_residuals(fit)
    panels = [("slow trials", "angle (deg)", np.degrees(angle), torque)]
    if any(trial.after is not None for trial in fit.trials):
        since = _fast_residuals(fit)
        panels.append(("fast trials", "time since the catch (s)", *since))
    has_line = not math.isnan(fit["catch_slope"].value)
    n_panels = len(panels) + has_line
    figure = Figure(figsize=(0.4 + 2.3 * max(n_panels, 1.5), 2.7))
    grid = figure.subplots(1, n_panels, squeeze=False)[0].tolist()
    for axes, (title, label, x, y) in zip(grid, panels, strict=False):
        every = max(1, x.size // _MAX_POINTS)
        axes.plot(
            x[::every], y[::every], linestyle="none", marker=".", markersize=1.2,
            color=GREY, alpha=0.35, rasterized=True,
        )  # fmt: skip
        middles = _binned_means(x, y)
        axes.plot(*middles, color=BLACK, linewidth=1.4)
        reach = 1.05 * float(np.quantile(np.abs(y), 0.999))
        _left(axes, title, label, "measured − fitted (N·m)", reach)
        if label.startswith("time"):
            axes.axvline(0.0, color=BLACK, linewidth=0.7, linestyle=(0, (1, 1.5)))
    if has_line:
        catches = _catches(fit)
        speeds = np.array([catch.mean_speed for catch in catches])
        angles = np.array([catch.angle for catch in catches])
        left = np.degrees(angles - _catch_angle_law(fit, speeds))
        grid[-1].plot(np.degrees(speeds), left, "o", color=BLACK, markersize=3.5)
        reach, label = 1.2 * float(np.abs(left).max()) or 1.0, "measured − fitted (deg)"
        _left(grid[-1], "catch angles", "mean speed (deg/s)", label, reach)
    return figure


def _left(axes: Axes, title: str, across: str, up: str, reach: float) -> None:
    axes.axhline(0.0, **_ZERO)
    axes.set(title=title, xlabel=across, ylabel=up, ylim=(-reach, reach))


def _slow_residuals(fit: ElbowFit) -> tuple[_Floats, _Floats]:
    # angles (rad) of all slow samples, and measured - fitted torque
    return _joined(
        (trial.pre_catch.angle, trial.pre_catch.measured - law)
        for trial, law in zip(fit.trials, fit.fitted_torque, strict=True)
        if trial.stretch.pace == "slow"
    )


def _fast_residuals(fit: ElbowFit) -> tuple[_Floats, _Floats]:
    # times since the catch of all fast samples, and measured - fitted torque
    return _joined(
        (
            np.concatenate([trial.pre_catch.time, after.time]) - trial.catch.time,
            np.concatenate([trial.pre_catch.measured, after.measured]) - law,
        )
        for trial, law in zip(fit.trials, fit.fitted_torque, strict=True)
        if trial.catch is not None and (after := trial.after) is not None
    )


def _joined(parts: Iterable[tuple[_Floats, _Floats]]) -> tuple[_Floats, _Floats]:
    x, y = zip(*parts, strict=True)
    return np.concatenate(x), np.concatenate(y)


def _binned_means(x: _Floats, y: _Floats) -> tuple[_Floats, _Floats]:
    # middles of bins of x and the means of y in them, each (_BINS,)
    edges = np.linspace(x.min(), x.max(), _BINS + 1)
    bins = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(bins, minlength=_BINS)
    total = np.bincount(bins, weights=y, minlength=_BINS)
    means = np.where(count >= _MIN_IN_BIN, total / np.maximum(count, 1), np.nan)
    return 0.5 * (edges[1:] + edges[:-1]), means  # a bin of too few has no mean


def _catch_angle_law(fit: ElbowFit, mean_speed: _Floats) -> _Floats:
    # the fitted catch angles (rad) of mean speeds (rad/s)
    constant, slope = fit["catch_angle_constant"].value, fit["catch_slope"].value
    constants = fit.constants
    law = constant - slope * np.maximum(mean_speed, constants.slowest_mean_speed)  # (2)
    return np.maximum(law, constants.smallest_catch_angle)  # (6)


def _catches(fit: ElbowFit) -> list[Catch]:
    return [trial.catch for trial in fit.trials if trial.catch is not None]


def friction_figure(fit: FrictionFit) -> Figure:
    """Return backdriving torque beside (7), against time and against speed."""
    figure = Figure(figsize=(6.7, 2.9))
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1.0), sharey=True)
    name, start = fit.strokes[0].recording, float(fit.strokes[0].part.time[0])
    first = [stroke for stroke in fit.strokes if stroke.recording == name]
    times = _separated([stroke.part.time - start for stroke in first])
    speeds = np.degrees(_separated([stroke.part.velocity for stroke in fit.strokes]))
    for axes, strokes, x, label, width in (
        (left, first, times, "time (s)", 1.8),
        (right, fit.strokes, speeds, "speed (deg/s)", 0.9),
    ):
        measured = _separated([stroke.part.torque for stroke in strokes])
        law = _separated([stroke.fitted for stroke in strokes])
        axes.plot(x, measured, linewidth=width, **_MEASURED)
        axes.plot(
            x, law, color=BLACK, linewidth=1.0, linestyle=_DASHES, label="(7), fitted"
        )
        axes.axhline(0.0, **_ZERO)
        axes.set_xlabel(label)
    left.set_ylabel("backdriving torque (N·m)")
    handles, texts = left.get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside lower center", ncols=2)
    lines = [_parameter_text(fit[name], of, 4) for name, of in FRICTION.items()]
    right.set_title("\n".join(lines), fontsize=8)
    return figure

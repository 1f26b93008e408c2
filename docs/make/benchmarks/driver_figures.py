"""The figures of docs/evidence/driver.md; everything in them is simulated."""

from collections.abc import Mapping
from math import radians
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    Friction,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.recording import MEASURED_TORQUE, Recording
from masrel.lab.report._material import FIGURES
from masrel.lab.report._trace_section import measured_panel
from masrel.plots import draw
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import SIMULATED
from tests.lab.hess.test_fit_of_recordings import NOTHING, measured, stretch, to_and_fro

START, END = radians(30.0), radians(146.0)
BACKDRIVE = to_and_fro(100.0 / 1.7)  # with a peak of 110 deg/s
BLACK, GREY, BLUE, ORANGE, VERMILLION, GREEN = (
    "#000000",
    "#6B6B6B",
    "#0072B2",
    "#E69F00",
    "#D55E00",
    "#009E73",
)
STYLES = {
    "exact step": (BLUE, "o", "-"),
    "semi-implicit Euler": (VERMILLION, "s", "--"),
    "solve_ivp RK45": (GREEN, "^", "-."),
    "solve_ivp LSODA": (GREY, "D", ":"),
}
LINES = {"HM1": ":", "HM2": "-.", "HM3": "--", "HM4": "-"}
COLOURS = {"HM1": GREEN, "HM2": ORANGE, "HM3": VERMILLION, "HM4": BLUE}


def _figure(width: float = 5.6, height: float = 3.6) -> Figure:
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False})
    mpl.rcParams.update({"axes.spines.right": False, "savefig.dpi": 200})
    return Figure(figsize=(width, height), layout="constrained")


def draw_integrators(
    integrators: Mapping[str, list[tuple[float, float, float]]], path: Path
) -> None:
    """Draw the processor time of a simulated second against the largest error."""
    figure = _figure()
    axes = figure.add_subplot()
    for name, points in integrators.items():
        colour, marker, line = STYLES[name]
        axes.loglog(
            [seconds for _, seconds, _ in points],
            [error for *_, error in points],
            color=colour,
            marker=marker,
            linestyle=line,
            markersize=5,
            label=name,
        )
    for setting, seconds, error in integrators["exact step"]:
        if setting == 0.0005:
            axes.annotate(
                "as shipped: 0.5 ms",
                (seconds, error),
                (7, 1),
                textcoords="offset points",
                color=BLUE,
                ha="left",
            )
    axes.axhline(18.8 / 2700.0, color=GREY, linewidth=0.8)
    axes.text(0.05, 18.8 / 2700.0 * 1.2, "torque quantum", color=GREY, ha="center")
    axes.set_xlabel("processor time of a simulated second (s)")
    axes.set_ylabel("largest error of the hand's torque (N·m)")
    axes.grid(color="#DDDDDD", linewidth=0.6)
    axes.legend(frameon=False, loc="lower left", fontsize=8)
    figure.savefig(path)


def draw_lateness(loops: Mapping[str, NDArray[np.float64]], path: Path) -> None:
    """Draw the share of ticks that are later than a time."""
    figure = _figure()
    axes = figure.add_subplot()
    styles = ((BLUE, "-"), (BLACK, "--"), (GREY, ":"))
    for (name, late), (colour, line) in zip(loops.items(), styles, strict=True):
        ordered = np.sort(np.maximum(late, 1.0))
        share = 1.0 - np.arange(ordered.size) / ordered.size
        axes.loglog(ordered, share, color=colour, linestyle=line, label=name)
    axes.axvline(1000.0, color=GREY, linewidth=0.8)
    axes.text(1060.0, 0.4, "a tick is missed", color=GREY, fontsize=8)
    axes.set_xlabel("lateness (µs)")
    axes.set_ylabel("share of ticks that are later")
    axes.grid(color="#DDDDDD", linewidth=0.6)
    axes.legend(frameon=False, loc="lower left", fontsize=8)
    figure.savefig(path)


def recorded(model: str, speed_deg_s: float, **options) -> Recording:
    """One presentation on the simulated device."""
    clock = SimulatedClock()
    speed = radians(speed_deg_s)
    hand = SimulatedHand(start=START, end=END, mean_speed=speed, **options)
    controller = Controller(STANDARD_MODELS[model], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand) as device:
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=DeviceLimits(torque=28.0),
            max_duration_s=3.0,
        ).recording


def draw_traces(path: Path) -> None:
    """Draw torque and angle over time of the four models at one speed."""
    figure = _figure(5.6, 4.6)
    upper, lower = figure.subplots(2, sharex=True, height_ratios=(2.2, 1.0))
    for model, line in LINES.items():
        columns = recorded(model, 92.0).columns
        style = {"color": COLOURS[model], "linestyle": line, "linewidth": 1.3}
        upper.plot(columns["time_s"], columns["model_torque_nm"], label=model, **style)
        lower.plot(columns["time_s"], columns["angle_deg"], **style)
    upper.set_ylabel("torque of the model (N·m)")
    upper.legend(frameon=False, loc="upper left", fontsize=8)
    lower.set_ylabel("angle (deg)")
    lower.set_xlabel("time (s)")
    for axes in (upper, lower):
        axes.grid(color="#DDDDDD", linewidth=0.6)
    figure.suptitle("HM1 to HM4 at 92 deg/s, simulated device", fontsize=9)
    figure.savefig(path)


def draw_measured(path: Path) -> None:
    """Draw torque that was sent and measured, of the four models at one speed."""
    panels = tuple(
        measured_panel(measured(joint, stretch(60.0)), model)
        for model, joint in STANDARD_MODELS.items()
    )
    shown = Drawn(FIGURES + "_stretch_figures:measured_figure", (panels,))
    files = draw(shown, stamp=SIMULATED, forms=("png",))
    path.write_bytes(files["png"])


def draw_backdrive(path: Path) -> None:
    """Draw Fig. 8 anew: what the sensor measures of the device moved to and fro."""
    figure = _figure(7.0, 3.1)
    over_time, over_speed = figure.subplots(1, 2, width_ratios=(1.5, 1.0), sharey=True)
    looks = (
        (0.0, VERMILLION, 1.0, (1.28, 0.4, "without compensation")),
        (0.9, BLUE, 0.8, (1.85, 0.09, "nine tenths compensated")),
    )
    for share, colour, width, label in looks:
        columns = measured(NOTHING, BACKDRIVE, compensation=share).columns
        felt = columns["ramp"] == 0
        time, speed, torque = (
            columns[name][felt]
            for name in ("time_s", "velocity_deg_s", MEASURED_TORQUE.column)
        )
        over_time.plot(time, torque, color=colour, linewidth=width)
        over_time.text(*label, color=colour, fontsize=8.5)
        over_speed.plot(speed, torque, color=colour, linewidth=0.7)
    for axes in (over_time, over_speed):
        for level in (-0.5, -0.2, 0.2, 0.5):
            axes.axhline(level, color=GREY, linewidth=0.7, linestyle=":")
        axes.axhline(0.0, color=BLACK, linewidth=0.6)
    _draw_law(over_speed)
    over_time.set_xlabel("time (s)")
    over_time.set_ylabel("measured torque (N·m)")
    over_time.set_yticks([-0.5, -0.2, 0.0, 0.2, 0.5])
    over_speed.set_xlabel("speed (deg/s)")
    for axes, letter in ((over_time, "a"), (over_speed, "b")):
        axes.set_title(letter, loc="left", weight="bold", fontsize=10)
    over_time.set_xlim(0.0, 3.4)
    figure.suptitle("SIMULATED DATA", x=0.995, ha="right", fontsize=8, color=VERMILLION)
    figure.savefig(path)


def _draw_law(axes: Axes) -> None:
    # (7) without its inertia
    friction = Friction()
    for side in (-1.0, 1.0):
        speed = side * np.array([0.0, 115.0])
        law = friction.viscous * np.radians(speed) + side * friction.coulomb
        axes.plot(speed, law, color=BLACK, linewidth=1.0, linestyle="--")
    axes.text(-105.0, 0.42, "dashed: (7)\nat an even speed", fontsize=8.5, va="center")


def draw_slip(path: Path) -> None:
    """Draw how a lost grip in the catch of HM4 goes."""
    figure = _figure(5.6, 4.6)
    upper, lower = figure.subplots(2, sharex=True)
    held = recorded("HM4", 92.0).columns
    caught = held["time_s"][np.flatnonzero(held["phase"] == 1)[0]]
    slip_s = float(caught) + 0.03
    slipped = recorded("HM4", 92.0, slip_time=slip_s).columns
    for columns, colour, line, label in (
        (held, GREY, "--", "held"),
        (slipped, BLUE, "-", "grip lost"),
    ):
        shown = (columns["time_s"] > slip_s - 0.1) & (columns["time_s"] < slip_s + 0.3)
        ms = (columns["time_s"][shown] - slip_s) * 1e3
        style = {"color": colour, "linestyle": line, "linewidth": 1.3}
        upper.plot(ms, columns["command_torque_nm"][shown], label=label, **style)
        lower.plot(ms, columns["velocity_deg_s"][shown], **style)
    upper.set_ylabel("torque commanded (N·m)")
    upper.legend(frameon=False, fontsize=8)
    lower.set_ylabel("speed (deg/s)")
    lower.set_xlabel("time after the hand lets go (ms)")
    for axes in (upper, lower):
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        axes.grid(color="#DDDDDD", linewidth=0.6)
    figure.suptitle("HM4 at 92 deg/s, grip lost in the catch, simulated", fontsize=9)
    figure.savefig(path)

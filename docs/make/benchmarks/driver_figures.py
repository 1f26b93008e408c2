"""The figures of docs/evidence/driver.md; everything in them is simulated."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from matplotlib.axes import Axes

from docs.make.benchmarks.figures import plain_figure
from docs.make.evidence import FIGURES
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import DeviceLimits, Friction
from masrel.lab.recording import MEASURED_TORQUE, Recording
from masrel.lab.report._material import FIGURES as MATERIAL
from masrel.lab.report._trace_section import measured_panel
from masrel.plots import draw
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import SIMULATED
from tests.lab.hess.rig import present
from tests.lab.hess.test_fit_of_recordings import NOTHING, measured, stretch, to_and_fro

BACKDRIVE = to_and_fro(100.0 / 1.7)  # with a peak of 110 deg/s
BLACK, GREY, BLUE, ORANGE, VERMILLION, GREEN = (
    "#000000",
    "#6B6B6B",
    "#0072B2",
    "#E69F00",
    "#D55E00",
    "#009E73",
)
LINES = {"HM1": ":", "HM2": "-.", "HM3": "--", "HM4": "-"}
COLOURS = {"HM1": GREEN, "HM2": ORANGE, "HM3": VERMILLION, "HM4": BLUE}


GRID = {"color": "#DDDDDD", "linewidth": 0.6}


def draw_simulated() -> None:
    """Draw what the simulated device does, which is the same whenever it is run."""
    draw_traces()
    draw_measured()
    draw_backdrive()
    draw_slip()


def recorded(model: str, slip_time: float | None = None) -> Recording:
    """One presentation on the simulated device, at 92 deg/s."""
    limits = DeviceLimits(torque=28.0)
    options = {"limits": limits, "max_duration_s": 3.0, "slip_time": slip_time}
    return present(model, **options).recording


@contextmanager
def two_panels(name: str, title: str, **options: object) -> Iterator[tuple[Axes, Axes]]:
    """Give panels above each other to draw in, with lines and a legend afterwards."""
    figure = plain_figure(5.6, 4.6)
    upper, lower = figure.subplots(2, sharex=True, **options)
    yield upper, lower
    upper.legend(frameon=False, loc="upper left", fontsize=8)
    for axes in (upper, lower):
        axes.grid(**GRID)
    figure.suptitle(title, fontsize=9)
    figure.savefig(FIGURES / f"{name}.png")


def draw_traces() -> None:
    """Draw torque and angle over time of the four models at one speed."""
    title, ratios = "HM1 to HM4 at 92 deg/s, simulated device", (2.2, 1.0)
    with two_panels("driver_traces", title, height_ratios=ratios) as (upper, lower):
        for model, line in LINES.items():
            columns = recorded(model).columns
            time, look = columns["time_s"], {"color": COLOURS[model], "lw": 1.3}
            upper.plot(time, columns["model_torque_nm"], line, label=model, **look)
            lower.plot(time, columns["angle_deg"], line, **look)
        upper.set_ylabel("torque of the model (N·m)")
        lower.set(xlabel="time (s)", ylabel="angle (deg)")


def draw_measured() -> None:
    """Draw torque that was sent and measured, of the four models at one speed."""
    panels = tuple(
        measured_panel(measured(joint, stretch(60.0)), model)
        for model, joint in STANDARD_MODELS.items()
    )
    shown = Drawn(MATERIAL + "_stretch_figures:measured_figure", (panels,))
    files = draw(shown, stamp=SIMULATED, forms=("png",))
    (FIGURES / "driver_measured.png").write_bytes(files["png"])


def draw_backdrive() -> None:
    """Draw Fig. 8 anew: what the sensor measures of the device moved to and fro."""
    figure = plain_figure(7.0, 3.1)
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
    for axes, letter in ((over_time, "a"), (over_speed, "b")):
        for level in (-0.5, -0.2, 0.2, 0.5):
            axes.axhline(level, color=GREY, linewidth=0.7, linestyle=":")
        axes.axhline(0.0, color=BLACK, linewidth=0.6)
        axes.set_title(letter, loc="left", weight="bold", fontsize=10)
    _draw_law(over_speed)
    over_time.set(
        xlabel="time (s)",
        ylabel="measured torque (N·m)",
        yticks=[-0.5, -0.2, 0.0, 0.2, 0.5],
        xlim=(0.0, 3.4),
    )
    over_speed.set_xlabel("speed (deg/s)")
    figure.suptitle("SIMULATED DATA", x=0.995, ha="right", fontsize=8, color=VERMILLION)
    figure.savefig(FIGURES / "driver_backdrive.png")


def _draw_law(axes: Axes) -> None:
    # (7) without its inertia
    friction = Friction()
    for side in (-1.0, 1.0):
        speed = side * np.array([0.0, 115.0])
        law = friction.viscous * np.radians(speed) + side * friction.coulomb
        axes.plot(speed, law, color=BLACK, linewidth=1.0, linestyle="--")
    axes.text(-105.0, 0.42, "dashed: (7)\nat an even speed", fontsize=8.5, va="center")


def draw_slip() -> None:
    """Draw how a lost grip in the catch of HM4 goes."""
    held = recorded("HM4").columns
    caught = held["time_s"][np.flatnonzero(held["phase"] == 1)[0]]
    slip_s = float(caught) + 0.03
    slipped = recorded("HM4", slip_s).columns
    title = "HM4 at 92 deg/s, grip lost in the catch, simulated"
    with two_panels("driver_slip", title) as (upper, lower):
        for columns, line, colour, label in (
            (held, "--", GREY, "held"),
            (slipped, "-", BLUE, "grip lost"),
        ):
            since_s = columns["time_s"] - slip_s
            shown = (since_s > -0.1) & (since_s < 0.3)
            ms, look = since_s[shown] * 1e3, {"color": colour, "lw": 1.3}
            torque = columns["command_torque_nm"][shown]
            upper.plot(ms, torque, line, label=label, **look)
            lower.plot(ms, columns["velocity_deg_s"][shown], line, **look)
        upper.set_ylabel("torque commanded (N·m)")
        lower.set(xlabel="time after the hand lets go (ms)", ylabel="speed (deg/s)")
        for axes in (upper, lower):
            axes.axvline(0.0, color=GREY, linewidth=0.8)

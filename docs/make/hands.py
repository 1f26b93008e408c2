"""The table and the figure of people's hands on the driver's pages.

``python -m docs.make.hands [HANDS]`` prints the table and draws the figure; a thousand
hands take some minutes.
"""

import sys
from collections.abc import Mapping
from dataclasses import replace
from math import degrees, radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tqdm import tqdm

from docs.make.evidence import FIGURES
from masrel.lab.hess import HandTraits
from masrel.lab.recording import PHASES
from masrel.plots._style import GREY, VERMILLION, finished, house_style
from tests.lab.hess.rig import controls
from tests.lab.hess.test_hands import (
    FREE_END_DEG,
    PRE_CATCH,
    Person,
    outcome,
    people,
    presented,
    shares,
    slip_time,
    table,
)

Columns = Mapping[str, np.ndarray]
HANDS = {600.0: ("#0072B2", "-"), 60.0: ("#009E73", "--"), 12.0: ("#E69F00", "-.")}
N_DRAWN = 200  # hands in the right half


def draw() -> None:
    """Draw speeds through a catch, and how much of a loose arm's loss is lost."""
    with house_style():
        figure = Figure(figsize=(7.2, 3.2))
        speeds, losses = figure.subplots(1, 2)
        _draw_speeds(speeds)
        _draw_losses(losses)
        files = finished(figure, stamp="SIMULATED DATA", forms=("png",))
    (FIGURES / "driver_hands.png").write_bytes(files["png"])


def _draw_speeds(axes: Axes) -> None:
    for stiffness, (colour, line) in HANDS.items():
        traits = HandTraits(stiffness=stiffness, damping=0.05 * stiffness)
        person = Person(
            traits=traits, model="HM4", mean_speed=radians(100.0), slips=0.0
        )
        held = presented(person).recording.columns
        catch_s = held["time_s"][np.argmax(held["phase"] == PHASES.index("catch"))]
        look = {"color": colour, "linestyle": line, "label": f"{stiffness:g} N·m/rad"}
        _draw_speed(axes, held, catch_s, look)
    # the last of them
    lost = presented(person, float(catch_s) + 0.02).recording.columns
    look = {"color": VERMILLION, "linestyle": ":", "label": "lets go after 20 ms"}
    _draw_speed(axes, lost, catch_s, look)
    axes.set(
        xlabel="time from the catch of HM4 (ms)",
        ylabel="speed (deg/s)",
        xlim=(-50.0, 150.0),
        ylim=(-60.0, 125.0),
    )
    axes.axhline(0.0, color=GREY, linewidth=0.5)
    axes.legend(frameon=False, loc="lower left", fontsize=7)


def _draw_speed(
    axes: Axes, columns: Columns, from_s: float, look: dict[str, str]
) -> None:
    axes.plot((columns["time_s"] - from_s) * 1e3, columns["velocity_deg_s"], **look)


def _draw_losses(axes: Axes) -> None:
    held, loose = [], []
    for person in people(N_DRAWN, seed=1):
        columns = presented(person).recording.columns
        counts = columns["phase"] != PRE_CATCH
        counts &= columns["angle_deg"] < FREE_END_DEG
        held.append(shares(columns)[counts].max())
        slip_s = slip_time(person, columns)
        # By so small an inertia no lost grip is ever noticed
        deaf = controls(person.model, loose_inertia=1e-3)
        slipped = presented(replace(person, model=deaf), slip_s).recording.columns
        after = (slipped["time_s"] > slip_s) & (slipped["time_s"] < slip_s + 0.02)
        loose.append(shares(slipped)[after].max())
    bins = np.linspace(0.0, 1.2, 49)
    axes.hist(held, bins, color=HANDS[600.0][0])
    axes.hist(loose, bins, color=VERMILLION)
    axes.axvline(0.6, color=GREY, linestyle="--", linewidth=1.0)
    axes.set(
        xlabel="speed lost in 5 ms,\nas a share of a loose arm's",
        ylabel=f"of {N_DRAWN} hands",
    )
    axes.text(0.58, 60.0, "grip lost\nfrom here on", color=GREY, fontsize=8, ha="right")
    axes.text(0.2, 35.0, "held", color=HANDS[600.0][0])
    axes.text(1.06, 40.0, "let go", color=VERMILLION)


if __name__ == "__main__":
    n_hands = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    draw()
    drawn = list(people(n_hands, seed=0))
    print(table([outcome(person) for person in tqdm(drawn)]))
    speeds = [degrees(person.mean_speed) for person in drawn]
    print(f"{min(speeds):.0f} to {max(speeds):.0f} deg/s")

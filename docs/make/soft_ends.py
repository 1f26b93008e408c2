"""Draw the figure of docs/model on soft ends: torque of a presentation, before and now.

``python -m docs.make.soft_ends`` also prints the largest falls of a tick.
"""

import math
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from masrel.elbow import STANDARD_MODELS
from masrel.hess import (
    Controller,
    DeviceLimits,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.recording import Recording

FIGURE = Path(__file__).parents[1] / "figures" / "soft_ends.png"
START, END = math.radians(30.0), math.radians(146.0)

SCENES = {  # title: model, speed in deg/s, longest duration in s
    "HM4 at 92 deg/s, arrives": ("HM4", 92.0, 10.0),
    "HM3 at 92 deg/s, time limit in the catch": ("HM3", 92.0, 0.8),
}
RAMPS = {"at once": (0.0, "#D55E00", "--"), "soft": (0.1, "#0072B2", "-")}


def presented(
    model: str, speed_deg_s: float, longest_s: float, ramp_s: float
) -> Recording:
    """One presentation on the simulated device, both ramps of one length."""
    clock = SimulatedClock()
    hand = SimulatedHand(start=START, end=END, mean_speed=math.radians(speed_deg_s))
    controller = Controller(
        STANDARD_MODELS[model], start_angle=START, post_catch_ramp=ramp_s
    )
    with open_device("simulated", clock=clock, hand=hand) as device:
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=DeviceLimits(end_ramp_time=ramp_s),
            max_duration_s=longest_s,
        ).recording


def sent(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Time, s, and torque, N·m, as the device holds it, to the zero; both (n,)."""
    columns = recording.columns
    time_s = np.append(columns["time_s"], columns["time_s"][-1] + [0.001, 0.1])
    return time_s, np.append(columns["command_torque_nm"], [0.0, 0.0])


def main() -> None:
    """Draw, and print what falls most."""
    mpl.rcParams.update({"font.size": 9, "savefig.dpi": 200})
    mpl.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
    figure = Figure(figsize=(5.6, 5.0), layout="constrained")
    for axes, (title, scene) in zip(figure.subplots(2), SCENES.items(), strict=True):
        for name, (ramp_s, colour, line) in RAMPS.items():
            time_s, torque = sent(presented(*scene, ramp_s))
            axes.plot(time_s, torque, line, color=colour, label=name, linewidth=1.3)
            late = time_s > (1.1 if scene[0] == "HM4" else 0.75)  # behind the catch
            print(f"{title}, {name}: {(-np.diff(torque[late])).max():.3f} N·m")
        axes.set_title(f"{title}, simulated", fontsize=9)
        axes.set_ylabel("torque commanded (N·m)")
        axes.grid(color="#DDDDDD", linewidth=0.6)
        axes.legend(frameon=False, fontsize=8, loc="upper left")
    axes.set_xlabel("time (s)")
    figure.savefig(FIGURE)


if __name__ == "__main__":
    main()

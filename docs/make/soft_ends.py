"""Draw the figure of docs/model on soft ends: torque of a presentation, before and now.

``python -m docs.make.soft_ends`` also prints the largest falls of a tick.
"""

from math import radians

import numpy as np

from docs.make.benchmarks.figures import plain_figure
from docs.make.evidence import FIGURES
from masrel.lab.hess import DeviceLimits, StretchRules
from masrel.lab.recording import Recording
from tests.lab.hess.rig import controls, present, stretching

SCENES = {  # title: model, where to, deg, how often, longest, s; from when behind, s
    "HM4, arrives": ("HM4", 146.0, 1, 10.0, 1.1),
    "HM3, done in its catch": ("HM3", 146.0, 1, 0.8, 0.75),
    "HM3, brought back from its catch and stretched again": ("HM3", 100.0, 2, 3.9, 1.1),
}
RAMPS = {"at once": (0.0, "#D55E00", "--"), "soft": (0.1, "#0072B2", "-")}


def presented(
    model: str, end_deg: float, n_stretches: int, longest_s: float, ramp_s: float
) -> Recording:
    """One presentation on the simulated device, both ramps of one length."""
    again = [radians(92.0)] * (n_stretches - 1)
    return present(
        controls(model, post_catch_ramp=ramp_s),
        hand=stretching(end=radians(end_deg), again=again),
        limits=DeviceLimits(end_ramp_time=ramp_s),
        max_duration_s=longest_s,
        stretches=StretchRules(n=n_stretches),
    ).recording


def sent(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Time, s, and torque, N·m, as the device holds it, to the zero; both (n,)."""
    columns = recording.columns
    time_s = np.append(columns["time_s"], columns["time_s"][-1] + [0.001, 0.1])
    return time_s, np.append(columns["command_torque_nm"], [0.0, 0.0])


def main() -> None:
    """Draw, and print what falls most."""
    figure = plain_figure(5.6, 7.2)
    panels = figure.subplots(len(SCENES))
    for axes, (title, scene) in zip(panels, SCENES.items(), strict=True):
        *shown, behind_s = scene
        for name, (ramp_s, colour, line) in RAMPS.items():
            time_s, torque = sent(presented(*shown, ramp_s))
            axes.plot(time_s, torque, line, color=colour, label=name, linewidth=1.3)
            is_end = (time_s > behind_s) & (time_s < behind_s + 0.6)
            print(f"{title}, {name}: {(-np.diff(torque[is_end])).max():.3f} N·m")
        axes.set_title(f"{title}, simulated", fontsize=9)
        axes.set_ylabel("torque commanded (N·m)")
        axes.grid(color="#DDDDDD", linewidth=0.6)
        axes.legend(frameon=False, fontsize=8, loc="upper left")
    axes.set_xlabel("time (s)")
    figure.savefig(FIGURES / "soft_ends.png")


if __name__ == "__main__":
    main()

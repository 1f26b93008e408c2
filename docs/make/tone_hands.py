"""What docs/reference/tone says of tone in people's hands: its table and its figure.

``python -m docs.make.tone_hands [HANDS]`` draws the figure and prints the table; a
hundred hands of each kind take some ten minutes.
"""

import sys
from dataclasses import replace

from matplotlib.figure import Figure

from docs.make.evidence import FIGURES
from masrel.lab.hess import HandTraits
from masrel.plots._style import (
    BLUE,
    SHADES,
    VERMILLION,
    finished,
    house_style,
)
from tests.lab.hess.test_tone_held import (
    HEAD,
    KINDS,
    SEEDS,
    outcome,
    presented,
    raters,
    row,
)


def draw() -> None:
    """Draw angle and torque of one presentation of clonus."""
    (rater,) = raters("clonus", [5])
    soft = HandTraits(stiffness=40.0, damping=2.0)
    columns = presented(replace(rater, traits=soft)).recording.columns
    with house_style():
        figure = Figure(figsize=(7.2, 4.0))
        angle, torque = figure.subplots(2, 1, sharex=True)
        for axes, name, colour in (
            (angle, "angle_deg", BLUE),
            (torque, "model_torque_nm", VERMILLION),
        ):
            for number in range(1, int(columns["stretch"].max()) + 1):
                on = columns["time_s"][columns["stretch"] == number]
                axes.axvspan(on[0], on[-1], color=SHADES["catch"], linewidth=0)
            axes.plot(columns["time_s"], columns[name], color=colour, linewidth=1.0)
            axes.margins(x=0.01)
        angle.set_ylabel("angle (deg)")
        torque.set(ylabel="torque (N·m)", xlabel="time (s)", ylim=(0.0, None))
        figure.align_ylabels([angle, torque])
        files = finished(figure, stamp="SIMULATED DATA", forms=("png",))
    (FIGURES / "tone_held.png").write_bytes(files["png"])


if __name__ == "__main__":
    n_hands = int(sys.argv[1]) if len(sys.argv) > 1 else len(SEEDS)
    draw()
    print(HEAD)
    for kind in KINDS if n_hands else ():
        print(
            row(kind, [outcome(r) for r in raters(kind, SEEDS[:n_hands])]), flush=True
        )

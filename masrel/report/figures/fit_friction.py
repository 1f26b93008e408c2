"""Backdriving torque beside the friction law of (7), as in the source's Fig. 8."""

import math

import numpy as np
from matplotlib.figure import Figure

from masrel.elbow.identification.friction import FrictionFit
from masrel.report._tables import number
from masrel.report.figures.style import (
    BLACK,
    GREY,
    Drawn,
    finish,
    house_style,
)

__all__ = ["draw_friction"]


def draw_friction(fit: FrictionFit, *, stamp: str) -> Drawn:
    """Draw torque against time and against speed."""
    with house_style():
        figure = Figure(figsize=(6.7, 2.9))
        left, right = figure.subplots(1, 2, width_ratios=(1.3, 1.0), sharey=True)
        first = fit.strokes[0].recording
        start = float(fit.strokes[0].time[0])
        dashes = (0, (5, 1.5))
        for number, stroke in enumerate(fit.strokes):
            labels = ("measured", "(7), fitted") if number == 0 else (None, None)
            speed = np.degrees(stroke.velocity)
            right.plot(speed, stroke.torque, color=GREY, lw=0.9)
            right.plot(speed, stroke.fitted, color=BLACK, lw=1.0, linestyle=dashes)
            if stroke.recording == first:
                time = stroke.time - start
                left.plot(time, stroke.torque, color=GREY, lw=1.8, label=labels[0])
                left.plot(
                    time,
                    stroke.fitted,
                    color=BLACK,
                    lw=1.0,
                    linestyle=dashes,
                    label=labels[1],
                )
        left.axhline(0.0, color=BLACK, linewidth=0.6)
        right.axhline(0.0, color=BLACK, linewidth=0.6)
        left.set_xlabel("time (s)")
        left.set_ylabel("backdriving torque (N·m)")
        right.set_xlabel("speed (deg/s)")
        figure.legend(loc="outside lower center", ncols=2)
        right.set_title(_said(fit), fontsize=8)
        return finish(figure, stamp)


def _said(fit: FrictionFit) -> str:
    units = {"inertia": "kg·m²", "viscous": "N·m·s/rad", "coulomb": "N·m"}
    symbols = {"inertia": "I", "viscous": "B", "coulomb": "β"}
    lines = []
    for name, unit in units.items():
        estimate = fit[name]
        said = f"{symbols[name]} = {number(estimate.value, 4)}"
        if not math.isnan(estimate.high):
            said += f" ± {number(estimate.high - estimate.value, 4)}"
        lines.append(f"{said} {unit}")
    return "\n".join(lines)

"""The figures of docs/reference/elbow.md about run time and sampling."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from docs.make.benchmarks.rows import Result
from docs.make.evidence import FIGURES
from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    finished,
    house_style,
)

_WAYS = {
    "exact": ("exact: events and peak", BLUE, "*", 11),
    "sampled": ("sampled, step by step", ORANGE, "s", 5),
    "solve_ivp": ("solve_ivp, RK45 with events", GREY, "^", 5),
}

# where the settings stand beside their points, so that they cover nothing
_LABELS = {"sampled": ((5, 5), "left"), "solve_ivp": ((-6, -8), "right")}


def draw_work(lines: Sequence[Result]) -> None:
    """Error of the events against the time that finding them takes."""
    with house_style(parse_math=True):
        figure = Figure(figsize=(5.6, 3.6))
        axes = figure.subplots()
        for way, (label, colour, marker, size) in _WAYS.items():
            of_way = [line for line in lines if line["program"].startswith(way)]
            x = [1e3 * line["seconds"] for line in of_way]
            y = [max(line["error, s"], 1e-17) for line in of_way]
            axes.loglog(x, y, marker=marker, color=colour, markersize=size, lw=0.8,
                        label=label)  # fmt: skip
            if way in _LABELS:
                offset, side = _LABELS[way]
                for line, *point in zip(of_way, x, y, strict=True):
                    axes.annotate(
                        line["program"].partition(", ")[2], point, xytext=offset,
                        textcoords="offset points", color=colour, ha=side,
                        fontsize=6.5,
                    )  # fmt: skip
        axes.set(
            xlabel="processor time of one stretch (ms)",
            ylabel="largest error of catch\nand catch end (s)",
        )
        axes.grid(which="major")
        axes.set_xlim(right=axes.get_xlim()[1] * 4)
        axes.legend(fontsize=7.5, loc="lower right")
        picture = finished(figure, stamp="", forms=["png"])["png"]
        (FIGURES / "elbow_work.png").write_bytes(picture)


def draw_approach(rates: Sequence[float], late: dict[str, np.ndarray]) -> None:
    """How late a sampled law sees the events, speed by speed, against the rate."""
    with house_style(parse_math=True):
        figure = Figure(figsize=(6.2, 2.9))
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        periods = 1e3 / np.array(rates)
        for axes, (name, rows), most in zip(panels, late.items(), (1, 2), strict=True):
            axes.fill_between(
                rates, 0.0, most * periods, color="#DDDDDD", lw=0,
                label=f"0 to {most} period" + "s" * (most > 1),
            )  # fmt: skip
            for row in rows:
                axes.plot(rates, 1e3 * row, ".", color=BLUE, markersize=2.5)
            axes.axvline(1000.0, color=BLACK, lw=0.7, linestyle=DASHES)
            axes.set(title=name, xscale="log", xlabel="samples a second (Hz)")
            axes.set_yscale("symlog", linthresh=0.01)
            axes.legend(fontsize=7.5, loc="upper right")
        panels[0].set_ylabel("sampled − exact (ms)")
        picture = finished(figure, stamp="", forms=["png"])["png"]
        (FIGURES / "elbow_sampled.png").write_bytes(picture)

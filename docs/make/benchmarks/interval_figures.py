"""Figures of work against error: the bootstrap, and the posterior of ρ."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tests.benchmarks.bootstrap import Race
from tests.benchmarks.posteriors import EVOLUTION, STRETCH

LOOKS: dict[str, tuple[str, str, str]] = {
    # colour, marker, line: told apart without colour too
    "exact": ("#000000", "*", ""),
    "drawn": ("#56B4E9", "v", "--"),
    "scipy, vectorized": ("#E69F00", "D", "-"),
    "scipy, loop": ("#D55E00", "s", "-"),
    "arch": ("#009E73", "^", ":"),
    "resample": ("#CC79A7", "P", "-."),
    "importance sampling": ("#0072B2", "o", "-"),
    EVOLUTION: ("#D55E00", "s", "-"),
    STRETCH: ("#E69F00", "D", "--"),
}
WORDS = {
    "exact": "masrel, exact",
    "drawn": "masrel, drawn",
}


def draw_races(races: Sequence[Race], path: Path) -> None:
    """Draw error against seconds, a panel for each study."""
    mpl.rcParams.update({"font.size": 8, "axes.spines.top": False})
    mpl.rcParams.update({"axes.spines.right": False, "savefig.dpi": 200})
    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    panels = figure.subplots(1, len(races), sharey=True, squeeze=False)[0]
    for letter, axes, race in zip("abcdef", panels, races, strict=False):
        _panel(axes, race)
        axes.set_title(f"{letter}  {race.name}", loc="left", fontsize=8)
        axes.set_xlabel("processor time (s)")
    panels[0].set_ylabel("error of an end / half width of the interval")
    handles = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside lower center",
        ncols=4,
        frameon=False,
    )
    figure.savefig(path)


def _panel(axes: Axes, race: Race) -> None:
    for method in dict.fromkeys(point.method for point in race.points):
        of = [point for point in race.points if point.method == method]
        colour, marker, line = LOOKS[method]
        if not any(point.error for point in of):  # it is the truth itself
            axes.axvline(of[0].seconds, color=colour, lw=1.2, ls=(0, (4, 2)))
            axes.plot(
                of[0].seconds,
                0.0,
                marker=marker,
                markersize=9,
                color=colour,
                linestyle="none",
                clip_on=False,
                transform=axes.get_xaxis_transform(),
                label=WORDS.get(method, method),
                zorder=5,
            )
            continue
        axes.loglog(
            [point.seconds for point in of],
            [point.error for point in of],
            linestyle=line or "none",
            marker=marker,
            markersize=9 if method == "exact" else 4.5,
            color=colour,
            label=WORDS.get(method, method),
        )
    if race.floor is not None:
        axes.axhline(race.floor, color="0.5", lw=0.8, ls=(0, (1, 2)))
        axes.annotate(
            "error of the reference",
            (1.0, race.floor),
            xycoords=("axes fraction", "data"),
            xytext=(-2, 3),
            textcoords="offset points",
            ha="right",
            size=6.5,
            color="0.35",
        )
    axes.grid(alpha=0.25)

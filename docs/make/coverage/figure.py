"""A figure of coverages: cells down, coverage along."""

from collections.abc import Mapping

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.make.coverage.study import percent
from docs.make.evidence import FIGURES

LOWEST = 92.5  # %, below which a coverage is too low

Looks = Mapping[str, tuple[str, str]]
"""Colour and marker of each interval, by which they are told apart without colour."""

_LEAST = 50.0  # %, where all that is below is drawn


def draw(rows: pd.DataFrame, name: str, looks: Looks) -> None:
    """Draw a panel per value of the column `panel`, cells down.

    A marker is the lowest coverage of a cell, and a line leads to the mean of all.
    """
    mpl.rcParams.update({"font.size": 7, "savefig.dpi": 200, "svg.hashsalt": "masrel"})
    panels = dict(list(rows.groupby("panel", sort=False)))
    heights = [of["cell"].nunique() for of in panels.values()]
    figure = Figure(figsize=(7.2, 1.0 + 0.16 * sum(heights)), layout="constrained")
    grid = {"height_ratios": heights}
    every = figure.subplots(len(panels), sharex=True, squeeze=False, gridspec_kw=grid)
    for axes, (title, of) in zip(every.flat, panels.items(), strict=True):
        _panel(axes, of, looks)
        axes.set_title(title, fontsize=8, loc="left")
    handles, labels = every[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False)
    every[-1, 0].set_xlabel("coverage (%)")
    figure.savefig(FIGURES / f"{name}.png", metadata={"Software": None})


def _panel(axes: Axes, rows: pd.DataFrame, looks: Looks) -> None:
    cells = list(rows["cell"].unique())
    axes.grid(axis="y", color="0.94", lw=6)
    axes.axvline(LOWEST, color="0.4", lw=0.8, zorder=1)
    axes.axvline(95, color="0.75", lw=0.8, zorder=1)
    for place, (name, (colour, marker)) in enumerate(looks.items()):
        of = rows[rows["interval"] == name]
        by_cell = percent(of).groupby(of["cell"], sort=False)
        covers = by_cell.agg(["min", "mean"]).clip(lower=_LEAST)
        off = 0.6 * (place / (len(looks) - 1) - 0.5)
        y = [cells.index(cell) + off for cell in covers.index]
        axes.hlines(y, covers["min"], covers["mean"], colour, lw=0.8)
        above = 3.0 - 0.1 * place  # the first on top
        look = {"c": colour, "marker": marker, "lw": 0.0, "zorder": above}
        axes.scatter(covers["min"], y, 12, label=name, **look)
    axes.set_yticks(range(len(cells)), cells)
    axes.set(ylim=(len(cells) - 0.4, -0.6), xlim=(_LEAST - 0.5, 100.5), axisbelow=True)
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)

"""The learning curve of a training, above every grade that was given."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from masrel.lab.report._figure_data import LearningView
from masrel.plots._style import BLACK, BLUE, DASHES, GREY, VERMILLION
from masrel.tables._tables import percent


def learning_figure(content: LearningView) -> Figure:
    """Return kappa time and again, and below it how far each grade was off."""
    figure = Figure(figsize=(6.0, 4.2))
    upper, lower = figure.subplots(2, sharex=True, height_ratios=(2.2, 1.0))
    _draw_curve(upper, content)
    _draw_grades(lower, content)
    upper.set_title(content.title, loc="left")
    lower.set_xlabel("presentation")
    lower.set_xlim(0.0, len(content.differences) + 1.0)
    lower.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside lower center", ncols=5, fontsize=8)
    return figure


def _draw_curve(axes: Axes, content: LearningView) -> None:
    kappas = np.array(content.kappas, dtype=np.float64).reshape(-1, 3)
    value, low, high = kappas.T
    for bound, word in zip(content.bounds, ("insufficient", "sufficient"), strict=True):
        axes.axhline(bound, color=GREY, linewidth=0.8, linestyle=DASHES, zorder=1.0)
        axes.annotate(
            word,
            (1.0, bound),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
            color=GREY,
        )
    has_ends = np.isfinite(low)
    axes.vlines(
        np.array(content.positions)[has_ends],
        low[has_ends],
        high[has_ends],
        color=BLUE,
        linewidth=1.8,
        label=f"{percent(content.level)} % interval",
    )
    axes.plot(
        content.positions, value, "o-", color=BLACK, markersize=5, label="weighted κ"
    )
    lowest = min([0.0, *low[has_ends], *value[np.isfinite(value)]])
    axes.set_ylim(max(-1.0, math.floor(10.0 * lowest) / 10.0) - 0.02, 1.03)
    axes.set_ylabel("κ with the intended grades")
    axes.grid(axis="y")


def _draw_grades(axes: Axes, content: LearningView) -> None:
    places = np.arange(1, len(content.differences) + 1)
    offsets = np.array(content.differences, dtype=np.int64)
    for at, colour, marker, label in (
        (offsets == 0, BLUE, "o", "right"),
        (offsets != 0, VERMILLION, "X", "wrong"),
    ):
        if at.any():
            axes.plot(
                places[at],
                offsets[at],
                linestyle="none",
                marker=marker,
                markersize=4.5,
                color=colour,
                label=label,
            )
    axes.axhline(0.0, color=GREY, linewidth=0.7, zorder=1.0)
    axes.set_ylabel("grades too high")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
    axes.margins(y=0.2)

"""The way of raters through a study, as boxes."""

import textwrap
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from masrel.lab.report._figure_data import FlowStep
from masrel.plots._style import BLACK, GREY

_WIDTH_IN, _STEP_IN, _LINE_IN = 6.2, 0.62, 0.16
_MAIN_X, _SIDE_X = 0.2, 0.45  # middle of the boxes on the way; left edge of the others
_N_LETTERS = 52  # in a line of the others


def flow_figure(steps: Sequence[FlowStep]) -> Figure:
    """Return a box for every step, and beside it what became of the others."""
    texts = [
        [line for text in step.others for line in textwrap.wrap(text, _N_LETTERS)]
        for step in steps
    ]
    heights = [max(_STEP_IN, 0.3 + _LINE_IN * len(lines)) for lines in texts]
    figure = Figure(figsize=(_WIDTH_IN, sum(heights) + 0.2))
    axes = figure.add_subplot()
    axes.set_axis_off()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(sum(heights), 0.0)
    top, before = 0.0, None
    for step, lines, height in zip(steps, texts, heights, strict=True):
        middle = top + height / 2
        _box(axes, _MAIN_X, middle, f"{step.label}: {step.n}", BLACK, "center")
        if lines:
            _box(axes, _SIDE_X, middle, "\n".join(lines), GREY, "left")
        if before is not None:
            axes.annotate(
                "",
                xy=(_MAIN_X, middle - 0.17),
                xytext=(_MAIN_X, before + 0.17),
                arrowprops={"arrowstyle": "->", "color": BLACK, "linewidth": 0.8},
            )
        top, before = top + height, middle
    return figure


def _box(axes: Axes, x: float, y: float, text: str, color: str, align: str) -> None:
    axes.text(
        x,
        y,
        text,
        ha=align,
        va="center",
        fontsize=9 if align == "center" else 8,
        bbox={
            "boxstyle": "square,pad=0.4",
            "facecolor": "white",
            "edgecolor": color,
            "linewidth": 0.8,
        },
    )

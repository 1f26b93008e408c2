"""What studies can show, over how many items, or raters, they have."""

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from masrel.plots._drawn_values import PlanCurves
from masrel.plots._style import BLACK, BLUE, GREY, ORANGE, VERMILLION

_COLOURS = (BLUE, ORANGE, BLACK, VERMILLION, GREY)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def planning_figure(content: PlanCurves) -> Figure:
    """Return the curves."""
    figure = Figure(figsize=(5.6, 3.6))
    axes = figure.subplots()
    for place, curve in enumerate(content.curves):
        axes.plot(
            curve.sizes,
            curve.numbers,
            marker=_MARKERS[place % len(_MARKERS)],
            markersize=4.5,
            linewidth=1.4,
            color=_COLOURS[place % len(_COLOURS)],
            label=curve.label,
        )
    axes.set_title(content.title, loc="left")
    if content.limit is not None:
        axes.axhline(content.limit, color=GREY, linewidth=0.8, linestyle="--")
    axes.set_xlabel(content.over)
    axes.set_ylabel(content.what)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(0.0, 1.02 if content.what in ("power", "assurance") else None)
    axes.grid(axis="y")
    figure.legend(loc="outside lower center", ncols=4, fontsize=8)
    return figure

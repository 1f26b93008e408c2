"""What studies can show, by number of items or raters."""

from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from masrel.plots._style import BLACK, BLUE, GREY, ORANGE, VERMILLION

_COLOURS = (BLUE, ORANGE, BLACK, VERMILLION, GREY)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def planning_figure(
    title: str,
    name: str,
    over: str,
    limit: float | None,
    curves: Sequence[tuple[str, Sequence[tuple[int, float]]]],
) -> Figure:
    """Return curves of one number, over "items" or "raters", by their labels."""
    figure = Figure(figsize=(5.6, 3.6))
    axes = figure.subplots()
    for place, (label, points) in enumerate(curves):
        axes.plot(
            *zip(*points, strict=True),
            marker=_MARKERS[place % len(_MARKERS)],
            markersize=4.5,
            linewidth=1.4,
            color=_COLOURS[place % len(_COLOURS)],
            label=label,
        )
    axes.set_title(title, loc="left")
    if limit is not None:  # what the number is to reach
        axes.axhline(limit, color=GREY, linewidth=0.8, linestyle="--")
    axes.set_xlabel(over)
    axes.set_ylabel(name.replace("_", " ").replace("half ", "half-"))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(0.0, 1.02 if name in ("power", "assurance", "reliability") else None)
    axes.grid(axis="y")
    figure.legend(loc="outside lower center", ncols=4, fontsize=8)
    return figure

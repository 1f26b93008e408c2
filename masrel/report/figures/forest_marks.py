"""The marks of a forest of estimates, and the legend that explains them."""

from collections.abc import Sequence
from typing import Any

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerLine2D
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from masrel.report._tables import percent
from masrel.report.figures.forest_row import ForestRow
from masrel.report.figures.ridge import RIDGE_ALPHA, RIDGE_COLOURS, Part, parts
from masrel.report.figures.style import BLACK, BLUE, DASHES, GREY, ORANGE

__all__ = ["DOT", "LOOKS", "ZERO", "handles_of", "put_legend"]

LOOKS: dict[str, dict[str, Any]] = {
    "confidence": {
        "color": BLUE,
        "linewidth": 1.8,
        "marker": "|",
        "markersize": 8,
        "markeredgewidth": 1.8,
    },
    "credible": {"color": ORANGE, "linewidth": 5.0, "solid_capstyle": "butt"},
}
DOT: dict[str, Any] = {"marker": "o", "color": BLACK, "markersize": 5}
ZERO: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHES}

_PARTS: dict[Part, str] = {
    "density": "posterior density, each to its own height",
    "stems": "resamples of one value, each row to its own height",
    "bars": "resamples together in bars, each row to its own height",
}


def put_legend(figure: Figure, handles: Sequence[Artist]) -> None:
    """Put a legend below the axes."""
    dots = [
        handle
        for handle in handles
        if isinstance(handle, Line2D) and handle.get_linestyle() == "None"
    ]
    figure.legend(
        handles=handles,
        loc="outside lower center",
        fontsize=8,
        borderaxespad=0.2,
        numpoints=2,
        handler_map={dot: HandlerLine2D(numpoints=1) for dot in dots},
    )


def handles_of(rows: Sequence[ForestRow]) -> list[Artist]:
    """Return what the legend of some rows explains, each mark once."""
    handles: dict[str, Artist] = {}
    if any(row.is_known for row in rows):
        handles["estimate"] = Line2D([], [], linestyle="none", **DOT)
    for interval in (row.drawn for row in rows if row.drawn is not None):
        words = f"{percent(interval.level)} % {interval.kind} interval"
        handles[words] = Line2D([], [], **LOOKS[interval.kind])
        if interval.distribution is not None:
            for part in parts(interval.distribution):
                handles[_PARTS[part]] = _handle(part)
    for words, handle in handles.items():
        handle.set_label(words)
    return list(handles.values())


def _handle(part: Part) -> Artist:
    if part == "stems":
        look: dict[str, Any] = {"marker": "|", "markersize": 9, "markeredgewidth": 1.4}
        return Line2D([], [], color=RIDGE_COLOURS[part], linestyle="none", **look)
    colour = RIDGE_COLOURS[part]
    return Patch(facecolor=(colour, RIDGE_ALPHA), edgecolor=colour, linewidth=0.8)

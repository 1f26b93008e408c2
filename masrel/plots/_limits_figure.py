"""Differences of two raters against their mean, with the limits of agreement.

Items at one place are one dot, the larger the more there are. Where there are too many
places for dots the plane is in hexagons, the darker the more items are in each.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter
from numpy.typing import NDArray

from masrel.plots._style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    ORANGE,
    SEQUENTIAL,
    Picture,
    legend_below,
    short_names,
    shown,
)
from masrel.tables._tables import counted, fixed_or_significant, percent

if TYPE_CHECKING:
    from masrel.agreement import LimitsOfAgreement

    # what a part is called, its two raters, and their limits
    Panel = tuple[str, tuple[Sequence[str], LimitsOfAgreement]]

_MAX_DOTS = 2000
_MAX_IN_A_LINE = 24  # letters of both raters
_DOT: dict[str, Any] = {"color": BLUE, "alpha": 0.75}
_SMALLEST, _LARGEST = 14.0, 160.0  # areas of dots, points²
_LIMIT: dict[str, Any] = {"color": ORANGE, "linestyle": (0, (6, 2))}


def bland_altman(
    limits: "LimitsOfAgreement",
    *,
    raters: Sequence[str] = ("first", "second"),
    unit: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Draw the differences of two raters against their means, with their limits.

    Parameters
    ----------
    limits : LimitsOfAgreement
        What `masrel.agreement.limits_of_agreement` returns.
    raters : sequence of str, optional
        What the two raters are called.
    unit : str, optional
        Unit of the measurements, such as deg.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from masrel.agreement import limits_of_agreement
    >>> found = limits_of_agreement([[10.0, 11.0], [12.0, 12.5], [14.0, 15.5]])
    >>> ax = bland_altman(found, unit="deg", ax=Figure().add_subplot())
    >>> ax.get_ylabel()
    'first − second (deg)'
    """
    ((_, picture),) = limits_pictures([("", (raters, limits))], unit)
    return shown(picture, ax)


def limits_pictures(panels: "Sequence[Panel]", unit: str) -> list[tuple[str, Picture]]:
    """Return the differences of every part, on one scale, each as a picture."""
    points = (np.column_stack([p.averages, p.differences]) for _, (_, p) in panels)
    # where items are, (n, 2), and how many at each place
    dots = [np.unique(at, axis=0, return_counts=True) for at in points]
    few = [freq for _, freq in dots if len(freq) <= _MAX_DOTS]
    most = max((int(freq.max(initial=1)) for freq in few), default=1)
    ends = [of for _, (_, panel) in panels for of in _ends(panel)]
    room = 0.08 * (max(ends) - min(ends)) or 1.0
    reach = min(ends) - room, max(ends) + room
    return [
        (title, Picture(5.2, 3.9, partial(_draw, *of, dots_of, most, unit, reach)))
        for (title, of), dots_of in zip(panels, dots, strict=True)
    ]


def _ends(panel: "LimitsOfAgreement") -> list[float]:
    # what the axis of the differences is to show
    shown = [0.0, *panel.differences.tolist()]
    of = (panel.lower_interval, panel.upper_interval)
    return shown + [x for end in of for x in (end.low, end.high) if math.isfinite(x)]


def _draw(
    raters: Sequence[str],
    panel: "LimitsOfAgreement",
    dots: tuple[NDArray[np.float64], NDArray[np.intp]],
    most: int,
    unit: str,
    reach: tuple[float, float],
    axes: Axes,
) -> None:
    at, freq = dots
    area = min(_SMALLEST, _LARGEST / most)  # of one item: points² on paper
    _draw_lines(axes, panel)
    if len(freq) > _MAX_DOTS:
        _draw_hexagons(axes, panel)
    else:
        axes.scatter(
            at[:, 0], at[:, 1], s=area * freq, **_DOT, linewidths=0.0, zorder=3.0
        )
    of_unit = f" ({unit})" if unit else ""
    first, second = short_names(raters)
    space = "\n" if len(first) + len(second) > _MAX_IN_A_LINE else " "
    axes.set_xlabel(f"mean of {first}{space}and {second}{of_unit}")
    axes.set_ylabel(f"{first} −{space}{second}{of_unit}")
    axes.margins(x=0.06)
    axes.set_ylim(*reach)
    mark = {"linestyle": "none", "marker": "o", "markeredgewidth": 0.0, **_DOT}
    marks = [
        Line2D([], [], markersize=(area * n) ** 0.5, label=counted(n, "item"), **mark)
        for n in (1, most)
        if most > 1 and len(freq) <= _MAX_DOTS
    ]
    name = f"{percent(panel.mean_interval.level)} % confidence interval, exact"
    band = Line2D([], [], color=GREY, alpha=0.3, linewidth=6.0, label=name)
    legend_below(axes, [*marks, band], ncols=3)


def _draw_hexagons(axes: Axes, panel: "LimitsOfAgreement") -> None:
    drawn = axes.hexbin(
        panel.averages,
        panel.differences,
        gridsize=45,
        mincnt=1,
        bins="log",
        cmap=SEQUENTIAL,
        linewidths=0.1,
        zorder=1.5,
    )
    # above the axes: at its right are the names of the lines
    place = axes.inset_axes((0.5, 1.03, 0.5, 0.03))
    bar = drawn.figure.colorbar(
        drawn, cax=place, location="top", format="{x:g}", label="items in a hexagon"
    )
    bar.minorformatter = LogFormatter()


def _draw_lines(axes: Axes, panel: "LimitsOfAgreement") -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.7, linestyle=DASHES, zorder=1.0)
    if math.isnan(panel.mean):
        return
    for name, value, ends, look in (
        ("upper limit", panel.upper, panel.upper_interval, _LIMIT),
        ("mean", panel.mean, panel.mean_interval, {"color": BLACK}),
        ("lower limit", panel.lower, panel.lower_interval, _LIMIT),
    ):
        axes.axhspan(
            ends.low, ends.high, color=GREY, alpha=0.16, linewidth=0.0, zorder=0.5
        )
        axes.axhline(value, linewidth=1.2, zorder=2.0, **look)
        text = fixed_or_significant(value, 2).replace("-", "−")
        axes.annotate(
            f"{name}\n{text}",
            (1.0, value),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
        )

"""Differences of raters against their mean, with the limits of agreement.

Items at one place are one dot, the larger the more there are. If there are too many
places for dots, the plane is in hexagons, the darker the more items are in each.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter
from numpy.typing import NDArray

from masrel.agreement import LimitsOfAgreement, LimitsWithMean, RepeatedLimits
from masrel.estimates import Interval
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

Limits = LimitsOfAgreement | RepeatedLimits | LimitsWithMean
# what a part is called, its raters, and their limits
Panel = tuple[str, tuple[Sequence[str], Limits]]

_MAX_DOTS = 2000
_MAX_IN_A_LINE = 24  # letters of both raters
_DOT: dict[str, Any] = {"color": BLUE, "alpha": 0.75}
_SMALLEST, _LARGEST = 14.0, 160.0  # areas of dots, points²
_LIMIT: dict[str, Any] = {"color": ORANGE, "linestyle": (0, (6, 2))}
# Lines of limits of two raters, and what they are there
_NAMES = {
    "LimitsOfAgreement": {
        "upper limit": "upper",
        "mean": "mean",
        "lower limit": "lower",
    },
    "RepeatedLimits": {"upper limit": "high", "mean": "bias", "lower limit": "low"},
}


def bland_altman(
    limits: Limits,
    *,
    raters: Sequence[str] = ("first", "second"),
    unit: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Draw the differences of raters against their means, with their limits.

    Parameters
    ----------
    limits : LimitsOfAgreement, RepeatedLimits or LimitsWithMean
        What `masrel.agreement.limits_of_agreement`, `limits_with_repeats` or
        `limits_with_mean` returns.
    raters : sequence of str, optional
        What the two raters are called; those of limits with the mean are counted.
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


def limits_pictures(panels: Sequence[Panel], unit: str) -> list[tuple[str, Picture]]:
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


# Names of lines that may lie near each other, on either side of the mean's
_BESIDE = {"upper limit": "bottom", "lower limit": "top"}


def _same(panel: Limits) -> float:
    # where two that are the same lie: no difference, or a ratio of 1
    return float(getattr(panel, "kind", None) == "ratio")


def _lines_at(panel: Any) -> "list[tuple[str, float, Interval]]":
    """Return what each line is called, where it is, and its interval."""
    if hasattr(panel, "limit"):  # with the mean: as far on either side
        limit, ends = panel.limit.value, panel.limit.interval
        below = ends and replace(ends, low=-ends.high, high=-ends.low)
        return [("limit", limit, ends), ("limit", -limit, below)] if ends else []
    return [
        (called, getattr(panel, name), getattr(panel, f"{name}_interval"))
        for called, name in _NAMES[type(panel).__name__].items()
    ]


def _lines(panel: Any) -> "tuple[list[float], list[list[tuple[str, float, Interval]]]]":
    """Return places along the means, and the lines there; level ones from 0 to 1."""
    if getattr(panel, "kind", None) != "proportional" or panel.reason is not None:
        return [0.0, 1.0], [_lines_at(panel)] * 2
    places = np.linspace(panel.averages.min(), panel.averages.max(), 60).tolist()
    return places, [_lines_at(panel.at(place)) for place in places]


def _ends(panel: Limits) -> list[float]:
    # what the axis of the differences is to show
    return [
        *(_same(panel), *panel.differences.tolist()),
        *(
            x
            for lines in _lines(panel)[1]
            for *_, of in lines
            for x in (of.low, of.high)
            if math.isfinite(x)
        ),
    ]


def _draw(
    raters: Sequence[str],
    panel: Limits,
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
    mean, less = counted(len(raters), "rater"), "each rater − mean"
    if not hasattr(panel, "limit"):
        first, second = short_names(raters)
        space = "\n" if len(first) + len(second) > _MAX_IN_A_LINE else " "
        mean = f"{first}{space}and {second}"
        less = f"{first} {'−/'[int(_same(panel))]}{space}{second}"
    axes.set(xlabel=f"mean of {mean}{of_unit}", ylabel=f"{less}{of_unit}")
    axes.margins(x=0.06)
    axes.set_ylim(*reach)
    of = "measurement" if hasattr(panel, "limit") else "item"
    mark = {"linestyle": "none", "marker": "o", "markeredgewidth": 0.0, **_DOT}
    marks = [
        Line2D([], [], markersize=(area * n) ** 0.5, label=counted(n, of), **mark)
        for n in (1, most)
        if most > 1 and len(freq) <= _MAX_DOTS
    ]
    for *_, ends in _lines_at(panel)[:1]:
        name = (
            f"{percent(ends.level)} % confidence interval"
            f"{', exact' * (type(panel).__name__ == 'LimitsOfAgreement')}"
        )
        marks.append(Line2D([], [], color=GREY, alpha=0.3, linewidth=6.0, label=name))
    legend_below(axes, marks, ncols=3)


def _draw_hexagons(axes: Axes, panel: Limits) -> None:
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


def _draw_lines(axes: Axes, panel: Limits) -> None:
    axes.axhline(_same(panel), color=GREY, linewidth=0.7, linestyle=DASHES, zorder=1.0)
    places, lines = _lines(panel)
    # level ones from one side of the axes to the other
    across = axes.transData if len(places) > 2 else axes.get_yaxis_transform()
    for line in zip(*lines, strict=True):
        (name, *_), values, ends = zip(*line, strict=True)
        if math.isnan(values[-1]):
            return
        look = {"color": BLACK} if name == "mean" else _LIMIT
        band = [of.low for of in ends], [of.high for of in ends]
        axes.fill_between(
            places, *band, color=GREY, alpha=0.16, linewidth=0.0, zorder=0.5,
            transform=across,
        )  # fmt: skip
        axes.plot(places, values, linewidth=1.2, zorder=2.0, transform=across, **look)
        axes.annotate(
            f"{name}\n{fixed_or_significant(values[-1], 2).replace('-', '−')}",
            (1.0, values[-1]),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            va=_BESIDE.get(name, "center"),
            fontsize=7.5,
        )

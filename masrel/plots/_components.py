"""The variance of ratings as parts: of items, of raters, and what is left."""

import math
from collections.abc import Sequence

from matplotlib.axes import Axes

from masrel.agreement import Label, VarianceComponents, variance_components
from masrel.plots._style import BLUE, GREY, ORANGE, Picture, shown
from masrel.tables._tables import fixed_or_significant, number

_COLOURS = {"items": BLUE, "raters": ORANGE, "residual": "#999999"}
_NONE_LESS = "taken as 0: mean squares estimate less for {}"


def components(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw what the variance of a rating is made of: items, raters and residual.

    Bars are shares of the three together, from 0 to 1 whatever the data; beside each
    is its standard deviation in the unit of the ratings. The share of items is
    ICC(A,1), unless mean squares estimate a variance as less than 0, which is said.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> ax = components([[1, 2], [3, 3], [5, 7]], ax=Figure().add_subplot())
    >>> [round(float(bar.get_width()), 2) for bar in ax.patches]
    [0.86, 0.06, 0.09]
    """
    parts = variance_components(ratings, categories=categories)
    return shown(components_picture(parts), ax)


def components_picture(parts: VarianceComponents) -> Picture:
    """Return the variances as shares of their sum, with standard deviations."""
    total = parts.items + parts.raters + parts.residual
    label = f"share of the variance of a rating, by {parts.method}"
    if parts.reason is not None:
        label += f"\nundefined: {parts.reason}"
    elif total == 0.0:
        label += "\nundefined: all ratings are alike"
    elif parts.negative:
        label += f"\n{_NONE_LESS.format(' and '.join(parts.negative))}"
    else:
        label += "; that of items is ICC(A,1)"

    def draw(axes: Axes) -> None:
        for place, (name, colour) in enumerate(_COLOURS.items()):
            variance = getattr(parts, name)
            share = variance / total if total > 0.0 else math.nan
            axes.barh(place, share, height=0.62, color=colour)
            sd = fixed_or_significant(math.sqrt(variance), 2)
            axes.annotate(
                f"{number(share, 2)}   SD {number(math.nan, 2) if sd == 'nan' else sd}",
                (1.0, place),
                xycoords=("axes fraction", "data"),
                xytext=(6, 0),
                textcoords="offset points",
                va="center",
            )
        axes.set_yticks(range(len(_COLOURS)), list(_COLOURS))
        axes.set_ylim(len(_COLOURS) - 0.5, -0.5)
        axes.set_xlim(0.0, 1.0)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_color(GREY)
        axes.grid(axis="x")
        axes.set_xlabel(label)

    return Picture(5.6, 1.8, draw)

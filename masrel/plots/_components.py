"""The variance of ratings as parts: of items, of raters, and what is left."""

import math
from collections.abc import Sequence

from matplotlib.axes import Axes

from masrel.agreement import Label, VarianceComponents, variance_components
from masrel.plots._cells import rows_of_shares
from masrel.plots._style import BLUE, ORANGE, Picture, shown
from masrel.tables._tables import number

_COLOURS = {"items": BLUE, "raters": ORANGE, "residual": "#999999"}


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
    total = parts.items + parts.raters + parts.residual or math.nan
    negative = " and ".join(parts.negative)
    note = f"{negative}: less than 0 by mean squares, taken as 0"
    if math.isnan(total):
        note = f"undefined: {parts.reason or 'all ratings are alike'}"
    elif not negative:
        note = "the share of items is ICC(A,1)"
    shares = {name: getattr(parts, name) / total for name in _COLOURS}
    texts = [
        f"{number(share, 2)}, SD {number((share * total) ** 0.5, 2, in_units=True)}"
        for share in shares.values()
    ]
    label = f"share of the variance of a rating, by {parts.method}\n{note}"

    def draw(axes: Axes) -> None:
        axes.barh(range(3), list(shares.values()), 0.62, color=list(_COLOURS.values()))
        axes.grid(axis="x")
        rows_of_shares(axes, list(shares), texts, 0.3, label)

    return Picture(5.6, 1.75, draw)

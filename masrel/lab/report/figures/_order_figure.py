"""Orders of drawn schedules: models by places, and what follows what, as heatmaps."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from masrel.lab.schedule._balance import OrderBalance
from masrel.tables._tables import counted

# from never to often: lighter to darker in a grey print, too
_COLOURS = LinearSegmentedColormap.from_list(
    "counts", ["#F7FBFF", "#9ECAE1", "#4292C6", "#08519C", "#08306B"]
)
_MAX_NUMBERS = 16  # columns up to which numbers are written in the cells
_MAX_NAMES = 30  # models whose names are written


def order_figure(panels: Sequence[OrderBalance]) -> Figure:
    """Return two heatmaps a session, one below the other."""
    n_models = max(len(panel.models) for panel in panels)
    n_places = max(len(panel.places[0]) for panel in panels)
    high = 0.9 + min(6.0, max(1.6, 0.2 * n_models))
    wide = 2.2 + min(9.0, 0.2 * n_places + 0.2 * n_models + 2.0)
    figure = Figure(figsize=(max(6.5, wide), high * len(panels) + 0.3))
    rows = figure.subplots(
        len(panels),
        2,
        squeeze=False,
        width_ratios=(min(max(n_places, n_models), 2 * n_models), n_models),
    )
    for (left, right), panel in zip(rows, panels, strict=True):
        _draw(figure, left, panel, panel.places, None)
        _draw(figure, right, panel, panel.pairs, panel.models)
        of = ", ".join(filter(None, (panel.session, panel.site)))
        left.set_title(f"{of}: {counted(panel.n_schedules, 'schedule')}", loc="left")
        left.set_xlabel("place in the session")
        left.set_ylabel("model")
        right.set_xlabel("the model right after it")
    return figure


def _draw(
    figure: Figure,
    axes: Axes,
    panel: OrderBalance,
    counts: Sequence[Sequence[int]],
    columns: Sequence[str] | None,
) -> None:
    # columns: names of the columns; None for places, from 1
    shown = np.array(counts, dtype=np.int64)
    n_rows, n_columns = shown.shape
    image = axes.imshow(
        shown,
        cmap=_COLOURS,
        vmin=0.0,
        vmax=max(1, int(shown.max())),
        aspect="auto",
        extent=(0.5, n_columns + 0.5, n_rows + 0.5, 0.5),
        interpolation="none",
    )
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0, labelsize=7)
    if n_rows <= _MAX_NAMES:
        axes.set_yticks(range(1, n_rows + 1), panel.models)
    if columns is not None and n_columns <= _MAX_NAMES:
        axes.set_xticks(range(1, n_columns + 1), columns, rotation=90)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(nbins=8, integer=True, min_n_ticks=1))
    if n_columns <= _MAX_NUMBERS:
        _write_numbers(axes, shown)
    bar = figure.colorbar(image, cax=axes.inset_axes((1.02, 0.05, 0.03, 0.9)))
    bar.ax.yaxis.set_major_locator(MaxNLocator(nbins=4, integer=True))
    bar.ax.tick_params(labelsize=7)
    bar.outline.set_visible(False)


def _write_numbers(axes: Axes, counts: NDArray[np.int64]) -> None:
    """Write each count into its cell; they are of shape (n_rows, n_columns)."""
    dark = 0.55 * counts.max()
    for (row, column), freq in np.ndenumerate(counts):
        axes.text(
            column + 1,
            row + 1,
            str(freq),
            ha="center",
            va="center",
            fontsize=6,
            color="white" if freq > dark else "black",
        )

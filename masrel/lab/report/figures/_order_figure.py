"""Orders of drawn schedules: models by places, and what follows what, as heatmaps."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from masrel.lab.schedule._balance import OrderBalance
from masrel.plots._cells import cells, name_columns, name_rows, room_of
from masrel.plots._style import SEQUENTIAL, Picture
from masrel.tables._tables import counted

_MAX_NUMBERS = 16  # columns up to which numbers are written in the cells
_CELL, _WIDEST, _HIGHEST = 0.3, 7.0, 5.0  # inches of a cell and of all of them


def order_pictures(panels: Sequence[OrderBalance]) -> list[tuple[str, Picture]]:
    """Return two heatmaps a session, below each other."""
    pictures = []
    for panel in panels:
        of = ", ".join(filter(None, (panel.session, panel.site)))
        places = [str(place + 1) for place in range(len(panel.places[0]))]
        title = f"{of}: {counted(panel.n_schedules, 'schedule')}, by place"
        pictures += [
            (title, _counts(panel.models, places, panel.places)),
            (
                "by the model right after",
                _counts(panel.models, panel.models, panel.pairs),
            ),
        ]
    return pictures


def _counts(
    rows: Sequence[str], columns: Sequence[str], counts: Sequence[Sequence[int]]
) -> Picture:
    of: NDArray[np.int64] = np.array(counts, dtype=np.int64)
    across = min(_CELL, _WIDEST / len(columns))
    down = min(_CELL, _HIGHEST / len(rows))

    def draw(axes: Axes) -> None:
        letters = of.astype(str) if len(columns) <= _MAX_NUMBERS else of[:0].astype(str)
        most = max(1, int(of.max()))
        cells(axes, of, letters, cmap=SEQUENTIAL, vmin=0.0, vmax=most)
        name_rows(axes, rows, down)
        name_columns(axes, columns, across, range(len(columns)))
        axes.set_ylabel("model")

    height = room_of(columns) + down * len(rows) + 0.3
    return Picture(room_of(rows) + across * len(columns) + 0.4, height, draw)

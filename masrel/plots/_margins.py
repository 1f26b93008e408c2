"""Where the axes of a figure go: labels are measured once, and none is cut off.

All axes are in one grid. What stands beside an axes (ticks, labels, titles, texts)
keeps its size, and the axes share what is left; a figure in which too little is left
grows.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from masrel.plots._picture import Measure

_EDGE, _GAP = 4.0, 10.0  # points: around all, and between two axes
_LEAST = 72.0  # points of an axes, across and down
_LEAST_ACROSS = 144.0  # points of all axes of a row
_POINTS = 72.0  # an inch

_Floats = NDArray[np.float64]
_METRICS = Measure()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Tracks:
    """The columns of a grid from the left, or its rows from the top."""

    # (n,): how wide each is beside the others, and the points it needs around its axes
    ratios: _Floats
    before: _Floats
    after: _Floats

    @property
    def around(self) -> float:
        """Points that are for no axes."""
        gaps = _GAP * (self.ratios.size - 1)
        return float(self.before.sum() + self.after.sum() + gaps + 2.0 * _EDGE)

    def ends(self, points: float) -> tuple[_Floats, _Floats]:
        """Return where the axes of each begin and end within so many points."""
        widths = self.ratios / self.ratios.sum() * (points - self.around)
        whole = self.before + widths + self.after + _GAP
        starts = _EDGE + np.cumsum(whole) - whole + self.before
        return starts, starts + widths


def arrange(figure: Figure, stamp: Text | None) -> None:
    """Place the axes of a figure between its stamp above and its legends below."""
    every = [axes for axes in figure.axes if axes.get_subplotspec() is not None]
    _place(figure, every, stamp)
    if _wrap_labels(every, figure.bbox.width):
        _place(figure, every, stamp)
    if stamp is not None:
        stamp.set_y(1.0 - _EDGE / (figure.get_figheight() * _POINTS))


def _place(figure: Figure, every: Sequence[Axes], stamp: Text | None) -> None:
    # every: the axes in the figure's grid; a figure without one stays as it is
    if not every:
        return
    above = 0.0 if stamp is None else _size(stamp)[1] + _EDGE
    legends = [_size(legend) for legend in figure.legends]
    below = sum(down + _EDGE for _, down in legends)
    columns, rows = _tracks([axes for axes in every if axes.get_visible()])
    n, m = columns.ratios.size, rows.ratios.size
    width, height = figure.get_size_inches() * _POINTS
    width = max([width, *(across + 2.0 * _EDGE for across, _ in legends)])
    width = max(width, columns.around + max(n * _LEAST, _LEAST_ACROSS))
    height = max(height, above + below + rows.around + m * _LEAST)
    figure.set_size_inches(width / _POINTS, height / _POINTS)
    lefts, rights = columns.ends(width)
    tops, bottoms = rows.ends(height - above - below)
    for axes in every:
        across, down = _cell(axes).colspan, _cell(axes).rowspan
        left, right = lefts[across.start], rights[across.stop - 1]
        top, bottom = above + tops[down.start], above + bottoms[down.stop - 1]
        box = (left, height - bottom, right - left, bottom - top)
        axes.set_position(Bbox.from_bounds(*np.divide(box, (width, height) * 2)))


def _wrap_labels(every: Sequence[Axes], width: float) -> bool:
    # whether a label below an axes was longer than there is room for, and is no more
    wrapped = False
    for axes in every:
        label, box = axes.xaxis.label, axes.bbox
        if not label.get_text():
            continue
        room = box.width
        if _cell(axes).get_gridspec().ncols == 1:
            middle = 0.5 * (box.x0 + box.x1)
            room = 2.0 * min(middle, width - middle)
        across, _ = _size(label)
        if across > room:
            letters = int(max(map(len, label.get_text().split("\n"))) * room / across)
            label.set_text(textwrap.fill(label.get_text(), max(letters, 8)))
            wrapped = True
    return wrapped


def _size(artist: Any) -> tuple[float, float]:
    box = artist.get_window_extent(_METRICS)
    return float(box.width), float(box.height)


def _cell(axes: Axes) -> SubplotSpec:
    spec = axes.get_subplotspec()
    if spec is None:
        raise ValueError("these axes are in no grid")
    return spec


def _tracks(every: Sequence[Axes]) -> tuple[_Tracks, _Tracks]:
    # what the labels of each axes need beyond it, at most, by column and by row
    grid = _cell(every[0]).get_gridspec()
    n_rows, n_columns = grid.get_geometry()
    across, down = np.zeros((2, n_columns)), np.zeros((2, n_rows))
    for axes in every:
        inner = axes.bbox
        outer = axes.get_tightbbox(_METRICS, for_layout_only=True) or inner
        columns, rows = _cell(axes).colspan, _cell(axes).rowspan
        for needs, place, points in (
            (across[0], columns.start, inner.x0 - outer.x0),
            (across[1], columns.stop - 1, outer.x1 - inner.x1),
            (down[0], rows.start, outer.y1 - inner.y1),
            (down[1], rows.stop - 1, inner.y0 - outer.y0),
        ):
            needs[place] = max(needs[place], points)
    ratios = grid.get_width_ratios() or [1.0] * n_columns
    heights = grid.get_height_ratios() or [1.0] * n_rows
    return (
        _Tracks(ratios=np.array(ratios), before=across[0], after=across[1]),
        _Tracks(ratios=np.array(heights), before=down[0], after=down[1]),
    )

"""From a figure to its files: its axes are placed, and it is drawn once for all forms.

Labels are measured once, and none is cut off. All axes are in one grid: what stands
beside an axes (ticks, labels, titles, texts) keeps its size, and the axes share what is
left; a figure in which too little is left grows. Vectors and pixels are drawn at once.
"""

import functools
import io
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.backends import backend_agg, backend_mixed, backend_svg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, Bbox, TransformedPath
from numpy.typing import NDArray
from PIL import Image

from masrel.plots._drawn_values import Form

_Floats = NDArray[np.float64]

_DPI = 200  # of pixels, also of those inside vectors
_LEVEL = 3  # of compression: more takes longer, and gains nothing
_POINTS = 72  # to the inch: the unit of vectors, and of all that is laid out
_EDGE, _GAP = 4.0, 10.0  # points: around all, and between two axes
_LEAST = 72.0  # points of an axes, across and down
_LEAST_ACROSS = 144.0  # points of all axes of a row

# These have no types.
_RendererAgg: Any = backend_agg.RendererAgg
_RendererSVG: Any = backend_svg.RendererSVG
_MixedModeRenderer: Any = backend_mixed.MixedModeRenderer


def files_of(figure: Figure, forms: Sequence[Form]) -> dict[Form, bytes]:
    """Return the files of a figure that is laid out, without a time of day."""
    if "pdf" in forms:
        return {"pdf": _pdf(figure)}
    figure.dpi = _POINTS
    width, height = figure.get_size_inches()
    vectors = io.StringIO()
    svg = _RendererSVG(
        width * _POINTS, height * _POINTS, vectors,
        image_dpi=_DPI, metadata={"Date": None},
    )  # fmt: skip
    pixels = _RendererAgg(int(width * _DPI + 0.5), int(height * _DPI + 0.5), _DPI)
    both = _VectorsAndPixels(svg, pixels)
    renderer = _MixedModeRenderer(figure, width, height, _DPI, both)
    figure.draw(renderer)
    svg.finalize()
    files: dict[Form, bytes] = {"svg": vectors.getvalue().encode()}
    if "png" in forms:
        files["png"] = _png(pixels)
    return {form: files[form] for form in forms}


def _png(pixels: Any) -> bytes:
    file = io.BytesIO()
    # The ground is white: what shines through nothing needs no fourth channel.
    image = Image.fromarray(np.asarray(pixels.buffer_rgba())[..., :3])
    image.save(file, "png", dpi=(_DPI, _DPI), compress_level=_LEVEL)
    return file.getvalue()


def _pdf(figure: Figure) -> bytes:
    # Imported here: it loads what subsets fonts, which takes as long as a report.
    from matplotlib.backends.backend_pdf import FigureCanvasPdf

    file = io.BytesIO()
    canvas = FigureCanvasPdf(figure)
    canvas.print_figure(file, format="pdf", dpi=_DPI, metadata={"CreationDate": None})
    return file.getvalue()


@functools.cache
def _text_size(text: str, prop: Any, ismath: Any) -> tuple[float, float, float]:
    return RendererBase().get_text_width_height_descent(text, prop, ismath)


class Measure(RendererBase):
    """Knows how large texts are, once for all figures, and draws nothing."""

    def get_text_width_height_descent(
        self, s: str, prop: Any, ismath: Any
    ) -> tuple[float, float, float]:
        return _text_size(s, prop, ismath)


class _VectorsAndPixels(Measure):
    """Draws into an SVG, and the same, enlarged, into pixels."""

    def __init__(self, svg: Any, pixels: Any) -> None:
        super().__init__()
        self._svg, self._pixels = svg, pixels
        self._scale = _DPI / _POINTS
        self._enlarged = Affine2D().scale(self._scale)

    def get_canvas_width_height(self) -> tuple[float, float]:
        return self._svg.width, self._svg.height

    def get_image_magnification(self) -> float:
        return self._scale

    def open_group(self, s: str, gid: str | None = None) -> None:
        self._svg.open_group(s, gid)

    def close_group(self, s: str) -> None:
        self._svg.close_group(s)

    def draw_path(self, gc: Any, path: Any, transform: Any, face: Any = None) -> None:
        self._svg.draw_path(gc, path, transform, face)
        large = transform + self._enlarged
        self._pixels.draw_path(self._large(gc), path, large, face)

    def draw_markers(
        self, gc: Any, marker_path: Any, marker_trans: Any, path: Any, trans: Any,
        face: Any = None,
    ) -> None:  # fmt: skip
        self._svg.draw_markers(gc, marker_path, marker_trans, path, trans, face)
        large, places = marker_trans + self._enlarged, trans + self._enlarged
        self._pixels.draw_markers(
            self._large(gc), marker_path, large, path, places, face
        )

    def draw_path_collection(
        self, gc: Any, master_transform: Any, paths: Any, all_transforms: Any,
        offsets: Any, offset_trans: Any, facecolors: Any, edgecolors: Any,
        linewidths: Any, linestyles: Any, *others: Any, **named: Any,
    ) -> None:  # fmt: skip
        self._svg.draw_path_collection(
            gc, master_transform, paths, all_transforms, offsets, offset_trans,
            facecolors, edgecolors, linewidths, linestyles, *others, **named,
        )  # fmt: skip
        self._pixels.draw_path_collection(
            self._large(gc), (master_transform + self._enlarged).frozen(), paths,
            all_transforms, offsets, (offset_trans + self._enlarged).frozen(),
            facecolors, edgecolors, linewidths, linestyles, *others, **named,
        )  # fmt: skip

    def draw_image(
        self, gc: Any, x: float, y: float, im: Any, transform: Any = None
    ) -> None:
        self._svg.draw_image(gc, x, y, im, transform)
        x, y = int(x * self._scale + 0.5), int(y * self._scale + 0.5)
        self._pixels.draw_image(self._large(gc), x, y, im)

    def draw_text(
        self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float,
        ismath: Any = False, mtext: Any = None,
    ) -> None:  # fmt: skip
        self._svg.draw_text(gc, x, y, s, prop, angle, ismath, mtext)
        x, y = x * self._scale, y * self._scale
        self._pixels.draw_text(self._large(gc), x, y, s, prop, angle, ismath, mtext)

    def _large(self, gc: Any) -> GraphicsContextBase:
        large: GraphicsContextBase = self._pixels.new_gc()
        large.copy_properties(gc)
        # Widths and dashes are in points; where it is clipped is not.
        if (rectangle := gc.get_clip_rectangle()) is not None:
            large.set_clip_rectangle(Bbox(rectangle.get_points() * self._scale))
        path, transform = gc.get_clip_path()
        if path is not None:
            large.set_clip_path(TransformedPath(path, transform + self._enlarged))
        return large


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

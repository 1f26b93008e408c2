"""How a figure becomes files: drawn once, as vectors and as pixels at a time."""

import functools
import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.backends import backend_agg, backend_mixed, backend_svg
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D, Bbox, TransformedPath
from PIL import Image

from masrel.plots._drawn_values import Form

_DPI = 200  # of pixels, also of those inside vectors
_LEVEL = 3  # of compression: more takes longer, and gains nothing
_POINTS = 72  # to the inch: the unit of vectors, and of all that is laid out

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

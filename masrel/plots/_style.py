"""The look all figures share, and how a figure becomes files.

Colours are Okabe and Ito's, which colour-blind readers tell apart; shapes, line
styles and text repeat what the colours say, so that a grey print loses nothing.
"""

import hashlib
import io
import os
import re
import textwrap
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, cast

import matplotlib as mpl
from matplotlib import font_manager
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_mixed import MixedModeRenderer
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import get_font
from matplotlib.text import Text
from matplotlib.transforms import (
    Affine2DBase,
    ScaledTranslation,
    Transform,
    blended_transform_factory,
)

from masrel.errors import MissingLettersWarning
from masrel.plots._drawn_values import Form

BLACK = "#000000"
GREY = "#6B6B6B"
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILLION = "#D55E00"
ALARM = "#A63C00"  # darker, so that letters in it can be read on white

GRID = "#DDDDDD"
PAGE = "#FFFFFF"
"""What is left blank between marks."""

ON_CELL = ("#111111", "#FEFEFE")
"""Letters on a light cell and on a dark one, whatever the page is."""

SEQUENTIAL = LinearSegmentedColormap.from_list(
    "sequential", ["#D6E6F2", "#5BA3D0", "#00487A"]
)
"""From little to much, lighter to darker: in a grey print, too."""

DASHES = (0, (4, 3))
"""Line style of what is a reference, not data."""

BANDS = ("#E9EFF5", "#C9D9E8")
"""Ground of where most, and where half, of many lines are."""

SHADES = {"pre-catch": "#FFFFFF", "catch": "#D9D9D9", "post-catch": "#F0F0F0"}
"""Background of each phase of a stretch."""

_POINTS = 72  # to the inch
_FONT = "DejaVu Sans"  # ships with matplotlib: the same everywhere

STYLE: dict[Any, object] = {
    "font.family": _FONT,
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "svg.hashsalt": "masrel",  # ids of an SVG are otherwise random
    "svg.fonttype": "path",
    "pdf.fonttype": 42,  # letters stay letters, as journals ask
    "text.hinting": "none",  # as in vectors, where texts are measured
    "figure.dpi": _POINTS,  # a point is a pixel where labels are measured
    "axes.titley": 1.0,  # titles stand where they are placed, and are not moved about
    "figure.constrained_layout.use": True,  # no label is cut off
}

_SCREEN = 120  # pixels to the inch in a notebook
_DPI = 200  # of pixels, also of those inside vectors
_LEAST_ACROSS, _LEAST_DOWN = 100.0, 72.0  # points of an axes
_ABOVE = 20.0  # points of a stamp
_HOW: dict[Form, dict[str, Any]] = {  # files hold no time
    # far sooner packed than with the most that can be, for a twentieth more bytes
    "png": {"metadata": {"Software": None}, "pil_kwargs": {"compress_level": 3}},
    "pdf": {"metadata": {"CreationDate": None}},
}
_OF_PAGE = {  # colours that follow the page into the dark
    BLACK: "currentColor",
    BLUE: "var(--blue)",
    GREY: "var(--soft)",
    PAGE: "var(--page)",
    GRID: "var(--rule)",
    ALARM: "var(--alarm)",
    BANDS[0]: "var(--band)",
    BANDS[1]: "var(--middle)",
}

_MAX_LETTERS = 22  # of a name


def short_name(name: str, most: int = _MAX_LETTERS) -> str:
    """Return a name that has room at an axis: the middle of a long one goes."""
    # names often differ at their end
    half = (most - 1) // 2
    return name if len(name) <= most else f"{name[:half]}…{name[-half:]}"


def short_names(names: Sequence[str]) -> list[str]:
    """Return names that have room at an axis, and differ where the whole ones do."""
    n_names, most = len({*names}), _MAX_LETTERS
    # where both ends of two are the same, more of all is kept
    while len({short_name(name, most) for name in names}) < n_names:
        most += 2
    return [short_name(name, most) for name in names]


# without what says how figures are shown, not how they look
_DEFAULTS = {
    key: value
    for key, value in mpl.rcParamsDefault.items()
    if key not in ("backend", "backend_fallback")
}


@contextmanager
def house_style(*, parse_math: bool = False) -> Iterator[None]:
    """Draw in the house style alone: a reader's own matplotlibrc changes nothing."""
    # parse_math: as powers of ten need it; a title or a name may have any letters in it
    # not mpl.rcdefaults, which reads every style that matplotlib has
    look = {**_DEFAULTS, **STYLE, "text.parse_math": parse_math}
    with mpl.rc_context(look), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # which is said of all at once
        yield


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture before it is drawn: the inches it needs, and what draws it."""

    width: float
    height: float
    draw: Callable[[Axes], None]


def shown(picture: Picture, ax: Axes | None) -> Axes:
    """Draw a picture on given axes, or on those of a new figure of pyplot."""
    with house_style():
        if ax is None:
            import matplotlib.pyplot as plt  # whose figures notebooks show

            size = picture.width, picture.height
            ax = plt.figure(figsize=size, dpi=_SCREEN).add_subplot()
        picture.draw(ax)
        complete_fonts(ax)
    return ax


def stacked(pictures: Sequence[tuple[str, Picture]]) -> Figure:
    """Return a figure of pictures below each other, each under its title."""
    heights = [picture.height for _, picture in pictures]
    width = max(picture.width for _, picture in pictures)
    figure = Figure(figsize=(width, sum(heights)))
    FigureCanvasAgg(figure)
    rows = figure.subplots(len(pictures), squeeze=False, height_ratios=heights)
    for ax, (title, picture) in zip(rows[:, 0], pictures, strict=True):
        picture.draw(ax)
        outer = ax.get_tightbbox(for_layout_only=True) if title else None
        above = 0.0 if outer is None else outer.y1 - ax.bbox.y1  # names of columns
        ax.set_title(title, loc="left", pad=6.0 + above)
    return figure


def inches_from(ax: Axes, x: float, y: float) -> Transform:
    """Return the transform of inches from a point of the axes, given in shares."""
    figure = cast(Figure, ax.get_figure(root=True))
    return figure.dpi_scale_trans + ScaledTranslation(
        x, y, cast(Affine2DBase, ax.transAxes)
    )


def colour_bar(axes: Axes, drawn: Any, label: str, **how: Any) -> Colorbar:
    """Explain the colours of a map below it, as wide as the axes."""
    place = blended_transform_factory(axes.transAxes, inches_from(axes, 0.0, 0.0))
    bar = axes.inset_axes((0.0, -0.27, 1.0, 0.11), transform=place)
    return bar.figure.colorbar(
        drawn, cax=bar, orientation="horizontal", label=label, **how
    )


def legend_below(
    ax: Axes, handles: Sequence[Any], *, ncols: int = 1, **how: Any
) -> None:
    """Explain marks below the axes, whatever stands there already."""
    if not handles:
        return
    # texts are as high however large the axes become
    outer = ax.get_tightbbox(for_layout_only=True)
    below = 0.0 if outer is None else min(outer.y0 - ax.bbox.y0, 0.0)
    dpi = cast(Figure, ax.get_figure(root=True)).dpi
    ax.legend(
        handles=handles,
        ncols=ncols,
        fontsize=8,
        loc="upper center",
        bbox_to_anchor=(0.0, below / dpi - 0.07),
        bbox_transform=inches_from(ax, 0.5, 0.0),
        borderaxespad=0.0,
        **how,
    )


def finished(
    figure: Figure, *, stamp: str, forms: Sequence[Form] = ("png", "svg")
) -> dict[Form, bytes]:
    """Return the files of a figure of the house style, under its stamp."""
    if set(forms) - {"inline"}:  # whose letters are the reader's
        complete_fonts(figure)
    lay_out(figure, stamp)
    # The same layout for every form: with this setting each form begins anew with one.
    with mpl.rc_context({"figure.constrained_layout.use": False}):
        figure.set_layout_engine(None)  # "none" leaves one, for which all is drawn
        vectors = [form for form in forms if form not in _HOW]
        files = _vectors(figure, vectors) if vectors else {}
        for form in (form for form in forms if form in _HOW):
            file = io.BytesIO()
            figure.canvas.print_figure(file, format=form, dpi=_DPI, **_HOW[form])
            files[form] = file.getvalue()
    return files


_MARK = "\N{START OF TEXT}"  # no text of a figure can have it
# a file has curves for its letters, a page those of its reader
_FONT_TYPES: dict[Form, str] = {"svg": "path", "inline": "none"}


class _Vectors(RendererSVG):
    """Draws texts once a form, with a mark before each and after the last."""

    writer: Any
    forms: Sequence[Form]

    def draw_text(self, *args: Any, **options: Any) -> None:
        for form in self.forms:
            self.writer.comment(_MARK)
            mpl.rcParams["svg.fonttype"] = _FONT_TYPES[form]
            super().draw_text(*args, **options)  # type: ignore[no-untyped-call]
        self.writer.comment(_MARK)


def _vectors(figure: Figure, forms: Sequence[Form]) -> dict[Form, bytes]:
    # by one drawing, as nothing takes longer
    file, (width, height) = io.StringIO(), figure.get_size_inches()
    vectors: Any = _Vectors(  # type: ignore[no-untyped-call]
        *(_POINTS * width, _POINTS * height, file),
        image_dpi=_DPI,
        metadata={"Date": None},
    )
    vectors.forms = forms
    mixed: Any = MixedModeRenderer  # by which some artists go through pixels
    figure.draw(mixed(figure, width, height, _DPI, vectors))
    vectors.finalize()
    parts = file.getvalue().split(f"<!-- {_MARK} -->\n")
    n = len(forms) + 1  # those of each text, and what is before it
    svgs = {
        form: "".join(p.rstrip(" ") for i, p in enumerate(parts) if i % n in (0, place))
        for place, form in enumerate(forms, start=1)
    }
    return {
        form: (_inlined(svg) if form == "inline" else svg).encode()
        for form, svg in svgs.items()
    }


def _inlined(svg: str) -> str:
    """Return the element of an SVG, its colours those of the page around it."""
    svg = re.sub(r"(?s) *<metadata>.*?</metadata>\n", "", svg[svg.index("<svg") :])
    svg = re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg)
    for colour, of_page in _OF_PAGE.items():
        svg = svg.replace(colour.lower(), of_page)
    # names of their own, as several stand in one page
    key = hashlib.sha256(svg.encode()).hexdigest()[:8]
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>f{key}-", svg)
    return svg.replace("<svg ", '<svg fill="currentColor" ', 1)


def lay_out(figure: Figure, stamp: str) -> None:
    """Place the axes of a figure between its stamp above and its legends below."""
    FigureCanvasAgg(figure)  # which measures texts by one renderer, not by one a text
    for axes in figure.axes:
        axes.xaxis.label.set_wrap(True)
    _enlarge(figure)
    if stamp:
        is_loud = stamp.isupper()
        # 7 pt letters are about 0.054 in wide; a long source goes on two lines
        figure.suptitle(
            textwrap.fill(stamp, int(figure.get_figwidth() / 0.054) - 2),
            x=0.995,
            ha="right",
            va="top",
            fontsize=9.5 if is_loud else 7,
            color=ALARM if is_loud else GREY,
            weight="bold" if is_loud else "normal",
        )
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
    # the last digits of the solver depend on where its variables lie in memory
    for axes in figure.axes:
        place = axes.get_position(original=True).bounds
        axes.set_position(tuple(round(part, 9) for part in place))


def _enlarge(figure: Figure) -> None:
    # as far as long names, or a wide legend, leave too little room for the axes
    across: dict[int, float] = defaultdict(float)  # points each row of axes needs
    down: dict[int, float] = defaultdict(float)  # and each column
    for axes in figure.axes:
        place, inner = axes.get_subplotspec(), axes.bbox
        outer = axes.get_tightbbox(for_layout_only=True)
        if place is not None and outer is not None:
            across[place.rowspan.start] += outer.width - inner.width + _LEAST_ACROSS
            down[place.colspan.start] += outer.height - inner.height + _LEAST_DOWN
    legends = [legend.get_window_extent() for legend in figure.legends]
    beyond = _ABOVE + sum(legend.height for legend in legends)
    width, height = figure.get_size_inches() * _POINTS
    width = max([width, *across.values(), *(legend.width + 8.0 for legend in legends)])
    height = max([height, *(points + beyond for points in down.values())])
    figure.set_size_inches(width / _POINTS, height / _POINTS)


# ---- fonts for the letters of any script, beside the one that figures are set in ----


def complete_fonts(artist: Artist) -> None:
    """Give all texts of a figure fonts that have their letters, where there are any."""
    texts = [text for text in artist.findobj(Text) if isinstance(text, Text)]
    lacking = {ord(letter) for text in texts for letter in text.get_text()} - {10}
    families = []
    for name, file in _fonts():
        if not lacking:
            break
        if covered := lacking & _letters(file):
            families.append(name)
            lacking -= covered
    if families != [_FONT]:
        for text in texts:
            text.set_fontfamily([_FONT, *families[1:]])
    if lacking:
        warnings.warn(MissingLettersWarning(map(chr, lacking)), stacklevel=4)


def _fonts() -> Iterator[tuple[str, str]]:
    # names and files: our own, the one that the user gives, and those of the system
    yield _FONT, font_manager.findfont(_FONT)
    if chosen := os.environ.get("MASREL_FONT"):
        if Path(chosen).is_file():
            font_manager.fontManager.addfont(chosen)
            chosen = get_font(chosen).family_name
        yield chosen, font_manager.findfont(chosen)
    entries = {of.fname: of.name for of in font_manager.fontManager.ttflist}
    # the last resort has a box for every letter
    real = {file: name for file, name in entries.items() if "Last" not in name}
    yield from sorted((name, file) for file, name in real.items())


@cache
def _letters(file: str) -> frozenset[int]:
    font = get_font(file)
    return frozenset(font.get_charmap()) if font.scalable else frozenset()

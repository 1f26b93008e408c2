"""The look all figures share, and how a figure becomes files.

Colours are Okabe and Ito's, which colour-blind readers tell apart; shapes, line
styles and text repeat what the colours say, so that a grey print loses nothing.
"""

import io
import textwrap
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.figure import Figure

from masrel.plots._drawn_values import Form

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

BLACK = "#000000"
GREY = "#6B6B6B"
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILLION = "#D55E00"
ALARM = "#A63C00"  # darker, so that letters in it can be read on white

DASHES = (0, (4, 3))
"""Line style of what is a reference, not data."""

SHADES = {"pre-catch": "#FFFFFF", "catch": "#D9D9D9", "post-catch": "#F0F0F0"}
"""Background of each phase of a stretch."""

_POINTS = 72  # to the inch

STYLE: "dict[RcKeyType, object]" = {
    "font.family": "DejaVu Sans",  # ships with matplotlib: the same everywhere
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "grid.color": "#DDDDDD",
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

_DPI = 200  # of pixels, also of those inside vectors
_LEAST_ACROSS, _LEAST_DOWN = 100.0, 72.0  # points of an axes
_ABOVE = 20.0  # points of a stamp
_NO_TIME: dict[Form, dict[str, None]] = {  # what no file is to hold
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}

_MAX_LETTERS = 22  # of a name


def short_name(name: str) -> str:
    """Return a name that has room at an axis: the middle of a long one goes."""
    # names often differ at their end
    if len(name) <= _MAX_LETTERS:
        return name
    half = (_MAX_LETTERS - 1) // 2
    return f"{name[:half]}…{name[-half:]}"


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
    with mpl.rc_context({**_DEFAULTS, **STYLE, "text.parse_math": parse_math}):
        yield


def finished(
    figure: Figure, *, stamp: str, forms: Sequence[Form] = ("png", "svg")
) -> dict[Form, bytes]:
    """Return the files of a figure of the house style, under its stamp."""
    lay_out(figure, stamp)
    files: dict[Form, bytes] = {}
    for form in forms:
        file = io.BytesIO()
        figure.canvas.print_figure(file, format=form, dpi=_DPI, metadata=_NO_TIME[form])
        files[form] = file.getvalue()
    return files


def lay_out(figure: Figure, stamp: str) -> None:
    """Place the axes of a figure between its stamp above and its legends below."""
    for axes in figure.axes:
        axes.xaxis.label.set_wrap(True)
    _enlarge(figure)
    if stamp:
        is_loud = stamp.isupper()
        # 7 pt letters are about 0.054 in wide; a long source goes on two lines
        n_letters = int(figure.get_figwidth() / 0.054) - 2
        figure.suptitle(
            textwrap.fill(stamp, n_letters),
            x=0.995,
            ha="right",
            va="top",
            fontsize=9.5 if is_loud else 7,
            color=ALARM if is_loud else GREY,
            weight="bold" if is_loud else "normal",
        )
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the same for every form


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

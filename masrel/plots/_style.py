"""The look all figures share, and how a figure becomes files.

Colours are Okabe and Ito's, which colour-blind readers tell apart; shapes, line
styles and text repeat what the colours say, so that a grey print loses nothing.
"""

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from masrel.plots._matplotlib import mpl

# isort: split
from matplotlib.figure import Figure
from matplotlib.text import Text

from masrel.plots._drawn_values import Form
from masrel.plots._picture import arrange, files_of

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

_NO_STYLE = ("backend", "backend_fallback")
"""What says how figures are shown, not how they look."""

SHADES = {"pre-catch": "#FFFFFF", "catch": "#D9D9D9", "post-catch": "#F0F0F0"}
"""Background of each phase of a stretch."""

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
    "figure.dpi": 72,  # a point is a pixel where labels are measured
    "axes.titley": 1.0,  # titles stand where they are placed, and are not moved about
}


_MAX_LETTERS = 22  # of a name


def short_name(name: str) -> str:
    """Return a name that has room at an axis: the middle of a long one goes."""
    # names often differ at their end
    if len(name) <= _MAX_LETTERS:
        return name
    half = (_MAX_LETTERS - 1) // 2
    return f"{name[:half]}…{name[-half:]}"


_DEFAULTS = {
    key: value for key, value in mpl.rcParamsDefault.items() if key not in _NO_STYLE
}


@contextmanager
def house_style(*, parse_math: bool = False) -> Iterator[None]:
    """Draw in the house style alone: a reader's own matplotlibrc changes nothing."""
    # parse_math: as powers of ten need it; a title or a name may have any letters in it
    with mpl.rc_context():
        # not mpl.rcdefaults, which reads every style that matplotlib has
        mpl.rcParams.update(_DEFAULTS)
        mpl.rcParams.update(STYLE)
        mpl.rcParams["text.parse_math"] = parse_math
        yield


def finished(
    figure: Figure, *, stamp: str, forms: Sequence[Form] = ("png", "svg")
) -> dict[Form, bytes]:
    """Return the files of a figure of the house style, under its stamp."""
    arrange(figure, _stamp(figure, stamp) if stamp else None)
    return files_of(figure, forms)


def _stamp(figure: Figure, text: str) -> Text:
    is_loud = text.isupper()
    # 7 pt letters are about 0.054 in wide; a long source goes on two lines
    n_letters = int(figure.get_figwidth() / 0.054) - 2
    return figure.text(
        0.995,
        1.0,
        textwrap.fill(text, n_letters),
        ha="right",
        va="top",
        fontsize=9.5 if is_loud else 7,
        color=ALARM if is_loud else GREY,
        weight="bold" if is_loud else "normal",
    )

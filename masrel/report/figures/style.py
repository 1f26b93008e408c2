"""The look all figures share, and how a figure becomes files.

Colours are Okabe and Ito's, which colour-blind readers tell apart; shapes, line
styles and text repeat what the colours say, so that a grey print loses nothing.
"""

import io
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

__all__ = [
    "BLACK",
    "BLUE",
    "DASHES",
    "GREY",
    "ORANGE",
    "SHADES",
    "VERMILLION",
    "Drawn",
    "Form",
    "as_bytes",
    "finish",
    "house_style",
    "put_stamp",
]

Form = Literal["png", "svg", "pdf"]
"""What a figure's file can be."""

BLACK = "#000000"
GREY = "#6B6B6B"
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILLION = "#D55E00"

DASHES = (0, (4, 3))
"""Line style of what is a reference, not data."""

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
    "figure.constrained_layout.use": True,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A finished figure.

    Attributes
    ----------
    png, svg : bytes
        Its two files; the same data give the same bytes.
    """

    png: bytes = field(repr=False)
    svg: bytes = field(repr=False)


@contextmanager
def house_style() -> Iterator[None]:
    """Draw in the house style alone: a reader's own matplotlibrc changes nothing."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


def finish(figure: Figure, stamp: str) -> Drawn:
    """Put the stamp on a figure and make its files."""
    put_stamp(figure, stamp)
    return Drawn(png=as_bytes(figure, "png"), svg=as_bytes(figure, "svg"))


def put_stamp(figure: Figure, stamp: str) -> None:
    """Say at the top of a figure where its data come from."""
    if not stamp:
        return
    loud = stamp.isupper()
    # 7 pt letters are about 0.054 in wide; a long source goes on two lines
    n_letters = int(figure.get_figwidth() / 0.054) - 2
    figure.suptitle(
        textwrap.fill(stamp, n_letters),
        x=0.995,
        ha="right",
        fontsize=9.5 if loud else 7,
        color=VERMILLION if loud else GREY,
        weight="bold" if loud else "normal",
    )


def as_bytes(figure: Figure, form: Form) -> bytes:
    """Make one file of a figure."""
    file = io.BytesIO()
    if form == "png":
        metadata = {"Software": None}
        canvas = FigureCanvasAgg(figure)
        canvas.print_figure(file, format="png", dpi=200, metadata=metadata)
    elif form == "svg":
        FigureCanvasSVG(figure).print_figure(
            file, format="svg", metadata={"Date": None}
        )
    else:
        FigureCanvasPdf(figure).print_figure(
            file, format="pdf", metadata={"CreationDate": None}
        )
    return file.getvalue()

"""Pictures of agreement, each a function of results or ratings and of axes.

Every one takes `ax`, and draws on a new figure of pyplot without it. `draw` makes
files of what they show, the same bytes for the same values.
"""

import contextlib
import importlib
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from masrel.plots._drawn_values import Drawn, Form

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from masrel.plots._forest import forest
    from masrel.plots._grades import categories, confusion, grades, items
    from masrel.plots._latent_scale import latent
    from masrel.plots._limits_figure import bland_altman
    from masrel.plots._rater_pairs import components, pairs
    from masrel.plots._traces import traces

__all__ = [
    "bland_altman",
    "categories",
    "components",
    "confusion",
    "draw",
    "forest",
    "grades",
    "items",
    "latent",
    "pairs",
    "traces",
]

_HOMES = {
    "bland_altman": "_limits_figure",
    "categories": "_grades",
    "components": "_rater_pairs",
    "confusion": "_grades",
    "forest": "_forest",
    "grades": "_grades",
    "items": "_grades",
    "latent": "_latent_scale",
    "pairs": "_rater_pairs",
    "traces": "_traces",
}


def __getattr__(name: str) -> object:
    # one picture loads what no other needs
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    _load_matplotlib()
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)


def draw(
    content: Drawn,
    *,
    stamp: str,
    forms: Sequence[Form] = ("png", "svg"),
) -> dict[Form, bytes]:
    """Draw values in the house style.

    Parameters
    ----------
    content : Drawn
        What is drawn.
    stamp : str
        The line that says where the data come from; none if empty.
    forms : sequence of {"png", "svg", "pdf", "inline"}, optional
        Which files to make.

    Returns
    -------
    dict of str to bytes
        Each form's file.
    """
    _load_matplotlib()
    from masrel.plots._style import Picture, finished, house_style, stacked

    with house_style():
        drawn = _drawn(content)
        if isinstance(drawn, Picture):
            drawn = [("", drawn)]
        figure = stacked(drawn) if isinstance(drawn, list) else drawn
        return finished(figure, stamp=stamp, forms=forms)


def _on_axes(content: Drawn, ax: "Axes | None", stamp: str) -> "Axes":
    """Draw the first picture on axes, or on those of a new figure of pyplot."""
    _load_matplotlib()
    from masrel.plots._style import ALARM, shown

    drawn = _drawn(content)
    ax = shown(drawn[0][1] if isinstance(drawn, list) else drawn, ax)
    ax.set_title(stamp, loc="right", color=ALARM, weight="bold", fontsize=8)
    return ax


def _drawn(content: Drawn) -> Any:
    # what its function gives; one figure loads what no other needs
    module, _, function = content.drawer.partition(":")
    return getattr(importlib.import_module(module), function)(*content.arguments)


def _load_matplotlib() -> None:
    """Load it whatever backend the environment names: none is needed here."""
    # It cannot be loaded where MPLBACKEND names a backend that is not there.
    if "matplotlib" in sys.modules:
        return
    backend = os.environ.pop("MPLBACKEND", None)
    import matplotlib as mpl

    if backend is not None:
        os.environ["MPLBACKEND"] = backend
        with contextlib.suppress(ValueError):
            mpl.rcParams["backend"] = backend

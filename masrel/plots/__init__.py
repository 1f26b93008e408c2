"""Figures of agreement, and how every figure is drawn.

In: what to draw, as plain frozen values. Out: PNG, SVG or PDF, the same bytes for the
same values.
"""

import contextlib
import importlib
import os
import sys
from collections.abc import Sequence

from masrel.plots._drawn_values import Content, Drawn, Form

__all__ = ["draw"]


def draw(
    content: Content | Drawn,
    *,
    stamp: str,
    forms: Sequence[Form] = ("png", "svg"),
) -> dict[Form, bytes]:
    """Draw values in the house style.

    Parameters
    ----------
    content : Content or Drawn
        What is drawn.
    stamp : str
        The line that says where the data come from; none if empty.
    forms : sequence of {"png", "svg", "pdf"}, optional
        Which files to make.

    Returns
    -------
    dict of str to bytes
        Each form's file.
    """
    _load_matplotlib()
    from masrel.plots._style import finished, house_style

    with house_style():
        module, _, function = content.drawer.partition(":")
        # one figure loads what no other needs
        drawer = getattr(importlib.import_module(module), function)
        return finished(drawer(*content.arguments), stamp=stamp, forms=forms)


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

"""Figures of agreement, and how every figure is drawn.

In: what to draw, as plain frozen values. Out: PNG, SVG or PDF, the same bytes for the
same values.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.plots._style import draw

__all__ = ["draw"]


def __getattr__(name: str) -> object:
    # matplotlib is loaded when something is drawn
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from masrel.plots import _style

    return getattr(_style, name)

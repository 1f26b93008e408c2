"""Figures: the only package that draws.

In: what to draw, as plain frozen values. Out: PNG, SVG or PDF, the same bytes for the
same values.
"""

from masrel.report.figures._style import draw

__all__ = ["draw"]

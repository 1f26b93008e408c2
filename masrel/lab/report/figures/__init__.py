"""Figures of the laboratory, drawn from plain values as those of `masrel.plots` are."""

from masrel.lab.report.figures._processes import draw_all

__all__ = ["draw_all"]

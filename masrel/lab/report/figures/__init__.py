"""Figures of the laboratory, drawn from plain values as those of `masrel.plots` are."""

"""Estimates against exact fractions, where floating point would lose digits."""

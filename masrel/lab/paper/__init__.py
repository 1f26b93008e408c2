"""Sessions on paper: sheets to print, and what was written on them brought back.

In: a protocol and drawn schedules. Out: printable sheets without a model's name, and
session logs whose grades are from paper.
"""

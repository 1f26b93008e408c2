"""Sessions on paper: sheets to print, and what was written on them brought back.

In: a protocol and drawn schedules. Out: printable sheets without a model's name, and
session logs whose grades are from paper.
"""

from masrel.paper._entry import EnteredSheet, enter_sheet
from masrel.paper._printing import PaperSheets, write_sheets
from masrel.paper._second_entry import SheetDifference, compare_sheet

__all__ = [
    "EnteredSheet",
    "PaperSheets",
    "SheetDifference",
    "compare_sheet",
    "enter_sheet",
    "write_sheets",
]

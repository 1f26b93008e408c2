"""Sessions on paper: sheets to print, and what was written on them brought back.

In: a protocol and drawn schedules. Out: printable sheets without a model's name, and
session logs whose grades are from paper.
"""

from masrel.lab.paper._entry import compare_sheet, enter_sheet
from masrel.lab.paper._printing import PaperSheets, write_sheets
from masrel.lab.run._state import SheetDifference

__all__ = [
    "PaperSheets",
    "SheetDifference",
    "compare_sheet",
    "enter_sheet",
    "write_sheets",
]

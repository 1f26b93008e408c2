"""Sessions on paper: sheets to print, and what was written on them brought back.

In: a protocol and drawn schedules. Out: printable sheets without a model's name, and
session logs whose grades are from paper.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.lab.paper._differences import SheetDifference
    from masrel.lab.paper._entry import EnteredSheet, compare_sheet, enter_sheet
    from masrel.lab.paper._printing import PaperSheets, write_sheets

__all__ = [
    "EnteredSheet",
    "PaperSheets",
    "SheetDifference",
    "compare_sheet",
    "enter_sheet",
    "write_sheets",
]

_HOMES = {
    "masrel.lab.paper._differences": ("SheetDifference",),
    "masrel.lab.paper._entry": ("EnteredSheet", "compare_sheet", "enter_sheet"),
    "masrel.lab.paper._printing": ("PaperSheets", "write_sheets"),
}


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

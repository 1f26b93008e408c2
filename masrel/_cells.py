"""Cells of CSV files that a spreadsheet would run as formulas.

Such a text is written after an apostrophe, and read without it. A text that begins with
apostrophes and then so gets one more, so that what is read is what was written.
"""

import re

# What begins a formula, and a number that merely begins like one
_FORMULA = re.compile(r"'*[=+\-@\t\r]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


def safe_cell(text: str) -> str:
    """Return a text as a cell that no spreadsheet runs."""
    if _FORMULA.match(text) and not _NUMBER.fullmatch(text):
        return f"'{text}"
    return text


def from_safe_cell(cell: str) -> str:
    """Return the text of a cell that `safe_cell` may have made."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell

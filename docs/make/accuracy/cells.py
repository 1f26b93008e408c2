"""Errors and exact numbers as the cells of Markdown tables."""

from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from docs.make.accuracy.__main__ import Off

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def units(number: float) -> str:
    """Write units in the last place: 0.4, 31, 6·10⁵."""
    if number == 0:
        return "0"
    if number < 9.95:
        return f"{number:.1f}"
    return f"{number:.0f}" if number < 1000 else power(number)


def power(number: float) -> str:
    """Write a number to one digit: 0.05, 4·10⁻¹¹."""
    if 0.01 <= number < 9.5 or number == 0:
        return f"{number:.1g}"
    digits, exponent = f"{number:.0e}".split("e")
    digits = digits.replace("-", "−")
    return f"{digits}·10{str(int(exponent)).translate(_RAISED)}"


def exact(value: Fraction | None) -> str:
    """Write an exact coefficient to some digits; None is 0/0."""
    if value is None:
        return "0/0"
    if value in (0, 1):
        return str(value)
    if abs(1 - value) < Fraction(1, 10**4):
        return f"1 − {power(float(1 - value))}"
    if abs(value) < Fraction(1, 10**4):
        return power(float(value))
    return f"{float(value):.4f}".replace("-", "−")


def error(offs: "Sequence[Off]", *, relative: bool) -> str:
    """Write the largest error of several weights, and of how many if not of all."""
    offered = [off for off in offs if off.is_offered]
    if not offered:
        return "–"
    largest = max(offered, key=lambda off: off.size)
    if largest.note:
        return largest.note.split(":")[0] if largest.is_unasked else largest.note
    if largest.absolute is not None:
        return f"{power(largest.absolute)} abs." if largest.absolute else "0"
    of = f" of {len(offered)}" if len(offered) < len(offs) else ""
    return (power(largest.relative) if relative else units(largest.units)) + of


def both(off: "Off") -> str:
    """Write an error in units and relative."""
    return f"{units(off.units)} ({power(off.relative)})"


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, n_text: int) -> str:
    """Write a table in Markdown, its first columns to the left.

    Only the first column and names of exceptions may be broken into lines.
    """
    bar = ["---"] * n_text + ["---:"] * (len(head) - n_text)
    whole = [[row[0], *map(_unbroken, row[1:])] for row in rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, bar, *whole))


def _unbroken(cell: str) -> str:
    return cell if cell.startswith("crash") else cell.replace(" ", "\N{NO-BREAK SPACE}")

"""Numbers as they are printed: which values are rounded to a text.

Every value between the ends of an interval is printed as that text, and whether the
ends are as well depends on the rule for ties. All is exact: ends are fractions.
"""

import re
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor
from typing import Literal, NamedTuple

from masrel.errors import ParameterError

Rule = Literal["half_even", "half_up"]
"""What becomes of a tie: the even neighbour, or the one further from 0."""

RULES: tuple[Rule, ...] = ("half_even", "half_up")

Window = tuple[int, int]
"""The least and the greatest whole number that is allowed; none where it is less."""

_NUMBER = re.compile(r"[-−]?(\d+\.?\d*|\.\d+)", re.ASCII)
_MAX_DECIMALS = 12


class Bounds(NamedTuple):
    """The values that are rounded to one text."""

    low: Fraction
    high: Fraction
    has_low: bool  # whether the end itself is one of them
    has_high: bool


@dataclass(frozen=True, slots=True)
class PrintedNumber:
    """A number with the decimals that it was printed with."""

    units: int  # the number in units of its last decimal
    decimals: int

    @property
    def value(self) -> Fraction:
        """The number itself."""
        return Fraction(self.units, 10**self.decimals)

    @property
    def half_unit(self) -> Fraction:
        """How far a value may lie from the number."""
        return Fraction(1, 2 * 10**self.decimals)

    def bounds(self, rule: Rule) -> Bounds:
        """Return the values that the rule rounds to the number."""
        if rule == "half_even":
            has_low = has_high = self.units % 2 == 0
        else:  # away from 0: of 0 neither end, of others the end nearer to 0
            has_low, has_high = self.units > 0, self.units < 0
        half = self.half_unit
        return Bounds(self.value - half, self.value + half, has_low, has_high)


def parse_printed(
    text: object, where: str, *, low: int, high: int, example: str
) -> PrintedNumber:
    """Return a printed number between two limits; `where` begins the message."""
    if not isinstance(text, str):
        problem = f"a text such as {example!r}, since its decimals count"
    elif not _NUMBER.fullmatch(text.strip()):
        problem = f"a number with a decimal point and no unit, such as {example!r}"
    else:
        value = Fraction(plain := text.strip().replace("−", "-"))
        decimals = len(plain.partition(".")[2])
        if low <= value <= high and decimals <= _MAX_DECIMALS:
            return PrintedNumber(int(value * 10**decimals), decimals)
        problem = (
            f"at most {_MAX_DECIMALS} decimals"
            if decimals > _MAX_DECIMALS
            else f"a number from {low} to {high}"
        )
    raise ParameterError(f"{where}: needs {problem}, got {text!r}")


def whole_numbers(bounds: Bounds) -> Window:
    """Return the whole numbers within bounds, and at those ends that count."""
    low, high, has_low, has_high = bounds
    return (
        ceil(low) if has_low else floor(low) + 1,
        floor(high) if has_high else ceil(high) - 1,
    )

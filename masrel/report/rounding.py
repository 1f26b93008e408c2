"""Numbers as a reader sees them: the only place that rounds."""

import math
from collections.abc import Sequence
from decimal import Decimal

__all__ = [
    "ABSENT",
    "UNDEFINED",
    "as_given",
    "counted",
    "decimals_given",
    "interval_words",
    "number",
    "percent",
    "whole_or_tenths",
]

ABSENT = "–"
"""What is shown where there is nothing."""

UNDEFINED = "undefined"
"""What is shown for ``nan``."""


def number(value: float | None, digits: int) -> str:
    """Return a number as shown: rounded, with a true minus sign."""
    if value is None:
        return ABSENT
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    if math.isnan(value):
        return UNDEFINED
    text = f"{value:.{digits}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")  # no "-0.000"
    return text.replace("-", "−")


def as_given(value: float) -> str:
    """Return a number somebody chose, with the digits it was given."""
    if not math.isfinite(value):
        return UNDEFINED
    text = f"{Decimal(repr(float(value))):f}"  # no exponent
    return text.removesuffix(".0").replace("-", "−")


def percent(share: float) -> str:
    """Return a share somebody chose in percent, with the digits it was given."""
    return f"{(Decimal(repr(float(share))) * 100).normalize():f}"


def decimals_given(values: Sequence[float]) -> int:
    """Return the decimals with which a column of chosen numbers loses nothing."""
    written = (as_given(value).partition(".")[2] for value in values)
    return max(map(len, written), default=0)


def counted(count: int, noun: str) -> str:
    """Return a count with its noun, in the plural unless there is one."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def whole_or_tenths(values: Sequence[float]) -> int:
    """Return the decimals a column of measurements needs: 0 if all are whole."""
    known = [value for value in values if math.isfinite(value)]
    return 0 if all(float(value).is_integer() for value in known) else 1


def interval_words(low: float, high: float, digits: int = 3) -> str:
    """Return the endpoints of an interval in brackets."""
    if math.isnan(low) or math.isnan(high):
        return f"[{UNDEFINED}]"
    return f"[{number(low, digits)}, {number(high, digits)}]"

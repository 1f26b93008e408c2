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
    """Return a number as shown: rounded, with a true minus sign.

    Parameters
    ----------
    value : float or None
        The number; ``nan`` is shown as undefined, None as absent, no bound as ∞.
    digits : int
        Decimals.

    Returns
    -------
    str
        What is printed.

    Examples
    --------
    >>> number(-0.04649, 3), number(float("nan"), 3), number(None, 3)
    ('−0.046', 'undefined', '–')
    """
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
    """Return a number somebody chose, with the digits it was given.

    Parameters
    ----------
    value : float
        The number.

    Returns
    -------
    str
        What is printed.

    Examples
    --------
    >>> as_given(146.0), as_given(0.35), as_given(1e-5)
    ('146', '0.35', '0.00001')
    """
    if not math.isfinite(value):
        return UNDEFINED
    text = f"{Decimal(repr(float(value))):f}"  # no exponent
    return text.removesuffix(".0").replace("-", "−")


def percent(share: float) -> str:
    """Return a share somebody chose in percent, with the digits it was given.

    Parameters
    ----------
    share : float
        The share, 1 for all.

    Returns
    -------
    str
        What is printed, without the sign.

    Examples
    --------
    >>> percent(0.95), percent(0.999), percent(0.57)
    ('95', '99.9', '57')
    """
    return f"{(Decimal(repr(float(share))) * 100).normalize():f}"


def decimals_given(values: Sequence[float]) -> int:
    """Return the decimals with which a column of chosen numbers loses nothing.

    Parameters
    ----------
    values : sequence of float
        The numbers.

    Returns
    -------
    int
        Decimals of the number that has most.

    Examples
    --------
    >>> decimals_given([130.0, 125.5]), decimals_given([1.0, 2.0])
    (1, 0)
    """
    written = (as_given(value).partition(".")[2] for value in values)
    return max(map(len, written), default=0)


def counted(count: int, noun: str) -> str:
    """Return a count with its noun, in the plural unless there is one.

    Parameters
    ----------
    count : int
        How many.
    noun : str
        Of what, one of it.

    Returns
    -------
    str
        Such as ``"2 sessions"``.
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def whole_or_tenths(values: Sequence[float]) -> int:
    """Return the decimals a column of measurements needs: 0 if all are whole.

    Parameters
    ----------
    values : sequence of float
        The measurements; ``nan`` is passed over.

    Returns
    -------
    int
        0 or 1.
    """
    known = [value for value in values if math.isfinite(value)]
    return 0 if all(float(value).is_integer() for value in known) else 1


def interval_words(low: float, high: float, digits: int = 3) -> str:
    """Return the endpoints of an interval in brackets.

    Parameters
    ----------
    low, high : float
        The endpoints; ``nan`` when undefined.
    digits : int
        Decimals.

    Returns
    -------
    str
        Such as ``"[0.320, 0.933]"``, or that it is undefined.
    """
    if math.isnan(low) or math.isnan(high):
        return f"[{UNDEFINED}]"
    return f"[{number(low, digits)}, {number(high, digits)}]"

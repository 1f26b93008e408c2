"""Estimates and their intervals in words: names, numbers, and of whom they speak."""

import math

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Estimate, Interval
from masrel.report._tables import UNDEFINED, interval_text, number, percent

__all__ = ["TARGETS", "as_words", "coefficient_name", "has_zero", "interval_name"]

TARGETS = {
    "raters": "other raters",
    "items": "other models",
    "both": "other raters and models",
}
"""Target of an interval to what it speaks of."""


def has_zero(coefficient: str | None) -> bool:
    """Return whether 0 is what chance gives of a coefficient."""
    # Not of a share, nor of a measure of order; of an ICC and a κ.
    if coefficient is None:
        return False
    entry = COEFFICIENTS.get(coefficient)  # the forms of ICC have entries of their own
    return entry is None or entry.chance_corrected


def as_words(estimate: Estimate) -> str:
    """Return a value with its interval, as shown."""
    if not math.isfinite(estimate.value):
        return UNDEFINED
    value, interval = number(estimate.value, 3), estimate.interval
    if interval is None:
        return value
    return f"{value} {interval_text(interval.low, interval.high)}"


def coefficient_name(coefficient: str, weights: str = "identity") -> str:
    """Return a coefficient's name for a reader."""
    title = COEFFICIENTS[coefficient].title
    if weights != "identity":
        title = f"{title}, {weights} weights"
    # A share as all others are: 1 is all, not 100.
    return f"{title} (0–1)" if coefficient == "percent_agreement" else title


def interval_name(interval: Interval) -> str:
    """Return level, kind and method of an interval."""
    return f"{percent(interval.level)} % {interval.kind}, {interval.method}"

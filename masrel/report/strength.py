"""Landis and Koch's words for the strength of agreement."""

import math

from masrel.agreement import strength as word_of
from masrel.report._tables import ABSENT

__all__ = ["LANDIS_KOCH", "strength"]

LANDIS_KOCH = (
    "Words after Landis JR, Koch GG (1977). The measurement of observer agreement "
    "for categorical data. Biometrics 33(1), 159-174, doi 10.2307/2529310; they name "
    "the point estimate alone."
)
"""Where the words are from, for a note below them."""


def strength(coefficient: str, value: float) -> str:
    """Name the strength of agreement in Landis and Koch's words."""
    if not coefficient.endswith("kappa") or not math.isfinite(value):
        return ABSENT
    return word_of(value)

"""Landis and Koch's words for the strength of agreement."""

import math

from masrel.report._tables import ABSENT

__all__ = ["LANDIS_KOCH", "strength"]

LANDIS_KOCH = (
    "Words after Landis JR, Koch GG (1977). The measurement of observer agreement "
    "for categorical data. Biometrics 33(1), 159-174, doi 10.2307/2529310; they name "
    "the point estimate alone."
)
"""Where the words are from, for a note below them."""

# The table on p. 165: upper ends of the classes.
_STRENGTHS = (
    (0.20, "slight"),
    (0.40, "fair"),
    (0.60, "moderate"),
    (0.80, "substantial"),
    (1.00, "almost perfect"),
)


def strength(coefficient: str, value: float) -> str:
    """Name the strength of agreement in Landis and Koch's words."""
    # [1] Landis, J. R., Koch, G. G. (1977). The measurement of observer agreement for
    # categorical data. Biometrics, 33(1), 159-174. https://doi.org/10.2307/2529310
    if not coefficient.endswith("kappa") or not math.isfinite(value):
        return ABSENT
    if value < 0.0:
        return "poor"
    return next((word for end, word in _STRENGTHS if value <= end), "almost perfect")

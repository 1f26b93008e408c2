"""An interval around an estimate, on its own scale or on one without ends."""

import math
from typing import Literal

__all__ = ["Transform", "around"]

Transform = Literal["none", "logit", "fisher"]
"""Scale on which an interval is symmetric."""


def around(
    value: float, half: float, transform: Transform, lowest: float
) -> tuple[float, float]:
    """Return the ends of an interval that is symmetric on some scale."""
    # transform: The estimate's own scale; the logit of its position between the ends of
    # the parameter space; or Fisher's z = artanh. On the latter two the error is
    # divided by the slope, and the ends are taken back, so that they stay inside.
    if transform == "none":
        return value - half, value + half
    low = lowest if transform == "logit" else -1.0
    if not low < value < 1.0:
        return math.nan, math.nan
    # artanh x is half the logit of (x + 1)/2: both are logits of a share
    width = 1.0 - low
    share = (value - low) / width
    half /= width * share * (1.0 - share)
    middle = math.log(share / (1.0 - share))
    return low + width * _expit(middle - half), low + width * _expit(middle + half)


def _expit(x: float) -> float:
    # from the side on which the exponential is small
    if x >= 0.0:
        return 1.0 / (1.0 + math.exp(-x))
    return math.exp(x) / (1.0 + math.exp(x))

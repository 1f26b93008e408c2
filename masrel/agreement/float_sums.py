"""Sums over items in floats, where no digits are lost."""

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.influence import Linear, RoundedLinear
from masrel.agreement.weights import Weights

__all__ = ["cancelled", "float_square_sum", "rounded"]

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]

_CANCELLED = 1_000  # times less than its terms, a sum in floats has lost three digits


def float_square_sum(
    counts: Integers,
    times: Integers,
    sizes: Integers,
    weights: Weights,
    function: RoundedLinear,
) -> float | None:
    """Return Σ_i function(item)², or None if its terms cancel."""
    # Takes counts (n_distinct, n_categories), times (n_distinct,), sizes (n_distinct,)
    slopes = np.zeros(counts.shape[1])
    slopes[: len(function.slopes)] = function.slopes
    met, at = np.unique(sizes, return_inverse=True)
    nothing = (0.0, 0.0, 0.0)
    parts = np.array([function.by_size[int(n)] if n else nothing for n in met])
    a, b, e = parts[at.reshape(-1)].T
    counted = counts.astype(np.float64)
    v = a * ((counted @ weights.as_floats()) * counted).sum(axis=1)
    value = v + b + e * (counted @ slopes)
    terms = np.abs(v) + np.abs(b) + np.abs(e) * (counted @ np.abs(slopes))
    if cancelled(value, terms, times):
        return None
    return float((times * value * value).sum())


def cancelled(value: Floats, terms: Floats, times: Integers) -> bool:
    """Return whether values are small beside the terms they are sums of."""
    # Takes value, terms (n_distinct,), times (n_distinct,)
    squares, of_terms = (float((times * x * x).sum()) for x in (value, terms))
    return of_terms > _CANCELLED**2 * squares


def rounded(function: Linear, denominator: int) -> RoundedLinear:
    """Return a function in floats."""
    largest = max(map(abs, function.slopes), default=0) or 1
    by_size = {
        size: (
            a * denominator / function.denominator,
            b / function.denominator,
            e * largest / function.denominator,
        )
        for size, (a, b, e) in function.by_size.items()
    }
    return RoundedLinear(by_size, [slope / largest for slope in function.slopes])

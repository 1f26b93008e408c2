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
    """Return Σ_i function(item)², or None if its terms cancel.

    Parameters
    ----------
    counts : ndarray of int64, shape (n_distinct, n_categories)
        Raters per category.
    times : ndarray of int64, shape (n_distinct,)
        How often each row occurs.
    sizes : ndarray of int64 or int, shape (n_distinct,)
        Ratings of each row.
    weights : Weights
        Disagreement of two categories.
    function : RoundedLinear
        A function of an item.

    Returns
    -------
    float or None
        The sum, unless more than three digits of it were lost.
    """
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
    """Return whether values are small beside the terms they are sums of.

    Parameters
    ----------
    value, terms : ndarray, shape (n_distinct,)
        Sums, and the sums of the absolute values of their terms.
    times : ndarray of int64, shape (n_distinct,)
        How often each occurs.

    Returns
    -------
    bool
        Whether the square sum of the values has lost more than three digits.
    """
    squares, of_terms = (float((times * x * x).sum()) for x in (value, terms))
    return of_terms > _CANCELLED**2 * squares


def rounded(function: Linear, denominator: int) -> RoundedLinear:
    """Return a function in floats.

    Parameters
    ----------
    function : Linear
        A function in integers, which may be too large for floats; their ratios are
        not.
    denominator : int
        That of the weights, which V is multiplied by in integers.

    Returns
    -------
    RoundedLinear
        The same.
    """
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

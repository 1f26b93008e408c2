"""Standard errors from the textbook value alone: every item weighed a little more."""

import math
from collections.abc import Callable, Sequence
from fractions import Fraction

Value = Callable[[Sequence[Fraction]], Fraction]
"""The coefficient of items that count this often each."""

_STEP = Fraction(1, 10**12)


def delta_error(value: Value, n_items: int) -> float:
    """Return the delta-method error, √(Σ (u_i - ū)² / (n (n - 1))), u_i = n ∂κ/∂w_i.

    The slopes are central differences in fractions, right to some 24 digits.
    """
    slopes = []
    for i in range(n_items):
        more, less = ([Fraction(1)] * n_items for _ in range(2))
        more[i] += _STEP
        less[i] -= _STEP
        slopes.append(n_items * (value(more) - value(less)) / (2 * _STEP))
    mean = sum(slopes, Fraction(0)) / n_items
    squares = sum([(slope - mean) ** 2 for slope in slopes])
    return math.sqrt(squares / (n_items * (n_items - 1)))

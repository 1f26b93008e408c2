"""All real roots of a polynomial in an interval, to 40 digits or more.

Roots are told apart by the changes of sign of Bernstein coefficients (Descartes'
rule): none without a change, exactly one with one, and halves are looked at otherwise.
"""

from collections.abc import Iterable
from decimal import Decimal
from itertools import pairwise
from math import comb

from masrel.elbow.polynomial import ONE, ZERO, Polynomial, derivative, moved, value

__all__ = ["cuts", "roots"]

_NOTHING = Decimal("1e-42")
# Of the largest coefficient: less is rounding of 50 digits, and counts as 0.

_SAME = Decimal("1e-30")
# Of the interval: two places as near as that are one.

_CLOSE = Decimal("1e-20")
# Of the interval: two roots as near as that are one, and double.

_HALF = Decimal("0.5")


def roots(polynomial: Polynomial, low: Decimal, high: Decimal) -> list[Decimal]:
    """Find the roots between two places, without those at the places themselves.

    Parameters
    ----------
    polynomial : tuple of Decimal
        Its coefficients, the constant first.
    low, high : Decimal
        The places, the lower first.

    Returns
    -------
    list of Decimal
        The roots in order, one that is double once; none of a polynomial that is 0.

    Examples
    --------
    >>> from masrel.elbow.polynomial import exactly
    >>> with exactly():
    ...     [float(x) for x in roots((-Decimal(2), ZERO, ONE), ZERO, Decimal(2))]
    [1.4142135623730951]
    """
    within = moved(polynomial, low, high)
    if _is_clear(within):
        return []
    slope = derivative(within)
    found = []
    whole = _bernstein(within)
    least = _NOTHING * max(map(abs, whole))
    waiting = [(whole, ZERO, ONE)]
    while waiting:
        coefficients, left, right = waiting.pop()
        signs = [1 if c > 0 else -1 for c in coefficients if abs(c) > least]
        changes = sum(a != b for a, b in pairwise(signs))
        if changes == 0:
            continue
        if changes == 1:
            found.append(_refined(within, slope, left, right, rises=signs[0] < 0))
        elif right - left < _CLOSE:
            found.append(left)  # a double root: the two are one
        else:
            middle = left + _HALF * (right - left)
            lower, upper = _halves(coefficients)
            if abs(lower[-1]) <= least:
                found.append(middle)
            waiting += [(lower, left, middle), (upper, middle, right)]
    width = high - low
    return sorted(low + width * x for x in found)


def cuts(
    polynomials: Iterable[Polynomial], low: Decimal, high: Decimal
) -> list[Decimal]:
    """Cut an interval where one of several polynomials may change its sign.

    Parameters
    ----------
    polynomials : iterable of tuple of Decimal
        Their coefficients, the constant first.
    low, high : Decimal
        The interval; nothing is cut of one that is empty.

    Returns
    -------
    list of Decimal
        `low`, the cuts, and `high`, in order and no two the same; empty if low is not
        below high.
    """
    least = _SAME
    if high - low <= least:
        return []
    inner = sorted(x for p in polynomials for x in roots(p, low, high))
    found = [low]
    for x in inner:
        if x - found[-1] > least and high - x > least:
            found.append(x)
    return [*found, high]


def _is_clear(p: Polynomial) -> bool:
    # quick: the constant outweighs whatever may be taken from it, or added to it
    most = sum((c for c in p[1:] if (c > 0) != (p[0] > 0)), ZERO)
    return abs(most) < abs(p[0])


def _bernstein(p: Polynomial) -> Polynomial:
    degree = len(p) - 1
    scaled = [c / comb(degree, j) for j, c in enumerate(p)]
    return tuple(
        sum((comb(i, j) * scaled[j] for j in range(i + 1)), ZERO)
        for i in range(degree + 1)
    )


def _halves(coefficients: Polynomial) -> tuple[Polynomial, Polynomial]:
    # de Casteljau at the middle
    row, lower, upper = list(coefficients), [], []
    while row:
        lower.append(row[0])
        upper.append(row[-1])
        row = [_HALF * (a + b) for a, b in pairwise(row)]
    return tuple(lower), tuple(reversed(upper))


def _refined(
    p: Polynomial, slope: Polynomial, low: Decimal, high: Decimal, *, rises: bool
) -> Decimal:
    # Newton's rule, or halving where it leaves the bracket or is slow
    x, step = low + _HALF * (high - low), high - low
    for _ in range(400):
        height = value(p, x)
        if not height:
            return x
        if (height > 0) == rises:
            high = x
        else:
            low = x
        tangent = value(slope, x)
        before = step
        step = height / tangent if tangent else before
        if not low < x - step < high or abs(2 * step) > abs(before):
            step = x - (low + _HALF * (high - low))
        x -= step
        if abs(step) < _NOTHING:
            break
    return x

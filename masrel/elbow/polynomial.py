"""Polynomials in 50-digit decimals: value, derivative, integral, change of interval.

A polynomial is the tuple of its coefficients, the constant first. Decimals are exact
for every float, and 50 digits leave the float nearest to a result without doubt.
"""

import decimal
from contextlib import AbstractContextManager
from decimal import Decimal
from itertools import zip_longest

__all__ = [
    "ONE",
    "ZERO",
    "Polynomial",
    "added",
    "derivative",
    "exactly",
    "integral",
    "moved",
    "product",
    "quotient",
    "scaled",
    "value",
]

Polynomial = tuple[Decimal, ...]

ZERO, ONE = Decimal(0), Decimal(1)


def exactly() -> AbstractContextManager[decimal.Context]:
    """Make decimals of a block keep 50 digits.

    Returns
    -------
    context manager
        The settings from before are back when the block ends.

    Examples
    --------
    >>> with exactly():
    ...     len(str(ONE / 3))
    52
    """
    return decimal.localcontext(decimal.Context(prec=50))


def value(polynomial: Polynomial, at: Decimal) -> Decimal:
    """Evaluate a polynomial by Horner's rule.

    Parameters
    ----------
    polynomial : tuple of Decimal
        Its coefficients, the constant first.
    at : Decimal
        Where.

    Returns
    -------
    Decimal
        Its value.

    Examples
    --------
    >>> value((ONE, ZERO, Decimal(3)), Decimal(2))
    Decimal('13')
    """
    total = ZERO
    for coefficient in reversed(polynomial):
        total = total * at + coefficient
    return total


def derivative(polynomial: Polynomial) -> Polynomial:
    """Return the derivative.

    Parameters
    ----------
    polynomial : tuple of Decimal
        Its coefficients, the constant first.

    Returns
    -------
    tuple of Decimal
        Those of the derivative; (0,) of a constant.
    """
    slopes = tuple(i * c for i, c in enumerate(polynomial) if i)
    return slopes or (ZERO,)


def integral(polynomial: Polynomial) -> Polynomial:
    """Return the antiderivative that is 0 at 0.

    Parameters
    ----------
    polynomial : tuple of Decimal
        Its coefficients, the constant first.

    Returns
    -------
    tuple of Decimal
        Those of the antiderivative.
    """
    return (ZERO, *(c / (i + 1) for i, c in enumerate(polynomial)))


def scaled(polynomial: Polynomial, factor: Decimal) -> Polynomial:
    """Multiply a polynomial by a number.

    Parameters
    ----------
    polynomial : tuple of Decimal
        Its coefficients, the constant first.
    factor : Decimal
        The number.

    Returns
    -------
    tuple of Decimal
        The coefficients of the product.
    """
    return tuple(factor * c for c in polynomial)


def added(one: Polynomial, other: Polynomial) -> Polynomial:
    """Add two polynomials.

    Parameters
    ----------
    one, other : tuple of Decimal
        Their coefficients, the constant first.

    Returns
    -------
    tuple of Decimal
        The coefficients of the sum.
    """
    return tuple(a + b for a, b in zip_longest(one, other, fillvalue=ZERO))


def product(one: Polynomial, other: Polynomial) -> Polynomial:
    """Multiply two polynomials.

    Parameters
    ----------
    one, other : tuple of Decimal
        Their coefficients, the constant first.

    Returns
    -------
    tuple of Decimal
        The coefficients of the product.

    Examples
    --------
    >>> product((ONE, ONE), (ONE, -ONE))
    (Decimal('1'), Decimal('0'), Decimal('-1'))
    """
    total = [ZERO] * (len(one) + len(other) - 1)
    for i, a in enumerate(one):
        for j, b in enumerate(other):
            total[i + j] += a * b
    return tuple(total)


def quotient(polynomial: Polynomial, at: Decimal) -> Polynomial:
    """Divide p(x) - p(at) by x - at, without a remainder.

    Parameters
    ----------
    polynomial : tuple of Decimal
        Coefficients of p, the constant first.
    at : Decimal
        A place.

    Returns
    -------
    tuple of Decimal
        The coefficients of the quotient; at `at` it is the slope of p.

    Examples
    --------
    (x² - 4) / (x - 2) = x + 2:

    >>> quotient((ZERO, ZERO, ONE), Decimal(2))
    (Decimal('2'), Decimal('1'))
    """
    carried, total = ZERO, []
    for coefficient in reversed(polynomial[1:]):
        carried = carried * at + coefficient
        total.append(carried)
    return tuple(reversed(total)) or (ZERO,)


def moved(polynomial: Polynomial, low: Decimal, high: Decimal) -> Polynomial:
    """Return p(low + (high - low) x), which has on 0 to 1 what p has on low to high.

    Parameters
    ----------
    polynomial : tuple of Decimal
        Coefficients of p, the constant first.
    low, high : Decimal
        The interval.

    Returns
    -------
    tuple of Decimal
        The coefficients in x.

    Examples
    --------
    >>> moved((ZERO, ZERO, ONE), ONE, Decimal(3))  # (1 + 2 x)²
    (Decimal('1'), Decimal('4'), Decimal('4'))
    """
    shifted = list(polynomial)
    if low:
        for i in range(len(shifted) - 1):
            for j in range(len(shifted) - 2, i - 1, -1):
                shifted[j] += low * shifted[j + 1]
    factor, width = ONE, high - low
    if width == 1:
        return tuple(shifted)
    for i, coefficient in enumerate(shifted):
        shifted[i] = coefficient * factor
        factor *= width
    return tuple(shifted)

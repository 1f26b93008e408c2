"""Polynomials of low degree: coefficients, constant first, numbers or columns of them.

What only adds and multiplies takes columns too, one row a polynomial; what looks for
places takes numbers, and `refined_columns` is its last step for columns.

Two places of an interval nearer than `TIE` of its length are one place, and Bernstein
coefficients within `NOTHING` of the largest count as 0: floats tell no more.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import comb, sqrt
from operator import ne
from typing import Any

import numpy as np

TIE = 1e-13
NOTHING = 1e-14

Number = Any  # float, or an ndarray of them
Polynomial = Sequence[Number]

_SHARES = [[1.0 / comb(n, j) for j in range(n + 1)] for n in range(12)]


def value(p: Polynomial, x: Number) -> Number:
    """Return the value at x, by Horner's rule."""
    others = reversed(p)
    total = next(others)
    for c in others:
        total = total * x + c
    return total


def derivative(p: Polynomial) -> Polynomial:
    """Return the derivative; (0,) of a constant."""
    return [i * c for i, c in enumerate(p)][1:] or [0.0]


def integral(p: Polynomial) -> Polynomial:
    """Return the antiderivative that is 0 at 0."""
    return [0.0, *[c / i for i, c in enumerate(p, 1)]]


def product(p: Polynomial, q: Polynomial) -> Polynomial:
    """Return the product of two polynomials."""
    total: list[Number] = [0.0] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            total[i + j] = total[i + j] + a * b
    return total


def shifted(p: Polynomial, x: Number) -> Polynomial:
    """Return the polynomial in the distance from x."""
    q, n = list(p), len(p) - 1
    for i in range(n):
        for j in range(n - 1, i - 1, -1):
            q[j] = q[j] + x * q[j + 1]
    return q


def reversed_from(p: Polynomial, x: Number) -> Polynomial:
    """Return the polynomial in the distance before x."""
    return [-c if i % 2 else c for i, c in enumerate(shifted(p, x))]


def bernstein(p: Polynomial, width: Number) -> list[Number]:
    """Return the Bernstein coefficients on 0 to width: no value is beyond them."""
    b: list[Number] = []
    n, power = len(p) - 1, 1.0
    for c, share in zip(p, _SHARES[n], strict=False):
        b.append(c * (power * share))
        power = power * width
    for k in range(n):
        for i in range(n, k, -1):
            b[i] = b[i] + b[i - 1]
    return b


def first_above(
    p: Polynomial, low: float, high: float, *, level: float = 0.0, grows: bool = False
) -> float | None:
    """Return where a polynomial is first above a level between two places; None if not.

    A place nearer to high than a tie is none. One that only grows is searched faster.
    """
    width = high - low
    if width <= 0.0 or (grows and value(p, high) <= level):
        return None
    if level:
        p = [p[0] - level, *p[1:]]
    x: float | None
    if len(p) == 2 and p[1] > 0.0:
        x = max(-p[0] / p[1], low)
    elif grows:
        x = _only_rise(p, low, high)
    else:
        b = bernstein(shifted(p, low) if low else p, width)
        if (most := max(b)) <= 0.0:
            return None
        x = _first_rise(p, b, low, high, NOTHING * max(most, -min(b)), TIE * width)
    return None if x is None or x > high - TIE * width else x


def _only_rise(p: Polynomial, low: float, high: float) -> float:
    # the end is above 0
    left = -value(p, low)
    if left <= 0.0:
        return low
    share = left / (left + value(p, high))
    return _refined(p, low, high, guess=low + share * (high - low))


def _first_rise(
    p: Polynomial, b: list[float], low: float, high: float, least: float, tie: float
) -> float | None:
    signs = [c > 0.0 for c in b if not -least <= c <= least]
    if True not in signs:
        return None
    if signs[0]:
        return low
    if False not in signs[signs.index(True) :]:  # below, then above
        return _refined(p, low, high, guess=_guess(b, low, high))
    if high - low <= tie:
        return None  # touches 0, or is above it for less than a tie
    middle, (one, other) = 0.5 * (low + high), _halves(b)
    x = _first_rise(p, one, low, middle, least, tie)
    return _first_rise(p, other, middle, high, least, tie) if x is None else x


def _halves(b: list[float]) -> tuple[list[float], list[float]]:
    # de Casteljau in the middle
    row, one, other = b, [], []
    while row:
        one.append(row[0])
        other.append(row[-1])
        row = [0.5 * (u + v) for u, v in pairwise(row)]
    return one, other[::-1]


def split_at_roots(
    p: Polynomial, length: float, levels: Sequence[float] = (0.0,)
) -> list[float]:
    """Return 0, the places where a polynomial passes a level, and length."""
    tie, b = TIE * length, bernstein(p, length)
    most, least = max(b), min(b)
    inner: list[float] = []
    for level in levels:
        if most > level > least:
            from_level = [c - level for c in b]
            small = NOTHING * max(most, -least, abs(level))
            above = [p[0] - level, *p[1:]]
            inner += _sign_changes(above, from_level, 0.0, length, small, tie)
    places = [0.0]
    for x in sorted(inner):
        if x - places[-1] > tie and length - x > tie:
            places.append(x)
    return [*places, length]


def _sign_changes(
    p: Polynomial, b: list[float], low: float, high: float, least: float, tie: float
) -> list[float]:
    signs = [c > 0.0 for c in b if not -least <= c <= least]
    n_changes = sum(map(ne, signs, signs[1:]))
    if n_changes == 0:
        return []
    if n_changes == 1:
        guess = _guess(b, low, high)
        return [_refined(p, low, high, rises=signs[-1], guess=guess)]
    if high - low <= tie:
        return []  # touches 0
    middle, (one, other) = 0.5 * (low + high), _halves(b)
    return [
        *_sign_changes(p, one, low, middle, least, tie),
        *([middle] if -least <= one[-1] <= least else []),
        *_sign_changes(p, other, middle, high, least, tie),
    ]


def _guess(b: list[float], low: float, high: float) -> float:
    # where the control polygon first passes 0, but not at an end: that may be a root
    share, is_above = 0.5, b[0] > 0.0
    for i, c in enumerate(b):
        if (c > 0.0) != is_above:
            share = (i - c / (c - b[i - 1])) / (len(b) - 1)
            break
    return low + min(max(share, 0.02), 0.98) * (high - low)


def _refined(
    p: Polynomial, low: float, high: float, *, guess: float, rises: bool = True
) -> float:
    """Return the one place between two where a polynomial changes sign.

    In closed form to degree 2; by Newton's rule above that, halved where it leaves the
    bracket or is slow, until the next step would be below the last digit.
    """
    if len(p) == 2:
        return float(min(max(-p[0] / p[1], low), high))
    if len(p) == 3 and p[2]:
        return min(max(_of_square(p, rises=rises), low), high)
    x, before, is_newton = guess, high - low, False
    digit, lead, others = 1e-16 * high, p[-1], p[-2::-1]
    for _ in range(200):
        height, slope = lead, 0.0
        for c in others:
            slope = slope * x + height
            height = height * x + c
        if height == 0.0:
            return x
        if (height > 0.0) == rises:
            high = x
        else:
            low = x
        step = height / slope if slope else before
        size = abs(step)
        if size <= digit or not low < high:
            return x
        if 2.0 * size > before or not low <= x - step <= high:
            x, before, is_newton = 0.5 * (low + high), high - low, False
            continue
        x -= step
        # steps shrink as their squares do
        if is_newton and size * size * size <= digit * before * before:
            return x
        before, is_newton = size, True
    return x


def _of_square(p: Polynomial, *, rises: bool) -> float:
    # the root of a square at which it rises, or falls, without cancellation
    c, b, a = map(float, p)
    square = b * b - 4.0 * a * c
    if square <= 0.0:
        return -0.5 * b / a
    root = sqrt(square) if rises else -sqrt(square)
    return -2.0 * c / (b + root) if (b > 0.0) == rises else (root - b) / (2.0 * a)


def refined_columns(p: Polynomial, low: Number, high: Number) -> Number:
    """Return the places, one a row, where polynomials rise through 0; as `_refined`."""
    if len(p) == 2:
        return np.minimum(np.maximum(-p[0] / p[1], low), high)
    x, slopes, near = 0.5 * (low + high), derivative(p), 1e-7 * (high - low)
    is_there = np.zeros(np.shape(x), dtype=np.bool_)
    for _ in range(100):
        height = value(p, x)
        is_above = height > 0.0
        low, high = np.where(is_above, low, x), np.where(is_above, x, high)
        after = x - height / value(slopes, x)
        is_inside = (after >= low) & (after <= high)
        step = np.where(is_inside, after, 0.5 * (low + high)) - x
        x = x + np.where(is_there, 0.0, step)  # whatever other rows need
        is_there |= np.abs(step) <= near
        if is_there.all():
            break
    for _ in range(2):  # each doubles the digits
        x = np.minimum(np.maximum(x - value(p, x) / value(slopes, x), low), high)
    return x

"""Polynomials of low degree: coefficients, constant first, numbers or columns of them.

A number is a float, or a column of them with one row per scene or per piece; what holds
for a polynomial holds for every row. A place that does not exist is nan.

Two places of an interval nearer than `TIE` of its length are one place, and Bernstein
coefficients within `NOTHING` of the largest count as 0: floats tell no more.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import comb, inf, isfinite, nan
from operator import ne
from typing import Any

import numpy as np
from numpy.typing import NDArray

TIE = 1e-13
NOTHING = 1e-14

Number = Any  # float, or an ndarray of them
Flag = Any  # bool, or an ndarray of them
Polynomial = Sequence[Number]

_SHARES = [[1.0 / comb(n, j) for j in range(n + 1)] for n in range(12)]


def some(flag: Flag) -> bool:
    """Whether it holds, in any row."""
    return flag if flag is True or flag is False else bool(np.any(flag))


def pick(flag: Flag, one: Any, other: Any) -> Any:
    """Return one thing where a flag holds, the other elsewhere."""
    if flag is not True and isinstance(flag, np.ndarray):
        return np.where(flag, one, other)
    return one if flag else other


def known(number: Number, otherwise: Number) -> Number:
    """Return a number, or another one where it is nan."""
    return pick(number == number, number, otherwise)


def least(a: Number, b: Number) -> Number:
    """Return the smaller number; b if either is nan."""
    return pick(a < b, a, b)


def greatest(a: Number, b: Number) -> Number:
    """Return the larger number; b if either is nan."""
    return pick(a > b, a, b)


def chosen(columns: Sequence[Number], which: Any) -> list[Number]:
    """Return some rows of columns; one value for all stays one."""
    return [c[which] if isinstance(c, np.ndarray) else c for c in columns]


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
    if isinstance(x, float) and x == 0.0:
        return p
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
    p: Polynomial,
    low: Number,
    high: Number,
    *,
    level: Number = 0.0,
    among: Flag = True,
) -> Number:
    """Return where a polynomial is first above a level between two places.

    A place nearer to high than a tie does not count. In columns only the rows `among`
    are searched; the others are nan.
    """
    p = [p[0] - level, *p[1:]]
    if isinstance(among, np.ndarray):
        return _first_above_in_rows(p, low, high, among)
    width = high - low
    if not width > 0.0:
        return nan
    if len(p) == 2 and p[1] > 0.0:
        x = max(-p[0] / p[1], low)
    else:
        b = bernstein(shifted(p, low), width)
        if (most := max(b)) <= 0.0:
            return nan
        nothing = NOTHING * max(most, -min(b))
        if next((c for c in b if not -nothing <= c <= nothing), 0.0) > 0.0:
            return low
        changes = _sign_changes(p, b, low, high, nothing, TIE * width)
        x = next((place for place, rises in changes if rises), nan)
    return x if x <= high - TIE * width else nan


def _halves(b: Sequence[Number]) -> tuple[list[Number], list[Number]]:
    # de Casteljau in the middle
    row, one, other = b, [], []
    while len(row):
        one.append(row[0])
        other.append(row[-1])
        row = [0.5 * (u + v) for u, v in pairwise(row)]
    return one, other[::-1]


def _first_above_in_rows(
    p: Polynomial, low: Number, high: Number, among: NDArray[np.bool_]
) -> Number:
    place = np.full(among.shape, nan)
    rows = slice(None) if among.all() else np.flatnonzero(among)
    low, high, *p = chosen([low, high, *p], rows)
    if len(p) == 2 and np.all(p[1] > 0.0):
        x = np.maximum(-p[0] / p[1], low)
    else:
        x = _first_rises(p, low, high, place[rows])
    place[rows] = np.where(x <= high - TIE * (high - low), x, nan)
    return place


def _first_rises(p: Polynomial, low: Number, high: Number, first: Number) -> Number:
    # the first places where rows rise, whose halves are rows; `first` is all nan
    b = np.stack(
        np.broadcast_arrays(*bernstein(shifted(p, low), high - low), first)[:-1]
    )
    nothing, tie = NOTHING * np.abs(b).max(axis=0), TIE * (high - low)
    which, n = np.arange(first.size), len(b)
    begin, end = (np.broadcast_to(x, first.shape) for x in (low, high))
    place = np.arange(n)[:, np.newaxis]
    while which.size:
        small = nothing[which]
        rises = np.where(b > small, place, n).min(axis=0)  # the first above, if any
        below = b < -small
        is_above = (rises < n) & (end > begin)
        at_once = is_above & ~(below & (place < rises)).any(axis=0)
        again = is_above & ~at_once & (below & (place > rises)).any(axis=0)
        once = is_above & ~at_once & ~again
        np.fmin.at(first, which[at_once], begin[at_once])
        if (i := np.flatnonzero(once)).size:
            root = _refined_in_rows(chosen(p, which[i]), begin[i], end[i])
            np.fmin.at(first, which[i], root)
        i = np.flatnonzero(again & (end - begin > tie[which]))
        middle, (one, other) = 0.5 * (begin[i] + end[i]), _halves(list(b[:, i]))
        which, b = np.tile(which[i], 2), np.hstack([one, other])
        begin, end = np.append(begin[i], middle), np.append(middle, end[i])
    return first


def split_at_roots(
    p: Polynomial, length: float, levels: Sequence[float] = (0.0,)
) -> list[float]:
    """Return 0, the places where a polynomial passes a level, and length."""
    tie, b = TIE * length, bernstein(p, length)
    top, bottom = max(b), min(b)
    inner: list[float] = []
    for level in levels:
        if top > level > bottom:
            from_level = [c - level for c in b]
            nothing = NOTHING * max(top, -bottom, abs(level))
            above = [p[0] - level, *p[1:]]
            changes = _sign_changes(above, from_level, 0.0, length, nothing, tie)
            inner += [place for place, _ in changes]
    places = [0.0]
    for x in sorted(inner):
        if x - places[-1] > tie and length - x > tie:
            places.append(x)
    return [*places, length]


def _sign_changes(
    p: Polynomial, b: list[float], low: float, high: float, nothing: float, tie: float
) -> Iterator[tuple[float, bool]]:
    # places in order, and whether it rises there
    signs = [c > 0.0 for c in b if not -nothing <= c <= nothing]
    n_changes = sum(map(ne, signs, signs[1:]))
    if n_changes == 1:
        yield _refined(p, low, high, rises=signs[-1]), signs[-1]
    if n_changes < 2 or high - low <= tie:
        return  # touches 0, or passes it for less than a tie
    middle, (one, other) = 0.5 * (low + high), _halves(b)
    yield from _sign_changes(p, one, low, middle, nothing, tie)
    if -nothing <= one[-1] <= nothing:
        yield middle, next((c > 0.0 for c in other if abs(c) > nothing), False)
    yield from _sign_changes(p, other, middle, high, nothing, tie)


def largest(p: Polynomial, length: Number, known: Number = -inf) -> Number:
    """Return the largest value on 0 to length, or what is known to be, if more."""
    if isinstance(length, np.ndarray):
        return _largest_in_rows(p, length, known)
    if not isfinite(sum(p)):
        return inf  # more than a float can hold
    peak = max(p[0], value(p, length), known)
    if len(p) > 2 and max(bernstein(p, length)) > peak:
        turns = split_at_roots(derivative(p), length)[1:-1]
        peak = max([peak, *[value(p, x) for x in turns]])
    return float(peak)


def _largest_in_rows(p: Polynomial, length: Number, known: Number) -> Number:
    # rows are halved as long as their Bernstein coefficients leave more to be found
    b = np.stack(np.broadcast_arrays(*bernstein(p, length), length)[:-1])
    best = np.where(length > 0.0, np.maximum(np.maximum(b[0], b[-1]), known), known)
    nothing = NOTHING * np.abs(b).max(axis=0)
    which = np.flatnonzero(length > 0.0)
    b = b[:, which]
    while True:
        more = b.max(axis=0) > best[which] + nothing[which]
        which, b = which[more], b[:, more]
        if not which.size:
            return best
        one, other = _halves(list(b))
        np.maximum.at(best, which, other[0])
        which, b = np.tile(which, 2), np.hstack([one, other])


def _refined(p: Polynomial, low: float, high: float, *, rises: bool) -> float:
    """Return the one place between two where a polynomial changes sign.

    Of a line in closed form; else by Newton's rule, halved where it leaves the bracket.
    """
    if len(p) == 2:
        return float(min(max(-p[0] / p[1], low), high))
    x, near, is_near = 0.5 * (low + high), 1e-7 * (high - low), False
    lead, others = p[-1], p[-2::-1]
    for _ in range(200):
        height, slope = lead, 0.0
        for c in others:
            slope = slope * x + height
            height = height * x + c
        if (height > 0.0) == rises:
            high = x
        else:
            low = x
        before, x = x, x - height / slope if slope else nan
        if not low <= x <= high:
            x = 0.5 * (low + high)
        if is_near:  # a step doubles the digits
            break
        is_near = abs(x - before) <= near
    return x


def _refined_in_rows(p: Polynomial, low: Number, high: Number) -> Number:
    # the places, one a row, where polynomials rise through 0; as `_refined`
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

"""The ends of a correlation by its profile likelihood, of one table or of many.

A rating is μ + item + rater + residual, all three random and normal, with variances of
0 or more. What a table says is the deviance, -2 log of the restricted likelihood, at
a = 1 + k σ²_items/σ²_residual and x = 1 + n σ²_raters/σ²_residual. In a complete table
these are ratios of expected mean squares, and the mean squares are all that counts.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.special import chdtri, expit

from masrel.agreement._engine import Floats

EXACT = 1e-15
"""Residual sum of squares, as a share of all, that is as good as a perfect fit."""

_LOW, _LOWEST = -7.0, -50.0
"""Logits of a correlation of next to nothing, and of one as good as 0."""

_FARTHEST = 60.0  # logit of a correlation as good as 1
_HALVES, _STEPS = 9, 5  # after which Ridders' and Newton's rules are at rounding
_STEP, _TINY = 1e-3, 1e-300  # of a logarithm; what is not 0


def profile_ends(
    n: int, k: int, squares: tuple[Any, Any, Any], level: float
) -> tuple[Floats, Floats]:
    """Return the ends of ICC(A,1) from mean squares of items, raters and residual."""
    # squares: each a number or (...)
    df = n - 1, k - 1, (n - 1) * (k - 1)
    items, raters, rest = (np.multiply(*of) for of in zip(df, squares, strict=True))
    rest = np.maximum(rest, EXACT * (items + raters))

    def deviance(a: Any, x: Any) -> Floats:
        squares = np.log(items / a + raters / x + rest)
        return np.asarray(df[0] * np.log(a) + df[1] * np.log(x) + (n * k - 1) * squares)

    def likeliest(square: Floats, df: int, others: Floats) -> Floats:
        return np.maximum(square * (n * k - 1 - df) / (df * others), 1.0)

    x = np.maximum(df[0] * raters / rest, 1.0)
    for _ in range(3):  # more than once at a variance of 0 alone
        a = likeliest(items, df[0], raters / x + rest)
        x = likeliest(raters, df[1], items / a + rest)
    return ends(deviance, a, x, n=n, k=k, level=level)


def ends(
    deviance: Callable[[Any, Any], Floats],
    a: Floats,
    x: Floats,
    *,
    n: int,
    k: int,
    level: float,
    absolute: bool = True,
) -> tuple[Floats, Floats]:
    """Return where the profile is a quantile of χ² above its least, at a and x."""
    # absolute: whether the variance of raters counts as error
    highest = deviance(a, x) + float(chdtri(1, 1.0 - level))
    with np.errstate(divide="ignore"):
        best = np.log(n * (a - 1.0) / (k * (n + absolute * (x - 1.0))))
    best = np.maximum(best, _LOWEST)

    def above(logit: Floats) -> Floats:
        odds = k / n * np.exp(logit)

        def along(w: Floats) -> Floats:
            return deviance(1.0 + odds * (n + absolute * np.expm1(w)), np.exp(w))

        # valleys of log x are near that of all, near the a of all, or at 0
        held = np.clip((a - 1.0) / odds - (n - 1), 1.0, 1.0 / EXACT)
        w = np.log([x, held, np.ones_like(x)])
        for _ in range(_STEPS):  # Newton's, downhill
            before, here, after = along(np.stack([w - _STEP, w, w + _STEP]))
            bend = np.maximum(abs(before - 2.0 * here + after) / _STEP, 1e-3 * _STEP)
            w = np.maximum(w - np.clip(0.5 * (after - before) / bend, -2.0, 2.0), 0.0)
        return np.asarray(np.nanmin(along(w), axis=0) - highest)

    low = expit(_crossing(above, best, best - 1.0))
    high = expit(_crossing(above, best, np.maximum(best, _LOW) + 1.0))
    return np.where(above(np.full_like(best, _LOWEST)) <= 0.0, 0.0, low), high


def _crossing(above: Callable[[Any], Any], inner: Floats, outer: Floats) -> Floats:
    """Return where a function crosses 0, which is below it at the inner place."""

    def at(place: Floats) -> Floats:
        return np.stack([place, above(place)])

    near, far = at(inner), at(outer)
    while (below := (far[1] < 0.0) & (abs(far[0]) < _FARTHEST)).any():
        outer = np.where(below, 3.0 * far[0] - 2.0 * near[0], far[0])
        near, far = np.where(below, far, near), at(outer)
    # by rounding either may lie on the other side, at levels near 0
    near[1], far[1] = np.minimum(near[1], 0.0), np.maximum(far[1], _TINY)
    for _ in range(_HALVES):  # Ridders' rule
        middle = at(0.5 * (near[0] + far[0]))
        reach = np.maximum(np.sqrt(middle[1] ** 2 - near[1] * far[1]), _TINY)
        last = at(middle[0] - (middle[0] - near[0]) * middle[1] / reach)
        near, far = (
            np.where(last[1] < 0.0, last, np.where(middle[1] < 0.0, middle, near)),
            np.where(last[1] < 0.0, np.where(middle[1] < 0.0, far, middle), last),
        )
    return np.asarray(last[0])

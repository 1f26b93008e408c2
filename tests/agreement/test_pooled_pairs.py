"""Pooled kappa of raters with themselves: one table of all pairs, items as clusters."""

import math
from fractions import Fraction

import pytest

from masrel.agreement import (
    pooled_kappa,
    stratified_kappa,
)
from masrel.errors import UndefinedStatisticWarning

FIRST = [["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"]]
SECOND = [["a", "a"], ["a", "b"], ["a", "a"], ["b", "b"]]


def test_two_raters_by_hand() -> None:
    # aa 3, ab 2, bb 3 of 8 pairs: p_o = 6/8; margins a 5/8 and 3/8, b 3/8 and 5/8:
    # p_e = (15 + 15)/64; κ = (48 - 30)/(64 - 30) = 18/34
    found = pooled_kappa([FIRST, SECOND])
    assert found.value == float(Fraction(18, 34))
    assert (found.observed, found.chance) == (6 / 8, 30 / 64)
    assert (found.n_items, found.n_raters) == (4, 2)
    # With D_o = 1/4 and D_e = 34/64 a pair in cell (k, l) moves κ by
    #   [D_o/D_e (v_k. p + v_.l p - 2 D_e) - (v_kl - D_o)] / D_e, D_o/D_e = 8/17:
    # aa: [8/17 (5/8 + 3/8 - 17/16) + 1/4]... in sixteenths of 1/17 · 32/17 each.
    d_o, d_e = Fraction(1, 4), Fraction(34, 64)
    first, second = (Fraction(5, 8), Fraction(3, 8)), (Fraction(3, 8), Fraction(5, 8))

    def moved(k: int, m: int) -> Fraction:
        chance = (1 - second[k]) + (1 - first[m]) - 2 * d_e
        return (d_o / d_e * chance - ((k != m) - d_o)) / d_e

    items = [
        sum((moved("ab".index(x), "ab".index(y)) for x, y in pairs), Fraction(0))
        for pairs in zip(FIRST, SECOND, strict=True)
    ]
    assert sum(items) == 0
    variance = Fraction(4, 3) * sum(u * u for u in items) / 64
    assert found.standard_error == pytest.approx(math.sqrt(variance), rel=1e-14)


def test_margins_that_differ_between_raters_raise_it_above_the_stratified() -> None:
    # each rater knows one word: no agreement beyond chance for either, all of it pooled
    pairs = [[["a", "a"]] * 6, [["b", "b"]] * 6]
    assert pooled_kappa(pairs).value == 1.0
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        assert math.isnan(stratified_kappa(pairs).value)

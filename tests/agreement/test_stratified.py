"""Stratified kappa: raters against themselves by hand, errors by slopes."""

import math
from fractions import Fraction

import pytest

from masrel.agreement import stratified_kappa
from tests.strategies import Table

FIRST: Table = [["a", "a"], ["b", "b"], ["a", "b"]]
SECOND: Table = [["a", "a"], ["b", "b"], ["b", "b"]]


def test_two_raters_by_hand() -> None:
    # First: p_o = 2/3, p_e = 2/9 + 2/9; second: 1 and 1/9 + 4/9.
    # (2/9 + 4/9)/(5/9 + 4/9): 2/3, between 2/5 and 1 of theirs.
    found = stratified_kappa([FIRST, SECOND])
    assert found.value == pytest.approx(float(Fraction(2, 3)), abs=1e-14)
    assert (found.observed, found.chance) == (5 / 6, 0.5)
    assert (found.n_items, found.n_raters, found.n_categories) == (3, 2, 2)


def test_error_of_two_raters_by_hand() -> None:
    # κ = 1 - ΣD_o/ΣD_e with sums 1/3 and 1. An item moves them by, in ninths,
    #   D_o: first -3, -3, 6; second 0 (perfect);
    #   D_e: first -1, -1, 2; second 4, -2, -2: together 3, -3, 0.
    # u = dD_e/3 - dD_o = 4/9, 2/9, -6/9; SE² = 56/81 / 6.
    found = stratified_kappa([FIRST, SECOND]).standard_error
    assert found == pytest.approx(math.sqrt(28 / 243), rel=1e-13)


def test_a_rater_without_pairs_moves_neither_value_nor_error() -> None:
    none: Table = [["a", None], [None, None], [None, "b"]]
    alone, beside = stratified_kappa([FIRST]), stratified_kappa([FIRST, none])
    assert (beside.value, beside.n_raters) == (0.4, 1)
    assert beside.standard_error == pytest.approx(alone.standard_error, rel=1e-14)

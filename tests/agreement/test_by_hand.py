"""Coefficients worked by hand, step by step, from tables small enough to check."""

import math
from fractions import Fraction

import numpy as np
import pytest

from masrel.agreement import (
    cohen_kappa,
    count_items,
    count_table,
    fleiss_kappa,
    light_kappa,
    percent_agreement,
)
from masrel.errors import UndefinedStatisticWarning

# Table V of the source: raters per item and category (1, 1+, 2, 3).
TABLE_V = [[7, 1, 0, 0], [2, 6, 0, 0], [0, 0, 8, 0], [0, 0, 2, 6]]


def test_table_v_worked_in_fractions() -> None:
    # Agreeing pairs of 28 a model: 21, 1 + 15, 28, 1 + 15; so P-bar = 81 / 112.
    observed = Fraction(21 + 16 + 28 + 16, 4 * 28)
    # Ratings per category of 32: 9, 7, 10, 6.
    chance = Fraction(9**2 + 7**2 + 10**2 + 6**2, 32**2)
    kappa = (observed - chance) / (1 - chance)
    found = fleiss_kappa(count_items(TABLE_V))
    assert found.value == pytest.approx(float(kappa), abs=1e-14)
    assert found.value == pytest.approx(0.626083678854127, abs=1e-14)
    both = float(observed), float(chance)
    assert (found.observed, found.chance) == pytest.approx(both, abs=1e-14)
    percent = percent_agreement(count_items(TABLE_V)).value
    assert percent == pytest.approx(81 / 112, abs=1e-14)


def test_missing_ratings_by_hand() -> None:
    # Items (a a b), (a . a), (b . .): pairs exist on the first two: P = 1/3, 1.
    # P-bar = 2/3. Shares of a: 2/3, 1, 0, mean 5/9; of b 4/9: the item with a single
    # rating counts here. P-bar_e = 41/81; kappa = (2/3 - 41/81)/(40/81) = 13/40.
    found = fleiss_kappa([["a", "a", "b"], ["a", None, "a"], ["b", None, None]])
    assert found.value == pytest.approx(13 / 40, abs=1e-14)
    assert (found.n_items, found.n_raters) == (3, 3)
    assert found.observed == pytest.approx(2 / 3, abs=1e-14)


def test_cohen_1960_style_table_by_hand() -> None:
    # 50 things, p_o = 35/50; margins (25, 25) and (30, 20):
    # p_e = (25·30 + 25·20) / 2500 = 1/2; kappa = 0.2 / 0.5 = 0.4.
    table = [[20, 5], [10, 15]]
    found = cohen_kappa(count_table(table))
    assert found.value == 0.4
    assert (found.observed, found.chance) == (0.7, 0.5)
    assert (found.n_items, found.n_raters, found.n_categories) == (50, 2, 2)


def test_pairs_with_a_missing_rating_are_left_out_of_the_margins() -> None:
    complete = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]
    assert cohen_kappa([*complete, ["a", None], [None, "b"]]) == cohen_kappa(complete)


@pytest.mark.parametrize("function", [fleiss_kappa, cohen_kappa])
def test_one_category_is_undefined_and_says_so(function) -> None:  # type: ignore[no-untyped-def]
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        found = function([["a", "a"], ["a", "a"]], categories=["a", "b"])
    assert math.isnan(found.value)
    assert math.isnan(found.standard_error)
    assert "one category" in found.reason
    assert found.observed == found.chance == 1.0


@pytest.mark.parametrize("n", [10, 49, 100_008])  # n · (1/n) is not 1 for each
def test_raters_who_never_waver_and_never_agree_have_an_error_of_exactly_0(
    n: int,
) -> None:
    # Every item is (a, b): D_o = 1, D_e = 1 · 1, κ = 0; no item differs from the mean.
    for function in (cohen_kappa, light_kappa):
        kappa = function(np.array([["a", "b"]] * n))
        assert (kappa.value, kappa.standard_error) == (0.0, 0.0)

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
    stratified_kappa,
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


def test_standard_error_of_percent_agreement_is_that_of_a_mean() -> None:
    # All items complete: P-bar is a mean of 21/28, 16/28, 28/28, 16/28, and its
    # standard error the sample sd over the root of 4.
    shares = [Fraction(n, 28) for n in (21, 16, 28, 16)]
    mean = sum(shares) / 4
    variance = sum((s - mean) ** 2 for s in shares) / 3 / 4
    found = percent_agreement(count_items(TABLE_V)).standard_error
    assert found == pytest.approx(math.sqrt(variance), rel=1e-14)


def test_standard_error_of_fleiss_kappa_on_two_items_by_hand() -> None:
    # Items (2, 0) and (1, 1), two raters. P = 1, 0; P-bar = 1/2; p = 3/4, 1/4;
    # P-bar_e = 10/16; kappa = (1/2 - 5/8) / (3/8) = -1/3.
    # Influence of item i: [(P_i - 1/2) - (4/3) 2 (Σ_k p_k x_ik - 5/8)] / (3/8),
    # with x the item's shares. Item 1: Σ = 3/4: (1/2 - (8/3)(1/8)) / (3/8) = 4/9;
    # item 2: Σ = 1/2: (-1/2 + (8/3)(1/8)) / (3/8) = -4/9.
    # SE² = (16/81 + 16/81) / (2 · 1); SE = 4/9.
    found = fleiss_kappa([["a", "a"], ["a", "b"]])
    assert found.value == pytest.approx(-1 / 3, abs=1e-16)
    assert found.standard_error == pytest.approx(4 / 9, rel=1e-14)


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


def test_cohens_standard_error_is_fleiss_cohen_and_everitts() -> None:
    # Fleiss, Cohen, Everitt (1969), eq. (13), for the table above, with cell shares
    # p_ij, rows p_i. and columns p_.j: n (1 - p_e)² ASE² = A + B - C,
    #   A = Σ p_ii [1 - (p_i. + p_.i)(1 - kappa)]²
    #   B = (1 - kappa)² Σ_{i≠j} p_ij (p_.i + p_j.)²
    #   C = [kappa - p_e (1 - kappa)]²
    # Rows .5, .5; columns .6, .4; kappa .4:
    #   A = .4 (1 - 1.1·.6)² + .3 (1 - .9·.6)² = .04624 + .06348 = .10972
    #   B = .36 [.1 (.6 + .5)² + .2 (.4 + .5)²] = .36 (.121 + .162) = .10188
    #   C = (.4 - .3)² = .01
    # ASE² = (.10972 + .10188 - .01) / (50 · .25) = .2016 / 12.5
    asymptotic = math.sqrt(0.2016 / 12.5)
    found = cohen_kappa(count_table([[20, 5], [10, 15]])).standard_error
    # Ours divides by n - 1, as for more raters.
    assert found == pytest.approx(asymptotic * math.sqrt(50 / 49), rel=1e-12)


def test_pairs_with_a_missing_rating_are_left_out_of_the_margins() -> None:
    complete = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]
    assert cohen_kappa([*complete, ["a", None], [None, "b"]]) == cohen_kappa(complete)


def test_stratified_kappa_by_hand() -> None:
    # R1: (a a) (b b) (a b): p_o = 2/3, margins a 2/3, 1/3: p_e = 4/9.
    # R2: a throughout: p_o = p_e = 1, a kappa of its own is 0/0.
    # Σ(p_o - p_e) / Σ(1 - p_e) = (2/9 + 0) / (5/9 + 0) = 2/5.
    first = [["a", "a"], ["b", "b"], ["a", "b"]]
    found = stratified_kappa([first, [["a", "a"]] * 3])
    assert found.value == 0.4
    assert found.observed == float(Fraction(5, 6))
    assert found.n_raters == 2


def test_one_stratum_is_cohens_kappa() -> None:
    pairs = [["a", "a"], ["b", "b"], ["a", "b"], ["c", "b"], [None, "c"], ["c", "c"]]
    one, cohen = stratified_kappa([pairs]), cohen_kappa(pairs)
    assert one.value == cohen.value
    assert one.standard_error == pytest.approx(cohen.standard_error, rel=1e-12)


def test_a_rater_without_pairs_is_left_out_of_the_strata() -> None:
    pairs = [["a", "a"], ["b", "b"], ["a", "b"]]
    with_none = stratified_kappa([pairs, [["a", None], [None, None], [None, "b"]]])
    assert with_none.value == stratified_kappa([pairs]).value
    assert with_none.n_raters == 1


@pytest.mark.parametrize("function", [fleiss_kappa, cohen_kappa])
def test_one_category_is_undefined_and_says_so(function) -> None:  # type: ignore[no-untyped-def]
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        found = function([["a", "a"], ["a", "a"]], categories=["a", "b"])
    assert math.isnan(found.value)
    assert math.isnan(found.standard_error)
    assert "one category" in found.reason
    assert found.observed == found.chance == 1.0


def test_one_item_has_a_value_and_no_standard_error() -> None:
    found = fleiss_kappa([["a", "b", "a"]])
    # P-bar = 1/3, p = 2/3, 1/3, P-bar_e = 5/9: kappa = -1/2.
    assert found.value == -0.5
    assert math.isnan(found.standard_error)


@pytest.mark.parametrize("n", [10, 49, 100_008])  # n · (1/n) is not 1 for each
def test_raters_who_never_waver_and_never_agree_have_an_error_of_exactly_0(
    n: int,
) -> None:
    # Every item is (a, b): D_o = 1, D_e = 1 · 1, κ = 0; no item differs from the mean.
    for function in (cohen_kappa, light_kappa):
        kappa = function(np.array([["a", "b"]] * n))
        assert (kappa.value, kappa.standard_error) == (0.0, 0.0)

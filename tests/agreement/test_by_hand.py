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
    item_disagreement,
    light_kappa,
    percent_agreement,
    pooled_kappa,
    robinson_a,
    stratified_kappa,
)
from masrel.errors import ParameterError, UndefinedStatisticWarning
from tests.strategies import Table

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


def test_spss_prints_an_error_over_n() -> None:
    # https://stats.oarc.ucla.edu/spss/faq/ on unequal ranges of scores: 12 films
    # prints Kappa .500, Asymp. Std. Error .156
    films = cohen_kappa(count_table([[4, 0, 0], [0, 4, 0], [0, 4, 0]]))
    assert films.value == 0.5
    assert films.standard_error == pytest.approx(0.163, abs=5e-4)
    assert films.standard_error * math.sqrt(11 / 12) == pytest.approx(0.156, abs=5e-4)


def test_pairs_with_a_missing_rating_are_left_out_of_the_margins() -> None:
    complete = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]
    assert cohen_kappa([*complete, ["a", None], [None, "b"]]) == cohen_kappa(complete)


@pytest.mark.parametrize("n", [10, 49, 100_008])  # n · (1/n) is not 1 for each
def test_raters_who_never_waver_and_never_agree_have_an_error_of_exactly_0(
    n: int,
) -> None:
    # Every item is (a, b): D_o = 1, D_e = 1 · 1, κ = 0; no item differs from the mean.
    for function in (cohen_kappa, light_kappa):
        kappa = function(np.array([["a", "b"]] * n))
        assert (kappa.value, kappa.standard_error) == (0.0, 0.0)


SMALL: Table = [["a", "a", "a"], ["b", "b", "b"], ["a", "b", "b"]]


def test_error_of_lights_kappa_by_hand() -> None:
    # Pair 1, 2 at a a: [1 - 2/3 - (3/5)(1/3 + 2/3 - 8/9)]/(5/9) = (4/15)(9/5) = 12/25,
    # at b b the same, at a b: [-2/3 - (3/5)(2/3 - 8/9)]/(5/9) = -24/25; pair 1, 3 the
    # same; pair 2, 3 is perfect and does not move. u = (2/3)(12, 12, -24)/25; SE² =
    # (64 + 64 + 256)/625 / 6 = 64/625.
    assert light_kappa(SMALL).standard_error == pytest.approx(8 / 25, rel=1e-13)


def test_missing_ratings_listwise_and_pairwise_by_hand() -> None:
    # The last two items are not whole. Pairwise, raters 1, 2 also have (a b), so that
    # p_o = 2/4, shares of a 3/4 and 1/4, p_e = 6/16: 1/5; raters 2, 3 also have (a b):
    # p_o = 3/4, shares of a 2/4 and 1/4, p_e = 8/16: 1/2; raters 1, 3 as before: 2/5.
    holed: Table = [*SMALL, ["a", "b", None], [None, "a", "b"]]
    assert light_kappa(holed).value == 0.6
    assert light_kappa(holed).n_items == 3
    found = light_kappa(holed, deletion="pairwise")
    assert found.value == pytest.approx(
        float((Fraction(1, 5) + Fraction(1, 2) + Fraction(2, 5)) / 3), abs=1e-14
    )
    assert found.n_items == 5


def test_one_pair_without_a_kappa_is_named_and_none_is_given() -> None:
    # Raters 2 and 3 chose b throughout: the mean of the others is not the mean.
    with pytest.warns(UndefinedStatisticWarning, match="columns 1 and 2"):
        found = light_kappa([["a", "b", "b"], ["b", "b", "b"], ["a", "b", "b"]])
    assert math.isnan(found.value)
    assert (
        found.reason
        == "0/0: there is only one category of the raters in columns 1 and 2"
    )
    # with what chance gives all the same
    assert not math.isnan(found.observed)


def test_the_reason_names_columns_of_the_table_as_given() -> None:
    # the second rater rates nothing and is left out; first and fourth have no item
    table: Table = [["a", None, "a", None], ["b", None, "b", None]]
    table += [[None, None, "a", "a"], [None, None, "b", "a"]]
    with pytest.warns(UndefinedStatisticWarning):
        found = light_kappa(table, deletion="pairwise")
    assert found.reason is not None
    assert "no item has both ratings of the raters in columns 0 and 3" in found.reason


FIRST: Table = [["a", "a"], ["b", "b"], ["a", "b"]]
SECOND: Table = [["a", "a"], ["b", "b"], ["b", "b"]]


def test_stratified_kappa_of_two_raters_by_hand() -> None:
    # First: p_o = 2/3, p_e = 2/9 + 2/9; second: 1 and 1/9 + 4/9.
    # (2/9 + 4/9)/(5/9 + 4/9): 2/3, between 2/5 and 1 of theirs.
    found = stratified_kappa([FIRST, SECOND])
    assert found.value == pytest.approx(float(Fraction(2, 3)), abs=1e-14)
    assert (found.observed, found.chance) == (5 / 6, 0.5)
    assert (found.n_items, found.n_raters, found.n_categories) == (3, 2, 2)


def test_error_of_stratified_kappa_by_hand() -> None:
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


KIM = [["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"]]
LEE = [["a", "a"], ["a", "b"], ["a", "a"], ["b", "b"]]


def test_pooled_kappa_of_two_raters_by_hand() -> None:
    # aa 3, ab 2, bb 3 of 8 pairs: p_o = 6/8; margins a 5/8 and 3/8, b 3/8 and 5/8:
    # p_e = (15 + 15)/64; κ = (48 - 30)/(64 - 30) = 18/34
    found = pooled_kappa([KIM, LEE])
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
        for pairs in zip(KIM, LEE, strict=True)
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


# Agreement 1, 1/3, none: n = 3 items, n' = 2 with a pair, their mean 2/3.
SINGLE: Table = [["a", "a", "a"], ["a", "a", "b"], ["a", None, None]]


def test_single_ratings_make_the_number_of_pairs_random_by_hand() -> None:
    # u_i = (n/n') s_i (P_i - 2/3): 3/2 (1/3), 3/2 (-1/3), 0;
    # SE² = (1/4 + 1/4)/(3 · 2) = 1/12.
    assert percent_agreement(SINGLE).value == pytest.approx(2 / 3, abs=1e-14)
    error = percent_agreement(SINGLE).standard_error
    assert error == pytest.approx(math.sqrt(1 / 12), rel=1e-14)


def test_of_a_finite_population_the_items_rated_are_known() -> None:
    # 1 - f with f = 3/12, and f = 1: all there is to know was seen
    plain, some, whole = (
        percent_agreement(SINGLE, population=n).standard_error for n in (None, 12, 3)
    )
    assert some == pytest.approx(plain * math.sqrt(3 / 4), rel=1e-14)
    assert whole == 0.0


def test_a_population_holds_the_items_rated() -> None:
    # three have a rating, the fourth has none
    holed = [*SINGLE, [None, None, None]]
    assert percent_agreement(holed, population=3).standard_error == 0.0
    with pytest.raises(ParameterError, match="at least the 3 items rated, got 2"):
        percent_agreement(holed, population=2)


def test_the_disagreement_on_each_item_by_hand() -> None:
    # pairs that differ: none of 3, two of 3 and none there is
    np.testing.assert_array_equal(item_disagreement(SINGLE), [0, 2 / 3, math.nan])
    # 1 and 2 of a scale of 1 to 3 are half a scale apart
    linear = item_disagreement([[1, 2], [1, 3], [2, 2]], weights="linear")
    assert linear.tolist() == [0.5, 1.0, 0.0]
    assert item_disagreement(count_items([[3, 0], [2, 1]])).tolist() == [0.0, 2 / 3]


def test_robinsons_a_of_two_raters_by_hand() -> None:
    # Levels 2 and 3 set aside: deviations -1, 0, 1 and -1, 1, 0. Items' means -1, 1/2,
    # 1/2: SS = 2 (1 + 1/4 + 1/4) = 3; of all squares, 2 + 2 = 4.
    found = robinson_a([[1, 2], [2, 4], [3, 3]])
    assert found.value == 0.75
    assert (found.n_items, found.n_raters, found.n_categories) == (3, 2, 4)
    assert math.isnan(found.standard_error)
    assert math.isnan(found.observed)
    assert math.isnan(found.chance)

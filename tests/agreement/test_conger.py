"""Conger's kappa: three raters by hand, missing ratings, errors by slopes."""

import math
from fractions import Fraction

import pytest

from masrel.agreement import cohen_kappa, conger_kappa
from masrel.errors import UndefinedStatisticWarning
from tests.strategies import Table

SMALL: Table = [["a", "a", "a"], ["b", "b", "b"], ["a", "b", "b"]]


def test_three_raters_by_hand() -> None:
    # P = 1, 1, 1/3: P-bar = 21/27. Shares of a: 2/3, 1/3, 1/3. Pairs by chance:
    # 2/9 + 2/9 twice, and 1/9 + 4/9: p_e = 13/27. (21 - 13)/(27 - 13).
    found = conger_kappa(SMALL)
    assert found.value == 8 / 14
    assert (found.observed, found.chance) == pytest.approx(
        (21 / 27, 13 / 27), abs=1e-14
    )
    assert (found.n_items, found.n_raters, found.n_categories) == (3, 3, 2)


def test_error_of_three_raters_by_hand() -> None:
    # Rater g choosing k moves p_e by b_g(k) = (1/3) Σ_{h≠g} p_hk about its mean: first
    # rater 2/9 or 4/9 about 8/27, so -2/27 for a and 4/27 for b; the others 1/3 always.
    # u = [P_i - P-bar - (3/7) Δ] / (14/27):
    #   a a a: [6 + (3/7) 2]/14 = 24/49,  b b b: [6 - (3/7) 4]/14 = 15/49,
    #   a b b: [-12 + (3/7) 2]/14 = -39/49. SE² = (24² + 15² + 39²)/49² / 6.
    found = conger_kappa(SMALL).standard_error
    assert found == pytest.approx(math.sqrt(387) / 49, rel=1e-13)


def test_a_lone_rating_counts_for_its_rater_by_hand() -> None:
    # P-bar = 2/3 of three pairs. First rater a in 2 of 4, second in 1 of 3: p_e =
    # 1/6 + 1/3 = 1/2: (2/3 - 1/2)/(1/2). Cohen's leaves b . out: 2/9 + 2/9, 2/5.
    table: Table = [["a", "a"], ["a", "b"], ["b", "b"], ["b", None]]
    assert conger_kappa(table).value == pytest.approx(float(Fraction(1, 3)), abs=1e-14)
    assert cohen_kappa(table).value == 0.4


def test_linear_weights_by_hand() -> None:
    # (1 1), (1 2), (3 3) of 1 to 3: agreement 1, 1/2, 1, mean 5/6. Shares 2/3 0 1/3 and
    # 1/3 1/3 1/3: 2/3 (1/3 + 1/6) + 1/3 (1/6 + 1/3) = 1/2: (5/6 - 1/2)/(1/2) = 2/3.
    found = conger_kappa([[1, 1], [1, 2], [3, 3]], weights="linear")
    assert found.value == pytest.approx(float(Fraction(2, 3)), abs=1e-14)
    assert found.weights == "linear"


def test_a_rater_without_any_rating_is_no_rater() -> None:
    table: Table = [["a", None, "a"], ["b", None, "a"], ["b", None, "b"]]
    assert conger_kappa(table) == conger_kappa([[row[0], row[2]] for row in table])


@pytest.mark.parametrize(
    ("table", "why"),
    [
        ([["a", "a", "a"]] * 3, "0/0: chance agreement is 1"),
        ([["a", None], [None, "b"]], "no item has ratings of two raters"),
    ],
)
def test_undefined_with_a_reason(table: Table, why: str) -> None:
    with pytest.warns(UndefinedStatisticWarning, match=why):
        found = conger_kappa(table)
    assert why in (found.reason or "")
    assert math.isnan(found.standard_error)

"""Percent agreement and its standard errors: by hand, with and without lone ratings."""

import math

import pytest

from masrel.agreement import (
    percent_agreement,
)
from masrel.errors import ParameterError
from tests.strategies import Table

# Krippendorff (2011), four observers of twelve units; the last has a single rating.
UNITS: Table = [
    [None if grade == "." else grade for grade in row.split()]
    for row in (
        "1 1 . 1,2 2 3 2,3 3 3 3,3 3 3 3,2 2 2 2,1 2 3 4,4 4 4 4,1 1 2 1,2 2 2 2,"
        ". 5 5 5,. . 1 1,. 3 . ."
    ).split(",")
]

# Agreement 1, 1/3, none: n = 3 items, n' = 2 with a pair, their mean 2/3.
SINGLE: Table = [["a", "a", "a"], ["a", "a", "b"], ["a", None, None]]


def test_krippendorffs_units_by_hand() -> None:
    # Eleven with a pair: eight agree in all, two in 3 of 6 and one in 0 of 6.
    found = percent_agreement(UNITS)
    assert found.value == pytest.approx(9 / 11, abs=1e-14)
    assert (found.n_items, found.n_raters, found.n_categories) == (12, 4, 5)


def test_linear_weights_count_how_far_apart_by_hand() -> None:
    # 1 and 2 of a scale of 1 to 3 are half in agreement, 1 and 3 are not at all:
    # items (1 2), (1 3), (2 2): 1/2, 0, 1.
    table = [[1, 2], [1, 3], [2, 2]]
    assert percent_agreement(table, weights="linear").value == 0.5
    assert percent_agreement(table, weights="quadratic").value == pytest.approx(7 / 12)
    # On a declared scale to 5 they are closer: 3/4, 1/2, 1.
    wide = percent_agreement(table, categories=range(1, 6), weights="linear")
    assert wide.value == 0.75


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


def test_is_not_corrected_for_chance_even_of_one_category() -> None:
    found = percent_agreement([["a", "a"], ["a", "a"]])
    assert (found.value, found.chance, found.reason) == (1.0, 0.0, None)

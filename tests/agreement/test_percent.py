"""Percent agreement and its standard errors: by hand, with and without lone ratings."""

import math

import numpy as np
import pytest

from masrel.agreement import count_items, item_disagreement, percent_agreement
from masrel.errors import ParameterError, UndefinedStatisticWarning
from tests.strategies import Table

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


def test_is_not_corrected_for_chance_even_of_one_category() -> None:
    found = percent_agreement([["a", "a"], ["a", "a"]])
    assert (found.value, found.chance, found.reason) == (1.0, 0.0, None)


def test_the_disagreement_on_each_item_by_hand() -> None:
    # pairs that differ: none of 3, two of 3 and none there is
    np.testing.assert_array_equal(item_disagreement(SINGLE), [0, 2 / 3, math.nan])
    # 1 and 2 of a scale of 1 to 3 are half a scale apart
    linear = item_disagreement([[1, 2], [1, 3], [2, 2]], weights="linear")
    assert linear.tolist() == [0.5, 1.0, 0.0]
    assert item_disagreement(count_items([[3, 0], [2, 1]])).tolist() == [0.0, 2 / 3]


@pytest.mark.parametrize("weights", ["identity", "linear"])
@pytest.mark.parametrize("n_grades", [5, 3000])
def test_agreement_is_what_items_leave_of_disagreement(
    weights: str, n_grades: int
) -> None:
    ratings = np.random.default_rng(8).integers(0, n_grades, (2000, 4))
    mean = item_disagreement(ratings, weights=weights).mean()
    agreement = percent_agreement(ratings, categories=None, weights=weights)
    assert 1.0 - mean == pytest.approx(agreement.value)


def test_weights_that_a_scale_does_not_have_are_said_and_leave_nothing() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="disagreement on items"):
        assert np.isnan(item_disagreement([[1, 1]], weights="linear")).all()
    with pytest.raises(ParameterError, match="weights: needs one of"):
        item_disagreement([[1, 1]], weights="none")  # type: ignore[arg-type]

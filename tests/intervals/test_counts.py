"""Intervals of tables of counts are those of the ratings that were counted."""

import numpy as np
import pytest

from masrel.agreement import cohen_kappa, count_items, count_table, light_kappa
from masrel.errors import CountsError, ParameterError, RatingsError
from masrel.estimates import Estimate
from masrel.intervals import difference, estimate, jackknife

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")

TABLE = [[20, 5], [10, 15]]
PAIRS = [[1, 1]] * 20 + [[1, 2]] * 5 + [[2, 1]] * 10 + [[2, 2]] * 15
COUNTS = [[3, 0, 0], [2, 1, 0], [0, 3, 0], [0, 1, 1], [1, 0, 0]]
RATINGS = [[1, 1, 1], [1, 1, 2], [2, 2, 2], [2, 3, None], [1, None, None]]
NAMED = ["cohen_kappa", "scott_pi", "conger_kappa", "light_kappa"]
UNNAMED = [
    "percent_agreement",
    "fleiss_kappa",
    "brennan_prediger",
    "gwet_ac",
    "krippendorff_alpha",
]


@pytest.mark.parametrize(
    "method", ["auto", "analytic", "jackknife", "bootstrap", "posterior"]
)
@pytest.mark.parametrize("name", [*NAMED, *UNNAMED])
def test_a_table_of_two_raters_is_their_ratings(name: str, method: str) -> None:
    of_table, of_pairs = (
        estimate(name, ratings, target="items", method=method, rng=1, **scale)  # type: ignore[arg-type]
        for ratings, scale in (
            (count_table(TABLE), {}),
            (PAIRS, {"categories": [1, 2]}),
        )
    )
    assert of_table.interval is not None
    assert of_pairs.interval is not None
    assert of_table.interval.method == of_pairs.interval.method
    assert numbers(of_table) == pytest.approx(numbers(of_pairs), rel=1e-12)


def numbers(of: Estimate) -> list[float]:
    """Return what an estimate says in numbers; sums may be in another order."""
    assert of.interval is not None
    return [
        *(of.value, of.standard_error, of.observed, of.chance),
        *(of.n_items, of.n_items_paired, of.n_raters),
        *(of.interval.low, of.interval.high),
    ]


@pytest.mark.parametrize("method", ["auto", "analytic", "jackknife", "bootstrap"])
@pytest.mark.parametrize("name", UNNAMED)
def test_counts_are_the_ratings_they_count(name: str, method: str) -> None:
    of_counts, of_ratings = (
        estimate(name, ratings, target="items", method=method, rng=1, **scale)  # type: ignore[arg-type]
        for ratings, scale in (
            (count_items(COUNTS * 4), {}),
            (RATINGS * 4, {"categories": [1, 2, 3]}),
        )
    )
    assert of_counts.interval is not None
    assert of_ratings.interval is not None
    assert of_counts.interval.notes == of_ratings.interval.notes
    assert numbers(of_counts) == pytest.approx(numbers(of_ratings), rel=1e-12)


def test_coefficients_of_two_raters_take_their_table() -> None:
    assert cohen_kappa(count_table(TABLE)).value == 0.4
    assert light_kappa(count_table(TABLE)).value == 0.4
    # on other items than 25 of 50 agreeing of each: a difference of independent ones
    found = difference(
        "cohen_kappa",
        count_table(TABLE),
        count_table([[12, 13], [13, 12]]),
        design="independent",
    )
    assert found.value == pytest.approx(0.44, abs=1e-15)


@pytest.mark.parametrize("target", ["raters", "both"])
def test_counts_name_no_raters(target: str) -> None:
    counted = count_items(COUNTS)
    with pytest.raises(ParameterError, match="counts do not say who rated what"):
        jackknife("fleiss_kappa", counted, target=target)  # type: ignore[arg-type]
    with pytest.raises(RatingsError, match="needs to know who rated what"):
        estimate("cohen_kappa", counted, target="items")
    with pytest.raises(ParameterError, match="the ratings are on the scale"):
        jackknife("fleiss_kappa", counted, target="items", categories=["a", "b", "c"])


def test_counts_of_nobody_have_no_interval() -> None:
    for counts in (np.zeros((3, 2), int), [[1, 0], [0, 1]]):
        interval = jackknife("fleiss_kappa", count_items(counts), target="items")
        assert interval.reason == "the estimate itself is undefined"


def test_more_than_can_be_spread_out_is_refused() -> None:
    many = [[10**9, 1], [2, 3]]
    assert cohen_kappa(count_table(many)).n_items == 10**9 + 6
    with pytest.raises(CountsError, match=r"ratings: needs at most 1e\+08"):
        jackknife("cohen_kappa", count_table(many), target="items")
    with pytest.raises(CountsError, match=r"ratings: needs at most 1e\+08"):
        jackknife("gwet_ac", count_items(many), target="items")

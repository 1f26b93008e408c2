"""Ratings of so many different grades that no table has a place for every two."""

import math
import tracemalloc
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.agreement import (
    COEFFICIENTS,
    count_items,
    krippendorff_alpha,
)

Distance = Callable[[Fraction, Fraction], Fraction]

POOLED = ["percent_agreement", "fleiss_kappa", "gwet_ac", "brennan_prediger"]


def continuous(n_items: int = 70, seed: int = 5) -> NDArray[np.float64]:
    """Three raters, centred, no two ratings alike; some missing."""
    rng = np.random.default_rng(seed)
    ratings = rng.normal(size=(n_items, 1)) + 0.5 * rng.normal(size=(n_items, 3))
    ratings[0, 0] = ratings[7, 2] = ratings[9, :2] = np.nan
    return ratings


def by_definition(ratings: NDArray[np.float64], distance: Distance) -> Fraction:
    """Return Krippendorff's alpha in fractions, pair by pair."""
    rows = [[Fraction(x) for x in row if not math.isnan(x)] for row in ratings.tolist()]
    rows = [row for row in rows if len(row) > 1]
    every = [x for row in rows for x in row]
    n = len(every)
    observed = sum(
        sum(distance(x, y) for x in row for y in row) / (len(row) - 1) for row in rows
    )
    expected = sum(distance(x, y) for x in every for y in every)
    return 1 - (n - 1) * Fraction(observed) / expected


@pytest.mark.parametrize(
    ("options", "distance"),
    [
        ({"metric": "interval"}, lambda x, y: (x - y) ** 2),
        ({"weights": "quadratic"}, lambda x, y: (x - y) ** 2),
        ({"weights": "linear"}, lambda x, y: abs(x - y)),
    ],
)
def test_alpha_of_continuous_ratings_is_that_of_fractions(
    options: dict[str, Any], distance: Distance
) -> None:
    ratings = continuous()
    exact = float(by_definition(ratings, distance))
    assert krippendorff_alpha(ratings, **options).value == pytest.approx(
        exact, rel=1e-13
    )


@pytest.mark.parametrize("name", ["gwet_ac", "conger_kappa", "light_kappa"])
@pytest.mark.parametrize("weights", ["linear", "quadratic", "ordinal"])
def test_many_grades_have_the_value_of_a_matrix(name: str, weights: str) -> None:
    # Whole numbers from 0 to 2099, each once and with what two raters do; the same as
    # one matrix of weights.
    rng = np.random.default_rng(8)
    q = 2100
    first = rng.permutation(q)
    ratings = np.column_stack([first, rng.permutation(q), (first + 7) % q])
    scale = np.arange(float(q))
    between = np.abs(scale[:, None] - scale)
    matrix = {
        "linear": 1 - between / (q - 1),
        "quadratic": 1 - (between / (q - 1)) ** 2,
        "ordinal": 1 - between * (between + 1) / (q * (q - 1)),
    }[weights]
    np.fill_diagonal(matrix, 1.0)
    matrix = np.minimum(np.maximum(matrix, matrix.T), 1.0)
    entry = COEFFICIENTS[name]
    result, custom = entry(ratings, weights=weights), entry(ratings, weights=matrix)
    assert result.value == pytest.approx(custom.value, abs=1e-12)
    assert result.standard_error == pytest.approx(custom.standard_error, rel=1e-9)
    assert (result.observed, result.chance) == pytest.approx(
        (custom.observed, custom.chance), abs=1e-12
    )


@pytest.mark.parametrize("weights", ["identity", "linear"])
@pytest.mark.parametrize("name", [*POOLED, "krippendorff_alpha"])
def test_thousands_of_raters_are_what_their_counts_are(name: str, weights: str) -> None:
    rng = np.random.default_rng(3)
    codes = rng.integers(0, 4, (12, 1500)).astype(float)
    codes[rng.random(codes.shape) < 0.2] = np.nan
    counts = np.array([[np.sum(row == k) for k in range(4)] for row in codes])
    entry = COEFFICIENTS[name]
    tracemalloc.start()
    estimate = entry(codes, weights=weights)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    of_counts = entry(count_items(counts, categories=range(4)), weights=weights)
    assert estimate.value == pytest.approx(of_counts.value, rel=1e-13)
    assert estimate.standard_error == pytest.approx(of_counts.standard_error, rel=1e-12)
    assert peak < 10e6  # a pair of raters in 8 bytes would be 18 MB, an item
    if name == "percent_agreement" and weights == "identity":
        n = counts.sum(axis=1)
        share = (counts * (counts - 1)).sum(axis=1) / (n * (n - 1))
        assert estimate.value == pytest.approx(share.mean(), rel=1e-13)

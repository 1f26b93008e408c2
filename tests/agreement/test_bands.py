"""Words for kappa: the published bands, and the normal law around the estimate."""

import math
from typing import get_args

import mpmath
import pytest

from masrel.agreement import (
    BandScale,
    bands,
    benchmark,
    brennan_prediger,
    count_items,
    fleiss_kappa,
    strength,
)
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate

SCALES: tuple[BandScale, ...] = get_args(BandScale)


def estimate(value: float, error: float) -> Estimate:
    """Make an estimate of which only value and error matter."""
    return Estimate(
        coefficient="fleiss_kappa",
        weights="identity",
        value=value,
        standard_error=error,
        observed=math.nan,
        chance=math.nan,
        n_items=20,
        n_items_paired=20,
        n_raters=2,
        n_categories=2,
    )


def phi(z: float) -> mpmath.mpf:
    # Φ, with digits enough for differences of far tails
    return mpmath.erfc(-mpmath.mpf(z) / mpmath.sqrt(2)) / 2


def within(low: float, high: float, value: float, error: float) -> float:
    with mpmath.workdps(330):
        value_, error_ = mpmath.mpf(value), mpmath.mpf(error)
        ends = [(mpmath.mpf(end) - value_) / error_ for end in (low, high, -1.0, 1.0)]
        low_, high_, first, last = map(phi, ends)
        return float((high_ - low_) / (last - first))


@pytest.mark.parametrize(
    ("scale", "published"),
    [
        # Landis and Koch (1977), p. 165
        (
            "landis_koch",
            {
                "almost perfect": 0.8,
                "substantial": 0.6,
                "moderate": 0.4,
                "fair": 0.2,
                "slight": 0.0,
                "poor": -1.0,
            },
        ),
        # Altman (1991), p. 404
        (
            "altman",
            {"very good": 0.8, "good": 0.6, "moderate": 0.4, "fair": 0.2, "poor": -1.0},
        ),
        # Fleiss (1981), p. 218
        ("fleiss", {"excellent": 0.75, "intermediate to good": 0.4, "poor": -1.0}),
        # Cicchetti and Sparrow, 1981
        ("cicchetti", {"excellent": 0.75, "good": 0.6, "fair": 0.4, "poor": -1.0}),
    ],
)
def test_words_and_ends_are_the_published_ones(
    scale: BandScale, published: dict[str, float]
) -> None:
    found = bands(estimate(0.5, 0.1), scale=scale)
    assert {band.word: band.low for band in found} == published
    assert [band.high for band in found] == [1.0, *list(published.values())[:-1]]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("error", [0.02, 0.07, 1.5])
@pytest.mark.parametrize("value", [-1.0, -0.31, 0.0, 0.5, 0.93, 1.0])
def test_every_band_has_its_digits_however_far(
    value: float, error: float, scale: BandScale
) -> None:
    # 0.93 with an error of 0.02 is "poor" once in 10^154
    for band in bands(estimate(value, error), scale=scale):
        exact = within(band.low, band.high, value, error)
        assert band.probability == pytest.approx(exact, rel=1e-9, abs=1e-307)


def test_the_word_is_the_best_that_is_certain_enough() -> None:
    # .85 ± .1 above .8, cut at 1: (Φ(1.5) - Φ(-.5))/Φ(1.5) = (.9332 - .3085)/.9332 =
    # .669; above .6: (.9332 - .0062)/.9332 = .993.
    found = estimate(0.85, 0.1)
    assert benchmark(found, level=0.66) == "almost perfect"
    assert benchmark(found, level=0.68) == "substantial"
    assert benchmark(found) == "substantial"
    assert benchmark(found, level=0.995) == "moderate"
    # above .75: (.9332 - .1587)/.9332 = .830
    assert benchmark(found, scale="fleiss", level=0.82) == "excellent"
    assert benchmark(found, scale="fleiss") == "intermediate to good"
    assert benchmark(found, scale="cicchetti") == "good"
    assert benchmark(found, scale="altman") == "good"


def test_what_is_undefined_or_has_no_error_earns_no_word() -> None:
    with pytest.warns(UndefinedStatisticWarning):
        nothing = fleiss_kappa([["a", "a"], ["a", "a"]])
    # two items, on both of which two raters agree; and a value without an error
    perfect, one_item = (
        fleiss_kappa([["a", "a"], ["b", "b"]]),
        fleiss_kappa([["a", "b"]]),
    )
    for undefined in (nothing, one_item, perfect, estimate(0.3, 0.0)):
        with pytest.warns(UndefinedStatisticWarning):
            assert benchmark(undefined) == "undefined"
        with pytest.warns(UndefinedStatisticWarning):
            assert all(math.isnan(band.cumulative) for band in bands(undefined))


@pytest.mark.parametrize(
    ("counts", "scale", "word"),
    [
        # four raters of two categories, κ_BP = 2 P - 1
        ([3, 1], "landis_koch", "slight"),  # 0 is slight, below it is poor
        ([3, 1], "altman", "poor"),
        ([4, 0], "landis_koch", "almost perfect"),
        # 15 and 1 of 16: P = 105/120, κ_BP = 0.75
        ([15, 1], "fleiss", "intermediate to good"),  # excellent is above 0.75
        ([15, 1], "cicchetti", "excellent"),  # 0.75 and more
        ([15, 1], "landis_koch", "substantial"),
    ],
)
def test_a_value_at_an_end_has_the_published_word(
    counts: list[int], scale: BandScale, word: str
) -> None:
    found = brennan_prediger(count_items([counts] * 5))
    assert strength(found.value, scale=scale) == word


@pytest.mark.parametrize("n_other", [1, 300])
def test_an_estimate_below_minus_one_has_probabilities_too(n_other: int) -> None:
    # Linear weights of three categories have T_w = 5, p_e = 5/9: all ratings at the
    # ends give (0 - 5/9)/(4/9) = -5/4.
    ratings = [["1", "3"]] * 999 + [["1", "2"]] * n_other
    found = brennan_prediger(ratings, categories=["1", "2", "3"], weights="linear")
    assert (found.value < -1) == (n_other < 300)
    for scale in get_args(BandScale):
        of_bands = bands(found, scale=scale)
        assert sum(band.probability for band in of_bands) == pytest.approx(1, rel=1e-14)
        assert of_bands[-1].cumulative == pytest.approx(1, rel=1e-14)
        assert of_bands[-1].low == (-math.inf if found.value < -1 else -1.0)
        assert benchmark(found, scale=scale) == "poor"

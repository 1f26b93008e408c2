"""Words for kappa: the published bands, and the normal law around the estimate."""

import itertools
import math
from typing import get_args

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.agreement import (
    BandScale,
    bands,
    benchmark,
    brennan_prediger,
    count_items,
    fleiss_kappa,
    strength,
)
from masrel.errors import ParameterError, UndefinedStatisticWarning
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


estimates = st.builds(estimate, st.floats(-1, 1), st.floats(0.005, 3))


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


def test_probabilities_by_hand_from_a_table_of_phi() -> None:
    # Value 0, error 1: Φ(1) - Φ(-1) = .682689, and Φ at .2, .4, .6, .8, 1 less .5 is
    # .079260, .155422, .225747, .288145, .341345. Slight: .079260/.682689 = .116100.
    found = {band.word: band for band in bands(estimate(0.0, 1.0))}
    by_hand = {
        "almost perfect": (0.341345 - 0.288145) / 0.682689,
        "substantial": (0.288145 - 0.225747) / 0.682689,
        "moderate": (0.225747 - 0.155422) / 0.682689,
        "fair": (0.155422 - 0.079260) / 0.682689,
        "slight": 0.079260 / 0.682689,
        "poor": 0.5,
    }
    total = 0.0
    for word, probability in by_hand.items():
        total += probability
        assert found[word].probability == pytest.approx(probability, abs=2e-6)
        assert found[word].cumulative == pytest.approx(total, abs=5e-6)


def test_an_estimate_that_says_nothing_spreads_over_the_whole_space() -> None:
    # An error without end: every value from -1 to 1 is as likely as any other.
    for scale in SCALES:
        for band in bands(estimate(0.3, 1e6), scale=scale):
            assert band.probability == pytest.approx((band.high - band.low) / 2)
            assert band.cumulative == pytest.approx((1.0 - band.low) / 2)


def test_half_lies_above_the_estimate_if_no_end_is_near() -> None:
    # (Φ(12) - Φ(0)) / (Φ(12) - Φ(-28)): the ends cut nothing a float can show
    found = {b.word: b.cumulative for b in bands(estimate(0.4, 0.05))}
    assert found["moderate"] == pytest.approx(0.5, rel=1e-14)


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


@given(estimates, st.sampled_from(SCALES))
def test_probabilities_sum_to_one(found: Estimate, scale: BandScale) -> None:
    made = bands(found, scale=scale)
    assert all(0.0 <= band.probability <= 1.0 for band in made)
    assert sum(band.probability for band in made) == pytest.approx(1.0, rel=1e-12)
    assert made[-1].cumulative == pytest.approx(1.0, rel=1e-12)
    for better, worse in itertools.pairwise(made):
        assert better.low == worse.high
        assert better.cumulative <= worse.cumulative <= 1.0
        step = worse.cumulative - better.cumulative
        assert step == pytest.approx(worse.probability, abs=1e-12)


@given(estimates)
def test_scales_agree_where_their_bands_begin_alike(found: Estimate) -> None:
    # all begin one at 0.4: only the words differ
    at = [{b.low: b.cumulative for b in bands(found, scale=s)}[0.4] for s in SCALES]
    assert at == pytest.approx([at[0]] * len(SCALES), abs=1e-12)


@given(estimates, st.floats(0.01, 0.98), st.floats(0.01, 0.98))
def test_more_certainty_earns_no_better_word(
    found: Estimate, one: float, other: float
) -> None:
    words = [band.word for band in bands(found)]
    low, high = sorted((one, other))
    sure, unsure = (benchmark(found, level=level) for level in (high, low))
    assert words.index(sure) >= words.index(unsure)


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


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (1.0, ("almost perfect", "very good", "excellent", "excellent")),
        (0.7, ("substantial", "good", "intermediate to good", "good")),
        (0.5, ("moderate", "moderate", "intermediate to good", "fair")),
        (0.3, ("fair", "fair", "poor", "poor")),
        (0.1, ("slight", "poor", "poor", "poor")),
        (-0.4, ("poor", "poor", "poor", "poor")),
        (-1.0, ("poor", "poor", "poor", "poor")),
    ],
)
def test_the_word_of_a_value_whatever_its_error(
    value: float, words: tuple[str, ...]
) -> None:
    for scale, word in zip(SCALES, words, strict=True):
        assert strength(value, scale=scale) == word


def test_an_error_of_0_earns_no_word() -> None:
    # two items, on both of which two raters agree
    perfect = fleiss_kappa([["a", "a"], ["b", "b"]])
    assert (perfect.value, perfect.standard_error) == (1.0, 0.0)
    for found in (perfect, estimate(0.3, 0.0)):
        for scale in SCALES:
            with pytest.warns(UndefinedStatisticWarning, match="is 0: no item moves"):
                assert benchmark(found, scale=scale) == "undefined"
            with pytest.warns(UndefinedStatisticWarning, match="is 0: no item moves"):
                made = bands(found, scale=scale)
            assert all(math.isnan(band.probability) for band in made)


def test_what_is_undefined_earns_no_word() -> None:
    with pytest.warns(UndefinedStatisticWarning):
        nothing = fleiss_kappa([["a", "a"], ["a", "a"]])
    one_item = fleiss_kappa([["a", "b"]])  # a value without an error
    for found, why in ((nothing, "0/0"), (one_item, "one item with a pair")):
        for scale in SCALES:
            with pytest.warns(UndefinedStatisticWarning, match=why):
                assert benchmark(found, scale=scale) == "undefined"
            with pytest.warns(UndefinedStatisticWarning, match=why):
                made = bands(found, scale=scale)
            for band in made:
                assert math.isnan(band.probability)
                assert math.isnan(band.cumulative)


def test_a_mistyped_scale_gets_one_sentence() -> None:
    said = "scale: needs one of landis_koch, altman, fleiss, cicchetti, got 'landis'"
    for function in (bands, benchmark):
        with pytest.raises(ParameterError, match=said):
            function(estimate(0.5, 0.1), scale="landis")  # type: ignore[operator]


@pytest.mark.parametrize("level", [0.0, 1.0, 95, -0.5, math.nan])
def test_a_level_is_a_probability(level: float) -> None:
    with pytest.raises(ParameterError, match=r"level: needs \(0, 1\), got"):
        benchmark(estimate(0.5, 0.1), level=level)


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

"""P-values and bands of estimates: by hand, and against 450 digits."""

import math
from typing import get_args

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from masrel.agreement import (
    COEFFICIENTS,
    Alternative,
    BandScale,
    bands,
    benchmark,
    brennan_prediger,
    count_items,
    equivalence_p_value,
    fleiss_kappa,
    holm,
    p_value,
    percent_agreement,
    strength,
)
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate
from tests.agreement.test_undefined import assert_undefined


def estimate(value: float, error: float, n_items: int = 20) -> Estimate:
    """Make an estimate of which only value, error and items matter."""
    return Estimate(
        coefficient="fleiss_kappa",
        weights="identity",
        value=value,
        standard_error=error,
        observed=math.nan,
        chance=math.nan,
        n_items=n_items,
        n_items_paired=n_items,
        n_raters=2,
        n_categories=2,
    )


def both_tails(t: float, df: int) -> float:
    # P(|T| ≥ t) = I(df/2, 1/2) at df/(df + t²), with digits enough for far tails
    with mpmath.workdps(450):
        x = mpmath.mpf(df) / (df + mpmath.mpf(t) ** 2)
        half = mpmath.mpf(1) / 2
        return float(mpmath.betainc(df * half, half, 0, x, regularized=True))


@pytest.mark.parametrize("df", [1, 2, 3, 4, 7, 29, 100, 1000, 20_000])
@pytest.mark.parametrize("t", [1e-9, 0.1, 1.0, 1.96, 5.0, 12.0, 25.0, 40.0])
def test_every_tail_has_its_digits(t: float, df: int) -> None:
    # 40 with 1000 degrees is 1e-209: what 2 · (1 - P(T < t)) would call 0. Below
    # 1e-307 a float has no more digits to be right in.
    found = p_value(estimate(t, 1.0, n_items=df + 1))
    assert found == pytest.approx(both_tails(t, df), rel=1e-9, abs=1e-307)


@given(
    grades=st.lists(st.tuples(*[st.sampled_from("abc")] * 3), min_size=2, max_size=30)
)
def test_of_percent_agreement_it_is_the_t_test_of_a_mean(
    grades: list[tuple[str, str, str]],
) -> None:
    # Every item complete: its agreement is 0, 1/3 or 1, their mean is Student's.
    shares = [((a == b) + (a == c) + (b == c)) / 3 for a, b, c in grades]
    for null in (0, 0.5):
        for alternative in get_args(Alternative):
            options = {"null": null, "alternative": alternative}
            if len(set(shares)) == 1:  # a standard error of 0
                assert_undefined(lambda: p_value(percent_agreement(grades), **options))  # noqa: B023
                continue
            other = stats.ttest_1samp(shares, null, alternative=alternative)
            found = p_value(percent_agreement(grades), **options)
            assert found == pytest.approx(other.pvalue, rel=1e-9)


@pytest.mark.parametrize("name", ["percent_agreement", "kendall_w", "robinson_a"])
def test_what_is_not_corrected_for_chance_is_not_compared_with_0(name: str) -> None:
    shares = COEFFICIENTS[name]([[1, 2], [2, 2], [3, 1], [4, 5]])
    with pytest.raises(
        ParameterError, match=r"null: needs a value for .* not corrected"
    ):
        p_value(shares)
    if name == "percent_agreement":  # 1/4 of four items: t = (1/4 - 1/2) / (1/4) = -1
        assert p_value(shares, null=0.25) == 1.0
        # P(|T| ≥ 1) with 3 degrees of freedom: 1 - (2/π)(π/6 + (1/2)(√3/2))
        by_hand = 1.0 - 2.0 / math.pi * (math.pi / 6.0 + math.sqrt(3.0) / 4.0)
        assert p_value(shares, null=0.5) == pytest.approx(by_hand, rel=1e-12)


@given(
    value=st.floats(-1, 1),
    error=st.floats(0.01, 0.5),
    low=st.floats(-1, 0.3),
    width=st.floats(0.01, 1),
)
def test_equivalence_is_two_one_sided_tests_and_an_interval(
    value: float, error: float, low: float, width: float
) -> None:
    high = low + width
    shown = estimate(value, error)
    p = equivalence_p_value(shown, low=low, high=high)
    t = stats.t(19)
    parts = t.sf((value - low) / error), t.cdf((value - high) / error)
    assert p == pytest.approx(max(parts), rel=1e-8)
    # below a: the interval of level 1 - 2a lies between the two values
    for a in (0.01, 0.05, 0.2):
        half = t.ppf(1.0 - a) * error
        if abs(p - a) > 1e-9:
            assert (p < a) == (low < value - half and value + half < high)


def test_is_undefined_where_the_estimate_or_its_error_is() -> None:
    assert_undefined(lambda: p_value(estimate(math.nan, math.nan)))
    assert_undefined(lambda: p_value(estimate(0.5, math.nan)))
    with pytest.warns(UndefinedStatisticWarning):
        nothing = fleiss_kappa([["a", "a"]] * 3)
    with pytest.warns(UndefinedStatisticWarning, match="p-value .* 0/0: chance"):
        assert math.isnan(p_value(nothing))
    one_item = fleiss_kappa([["a", "b"]], categories=["a", "b"])
    assert one_item.reason is None
    with pytest.warns(UndefinedStatisticWarning, match="one item with a pair"):
        assert math.isnan(p_value(one_item))


@given(st.lists(st.floats(0, 1), min_size=1, max_size=8))
def test_holm_rejects_what_the_procedure_rejects(p_values: list[float]) -> None:
    # Holm (1979): in ascending order compare with α/n, α/(n - 1), ...; the first that
    # is larger, and all after it, stay.
    for level in (0.01, 0.05, 0.3):
        order = sorted(range(len(p_values)), key=p_values.__getitem__)
        rejected: set[int] = set()
        for rank, place in enumerate(order):
            if (len(order) - rank) * p_values[place] > level:
                break
            rejected.add(place)
        found = {k for k, p in enumerate(holm(p_values)) if p <= level}
        assert found == rejected


SCALES: tuple[BandScale, ...] = get_args(BandScale)


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

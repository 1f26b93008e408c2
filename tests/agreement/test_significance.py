"""P-values of estimates: by hand, against 450 digits, and against a test of a mean."""

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
    equivalence_p_value,
    fleiss_kappa,
    holm,
    p_value,
    percent_agreement,
)
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate
from tests.agreement.undefined import assert_undefined


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
    # P(|T| ≥ t) by the finite sums of Abramowitz and Stegun (1964), 26.7.3 and 26.7.4,
    # with tan θ = t/√df: 1 - sin θ (1 + 1/2 cos²θ + 1·3/(2·4) cos⁴θ + ...) for even df,
    # 1 - 2/π (θ + sin θ (cos θ + 2/3 cos³θ + 2·4/(3·5) cos⁵θ + ...)) for odd. Digits
    # enough that the difference from 1 keeps some.
    with mpmath.workdps(450):
        square = mpmath.mpf(df) / (df + mpmath.mpf(t) ** 2)
        sine, odd = mpmath.sqrt(1 - square), df % 2
        term = mpmath.sqrt(square) if odd else mpmath.mpf(1)
        total = mpmath.mpf(0)
        for k in range(2 + odd, df + 1, 2):
            total += term
            term *= square * (k - 1) / k
        if odd:
            angle = mpmath.atan(mpmath.mpf(t) / mpmath.sqrt(df))
            return float(1 - 2 / mpmath.pi * (angle + sine * total))
        return float(1 - sine * total)


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


@pytest.mark.parametrize("wrong", [math.nan, math.inf, "0.4", True])
def test_a_hypothesis_is_a_number(wrong: float) -> None:
    kappa = estimate(0.5, 0.1)
    with pytest.raises(ParameterError, match="null: needs a finite number, got"):
        p_value(kappa, null=wrong)
    with pytest.raises(ParameterError, match="low: needs a finite number, got"):
        equivalence_p_value(kappa, low=wrong, high=0.5)
    with pytest.raises(ParameterError, match=r"needs low < high, got 0\.5 and 0\.5"):
        equivalence_p_value(kappa, low=0.5, high=0.5)
    with pytest.raises(ParameterError, match="alternative: needs one of two-sided, gr"):
        p_value(kappa, alternative=wrong)  # type: ignore[arg-type]


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


def test_holm_does_not_count_what_is_undefined() -> None:
    # two tests are left: .01 and .04 times 2 and 1
    first, none, last = holm([0.04, math.nan, 0.01])
    assert math.isnan(none)
    assert (first, last) == (0.04, 0.02)


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

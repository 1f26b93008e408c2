"""P-values of estimates: by hand, against 450 digits, and against a test of a mean."""

import dataclasses
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
    Significance,
    cohen_kappa,
    count_table,
    equivalence_p_value,
    fleiss_kappa,
    holm,
    icc,
    kendall_w,
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


def test_of_two_items_it_is_an_angle() -> None:
    # One degree of freedom is Cauchy's law: P(|T| ≥ t) = 1 - (2/π) atan t; t = 1: 1/2.
    assert p_value(estimate(0.5, 0.5, n_items=2)) == pytest.approx(0.5, rel=1e-14)
    expected = 1.0 - 2.0 / math.pi * math.atan(3.0)
    assert p_value(estimate(0.75, 0.25, n_items=2)) == pytest.approx(expected)


def test_of_three_items_it_is_a_root() -> None:
    # Two degrees of freedom: P(|T| ≥ t) = 1 - t/√(t² + 2); t = √2: 1 - 1/√2.
    found = p_value(estimate(math.sqrt(2.0), 1.0, n_items=3))
    assert found == pytest.approx(1.0 - math.sqrt(0.5), rel=1e-14)


def test_of_a_table_of_two_raters_by_hand() -> None:
    # [[20, 5], [10, 15]]: kappa 0.4, ASE² = 0.2016/12.5 over 50, ours over 49;
    # t = 0.4/√(0.2016/12.5 · 50/49) = 3.1180, P(|t(49)| ≥ 3.1180) = 0.003045.
    t = 0.4 / math.sqrt(0.2016 / 12.5 * 50 / 49)
    found = p_value(cohen_kappa(count_table([[20, 5], [10, 15]])))
    assert found == pytest.approx(both_tails(t, 49), rel=1e-10)
    assert found == pytest.approx(0.003045, abs=5e-7)


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


@given(
    value=st.floats(-1, 1),
    error=st.floats(0, 10, exclude_min=True),
    n_items=st.integers(2, 10_000),
)
def test_is_a_probability_whatever_the_sign(
    value: float, error: float, n_items: int
) -> None:
    found = p_value(estimate(value, error, n_items))
    assert 0.0 <= found <= 1.0
    assert p_value(estimate(-value, error, n_items)) == found


@given(st.floats(0, 50), st.floats(0, 50), st.integers(2, 200))
def test_falls_as_the_coefficient_rises(one: float, other: float, n_items: int) -> None:
    low, high = sorted((one, other))
    more = p_value(estimate(high, 1.0, n_items))
    assert more <= p_value(estimate(low, 1.0, n_items)) * (1 + 1e-12)


def test_of_exactly_nothing_is_one() -> None:
    assert p_value(estimate(0.0, 0.3)) == 1.0
    assert p_value(estimate(-0.0, 0.3)) == 1.0


def test_an_error_of_0_is_no_certainty() -> None:
    # Two items, both raters agree: nobody knows κ to be 1.
    perfect = cohen_kappa([["a", "a"], ["b", "b"]])
    assert (perfect.value, perfect.standard_error) == (1.0, 0.0)
    for estimate_ in (perfect, estimate(0.0, 0.0), estimate(-1e-300, 0.0)):
        with pytest.warns(UndefinedStatisticWarning, match="error is 0: no item moves"):
            assert math.isnan(p_value(estimate_))
        with pytest.warns(UndefinedStatisticWarning, match="error is 0: no item moves"):
            assert math.isnan(equivalence_p_value(estimate_, low=-0.5, high=0.5))


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


# Tables of Cohen's kappa against a value: Fleiss, Cohen and Everitt's error over n and
# the normal law, computed independently; ours has n - 1 and Student's t.
AGAINST = [
    ([[20, 5], [10, 15]], "identity", 0.4, 0.4, 0.126996062931, 0.128285396118),
    ([[40, 4], [3, 13]], "identity", 0.5, 0.707520891365, 0.102805194105, 0.1036727639),
    (
        *([[15, 4, 1], [3, 12, 5], [0, 4, 16]], "linear", 0.4),
        *(0.6625, 0.0747717229096, 0.0754027191),
    ),
    (
        *([[15, 4, 1], [3, 12, 5], [0, 4, 16]], "quadratic", 0.4),
        *(0.75, 0.0670561539143, 0.0676220386634),
    ),
]


@pytest.mark.parametrize("case", AGAINST)
def test_kappa_against_a_value(case: tuple[object, ...]) -> None:
    table, weights, null, value, over_n, over_one_less = case
    kappa = cohen_kappa(count_table(table), weights=weights)  # type: ignore[arg-type]
    n = kappa.n_items
    assert kappa.value == pytest.approx(value, abs=1e-12)
    assert kappa.standard_error == pytest.approx(over_one_less, rel=1e-9)
    assert over_one_less == pytest.approx(over_n * math.sqrt(n / (n - 1)), rel=1e-9)  # type: ignore[operator]
    t = (value - null) / over_one_less  # type: ignore[operator]
    two = p_value(kappa, null=null)  # type: ignore[arg-type]
    assert two == pytest.approx(both_tails(abs(t), n - 1), rel=1e-6, abs=1e-12)
    greater = p_value(kappa, null=null, alternative="greater")  # type: ignore[arg-type]
    less = p_value(kappa, null=null, alternative="less")  # type: ignore[arg-type]
    assert greater + less == pytest.approx(1.0, rel=1e-12)
    assert 2.0 * min(greater, less) == pytest.approx(two, rel=1e-12)


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


def test_non_inferiority_by_hand() -> None:
    # κ = .75 with error .25, at least .5 needed; t(2): P(T ≥ 1) = (1 - 1/√3) / 2
    found = p_value(estimate(0.75, 0.25, 3), null=0.5, alternative="greater")
    assert found == pytest.approx((1.0 - 1.0 / math.sqrt(3.0)) / 2.0, rel=1e-12)


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


def test_an_error_too_small_to_divide_by_is_no_fault() -> None:
    assert p_value(estimate(0.5, 5e-324)) == 0.0


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


def test_coefficients_with_tests_of_their_own_have_none_here() -> None:
    table = [[1, 2], [2, 3], [4, 4]]
    assert_undefined(lambda: p_value(kendall_w(table), null=0.5))
    assert_undefined(lambda: p_value(icc(table)))


def test_a_test_is_no_interval_and_cannot_be_changed() -> None:
    fields = {field.name for field in dataclasses.fields(Significance)}
    assert not fields & {"low", "high", "interval", "level", "standard_error"}
    found = Significance(
        name="bowker",
        hypothesis="the table is symmetric",
        statistic=3.25,
        distribution="chi-squared",
        df=(2.0,),
        p_value=0.1969,
        n_items=40,
    )
    assert str(found) == "bowker: 3.25, chi-squared(2), p = 0.197"
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.p_value = 0.04  # type: ignore[misc]


def test_holm_of_five_tests_by_hand() -> None:
    # Ascending .005 .01 .03 .04 .6, times 5 4 3 2 1: .025 .04 .09 .08 .6, of which the
    # fourth is less than the third before it.
    assert holm([0.04, 0.01, 0.6, 0.005, 0.03]) == pytest.approx(
        [0.09, 0.04, 0.6, 0.025, 0.09], rel=1e-15
    )


def test_holm_of_ties_of_nothing_and_of_p_values_beyond_1() -> None:
    assert holm([]) == []
    assert holm([0.2]) == [0.2]
    assert holm([0.5, 0.5, 0.6]) == [1.0, 1.0, 1.0]
    assert holm([0.02, 0.02]) == [0.04, 0.04]


def test_holm_does_not_count_what_is_undefined() -> None:
    # two tests are left: .01 and .04 times 2 and 1
    first, none, last = holm([0.04, math.nan, 0.01])
    assert math.isnan(none)
    assert (first, last) == (0.04, 0.02)


def test_holm_takes_probabilities() -> None:
    with pytest.raises(ParameterError, match=r"place 1: needs \[0, 1\], got 1.5"):
        holm([0.1, 1.5])


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

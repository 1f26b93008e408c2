"""Differences of coefficients by hand, against loops, t-tests, coverage; refusals."""

import math
from fractions import Fraction
from typing import Literal

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import stats

from masrel.agreement import COEFFICIENTS, cohen_kappa, fleiss_kappa
from masrel.errors import (
    ParameterError,
    RatingsError,
    SmallSampleWarning,
    UndefinedStatisticWarning,
)
from masrel.estimates import Estimate
from masrel.intervals import difference, difference_test, jackknife
from tests.intervals.data import dirichlet_multinomial

Design = Literal["dependent", "independent"]

CATEGORIES = range(3)


def two(n: int) -> tuple[list[list[int]], list[list[int]]]:
    rng = np.random.default_rng(6)
    first = dirichlet_multinomial(rng, n, 4, 0.6)
    # The second raters see what the first saw, but one in three at random.
    grades = np.array(first)
    again = np.where(rng.random(grades.shape) < 0.7, grades, rng.integers(0, 3, (n, 4)))
    return first, again.tolist()


def shares(table: list[list[int]]) -> list[float]:
    """Agreement of each item: how many pairs of its raters agree."""
    k = len(table[0])
    return [sum(row.count(g) - 1 for g in row) / (k * (k - 1)) for row in table]


def test_two_independent_kappas_by_hand() -> None:
    # (a a) (b b) (a b): p_o = 2/3, p_e = 4/9: 2/5. Without one: 0, 0 (one rater has one
    # category) and 1 about 1/3: SE² = (2/3)(1/9 + 1/9 + 4/9) = 4/9. The other is 1
    # whichever is left out. So -3/5 ± t · 2/3 with (4/9)²/((4/9)²/2) = 2 degrees, whose
    # quantile of two sides is L √(2/(1 - L²)) at level L: √(2/3) at 1/2.
    first = [["a", "a"], ["b", "b"], ["a", "b"]]
    second = [["a", "a"], ["b", "b"], ["a", "a"], ["b", "b"]]
    with pytest.warns(SmallSampleWarning):
        found = difference(
            "cohen_kappa", first, second, design="independent", level=0.5
        )
    assert found.value == float(Fraction(2, 5)) - 1.0
    assert found.standard_error == pytest.approx(2 / 3, rel=1e-14)
    assert found.interval is not None
    half = math.sqrt(2 / 3) * 2 / 3
    assert found.interval.low == pytest.approx(-0.6 - half, rel=1e-12)
    assert found.interval.high == pytest.approx(-0.6 + half, rel=1e-12)
    assert (found.n_items, found.n_raters) == (3, 2)
    # 2/3 - 1 and 4/9 - 1/2
    assert found.observed == pytest.approx(-1 / 3, rel=1e-15)
    assert found.chance == pytest.approx(-1 / 18, rel=1e-14)


def test_the_test_of_two_independent_kappas_by_hand() -> None:
    # The same: -3/5 over 2/3 is t = -9/10 with 2 degrees, of which P(|T| ≥ t) is
    # 1 - t/√(2 + t²): 1 - 0.9/√2.81.
    first = [["a", "a"], ["b", "b"], ["a", "b"]]
    second = [["a", "a"], ["b", "b"], ["a", "a"], ["b", "b"]]
    found = difference_test("cohen_kappa", first, second, design="independent")
    assert found.statistic == pytest.approx(-0.9, rel=1e-14)
    assert found.df == pytest.approx((2.0,), rel=1e-14)
    assert found.p_value == pytest.approx(1 - 0.9 / math.sqrt(2.81), rel=1e-12)
    assert (found.name, found.distribution, found.n_items) == (
        "difference_test",
        "t",
        3,
    )
    assert found.reason is None


def test_of_percent_agreement_the_test_is_a_paired_or_welchs_t_test() -> None:
    first, second = two(25)
    paired = stats.ttest_rel(shares(first), shares(second))
    found = difference_test("percent_agreement", first, second, design="dependent")
    assert found.p_value == pytest.approx(paired.pvalue, rel=1e-9)
    assert found.df == (24.0,)
    welch = stats.ttest_ind(shares(first), shares(second[:15]), equal_var=False)
    found = difference_test(
        "percent_agreement", first, second[:15], design="independent"
    )
    assert found.p_value == pytest.approx(welch.pvalue, rel=1e-9)
    assert found.df == pytest.approx((welch.df,), rel=1e-9)


@pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")
@given(
    rows=st.lists(st.tuples(*[st.integers(0, 2)] * 4), min_size=4, max_size=12),
    design=st.sampled_from(["dependent", "independent"]),
    name=st.sampled_from(["fleiss_kappa", "gwet_ac", "percent_agreement"]),
)
def test_p_is_one_less_the_level_of_the_interval_that_ends_at_0(
    rows: list[tuple[int, ...]], design: Design, name: str
) -> None:
    first, second = ([row[at : at + 2] for row in rows] for at in (0, 2))
    test = difference_test(name, first, second, design=design, categories=CATEGORIES)
    assume(test.reason is None and 1e-6 < test.p_value < 1 - 1e-6)
    found = difference(
        name,
        first,
        second,
        design=design,
        categories=CATEGORIES,
        level=1 - test.p_value,
    )
    assert found.interval is not None
    nearer = min(found.interval.low, found.interval.high, key=abs)
    assert nearer == pytest.approx(0.0, abs=1e-9)
    for level, holds in ((0.95, test.p_value > 0.05), (0.5, test.p_value > 0.5)):
        interval = difference(
            name, first, second, design=design, categories=CATEGORIES, level=level
        ).interval
        assert interval is not None
        assert (interval.low < 0.0 < interval.high) == holds


def test_a_test_without_spread_is_undefined_as_its_interval_is() -> None:
    first, _ = two(20)
    with pytest.warns(UndefinedStatisticWarning, match="leaves the difference as it"):
        found = difference_test("fleiss_kappa", first, first, design="dependent")
    assert math.isnan(found.p_value)
    assert math.isnan(found.statistic)
    assert found.reason == "leaving out any item leaves the difference as it is"


def test_of_percent_agreement_of_the_same_items_it_is_the_paired_t_test() -> None:
    first, second = two(25)
    other = stats.ttest_rel(shares(first), shares(second))
    found = difference("percent_agreement", first, second, design="dependent")
    assert found.value / found.standard_error == pytest.approx(other.statistic)
    interval = other.confidence_interval(0.95)
    assert found.interval is not None
    assert (found.interval.low, found.interval.high) == pytest.approx(
        (interval.low, interval.high), rel=1e-9
    )


def test_of_percent_agreement_of_other_items_it_is_welchs_t_test() -> None:
    first, second = two(40)
    second = second[:15]
    other = stats.ttest_ind(shares(first), shares(second), equal_var=False)
    found = difference(
        "percent_agreement", first, second, design="independent", level=0.9
    )
    assert found.value / found.standard_error == pytest.approx(other.statistic)
    interval = other.confidence_interval(0.9)
    assert found.interval is not None
    assert (found.interval.low, found.interval.high) == pytest.approx(
        (interval.low, interval.high), rel=1e-9
    )


@pytest.mark.parametrize("design", ["dependent", "independent"])
@pytest.mark.parametrize("weights", ["identity", "quadratic"])
@pytest.mark.parametrize(
    "name",
    [
        "conger_kappa",
        "gwet_ac",
        "brennan_prediger",
        "krippendorff_alpha",
        "light_kappa",
    ],
)
def test_every_coefficient_is_left_out_of_item_by_item(
    name: str, weights: str, design: Design
) -> None:
    first, second = two(14)
    if design == "independent":
        second = second[:11]

    def value(table: list[list[int]]) -> float:
        found = COEFFICIENTS[name](table, categories=CATEGORIES, weights=weights)  # type: ignore[arg-type]
        return found.value

    def without(table: list[list[int]]) -> list[float]:
        return [value(table[:i] + table[i + 1 :]) for i in range(len(table))]

    def jackknifed(left: list[float]) -> float:
        n, mean = len(left), sum(left) / len(left)
        return (n - 1) / n * sum((x - mean) ** 2 for x in left)

    one, other = without(first), without(second)
    if design == "dependent":
        variance = jackknifed([x - y for x, y in zip(one, other, strict=True)])
    else:
        variance = jackknifed(one) + jackknifed(other)
    found = difference(
        name,
        first,
        second,
        design=design,
        categories=CATEGORIES,
        weights=weights,  # type: ignore[arg-type]
    )
    assert found.value == pytest.approx(value(first) - value(second), abs=1e-14)
    assert found.standard_error == pytest.approx(math.sqrt(variance), rel=1e-9)
    assert found.coefficient == f"difference of {name}"
    assert found.weights == weights


def test_items_that_nobody_rated_in_either_are_no_items() -> None:
    first, second = two(12)
    none: list[int | None] = [None] * 4
    found, holed = (
        difference("fleiss_kappa", *both, design="dependent", categories=CATEGORIES)
        for both in ((first, second), ([none, *first], [none, *second]))
    )
    assert holed == found


@pytest.mark.parametrize("design", ["dependent", "independent"])
def test_the_other_way_round_it_is_the_negative(design: Design) -> None:
    first, second = two(20)

    def of(one: list[list[int]], other: list[list[int]]) -> Estimate:
        return difference(
            "fleiss_kappa", one, other, design=design, categories=CATEGORIES
        )

    found, turned = of(first, second), of(second, first)
    assert turned.value == -found.value
    assert turned.standard_error == found.standard_error
    assert found.interval is not None
    assert turned.interval is not None
    assert turned.interval.low == pytest.approx(-found.interval.high, rel=1e-14)


def test_a_difference_lies_within_what_two_coefficients_can_differ_by() -> None:
    # One pair of four agrees, and three of four: of so few items t · SE goes beyond -2
    # of kappa, and beyond -1 of a share.
    first = [["a", "b"], ["b", "a"], ["a", "b"], ["b", "b"]]
    second = [["a", "a"], ["b", "b"], ["a", "a"], ["b", "a"]]
    with pytest.warns(SmallSampleWarning):
        found = difference("fleiss_kappa", first, second, design="independent")
    assert found.interval is not None
    assert found.interval.low == -2.0
    with pytest.warns(SmallSampleWarning):
        share = difference("percent_agreement", first, second, design="independent")
    assert share.interval is not None
    assert share.interval.low == -1.0


def test_same_items_are_left_out_of_both_at_once() -> None:
    first, second = two(12)
    whole = fleiss_kappa(first).value - fleiss_kappa(second).value
    left = [
        fleiss_kappa(first[:i] + first[i + 1 :]).value
        - fleiss_kappa(second[:i] + second[i + 1 :]).value
        for i in range(12)
    ]
    mean = sum(left) / 12
    error = math.sqrt(11 / 12 * sum((x - mean) ** 2 for x in left))
    found = difference(
        "fleiss_kappa", first, second, design="dependent", categories=CATEGORIES
    )
    assert found.value == pytest.approx(whole, abs=1e-15)
    assert found.standard_error == pytest.approx(error, rel=1e-9)
    assert found.interval is not None
    # t(11; .975) of any table of Student's t
    assert found.interval.high == pytest.approx(whole + 2.200985160082949 * error)
    assert found.interval.target == "items"


def test_independent_variances_add() -> None:
    first, second = two(40)
    second = second[:25]
    parts = []
    for table in (first, second):
        alone = jackknife("fleiss_kappa", table, target="items", categories=CATEGORIES)
        t = {40: 2.0226909, 25: 2.0638986}[len(table)]
        parts.append(((alone.high - alone.low) / 2 / t) ** 2)
    found = difference(
        "fleiss_kappa", first, second, design="independent", categories=CATEGORIES
    )
    assert found.standard_error == pytest.approx(math.sqrt(sum(parts)), rel=1e-6)
    # Satterthwaite: some 50 degrees, t between those of 40 and 80.
    assert found.interval is not None
    ratio = (found.interval.high - found.value) / found.standard_error
    assert 1.990 < ratio < 2.022


def test_the_same_ratings_do_not_differ_and_it_says_so() -> None:
    first, _ = two(20)
    with pytest.warns(UndefinedStatisticWarning, match="leaves the difference as it"):
        found = difference(
            "fleiss_kappa", first, first, design="dependent", categories=CATEGORIES
        )
    assert (found.value, found.standard_error) == (0.0, 0.0)
    assert found.interval is not None
    assert "leaves the difference as it is" in (found.interval.reason or "")


def test_what_only_rounding_sets_apart_does_not_differ() -> None:
    # Conger's κ of the same ratings in another order of the raters
    first, _ = two(20)
    second = [row[::-1] for row in first]
    with pytest.warns(UndefinedStatisticWarning, match="leaves the difference as it"):
        found = difference(
            "conger_kappa", first, second, design="dependent", categories=CATEGORIES
        )
    assert found.standard_error == 0.0


def test_what_both_have_in_common_cancels() -> None:
    first, second = two(40)
    errors = [
        difference(
            cohen_kappa,
            [row[:2] for row in first],
            [row[:2] for row in second],
            design=design,  # type: ignore[arg-type]
            categories=CATEGORIES,
        ).standard_error
        for design in ("dependent", "independent")
    ]
    assert errors[0] < errors[1]


def test_coverage_of_no_difference_is_what_it_says() -> None:
    # 400 pairs of studies of 40 items × 3 raters of the same kappa; with independent
    # items a 95 % interval holds 0 some 380 times, sd 4.4: below 360 once in 10^5.
    rng = np.random.default_rng(9)
    covered = 0
    for _ in range(400):
        tables = [dirichlet_multinomial(rng, 40, 3, 0.5) for _ in range(2)]
        found = difference(
            "fleiss_kappa", *tables, design="independent", categories=CATEGORIES
        ).interval
        assert found is not None
        covered += found.low <= 0.0 <= found.high
    assert 360 <= covered <= 398


@pytest.mark.parametrize(
    ("second", "said"),
    [
        ([["a", "a"]] * 3, "same items, got 4 and 3"),
        ([["a", "b"], [None, None], ["a", "a"], ["b", "b"]], "row 1 has ratings in"),
    ],
)
def test_dependent_ratings_are_of_the_same_items(
    second: list[list[str | None]], said: str
) -> None:
    first = [["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"]]
    with pytest.raises(RatingsError, match=said):
        difference("fleiss_kappa", first, second, design="dependent")


def test_design_has_no_default_and_is_checked() -> None:
    first, second = two(12)
    with pytest.raises(TypeError, match="design"):
        difference("fleiss_kappa", first, second)  # type: ignore[call-arg]
    with pytest.raises(ParameterError, match="design: needs one of dependent"):
        difference("fleiss_kappa", first, second, design="paired")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="design: needs one of dependent"):
        difference_test("fleiss_kappa", first, second, design="paired")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="no function of sums"):
        difference("kendall_w", first, second, design="dependent")


def test_level_coefficient_and_ratings_are_checked() -> None:
    first, second = two(12)
    with pytest.raises(ParameterError, match=r"level: needs \(0, 1\), got 95"):
        difference("fleiss_kappa", first, second, design="dependent", level=95)
    with pytest.raises(ParameterError, match=r"coefficient: needs one of .*'kappa'"):
        difference("kappa", first, second, design="dependent")
    with pytest.raises(ParameterError, match="needs 2 raters, got 4"):
        difference("cohen_kappa", first, second, design="dependent")
    with pytest.raises(RatingsError, match="needs one of 0, 1, 2"):
        difference(
            *("fleiss_kappa", first, [[3] * 4] * 12),
            design="independent",
            categories=CATEGORIES,
        )


@pytest.mark.filterwarnings("ignore::masrel.errors.UndefinedStatisticWarning")
def test_with_one_item_left_out_undefined_has_a_value_and_no_interval() -> None:
    # Without its last item the first has one category only: 0/0.
    found = difference(
        "fleiss_kappa",
        [["a", "a"]] * 11 + [["a", "b"]],
        [["a", "a"], ["b", "b"]] * 6,
        design="dependent",
        categories=["a", "b"],
    )
    # 11/12 of pairs, shares 23/24 and 1/24: kappa -1/23; the other is 1
    assert found.value == pytest.approx(-1 / 23 - 1, rel=1e-14)
    assert math.isnan(found.standard_error)
    assert found.interval is not None
    assert "one item left out" in (found.interval.reason or "")


def test_undefined_and_small_are_said() -> None:
    with pytest.warns(UndefinedStatisticWarning):
        found = difference(
            "fleiss_kappa",
            [["a", "a"]] * 4,
            [["a", "b"], ["a", "a"], ["b", "b"], ["a", "a"]],
            design="dependent",
            categories=["a", "b"],
        )
    assert math.isnan(found.value)
    assert "0/0" in (found.reason or "")
    first, second = two(9)
    with pytest.warns(SmallSampleWarning, match="9 items"):
        difference(
            "fleiss_kappa", first, second, design="dependent", categories=CATEGORIES
        )


def test_the_smaller_of_two_samples_is_warned_of() -> None:
    large, small = two(40)[0], two(4)[0]
    for pair in ((large, small), (small, large)):
        with pytest.warns(SmallSampleWarning, match="4 items"):
            found = difference(
                "fleiss_kappa", *pair, design="independent", categories=CATEGORIES
            )
        assert found.interval is not None
        assert any("4 items" in note for note in found.interval.notes)


def test_a_difference_that_loses_a_category_without_an_item_says_so() -> None:
    once = [["a", "a"]] * 11 + [["a", "b"]]
    with pytest.warns(UndefinedStatisticWarning, match="one item left out"):
        found = difference(
            "fleiss_kappa",
            once,
            [["a", "a"], ["b", "b"]] * 6,
            design="dependent",
            categories=["a", "b"],
        )
    assert found.interval is not None
    assert found.interval.reason == "with one item left out an estimate is undefined"


def test_an_interval_cut_at_the_ends_says_so() -> None:
    apart = [["a", "b"], ["b", "a"], ["a", "a"]] * 2
    alike = [["a", "a"], ["b", "b"], ["a", "b"]] * 2
    with pytest.warns(SmallSampleWarning):
        found = difference(
            "fleiss_kappa",
            alike,
            apart,
            design="independent",
            categories=["a", "b"],
            level=0.999,
        )
    assert found.interval is not None
    assert found.interval.high == 2.0
    assert any("cut at the ends" in note for note in found.interval.notes)

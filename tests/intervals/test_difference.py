"""Differences of coefficients against loops, coverage, and what is refused."""

import math

import numpy as np
import pytest

from masrel.agreement import cohen_kappa, fleiss_kappa
from masrel.errors import (
    ParameterError,
    RatingsError,
    SmallSampleWarning,
    UndefinedStatisticWarning,
)
from masrel.intervals import difference, jackknife
from tests.intervals.data import dirichlet_multinomial

CATEGORIES = range(3)


def two(n: int) -> tuple[list[list[int]], list[list[int]]]:
    rng = np.random.default_rng(6)
    first = dirichlet_multinomial(rng, n, 4, 0.6)
    # The second raters see what the first saw, but one in three at random.
    grades = np.array(first)
    again = np.where(rng.random(grades.shape) < 0.7, grades, rng.integers(0, 3, (n, 4)))
    return first, again.tolist()


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
    found = difference(
        "fleiss_kappa", first, first, design="dependent", categories=CATEGORIES
    )
    assert (found.value, found.standard_error) == (0.0, 0.0)
    assert found.interval is not None
    assert "leaves the difference as it is" in (found.interval.reason or "")


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
    with pytest.raises(ParameterError, match="no function of sums"):
        difference("kendall_w", first, second, design="dependent")


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

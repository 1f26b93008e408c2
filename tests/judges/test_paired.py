"""Tests of paired counts: a published table, by hand, plain sums, levels."""

import json
import math
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, ttest_1samp

from masrel.agreement._engine import Integers
from masrel.errors import UndefinedStatisticWarning
from masrel.judges import score_test
from masrel.judges._paired import (
    PairedTest,
    lower_region,
    maximum,
    p_less,
    region_share,
)

ORACLE = json.loads((Path(__file__).parent / "annotators.json").read_text("utf-8"))


@st.composite
def counts(draw: st.DrawFn) -> tuple[int, int, int]:
    n = draw(st.integers(1, 400))
    b = draw(st.integers(0, n))
    return b, draw(st.integers(0, n - b)), n


@pytest.mark.parametrize("row", ORACLE["tango"])
def test_tangos_test_and_interval_are_those_of_another_implementation(
    row: dict[str, float],
) -> None:
    result = score_test(int(row["b"]), int(row["c"]), int(row["n"]), delta=row["delta"])
    assert result.statistic == pytest.approx(row["z"], rel=1e-9)
    assert result.p_less == pytest.approx(row["p_less"], rel=1e-9)
    assert result.p_greater == pytest.approx(row["p_greater"], rel=1e-9)
    assert result.p_value == pytest.approx(row["p_two_sided"], rel=1e-9)
    assert (result.low, result.high) == pytest.approx((row["low95"], row["high95"]))


def test_by_hand_without_changes_only_the_bound_itself_varies() -> None:
    # b = c = 0: q = 0, z = -n δ/√(n δ(1 - δ)) = -√(n δ/(1 - δ)) = -2 for n 36, δ .1,
    # and z² = 1.959964² at δ = z²/(n + z²)
    result = score_test(0, 0, 36, delta=0.1)
    assert result.statistic == pytest.approx(-2.0)
    assert result.high == pytest.approx(1.959964**2 / (36 + 1.959964**2), rel=1e-6)


def test_nothing_that_changes_says_nothing_of_no_difference() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        result = score_test(0, 0, 30)
    assert math.isnan(result.statistic)
    assert math.isnan(result.p_value)
    assert result.reason is not None
    assert result.low == pytest.approx(-result.high)


@given(counts(), st.sampled_from([-0.4, -0.1, 0.05, 0.2, 0.9]))
def test_the_other_way_round_all_is_negative(
    of: tuple[int, int, int], delta: float
) -> None:
    b, c, n = of
    result, mirrored = (
        score_test(b, c, n, delta=delta),
        score_test(c, b, n, delta=-delta),
    )
    assert mirrored.statistic == pytest.approx(-result.statistic, abs=1e-12)
    assert mirrored.low == pytest.approx(-result.high, abs=1e-12)
    assert mirrored.p_less == pytest.approx(result.p_greater)


@given(counts(), st.sampled_from([0.5, 0.9, 0.99]))
def test_an_interval_has_the_differences_that_the_test_does_not_reject(
    of: tuple[int, int, int], level: float
) -> None:
    b, c, n = of
    ends = score_test(b, c, n, level=level, delta=0.1234)
    assert -1.0 <= ends.low <= ends.value <= ends.high <= 1.0
    for end in (ends.low, ends.high):
        if abs(end) < 1.0 - 1e-9:
            at = score_test(b, c, n, delta=end)
            assert at.p_value == pytest.approx(1.0 - level, rel=1e-6)


@given(counts())
def test_students_t_is_that_of_the_differences_themselves(
    of: tuple[int, int, int],
) -> None:
    b, c, n = of
    if b + c and n not in {1, b, c}:
        values = [1] * b + [-1] * c + [0] * (n - b - c)
        other = ttest_1samp(values, 0.1, alternative="less").pvalue
        assert p_less(b, c, n, 0.1, "t") == pytest.approx(other, rel=1e-9, abs=1e-15)


def test_students_t_of_no_spread() -> None:
    assert p_less(0, 0, 40, 0.1, "t") == 0.0
    assert p_less(40, 0, 40, 0.1, "t") == 1.0
    assert math.isnan(p_less(0, 0, 40, 0.0, "t"))


# -- the exact test --------------------------------------------------------------------


def test_by_hand_one_item() -> None:
    # H0 p_b - p_c = ε. Of c = 1 alone p_c is largest at (1 - ε)/2; of c = 1 or a tie,
    # 1 - p_b is at p_c = 0.
    assert p_less(0, 1, 1, 0.2, "exact") == pytest.approx(0.4)
    assert p_less(0, 0, 1, 0.2, "exact") == pytest.approx(0.8)
    assert p_less(1, 0, 1, 0.2, "exact") == 1.0


def test_of_no_difference_and_no_tie_it_is_the_sign_test() -> None:
    # p is at least the share where ties are impossible, and no outcome beats it here
    assert p_less(0, 9, 9, 0.0, "exact") == pytest.approx(binom.cdf(0, 9, 0.5))


def trinomial(b: int, c: int, n: int, p_b: float, p_c: float) -> float:
    ways = math.comb(n, b) * math.comb(n - b, c)
    return ways * p_b**b * p_c**c * max(1.0 - p_b - p_c, 0.0) ** (n - b - c)


@pytest.mark.parametrize(("b", "c", "delta"), [(0, 0, 0.1), (2, 3, 0.2), (1, 6, 0.0)])
def test_the_exact_p_value_is_a_plain_sum_where_that_is_largest(
    b: int, c: int, delta: float
) -> None:
    n = 12

    def z(b: int, c: int) -> float:
        d = delta or 1e-9  # the limit, where 0/0 is 0
        return score_test(b, c, n, delta=d).statistic

    extreme = [
        (i, j)
        for i, j in product(range(n + 1), repeat=2)
        if i + j <= n and z(i, j) <= z(b, c) + 1e-6
    ]
    top = (1.0 - delta) / 2.0
    sums = [
        sum(trinomial(i, j, n, q + delta, q) for i, j in extreme)
        for q in np.linspace(0.0, top, 401)
    ]
    assert p_less(b, c, n, delta, "exact") == pytest.approx(max(sums), rel=1e-4)


@given(counts(), st.sampled_from([0.0, 0.02, 0.1, 0.2, 0.6]))
def test_no_peak_of_the_nuisance_is_missed(
    of: tuple[int, int, int], delta: float
) -> None:
    b, c, n = of
    z = 0.0 if delta == b + c == 0 else score_test(b, c, n, delta=delta).statistic
    q = (1.0 - delta) / 2.0 * np.sin(np.linspace(0.0, math.pi / 2.0, 500)) ** 2
    shares = region_share(lower_region(z, n, delta), delta, q)
    exact = p_less(b, c, n, delta, "exact")
    assert exact >= shares.max() * (1.0 - 1e-6) - 1e-14


@pytest.mark.parametrize("n", [20, 75])
def test_the_statistic_grows_with_b_and_falls_with_c(n: int) -> None:
    # what makes the boundary the worst of all that the hypothesis allows
    from masrel.judges._paired import tango

    c, b = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    for delta in (0.01, 0.1, 0.2, 0.5, 0.9):
        z = np.where(b + c <= n, tango(b, c, n, delta), np.nan)
        assert np.nanmin(np.diff(z[: n // 2], axis=1)) > 0.0
        assert np.nanmax(np.diff(z[:, : n // 2], axis=0)) < 0.0


def rejected(n: int, delta: float, bound: float, test: PairedTest) -> Integers:
    """For each c the largest b that is rejected, -1 for none."""
    return np.array(
        [
            max(
                (b for b in range(n - c + 1) if p_less(b, c, n, delta, test) <= bound),
                default=-1,
            )
            for c in range(n + 1)
        ]
    )


def worst_level(n: int, delta: float, bound: float, test: PairedTest) -> float:
    """How often p ≤ bound at the boundary, where that is most often."""
    largest = rejected(n, delta, bound, test)
    return maximum(lambda q: region_share(largest, delta, q), n, delta)


def test_the_exact_test_keeps_its_level_and_tangos_does_not() -> None:
    assert worst_level(20, 0.2, 0.05, "exact") <= 0.05
    assert worst_level(20, 0.2, 0.05 / 5.5, "exact") <= 0.05 / 5.5
    assert worst_level(20, 0.2, 0.05, "score") == pytest.approx(0.069, abs=5e-4)


def test_students_t_rejects_too_often_where_few_items_change() -> None:
    # P(d = 1) = .12 and P(d = -1) = .02, where a simulation of 200 000 studies has .115
    largest = rejected(30, 0.1, 0.05, "t")
    share = region_share(largest, 0.1, np.array([0.02]))
    assert share.item() == pytest.approx(0.115, abs=0.0015)

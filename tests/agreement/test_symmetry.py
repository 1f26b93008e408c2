"""Tests of symmetry: by hand on sparse tables, against statsmodels on random ones."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats
from statsmodels.stats import contingency_tables as peer

from masrel.agreement import (
    McnemarKind,
    bhapkar,
    bowker,
    contingency_table,
    mcnemar,
    stuart_maxwell,
)
from masrel.errors import (
    CountsError,
    ParameterError,
    RatingsError,
    UndefinedStatisticWarning,
)

TESTS = [bowker, stuart_maxwell, bhapkar]

# Stuart (1955), after Kendall: unaided vision of 7477 women, right eye by left eye.
VISION = [
    [1520, 266, 124, 66],
    [234, 1512, 432, 78],
    [117, 362, 1772, 205],
    [36, 82, 179, 492],
]


def test_published_vision_table() -> None:
    # Stuart (1955): 11.96 with 3 degrees of freedom; Bhapkar (1966): 11.98
    stuart = stuart_maxwell(VISION)
    assert stuart.statistic == pytest.approx(11.96, abs=0.005)
    assert bhapkar(VISION).statistic == pytest.approx(11.98, abs=0.005)
    assert stuart.df == bhapkar(VISION).df == (3.0,)
    # Bowker: Σ (b - c)²/(b + c) = 32²/500 + 7²/241 + 30²/102 + 70²/794 + 4²/160
    # + 26²/384 = 19.107 with 6
    assert bowker(VISION).statistic == pytest.approx(19.107, abs=0.0005)
    assert bowker(VISION).df == (6.0,)
    assert stuart.n_items == 7477


def full_tables(sides: tuple[int, int] = (2, 6)) -> st.SearchStrategy[NDArray]:  # type: ignore[type-arg]
    """Tables in which every two categories are connected by changes."""
    return st.integers(*sides).flatmap(
        lambda q: st.lists(
            st.lists(st.integers(1, 30), min_size=q, max_size=q), min_size=q, max_size=q
        ).map(np.array)
    )


@given(full_tables())
def test_bowker_against_statsmodels(table: NDArray[np.int64]) -> None:
    other = peer.SquareTable(table, shift_zeros=False).symmetry()
    found = bowker(table)
    assert found.statistic == pytest.approx(other.statistic, rel=1e-12, abs=1e-12)
    assert found.p_value == pytest.approx(other.pvalue, rel=1e-9)
    assert found.df == (other.df,)


@given(full_tables())
def test_equal_margins_against_statsmodels(table: NDArray[np.int64]) -> None:
    square = peer.SquareTable(table, shift_zeros=False)
    for test, method in ((stuart_maxwell, "stuart_maxwell"), (bhapkar, "bhapkar")):
        other = square.homogeneity(method=method)
        found = test(table)
        assert found.statistic == pytest.approx(other.statistic, rel=1e-8, abs=1e-9)
        assert found.p_value == pytest.approx(other.pvalue, rel=1e-7)
        assert found.df == (other.df,)


@given(
    st.tuples(*[st.integers(0, 40)] * 4).filter(lambda cells: cells[1] + cells[2] > 0)
)
def test_mcnemar_against_statsmodels(cells: tuple[int, ...]) -> None:
    table = [list(cells[:2]), list(cells[2:])]
    exact = peer.mcnemar(table, exact=True)
    found = mcnemar(table)
    assert found.p_value == pytest.approx(exact.pvalue, rel=1e-12)
    assert found.statistic == exact.statistic
    kinds: tuple[tuple[McnemarKind, bool], ...] = (
        ("uncorrected", False),
        ("corrected", True),
    )
    for kind, correction in kinds:
        if correction and cells[1] == cells[2]:
            continue  # (|b - c| - 1)² would be 1 where nothing speaks for a change
        other = peer.mcnemar(table, exact=False, correction=correction)
        ours = mcnemar(table, kind=kind)
        assert ours.statistic == pytest.approx(other.statistic, rel=1e-13)
        assert ours.p_value == pytest.approx(other.pvalue, rel=1e-12)


def test_equal_margins_of_a_sparse_table_by_hand() -> None:
    # d = (4, -6, 2) from margins (15, 13, 12) and (11, 19, 10); changes 1-2: 6,
    # 2-3: 6. V = [[6, -6, 0], [-6, 12, -6], [0, -6, 6]]; without the first category
    # d = (-6, 2), V⁻¹ of [[12, -6], [-6, 6]] = [[6, 6], [6, 12]]/36:
    # (6 · 36 - 2 · 6 · 12 + 12 · 4)/36 = (216 - 144 + 48)/36 = 10/3
    found = stuart_maxwell([[10, 5, 0], [1, 10, 2], [0, 4, 8]])
    assert found.statistic == pytest.approx(10 / 3, rel=1e-14)
    assert found.df == (2.0,)
    # X/(1 - X/n) with n = 40: (10/3)/(1 - 1/12) = 40/11
    found = bhapkar([[10, 5, 0], [1, 10, 2], [0, 4, 8]])
    assert found.statistic == pytest.approx(40 / 11, rel=1e-14)


def test_a_category_of_equal_margins_stays_in() -> None:
    # d = (2, 0, -2): the margins of category 2 are equal, but it carries changes.
    # Pairs 1-2: 3, 1-3: 1, 2-3: 3. Without category 3: d = (2, 0),
    # V = [[4, -3], [-3, 6]], its inverse's corner 6/15: X = 4 · 6/15 with 2 degrees.
    # Dropping category 2 as well would give 4/4 with 1.
    table = [[5, 2, 1], [1, 5, 2], [0, 1, 5]]
    found = stuart_maxwell(table)
    assert np.sum(table, axis=0)[1] == np.sum(table, axis=1)[1]
    assert found.statistic == pytest.approx(8 / 5, rel=1e-13)
    assert found.df == (2.0,)


def test_groups_that_no_change_connects_are_tested_each() -> None:
    # two tables in one, and a category that nobody changed to or from
    table = np.zeros((5, 5), dtype=np.int64)
    table[:2, :2] = [[3, 5], [1, 4]]
    table[2:4, 2:4] = [[2, 1], [7, 6]]
    table[4, 4] = 9
    # (5 - 1)²/6 + (1 - 7)²/8
    found = stuart_maxwell(table)
    assert found.statistic == pytest.approx(16 / 6 + 36 / 8, rel=1e-14)
    assert found.df == (2.0,)
    assert bowker(table).statistic == pytest.approx(16 / 6 + 36 / 8, rel=1e-14)


def test_all_items_changing_one_way_are_infinitely_unlike_under_wald() -> None:
    # X = 6²/6 = n
    statistic = stuart_maxwell([[0, 6], [0, 0]]).statistic
    assert statistic == pytest.approx(6.0, rel=1e-14)
    found = bhapkar([[0, 6], [0, 0]])
    assert found.statistic == math.inf
    assert found.p_value == 0.0


@pytest.mark.parametrize("test", TESTS)
@pytest.mark.parametrize("table", [[[3, 0], [0, 4]], [[5]], [[0, 0], [0, 0]]])
def test_without_a_change_there_is_nothing_to_test(test, table) -> None:  # type: ignore[no-untyped-def]
    with pytest.warns(UndefinedStatisticWarning, match="0/0: no item changed"):
        found = test(table)
    assert math.isnan(found.p_value)
    assert found.df == (0.0,)
    assert str(found) == f"{test.__name__}: undefined (0/0: no item changed)"


def test_mcnemar_without_a_change() -> None:
    # exact: both tails of an empty sample are certain
    assert mcnemar([[3, 0], [0, 4]]).p_value == 1.0
    for kind in ("uncorrected", "corrected"):
        with pytest.warns(UndefinedStatisticWarning, match="0/0: no item changed"):
            found = mcnemar([[3, 0], [0, 4]], kind=kind)  # type: ignore[arg-type]
        assert math.isnan(found.p_value)


def test_exact_mcnemar_of_many_changes_goes_on_where_integers_end() -> None:
    for b, c in ((480, 520), (480, 521), (700, 900), (1, 1200)):
        found = mcnemar([[0, b], [c, 0]]).p_value
        other = min(1.0, 2 * stats.binom.cdf(min(b, c), b + c, 0.5))
        assert found == pytest.approx(other, rel=1e-9)


def test_corrected_mcnemar_of_equal_changes_is_zero() -> None:
    found = mcnemar([[0, 4], [4, 0]], kind="corrected")
    assert (found.statistic, found.p_value) == (0.0, 1.0)
    # |5 - 4| - 1 = 0 as well
    assert mcnemar([[0, 5], [4, 0]], kind="corrected").statistic == 0.0


def test_mcnemar_takes_two_categories_and_three_kinds() -> None:
    with pytest.raises(CountsError, match="table"):
        mcnemar(np.eye(3, dtype=int))
    with pytest.raises(ParameterError, match="kind: needs one of exact, uncorrected"):
        mcnemar([[1, 2], [3, 4]], kind="yates")  # type: ignore[arg-type]


@pytest.mark.parametrize("test", [*TESTS, mcnemar])
@pytest.mark.parametrize("table", [[[1, 2, 3], [4, 5, 6]], [[1, -1], [0, 2]], [1, 2]])
def test_what_is_no_square_table_of_counts_is_refused(test, table) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(CountsError):
        test(table)


def test_a_contingency_table_keeps_the_declared_order_and_drops_missing_pairs() -> None:
    ratings = [["1+", "2"], ["1", "1"], ["2", None], [None, "1"], ["1+", "2"]]
    table = contingency_table(ratings, categories=["1", "1+", "2", "3"])
    assert table.tolist() == [[1, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 0], [0, 0, 0, 0]]
    with pytest.raises(RatingsError, match="two raters, got 3"):
        contingency_table([["a", "a", "b"]])

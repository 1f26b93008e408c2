"""Tests and indices of two raters, kappa of one category: by hand, against others."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from masrel.agreement import (
    bhapkar,
    bias_index,
    bowker,
    brennan_prediger,
    category_kappa,
    cohen_kappa,
    contingency_table,
    count_table,
    fleiss_kappa,
    fleiss_null,
    kappa_max,
    mcnemar,
    prevalence_index,
    stuart_maxwell,
)
from masrel.errors import (
    CountsError,
    ParameterError,
    RatingsError,
)
from tests.agreement.test_undefined import assert_undefined
from tests.strategies import Table

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


def test_exact_mcnemar_of_many_changes_goes_on_where_integers_end() -> None:
    for b, c in ((480, 520), (480, 521), (700, 900), (1, 1200)):
        found = mcnemar([[0, b], [c, 0]]).p_value
        other = min(1.0, 2 * stats.binom.cdf(min(b, c), b + c, 0.5))
        assert found == pytest.approx(other, rel=1e-9)


def test_mcnemar_takes_two_categories_and_three_kinds() -> None:
    with pytest.raises(CountsError, match="table"):
        mcnemar(np.eye(3, dtype=int))
    with pytest.raises(ParameterError, match="kind: needs one of exact, uncorrected"):
        mcnemar([[1, 2], [3, 4]], kind="yates")  # type: ignore[arg-type]


def test_a_contingency_table_keeps_the_declared_order_and_drops_missing_pairs() -> None:
    ratings = [["1+", "2"], ["1", "1"], ["2", None], [None, "1"], ["1+", "2"]]
    table = contingency_table(ratings, categories=["1", "1+", "2", "3"])
    assert table.tolist() == [[1, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 0], [0, 0, 0, 0]]
    with pytest.raises(RatingsError, match="two raters, got 3"):
        contingency_table([["a", "a", "b"]])


Cells = list[list[int]]

pairs_of_two = st.tuples(*[st.integers(0, 30)] * 4).filter(any)


def squares(sides: tuple[int, int] = (2, 5)) -> st.SearchStrategy[Cells]:
    return st.integers(*sides).flatmap(
        lambda q: st.lists(
            st.lists(st.integers(0, 12), min_size=q, max_size=q), min_size=q, max_size=q
        )
    )


def margins(cells: Cells) -> tuple[list[int], list[int]]:
    return [sum(r) for r in cells], [sum(c) for c in zip(*cells, strict=True)]


def has_kappa(cells: Cells) -> bool:
    # 0/0 if there is nothing, or both raters used one category and the same
    n = sum(map(sum, cells))
    return all(cells[k][k] < n for k in range(len(cells)))


def test_cohens_own_example_of_the_largest_kappa() -> None:
    # Cohen (1960), Table 2: p_o = 140/200, margins .60 .30 .10 and .50 .30 .20, so that
    # p_c = .41 and kappa .492. At most .50 + .30 + .10 = .90 can agree: kappa_M = .831.
    cells = [[88, 14, 18], [10, 40, 10], [2, 6, 12]]
    assert cohen_kappa(count_table(cells)).value == pytest.approx(0.492, abs=5e-4)
    assert kappa_max(cells) == pytest.approx(0.831, abs=5e-4)
    assert kappa_max(cells) == pytest.approx(0.49 / 0.59, rel=1e-15)


@given(pairs_of_two)
def test_kappa_is_made_of_agreement_prevalence_and_bias(
    cells: tuple[int, ...],
) -> None:
    # Byrt, Bishop and Carlin (1993): (PABAK - PI² + BI²)/(1 - PI² + BI²), with PABAK
    # = 2 p_o - 1
    a, b, c, d = cells
    table, n = [[a, b], [c, d]], sum(cells)
    if not has_kappa(table):
        assert_undefined(lambda: cohen_kappa(count_table(table)))
        return
    pabak = Fraction(2 * (a + d), n) - 1
    found = brennan_prediger(count_table(table)).value
    assert found == pytest.approx(float(pabak), abs=1e-14)
    prevalence, bias = prevalence_index(table), bias_index(table)
    less = bias**2 - prevalence**2
    kappa = cohen_kappa(count_table(table)).value
    assert kappa == pytest.approx((float(pabak) + less) / (1 + less), abs=1e-12)


@given(squares())
def test_no_kappa_is_above_the_largest(cells: Cells) -> None:
    if not has_kappa(cells):
        assert_undefined(lambda: kappa_max(cells))
        return
    most = kappa_max(cells)
    assert cohen_kappa(count_table(cells)).value <= most + 1e-14 <= 1.0 + 1e-14
    rows, columns = margins(cells)
    assert (most == 1.0) == (rows == columns)


DIAGNOSES = ["depression", "personality", "schizophrenia", "neurosis", "other"]

# Fleiss (1971), Table 1: psychiatrists, of six, who chose each for thirty patients.
PATIENTS = """
00060 03003 01401 00006 03030 20400 00402 20310 20040 00006
10050 11040 03300 10050 02031 00501 30012 51000 02040 10203
00006 01050 02013 20040 10041 05010 40002 02040 10500 00006
""".split()

RATINGS = [
    [name for name, n in zip(DIAGNOSES, patient, strict=True) for _ in range(int(n))]
    for patient in PATIENTS
]


def test_published_kappa_of_each_diagnosis() -> None:
    # Table 2 there, with the shares .144, .144, .167, .306, .239; and .430 of all
    published = [0.245, 0.245, 0.520, 0.471, 0.566]
    for diagnosis, kappa in zip(DIAGNOSES, published, strict=True):
        found = category_kappa(RATINGS, diagnosis, categories=DIAGNOSES)
        assert found.value == pytest.approx(kappa, abs=5e-4)
        assert (found.coefficient, found.weights) == ("category_kappa", diagnosis)
        assert (found.n_items, found.n_raters, found.n_categories) == (30, 6, 2)
    assert fleiss_kappa(RATINGS).value == pytest.approx(0.430, abs=5e-4)


def test_items_with_a_missing_rating_are_not_tested() -> None:
    whole: Table = [["a", "a", "b"], ["b", "b", "b"], ["c", "c", "c"]]
    holed: Table = [*whole, ["a", "a", None], [None, None, None]]
    assert fleiss_null(holed) == fleiss_null(whole)
    assert fleiss_null(holed, category="a") == fleiss_null(whole, category="a")

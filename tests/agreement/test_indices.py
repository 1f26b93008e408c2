"""Prevalence, bias and the largest kappa: by hand, published, and every other table."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.agreement import (
    bias_index,
    brennan_prediger,
    cohen_kappa,
    count_table,
    kappa_max,
    prevalence_index,
    specific_agreement,
)
from masrel.errors import CountsError, UndefinedStatisticWarning
from tests.agreement.undefined import assert_undefined

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


@pytest.mark.parametrize("function", [prevalence_index, bias_index, kappa_max])
def test_without_an_item_there_is_nothing(function) -> None:  # type: ignore[no-untyped-def]
    with pytest.warns(UndefinedStatisticWarning, match="no item has ratings of two"):
        assert math.isnan(function([[0, 0], [0, 0]]))


@pytest.mark.parametrize("function", [prevalence_index, bias_index, kappa_max])
@pytest.mark.parametrize(
    ("table", "said"),
    [
        ([[1, 2, 3], [4, 5, 6]], "as many rows as columns"),
        ([[1, -1], [0, 2]], "row 0, column 1"),
        ([[0.5, 1], [0, 2]], "0.5"),
    ],
)
def test_what_is_no_table_of_counts_is_refused(function, table, said) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(CountsError, match=said):
        function(table)


def test_specific_agreement_of_a_published_table() -> None:
    # Cicchetti and Feinstein (1990), [[40, 9], [6, 45]]: 80/95 and 90/105
    assert specific_agreement([[40, 9], [6, 45]]) == (80 / 95, 90 / 105)

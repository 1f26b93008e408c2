"""Prevalence, bias and the largest kappa: by hand, published, and every other table."""

import itertools
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
    percent_agreement,
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


def test_a_table_by_hand() -> None:
    # a = 20, b = 6, c = 4, d = 10 of 40: |20 - 10|/40 and |6 - 4|/40; margins 26, 14
    # and 24, 16: at most 24 + 14 agree, by chance (26 · 24 + 14 · 16)/40 = 21.2:
    # (38 - 21.2)/(40 - 21.2) = 168/188.
    cells = [[20, 6], [4, 10]]
    assert prevalence_index(cells) == 0.25
    assert bias_index(cells) == 0.05
    assert kappa_max(cells) == 168 / 188


def test_cohens_own_example_of_the_largest_kappa() -> None:
    # Cohen (1960), Table 2: p_o = 140/200, margins .60 .30 .10 and .50 .30 .20, so that
    # p_c = .41 and kappa .492. At most .50 + .30 + .10 = .90 can agree: kappa_M = .831.
    cells = [[88, 14, 18], [10, 40, 10], [2, 6, 12]]
    assert cohen_kappa(count_table(cells)).value == pytest.approx(0.492, abs=5e-4)
    assert kappa_max(cells) == pytest.approx(0.831, abs=5e-4)
    assert kappa_max(cells) == pytest.approx(0.49 / 0.59, rel=1e-15)


def test_the_first_paradox_is_prevalence() -> None:
    # Feinstein and Cicchetti (1990): 85 of 100 agree in both tables, with kappa .70
    # and .32. The index tells them apart: .05 and .75, hardly any bias in either.
    even, uneven = [[40, 9], [6, 45]], [[80, 10], [5, 5]]
    for cells in (even, uneven):
        assert percent_agreement(count_table(cells)).value == 0.85
        assert bias_index(cells) <= 0.05
    assert cohen_kappa(count_table(even)).value == pytest.approx(0.70, abs=0.005)
    assert cohen_kappa(count_table(uneven)).value == pytest.approx(0.32, abs=0.005)
    assert prevalence_index(even) == 0.05
    assert prevalence_index(uneven) == 0.75


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


@given(pairs_of_two)
def test_indices_are_shares_that_neither_rater_nor_name_changes(
    cells: tuple[int, ...],
) -> None:
    a, b, c, d = cells
    for index in (prevalence_index, bias_index):
        found = index([[a, b], [c, d]])
        assert 0.0 <= found <= 1.0
        assert index([[a, c], [b, d]]) == found  # raters change places
        assert index([[d, c], [b, a]]) == found  # and categories


@given(squares())
def test_no_kappa_is_above_the_largest(cells: Cells) -> None:
    if not has_kappa(cells):
        assert_undefined(lambda: kappa_max(cells))
        return
    most = kappa_max(cells)
    assert cohen_kappa(count_table(cells)).value <= most + 1e-14 <= 1.0 + 1e-14
    rows, columns = margins(cells)
    assert (most == 1.0) == (rows == columns)


@given(st.lists(st.integers(0, 2), min_size=9, max_size=9))
def test_the_largest_kappa_is_that_of_some_table_of_the_same_margins(
    flat: list[int],
) -> None:
    cells = [flat[:3], flat[3:6], flat[6:]]
    if not has_kappa(cells):
        assert_undefined(lambda: kappa_max(cells))
        return
    rows, columns = margins(cells)
    best = max(
        cohen_kappa(count_table(other)).value for other in every_table(rows, columns)
    )
    assert kappa_max(cells) == pytest.approx(best, abs=1e-14)


def every_table(rows: list[int], columns: list[int]) -> list[Cells]:
    # 3 × 3: four cells are free, the others follow from the margins
    found = []
    r, c = rows, columns
    bounds = [min(r[i], c[j]) + 1 for i in (0, 1) for j in (0, 1)]
    for w, x, y, z in itertools.product(*map(range, bounds)):
        last = [c[0] - w - y, c[1] - x - z]
        table = [[w, x, r[0] - w - x], [y, z, r[1] - y - z], [*last, r[2] - sum(last)]]
        if min(map(min, table)) >= 0:
            found.append(table)
    return found


def test_margins_without_a_category_in_common_allow_no_agreement() -> None:
    # 6 against 0: nothing can agree, and by chance nothing does.
    assert kappa_max([[0, 6], [0, 0]]) == 0.0


def test_many_items_cost_no_digits() -> None:
    # Margins N + 2, 1 and N + 1, 2: at most N + 2 of N + 3 agree. (N + 3)(N + 2) less
    # (N + 2)(N + 1) + 2 is 2N + 2, and (N + 3)² less it 3N + 5: of 20 digits the first
    # ten cancel.
    n = 10**9 + 1
    assert kappa_max([[n, 2], [1, 0]]) == (2 * n + 2) / (3 * n + 5)


@pytest.mark.parametrize("function", [prevalence_index, bias_index, kappa_max])
def test_without_an_item_there_is_nothing(function) -> None:  # type: ignore[no-untyped-def]
    with pytest.warns(UndefinedStatisticWarning, match="no item has ratings of two"):
        assert math.isnan(function([[0, 0], [0, 0]]))


def test_one_category_has_no_largest_kappa_but_a_prevalence() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        assert math.isnan(kappa_max([[5, 0], [0, 0]]))
    assert prevalence_index([[5, 0], [0, 0]]) == 1.0
    assert bias_index([[0, 5], [0, 0]]) == 1.0


@pytest.mark.parametrize("function", [prevalence_index, bias_index])
def test_indices_are_of_two_categories(function) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(CountsError, match="needs 2 × 2, got 3 × 3"):
        function([[1, 0, 0], [0, 1, 0], [0, 0, 1]])


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


@given(squares())
def test_specific_agreements_average_to_percent_agreement(cells: Cells) -> None:
    # each weighed by how often it was used: Σ 2 t_kk / Σ (t_k. + t_.k) = p_o
    first, second = margins(cells)
    used = [r + c for r, c in zip(first, second, strict=True)]
    if not all(used):
        assert_some_undefined(cells, used)
        return
    found = specific_agreement(cells)
    mean = sum(n * share for n, share in zip(used, found, strict=True)) / sum(used)
    expected = percent_agreement(count_table(cells)).value
    assert mean == pytest.approx(expected, rel=1e-12, abs=1e-14)


def assert_some_undefined(cells: Cells, used: list[int]) -> None:
    with pytest.warns(UndefinedStatisticWarning, match="nobody used it"):
        found = specific_agreement(cells)
    assert [math.isnan(share) for share in found] == [n == 0 for n in used]

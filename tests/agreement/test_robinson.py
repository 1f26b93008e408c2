"""Robinson's A: sums of squares by hand, and what it has in common with others."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.agreement import robinson_a
from masrel.errors import UndefinedStatisticWarning
from tests.agreement.undefined import assert_undefined

Rows = list[list[int]]


rows = st.integers(2, 5).flatmap(
    lambda k: st.lists(
        st.lists(st.integers(-9, 9), min_size=k, max_size=k), min_size=2, max_size=8
    )
)


def plain(table: Rows) -> Fraction | None:
    # squares between items, over all but those between raters
    n, k = len(table), len(table[0])
    mean = Fraction(sum(map(sum, table)), n * k)
    items = sum(k * (Fraction(sum(row), k) - mean) ** 2 for row in table)
    raters = sum(
        n * (Fraction(sum(column), n) - mean) ** 2
        for column in zip(*table, strict=True)
    )
    rest = sum((x - mean) ** 2 for row in table for x in row) - raters
    return Fraction(items / rest) if rest else None


def test_two_raters_by_hand() -> None:
    # Levels 2 and 3 set aside: deviations -1, 0, 1 and -1, 1, 0. Items' means -1, 1/2,
    # 1/2: SS = 2 (1 + 1/4 + 1/4) = 3; of all squares, 2 + 2 = 4.
    found = robinson_a([[1, 2], [2, 4], [3, 3]])
    assert found.value == 0.75
    assert (found.n_items, found.n_raters, found.n_categories) == (3, 2, 4)
    assert math.isnan(found.standard_error)
    assert math.isnan(found.observed)
    assert math.isnan(found.chance)


@given(rows)
def test_is_the_quotient_of_plain_sums(table: Rows) -> None:
    expected = plain(table)
    if expected is None:
        assert_undefined(lambda: robinson_a(table))
        return
    assert robinson_a(table).value == pytest.approx(float(expected), rel=1e-15)
    assert 0 <= expected <= 1


@pytest.mark.parametrize(
    ("table", "why"),
    [
        ([[1, 2]], "fewer than two items or raters"),
        ([[1], [2]], "fewer than two items or raters"),
        ([[1, None], [None, 2]], "fewer than two items or raters"),
        ([[1, 2], [1, 2], [1, 2]], "0/0: no variance but between raters"),
        ([[3, 3], [3, 3]], "0/0: no variance but between raters"),
    ],
)
def test_undefined_with_a_reason(table: Rows, why: str) -> None:
    with pytest.warns(UndefinedStatisticWarning, match=why):
        found = robinson_a(table)
    assert math.isnan(found.value)
    assert why in (found.reason or "")

"""Light's kappa: the mean of pairs by hand, gaps either way, errors by slopes."""

import math
from fractions import Fraction

import pytest
from hypothesis import given

from masrel.agreement import cohen_kappa, light_kappa
from masrel.errors import UndefinedStatisticWarning
from tests.strategies import LABELS, Table, tables

SMALL: Table = [["a", "a", "a"], ["b", "b", "b"], ["a", "b", "b"]]


def test_error_of_three_raters_by_hand() -> None:
    # Pair 1, 2 at a a: [1 - 2/3 - (3/5)(1/3 + 2/3 - 8/9)]/(5/9) = (4/15)(9/5) = 12/25,
    # at b b the same, at a b: [-2/3 - (3/5)(2/3 - 8/9)]/(5/9) = -24/25; pair 1, 3 the
    # same; pair 2, 3 is perfect and does not move. u = (2/3)(12, 12, -24)/25; SE² =
    # (64 + 64 + 256)/625 / 6 = 64/625.
    assert light_kappa(SMALL).standard_error == pytest.approx(8 / 25, rel=1e-13)


def test_missing_ratings_listwise_and_pairwise_by_hand() -> None:
    # The last two items are not whole. Pairwise, raters 1, 2 also have (a b), so that
    # p_o = 2/4, shares of a 3/4 and 1/4, p_e = 6/16: 1/5; raters 2, 3 also have (a b):
    # p_o = 3/4, shares of a 2/4 and 1/4, p_e = 8/16: 1/2; raters 1, 3 as before: 2/5.
    holed: Table = [*SMALL, ["a", "b", None], [None, "a", "b"]]
    assert light_kappa(holed).value == 0.6
    assert light_kappa(holed).n_items == 3
    found = light_kappa(holed, deletion="pairwise")
    assert found.value == pytest.approx(
        float((Fraction(1, 5) + Fraction(1, 2) + Fraction(2, 5)) / 3), abs=1e-14
    )
    assert found.n_items == 5


@given(tables(n_raters=(3, 3), missing=False))
def test_is_the_mean_of_cohens_kappa(table: Table) -> None:
    pairs = [[[r[g], r[h]] for r in table] for g, h in ((0, 1), (0, 2), (1, 2))]
    if any(len({g for row in pair for g in row}) < 2 for pair in pairs):
        with pytest.warns(UndefinedStatisticWarning, match="one category"):
            undefined = light_kappa(table, categories=LABELS)
        assert math.isnan(undefined.value)
        return
    values = [cohen_kappa(pair, categories=LABELS).value for pair in pairs]
    found = light_kappa(table, categories=LABELS).value
    assert found == pytest.approx(sum(values) / 3, rel=1e-13, abs=1e-15)


def test_one_pair_without_a_kappa_is_named_and_none_is_given() -> None:
    # Raters 2 and 3 chose b throughout: the mean of the others is not the mean.
    with pytest.warns(UndefinedStatisticWarning, match="columns 1 and 2"):
        found = light_kappa([["a", "b", "b"], ["b", "b", "b"], ["a", "b", "b"]])
    assert math.isnan(found.value)
    assert found.reason == "0/0: one category is all of the raters in columns 1 and 2"
    # with what chance gives all the same
    assert not math.isnan(found.observed)


def test_the_reason_names_columns_of_the_table_as_given() -> None:
    # the second rater rates nothing and is left out; first and fourth have no item
    table: Table = [["a", None, "a", None], ["b", None, "b", None]]
    table += [[None, None, "a", "a"], [None, None, "b", "a"]]
    with pytest.warns(UndefinedStatisticWarning):
        found = light_kappa(table, deletion="pairwise")
    assert found.reason is not None
    assert "no item has both ratings of the raters in columns 0 and 3" in found.reason

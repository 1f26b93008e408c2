"""Stratified kappa: raters against themselves by hand, errors by slopes."""

import math
from collections.abc import Sequence
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.agreement import cohen_kappa, stratified_kappa
from masrel.errors import UndefinedStatisticWarning
from tests.agreement.slopes import delta_error
from tests.strategies import LABELS, Table, tables

FIRST: Table = [["a", "a"], ["b", "b"], ["a", "b"]]
SECOND: Table = [["a", "a"], ["b", "b"], ["b", "b"]]

strata = st.integers(1, 3).flatmap(
    lambda r: tables(n_raters=(2 * r, 2 * r)).map(
        lambda table: [[row[2 * i : 2 * i + 2] for row in table] for i in range(r)]
    )
)


def plain(pairs: list[Table], w: Sequence[Fraction]) -> Fraction | None:
    # Σ(p_o - p_e)/Σ(1 - p_e) over raters with a pair, items counted w times
    above = below = Fraction(0)
    for table in pairs:
        cells = [
            (first, second, x)
            for (first, second), x in zip(table, w, strict=True)
            if first is not None and second is not None
        ]
        n = sum((x for *_, x in cells), Fraction(0))
        if not n:
            continue
        observed = sum(x for a, b, x in cells if a == b) / n
        chance = sum(
            sum(x for a, _, x in cells if a == k)
            * sum(x for _, b, x in cells if b == k)
            for k in LABELS
        ) / (n * n)
        above += observed - chance
        below += 1 - chance
    return above / below if below else None


def test_two_raters_by_hand() -> None:
    # First: p_o = 2/3, p_e = 2/9 + 2/9; second: 1 and 1/9 + 4/9.
    # (2/9 + 4/9)/(5/9 + 4/9): 2/3, between 2/5 and 1 of theirs.
    found = stratified_kappa([FIRST, SECOND])
    assert found.value == pytest.approx(float(Fraction(2, 3)), abs=1e-14)
    assert (found.observed, found.chance) == (5 / 6, 0.5)
    assert (found.n_items, found.n_raters, found.n_categories) == (3, 2, 2)


def test_error_of_two_raters_by_hand() -> None:
    # κ = 1 - ΣD_o/ΣD_e with sums 1/3 and 1. An item moves them by, in ninths,
    #   D_o: first -3, -3, 6; second 0 (perfect);
    #   D_e: first -1, -1, 2; second 4, -2, -2: together 3, -3, 0.
    # u = dD_e/3 - dD_o = 4/9, 2/9, -6/9; SE² = 56/81 / 6.
    found = stratified_kappa([FIRST, SECOND]).standard_error
    assert found == pytest.approx(math.sqrt(28 / 243), rel=1e-13)


def test_a_rater_without_pairs_moves_neither_value_nor_error() -> None:
    none: Table = [["a", None], [None, None], [None, "b"]]
    alone, beside = stratified_kappa([FIRST]), stratified_kappa([FIRST, none])
    assert (beside.value, beside.n_raters) == (0.4, 1)
    assert beside.standard_error == pytest.approx(alone.standard_error, rel=1e-14)


def test_linear_weights_by_hand() -> None:
    # Of 1 to 3: (1 2), (3 3), (2 2): D_o = 1/6; shares 1/3 each and 0, 2/3, 1/3; apart
    # 1 - 2: 2/9 + 0, 1 - 3: 1/9 + 0, 2 - 3: 1/9 + 2/9, halves but 1 - 3: D_e =
    # (2 + 3)/18 + 1/9 = 7/18. The other rater is perfect, at 1, 2, 3: D_e =
    # (2/9 + 2/9)/2 + 2/9 = 8/18. 1 - (3/18)/(15/18) = 4/5.
    first, second = [[1, 2], [3, 3], [2, 2]], [[1, 1], [2, 2], [3, 3]]
    assert stratified_kappa([first, second], weights="linear").value == 0.8


@pytest.mark.filterwarnings("ignore::masrel.errors.UndefinedStatisticWarning")
@given(strata)
def test_value_and_error_are_those_of_the_plain_formula(pairs: list[Table]) -> None:
    rated = [  # with a pair of any rater
        i for i in range(len(pairs[0])) if any(None not in table[i] for table in pairs)
    ]
    kept = [[table[i] for i in rated] for table in pairs]
    found = stratified_kappa(pairs, categories=LABELS)
    expected = plain(kept, [Fraction(1)] * len(rated))
    if expected is None:
        assert found.reason
        return
    assert found.value == pytest.approx(float(expected), abs=1e-14)
    if len(rated) > 1:
        error = delta_error(lambda w: plain(kept, w) or Fraction(0), len(rated))
        assert found.standard_error == pytest.approx(error, rel=1e-9, abs=1e-12)


def test_raters_alike_are_one_rater() -> None:
    # The same stratum three times: nothing new, as far as other items are concerned.
    one, three = stratified_kappa([FIRST]), stratified_kappa([FIRST] * 3)
    assert three.value == one.value == cohen_kappa(FIRST).value
    assert three.standard_error == pytest.approx(one.standard_error, rel=1e-13)


def test_pooled_pairs_are_another_number() -> None:
    # One of them says a, the other b, always and both times: pooled, that is perfect
    # agreement; of each alone it is 0/0.
    tables_ = [[["a", "a"]] * 3, [["b", "b"]] * 3]
    assert cohen_kappa([*tables_[0], *tables_[1]]).value == 1.0
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        assert math.isnan(stratified_kappa(tables_).value)

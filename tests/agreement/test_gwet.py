"""Gwet's AC1 and AC2: published tables, errors by hand, declared categories."""

import math
from fractions import Fraction

import pytest

from masrel.agreement import (
    cohen_kappa,
    count_items,
    count_table,
    gwet_ac,
)
from masrel.errors import UndefinedStatisticWarning
from tests.strategies import Table

SMALL: Table = [["a", "a"], ["a", "a"], ["a", "b"]]


def test_published_paradox_of_rare_positives() -> None:
    # Gwet (2008), after a table of 125: nearly all agree on one category; kappa is
    # below 0, AC1 .94.
    cells = [[118, 5], [2, 0]]
    assert cohen_kappa(count_table(cells)).value == pytest.approx(-0.0234, abs=5e-5)
    found = gwet_ac(count_table(cells))
    # p = 243/250 and 7/250: p_e = 2 · 243 · 7/62500 = 1701/31250; p_o = 118/125
    assert found.value == float(Fraction(29500 - 1701, 31250 - 1701))
    assert found.value == pytest.approx(0.94, abs=0.005)


def test_published_value_of_krippendorffs_units() -> None:
    # Gwet (2014), from the counts of twelve units by four observers: AC1 = .775
    counts = [
        (3, 0, 0, 0, 0),
        (0, 3, 1, 0, 0),
        (0, 0, 4, 0, 0),
        (0, 0, 4, 0, 0),
        (0, 4, 0, 0, 0),
        (1, 1, 1, 1, 0),
        (0, 0, 0, 4, 0),
        (3, 1, 0, 0, 0),
        (0, 4, 0, 0, 0),
        (0, 0, 0, 0, 3),
        (2, 0, 0, 0, 0),
        (0, 0, 1, 0, 0),
    ]
    found = gwet_ac(count_items(counts))
    assert found.value == pytest.approx(0.77544, abs=5e-6)
    assert found.n_raters == 4


def test_error_by_hand() -> None:
    # P-bar = 2/3; p = 5/6, 1/6, p_e = 2 · 5/36 = 5/18: (12 - 5)/(18 - 5) = 7/13.
    # Slopes of p_e in p are 1 - 2p = ∓2/3: a a moves it by -2/3 (1/6 + 1/6) = -2/9,
    # a b by 4/9. u = [P_i - P-bar - (6/13) Δ]/(13/18):
    #   a a: (1/3 + 4/39)(18/13) = 102/169;  a b: (-2/3 - 8/39)(18/13) = -204/169;
    # SE² = (2 · 102² + 204²)/169² / 6 = (102/169)².
    found = gwet_ac(SMALL)
    assert found.value == pytest.approx(7 / 13, abs=1e-14)
    assert found.standard_error == pytest.approx(102 / 169, rel=1e-13)


def test_ac2_by_hand() -> None:
    # Linear weights of 1 to 3: items (1 2), (3 3): P = 1/2, 1. T_w = 3 + 4/2 = 5, p =
    # 1/4, 1/4, 2/4: Σp(1 - p) = 10/16, p_e = 5/6 · 10/16 = 25/48: (36 - 25)/(48 - 25).
    found = gwet_ac([[1, 2], [3, 3]], weights="linear")
    assert found.value == 11 / 23
    assert (found.observed, found.chance) == (0.75, 25 / 48)


def test_categories_that_nobody_used_still_count_by_hand() -> None:
    # Of three declared: p_e = 5/18 / 2 = 5/36: (24 - 5)/(36 - 5); of two 7/13.
    found = gwet_ac(SMALL, categories=["a", "b", "c"])
    assert found.value == pytest.approx(19 / 31, abs=1e-14)
    assert found.n_categories == 3


def test_one_declared_category_leaves_no_room_for_chance() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        found = gwet_ac([["a", "a"], ["a", "a"]], categories=["a"])
    assert math.isnan(found.value)


def test_error_with_a_lone_rating_by_hand() -> None:
    # Items a a, b b, a b, and a alone: shares 5/8, 3/8, p_e = 15/32, P-bar = 2/3, n = 4
    # of which 3 have a pair: κ = (64 - 45)/(96 - 45) = 19/51, 1 - κ = 32/51. Slopes
    # -1/4 of a, 1/4 of b: a a (and a alone) moves p_e by -(3/8 + 3/8)/4 = -6/32, b b by
    # 10/32, a b by 2/32. u = [(4/3) s_i (P_i - 2/3) - (32/51) Δ]/(17/32).
    table: Table = [["a", "a"], ["b", "b"], ["a", "b"], ["a", None]]
    kappa, pair, chance = Fraction(19, 51), Fraction(4, 3), Fraction(15, 32)
    moved = [Fraction(n, 32) for n in (-6, 10, 2, -6)]
    apart = [pair * Fraction(n, 3) for n in (1, 1, -2, 0)]
    u = [
        (p - (1 - kappa) * m) / (1 - chance) for p, m in zip(apart, moved, strict=True)
    ]
    assert sum(u) == 0
    found = gwet_ac(table)
    assert found.value == 19 / 51
    error = math.sqrt(sum(x * x for x in u) / 12)
    assert found.standard_error == pytest.approx(error)
    corrected = gwet_ac(table, population=8).standard_error
    assert corrected == pytest.approx(found.standard_error / math.sqrt(2), rel=1e-14)

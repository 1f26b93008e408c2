"""Conger's kappa: three raters by hand, missing ratings, errors by slopes."""

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction

import pytest
from hypothesis import given

from masrel.agreement import cohen_kappa, conger_kappa, fleiss_kappa
from masrel.errors import ParameterError, UndefinedStatisticWarning
from tests.agreement.slopes import delta_error
from tests.agreement.undefined import assert_undefined
from tests.strategies import LABELS, Table, tables

SMALL: Table = [["a", "a", "a"], ["b", "b", "b"], ["a", "b", "b"]]


def plain(table: Table, w: Sequence[Fraction]) -> Fraction | None:
    # (P-bar - p_e)/(1 - p_e), an item counted w times; p_e the mean over pairs of
    # raters of what Cohen's kappa has, each with all its own ratings
    above = below = Fraction(0)
    for row, x in zip(table, w, strict=True):
        grades = [g for g in row if g is not None]
        pairs = list(itertools.permutations(grades, 2))
        if pairs:
            above += x * Fraction(sum(a == b for a, b in pairs), len(pairs))
            below += x
    shares = []
    for rater in zip(*table, strict=True):
        given_ = [(g, x) for g, x in zip(rater, w, strict=True) if g is not None]
        whole = sum(x for _, x in given_)
        if not whole:
            continue
        shares.append({k: sum(x for g, x in given_ if g == k) / whole for k in LABELS})
    both = list(itertools.combinations(shares, 2))
    if not both:
        return None
    chance = sum(p[k] * q[k] for p, q in both for k in LABELS) / Fraction(len(both))
    if not below or chance == 1:
        return None
    return (above / below - chance) / (1 - chance)


def test_three_raters_by_hand() -> None:
    # P = 1, 1, 1/3: P-bar = 21/27. Shares of a: 2/3, 1/3, 1/3. Pairs by chance:
    # 2/9 + 2/9 twice, and 1/9 + 4/9: p_e = 13/27. (21 - 13)/(27 - 13).
    found = conger_kappa(SMALL)
    assert found.value == 8 / 14
    assert (found.observed, found.chance) == pytest.approx(
        (21 / 27, 13 / 27), abs=1e-14
    )
    assert (found.n_items, found.n_raters, found.n_categories) == (3, 3, 2)


def test_error_of_three_raters_by_hand() -> None:
    # Rater g choosing k moves p_e by b_g(k) = (1/3) Σ_{h≠g} p_hk about its mean: first
    # rater 2/9 or 4/9 about 8/27, so -2/27 for a and 4/27 for b; the others 1/3 always.
    # u = [P_i - P-bar - (3/7) Δ] / (14/27):
    #   a a a: [6 + (3/7) 2]/14 = 24/49,  b b b: [6 - (3/7) 4]/14 = 15/49,
    #   a b b: [-12 + (3/7) 2]/14 = -39/49. SE² = (24² + 15² + 39²)/49² / 6.
    found = conger_kappa(SMALL).standard_error
    assert found == pytest.approx(math.sqrt(387) / 49, rel=1e-13)


def test_a_lone_rating_counts_for_its_rater_by_hand() -> None:
    # P-bar = 2/3 of three pairs. First rater a in 2 of 4, second in 1 of 3: p_e =
    # 1/6 + 1/3 = 1/2: (2/3 - 1/2)/(1/2). Cohen's leaves b . out: 2/9 + 2/9, 2/5.
    table: Table = [["a", "a"], ["a", "b"], ["b", "b"], ["b", None]]
    assert conger_kappa(table).value == pytest.approx(float(Fraction(1, 3)), abs=1e-14)
    assert cohen_kappa(table).value == 0.4


def test_linear_weights_by_hand() -> None:
    # (1 1), (1 2), (3 3) of 1 to 3: agreement 1, 1/2, 1, mean 5/6. Shares 2/3 0 1/3 and
    # 1/3 1/3 1/3: 2/3 (1/3 + 1/6) + 1/3 (1/6 + 1/3) = 1/2: (5/6 - 1/2)/(1/2) = 2/3.
    found = conger_kappa([[1, 1], [1, 2], [3, 3]], weights="linear")
    assert found.value == pytest.approx(float(Fraction(2, 3)), abs=1e-14)
    assert found.weights == "linear"


@pytest.mark.filterwarnings("ignore::masrel.errors.UndefinedStatisticWarning")
@given(tables(n_raters=(2, 4)))
def test_value_and_error_are_those_of_the_plain_formula(table: Table) -> None:
    rated = [row for row in table if any(g is not None for g in row)]
    found = conger_kappa(table, categories=LABELS)
    if len(rated) < 2:
        assert math.isnan(found.standard_error)
        return
    expected = plain(rated, [Fraction(1)] * len(rated))
    if expected is None:
        assert found.reason
        return
    assert found.value == pytest.approx(float(expected), abs=1e-14)
    error = delta_error(lambda w: plain(rated, w) or Fraction(0), len(rated))
    assert found.standard_error == pytest.approx(error, rel=1e-10, abs=1e-13)


@given(tables(n_raters=(2, 5), missing=False))
def test_of_complete_ratings_it_is_never_below_fleiss_kappa(table: Table) -> None:
    # chance between two raters who differ is less than that of both together
    if len({grade for row in table for grade in row}) < 2:
        assert_undefined(lambda: conger_kappa(table, categories=LABELS))
        return
    conger, fleiss = (
        function(table, categories=LABELS) for function in (conger_kappa, fleiss_kappa)
    )
    assert conger.chance <= fleiss.chance + 1e-15
    assert conger.value >= fleiss.value - 1e-15


def test_of_a_finite_population_the_items_rated_are_known() -> None:
    plain_, some, whole = (
        conger_kappa(SMALL, population=n).standard_error for n in (None, 12, 3)
    )
    assert some == pytest.approx(plain_ * math.sqrt(3 / 4), rel=1e-14)
    assert whole == 0.0
    with pytest.raises(ParameterError, match="at least the 3 items rated, got 2"):
        conger_kappa(SMALL, population=2)


def test_an_item_that_nobody_rated_is_no_item() -> None:
    holed: Table = [*SMALL, [None, None, None]]
    assert conger_kappa(holed) == conger_kappa(SMALL)


def test_a_rater_without_any_rating_is_no_rater() -> None:
    table: Table = [["a", None, "a"], ["b", None, "a"], ["b", None, "b"]]
    assert conger_kappa(table) == conger_kappa([[row[0], row[2]] for row in table])


@pytest.mark.parametrize(
    ("table", "why"),
    [
        ([["a", "a", "a"]] * 3, "0/0: chance agreement is 1"),
        ([["a", None], [None, "b"]], "no item has ratings of two raters"),
    ],
)
def test_undefined_with_a_reason(table: Table, why: str) -> None:
    with pytest.warns(UndefinedStatisticWarning, match=why):
        found = conger_kappa(table)
    assert why in (found.reason or "")
    assert math.isnan(found.standard_error)

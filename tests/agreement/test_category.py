"""Kappa of one category and the test of none: Fleiss' diagnoses, and by hand."""

import dataclasses
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given

from masrel.agreement import (
    category_kappa,
    count_items,
    fleiss_kappa,
    fleiss_null,
)
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from tests.agreement.undefined import assert_undefined
from tests.strategies import LABELS, Table, tables

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

SMALL: Table = [["a", "a"], ["b", "b"], ["c", "c"], ["a", "b"]]


def test_published_kappa_of_each_diagnosis() -> None:
    # Table 2 there, with the shares .144, .144, .167, .306, .239; and .430 of all
    published = [0.245, 0.245, 0.520, 0.471, 0.566]
    for diagnosis, kappa in zip(DIAGNOSES, published, strict=True):
        found = category_kappa(RATINGS, diagnosis, categories=DIAGNOSES)
        assert found.value == pytest.approx(kappa, abs=5e-4)
        assert (found.coefficient, found.weights) == ("category_kappa", diagnosis)
        assert (found.n_items, found.n_raters, found.n_categories) == (30, 6, 2)
    assert fleiss_kappa(RATINGS).value == pytest.approx(0.430, abs=5e-4)


def test_published_tests_of_each_diagnosis() -> None:
    # The error of one category is √(2 / (30 · 6 · 5)) = 0.0471 whatever its share;
    # R's irr prints these z, and 17.7 of all.
    printed = [5.192, 5.192, 11.031, 9.994, 12.009]
    for diagnosis, z in zip(DIAGNOSES, printed, strict=True):
        found = fleiss_null(RATINGS, category=diagnosis, categories=DIAGNOSES)
        assert found.statistic == pytest.approx(z, abs=5e-4)
        assert found.p_value == pytest.approx(math.erfc(found.statistic / math.sqrt(2)))
    assert fleiss_null(RATINGS).statistic == pytest.approx(17.7, abs=0.05)


def test_one_category_against_the_others_by_hand() -> None:
    # a: two, none, none and one of two: P-bar = 3/4, p = 3/8, P-bar_e = 34/64:
    # (48 - 34)/(64 - 34) = 7/15; b alike. Nobody doubts c.
    assert category_kappa(SMALL, "a").value == float(Fraction(7, 15))
    assert category_kappa(SMALL, "b").value == float(Fraction(7, 15))
    assert category_kappa(SMALL, "c").value == 1.0
    found = category_kappa(SMALL, "a")
    assert (found.observed, found.chance) == (0.75, 34 / 64)


def test_of_two_categories_both_are_the_kappa_of_all() -> None:
    # (2, 0) and (1, 1): kappa -1/3, error 4/9; derived where Fleiss' kappa is tested
    for category in "ab":
        found = category_kappa([["a", "a"], ["a", "b"]], category)
        assert found.value == pytest.approx(-1 / 3, abs=1e-16)
        assert found.standard_error == pytest.approx(4 / 9, rel=1e-14)


def test_a_missing_rating_is_none_of_the_others() -> None:
    # (a a c), (a . a), (b . .), c merged with b: 13/40, derived where Fleiss' is
    holed = [["a", "a", "c"], ["a", None, "a"], ["b", None, float("nan")]]
    found = category_kappa(holed, "a")
    assert found.value == pytest.approx(13 / 40, abs=1e-14)
    assert (found.n_items, found.n_raters) == (3, 3)


def test_counts_are_enough() -> None:
    rows = [[row.count(diagnosis) for diagnosis in DIAGNOSES] for row in RATINGS]
    counts = count_items(rows, categories=DIAGNOSES)
    for diagnosis in DIAGNOSES:
        found = category_kappa(counts, diagnosis)
        expected = category_kappa(RATINGS, diagnosis)
        assert found.value == pytest.approx(expected.value, abs=1e-14)
        assert found.standard_error == pytest.approx(expected.standard_error, rel=1e-13)
        assert (found.n_items, found.n_raters) == (30, 6)


@pytest.mark.filterwarnings("ignore::masrel.errors.UndefinedStatisticWarning")
@given(tables(missing=False))
def test_fleiss_kappa_is_their_mean_weighed_by_p_times_q(table: Table) -> None:
    grades = [grade for row in table for grade in row]
    if len(set(grades)) < 2:
        assert_undefined(lambda: fleiss_kappa(table, categories=LABELS))
        return
    shares = {g: grades.count(g) / len(grades) for g in set(grades)}
    weights = {g: p * (1 - p) for g, p in shares.items()}
    mean = sum(
        w * category_kappa(table, g, categories=LABELS).value
        for g, w in weights.items()
        if g is not None
    ) / sum(weights.values())
    found = fleiss_kappa(table, categories=LABELS).value
    assert found == pytest.approx(mean, rel=1e-12, abs=1e-14)


@pytest.mark.filterwarnings("ignore::masrel.errors.UndefinedStatisticWarning")
@given(tables())
def test_is_fleiss_kappa_of_the_question_is_it_this_one(table: Table) -> None:
    asked = [[None if g is None else str(g == "1+") for g in row] for row in table]
    expected = fleiss_kappa(asked, categories=["False", "True"])
    found = category_kappa(table, "1+", categories=LABELS)
    assert found.reason == expected.reason
    for field in ("value", "standard_error", "observed", "chance"):
        one, other = getattr(found, field), getattr(expected, field)
        assert one == pytest.approx(other, rel=1e-12, abs=1e-15, nan_ok=True)


def test_null_error_of_two_categories_by_hand() -> None:
    # Σpq = 2pq, Σpq(q - p) = 0: SE0 = √(2/(N n (n - 1))), here √(2/8) = 1/2, and
    # kappa 7/15: z = 14/15, P = erfc(z/√2).
    found = fleiss_null([["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"]])
    assert found.statistic == pytest.approx(14 / 15, rel=1e-14)
    assert found.p_value == pytest.approx(math.erfc(14 / 15 / math.sqrt(2)), rel=1e-13)
    assert (found.name, found.distribution, found.df) == ("fleiss_null", "normal", ())


def test_null_error_of_three_categories_by_hand() -> None:
    # Shares 3/8, 3/8, 2/8: Σpq = (15 + 15 + 12)/64 = 21/32. Σpq(q - p) =
    # (15 · 2 + 15 · 2 + 12 · 4)/512 = 27/128. SE0² = 2/8 (441/1024 - 216/1024) /
    # (21/32)² = 225/1764, SE0 = 15/42; kappa = 13/21: z = 26/15.
    found = fleiss_null(SMALL)
    assert found.statistic == pytest.approx(26 / 15, rel=1e-14)
    assert found.n_items == 4


def test_without_agreement_z_is_as_normal_as_it_says() -> None:
    # 1500 tables of 60 items by 4 raters who guess: z has sd 1 ± 0.018, and p is below
    # 5 % in 75 ± 8.4 of them; each bound is five of these away, once in a million.
    rng = np.random.Generator(np.random.PCG64(3))
    guesses = rng.choice(3, size=(1500, 60, 4), p=[0.5, 0.3, 0.2])
    tests = [fleiss_null(table, categories=range(3)) for table in guesses]
    assert 0.91 < np.std([test.statistic for test in tests]) < 1.09
    assert 33 <= sum(test.p_value < 0.05 for test in tests) <= 117


def test_items_with_a_missing_rating_are_not_tested() -> None:
    whole: Table = [["a", "a", "b"], ["b", "b", "b"], ["c", "c", "c"]]
    holed: Table = [*whole, ["a", "a", None], [None, None, None]]
    assert fleiss_null(holed) == fleiss_null(whole)
    assert fleiss_null(holed, category="a") == fleiss_null(whole, category="a")


def test_a_rater_without_any_rating_is_none() -> None:
    # the null needs as many ratings of every item, and those who rated gave them
    for category in (None, "a"):
        found = fleiss_null([[*row, None] for row in SMALL], category=category)
        assert found == fleiss_null(SMALL, category=category)


def test_the_error_of_the_test_is_not_that_of_the_estimate() -> None:
    # and so no interval can come of it: the result has a z and nothing to make one
    estimate, test = fleiss_kappa(RATINGS), fleiss_null(RATINGS)
    assert estimate.value / test.statistic < 0.5 * estimate.standard_error
    fields = {field.name for field in dataclasses.fields(test)}
    assert not fields & {"interval", "standard_error", "low", "high"}
    assert estimate.interval is None


@pytest.mark.parametrize(
    ("ratings", "why"),
    [
        ([["a", "a"], ["a", "a"]], "0/0: all ratings are in one category"),
        ([["a"], ["b"]], "fewer than two raters"),
        ([["a", None], [None, "b"]], "no item is rated by every rater"),
    ],
)
def test_nothing_to_test_is_said(ratings: Table, why: str) -> None:
    with pytest.warns(UndefinedStatisticWarning, match=why):
        found = fleiss_null(ratings, categories=["a", "b"])
    assert math.isnan(found.statistic)
    assert math.isnan(found.p_value)
    assert why in (found.reason or "")


@pytest.mark.parametrize("category", ["c", "d"])
def test_a_category_that_nobody_or_everybody_used_has_no_kappa(category: str) -> None:
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        found = category_kappa([["c", "c"]] * 3, category, categories=["c", "d"])
    assert math.isnan(found.value)
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        test = fleiss_null([["c", "c"]] * 3, category=category, categories=["c", "d"])
    assert math.isnan(test.p_value)


def test_a_category_is_one_of_those_declared() -> None:
    with pytest.raises(ParameterError, match="category: needs one of 'a', 'b', 'c'"):
        category_kappa(SMALL, "A")
    with pytest.raises(ParameterError, match="category: needs one of 1, 2, got '1'"):
        fleiss_null([[1, 2], [1, 1]], category="1")
    with pytest.raises(RatingsError, match="needs one of"):
        category_kappa(SMALL, "a", categories=["a", "b"])

"""Kappa of one category and the test of none: Fleiss' diagnoses, and by hand."""

import math
from fractions import Fraction

import pytest
from hypothesis import given

from masrel.agreement import (
    category_kappa,
    fleiss_kappa,
    fleiss_null,
)
from masrel.errors import UndefinedStatisticWarning
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


def test_null_error_of_two_categories_by_hand() -> None:
    # Σpq = 2pq, Σpq(q - p) = 0: SE0 = √(2/(N n (n - 1))), here √(2/8) = 1/2, and
    # kappa 7/15: z = 14/15, P = erfc(z/√2).
    found = fleiss_null([["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"]])
    assert found.statistic == pytest.approx(14 / 15, rel=1e-14)
    assert found.p_value == pytest.approx(math.erfc(14 / 15 / math.sqrt(2)), rel=1e-13)
    assert (found.name, found.distribution, found.df) == ("fleiss_null", "normal", ())


def test_items_with_a_missing_rating_are_not_tested() -> None:
    whole: Table = [["a", "a", "b"], ["b", "b", "b"], ["c", "c", "c"]]
    holed: Table = [*whole, ["a", "a", None], [None, None, None]]
    assert fleiss_null(holed) == fleiss_null(whole)
    assert fleiss_null(holed, category="a") == fleiss_null(whole, category="a")


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

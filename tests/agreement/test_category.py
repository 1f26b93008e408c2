"""Kappa of one category and the test of none: Fleiss' diagnoses, and by hand."""

import math

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


def test_published_kappa_of_each_diagnosis() -> None:
    # Table 2 there, with the shares .144, .144, .167, .306, .239; and .430 of all
    published = [0.245, 0.245, 0.520, 0.471, 0.566]
    for diagnosis, kappa in zip(DIAGNOSES, published, strict=True):
        found = category_kappa(RATINGS, diagnosis, categories=DIAGNOSES)
        assert found.value == pytest.approx(kappa, abs=5e-4)
        assert (found.coefficient, found.weights) == ("category_kappa", diagnosis)
        assert (found.n_items, found.n_raters, found.n_categories) == (30, 6, 2)
    assert fleiss_kappa(RATINGS).value == pytest.approx(0.430, abs=5e-4)


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

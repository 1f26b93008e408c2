"""Input that is nearly ratings: read as what it says, or refused by name."""

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from masrel.agreement import (
    code_ratings,
    count_ratings,
    fleiss_kappa,
    gwet_ac,
    icc,
    kendall_w,
    robinson_a,
)
from masrel.errors import ParameterError, RatingsError, RatingsWarning

PLAIN = [["a", "b"], ["b", "b"], [None, "a"], ["a", "a"]]
NUMBERS = [[1.0, 2.0], [2.0, 2.0], [None, 1.0], [1.0, 1.0]]


def test_what_an_array_masks_is_missing() -> None:
    mask = [[False, False], [False, False], [True, False], [False, False]]
    text = np.ma.array([["a", "b"], ["b", "b"], ["b", "a"], ["a", "a"]], mask=mask)
    assert fleiss_kappa(text) == fleiss_kappa(PLAIN)
    for dtype in (np.int8, np.int64, np.float64):
        numbers = np.ma.array([[1, 2], [2, 2], [2, 1], [1, 1]], mask=mask, dtype=dtype)
        assert fleiss_kappa(numbers).value == fleiss_kappa(NUMBERS).value
        assert icc(numbers).value == icc(NUMBERS, categories=[1, 2]).value
    whole = np.ma.array([[1, 2], [2, 2]])
    assert fleiss_kappa(whole) == fleiss_kappa([[1, 2], [2, 2]])


FORMS: dict[str, Callable[[list[list[object]]], object]] = {
    "lists": lambda rows: rows,
    "array of text": lambda rows: np.array(rows),
    "large array of text": lambda rows: np.array(rows * 40),
    "array of objects": lambda rows: np.array(rows, dtype=object),
    "large array of objects": lambda rows: np.array(rows * 40, dtype=object),
    "frame": pd.DataFrame,
    "frame of categories": lambda rows: pd.DataFrame(rows).astype("category"),
    "frame of strings": lambda rows: pd.DataFrame(rows).astype("string"),
}


@pytest.mark.parametrize("form", FORMS)
def test_empty_text_is_no_grade_unless_it_is_declared(form: str) -> None:
    rows: list[list[object]] = [["b", "a"], ["a", ""], ["", "b"]]
    ratings = FORMS[form](rows)
    for function in (fleiss_kappa, gwet_ac, count_ratings, code_ratings):
        with pytest.raises(
            RatingsError, match=r"row 1, column 1: needs a label, or None for.*got ''"
        ):
            function(ratings)
    declared = fleiss_kappa(ratings, categories=["", "a", "b"])
    assert declared.n_categories == 3


@pytest.mark.parametrize("text", ["nan", "None", "NaT", "<NA>"])
@pytest.mark.parametrize("form", FORMS)
def test_what_astype_str_leaves_of_a_missing_rating_is_warned_of(
    form: str, text: str
) -> None:
    rows: list[list[object]] = [["b", "a"], ["a", text], [text, "b"]]
    ratings = FORMS[form](rows)
    n = 80 if "large" in form else 2
    for function in (fleiss_kappa, count_ratings, code_ratings):
        with pytest.warns(RatingsWarning) as noted:
            function(ratings)
        assert len(noted) == 1
        assert f"{text!r} ({n} times)" in str(noted[0].message)
        assert noted[0].filename == __file__
        function(ratings, categories=sorted(["a", "b", text]))  # and no warning
    plain = fleiss_kappa(FORMS[form]([["b", "a"], ["a", "c"], ["c", "b"]])).value
    with pytest.warns(RatingsWarning):
        assert fleiss_kappa(ratings).value == plain


def test_categories_may_be_an_array_and_must_be_many() -> None:
    numbers = [[1, 2], [2, 3], [3, 3]]
    for function in (icc, kendall_w, robinson_a, fleiss_kappa):
        declared = function(numbers, categories=np.array([1, 2, 3]))
        assert declared.value == function(numbers, categories=[1, 2, 3]).value
        assert declared.n_categories == 3
        with pytest.raises(RatingsError, match="categories: needs a sequence"):
            function(numbers, categories=5)


def test_counted_ratings_have_the_scale_they_were_counted_on() -> None:
    counted = count_ratings(PLAIN, ["a", "b", "c"])
    assert gwet_ac(counted, categories=["a", "b", "c"]) == gwet_ac(counted)
    for other in (["a", "b"], ["b", "a", "c"]):
        with pytest.raises(ParameterError, match=r"on the scale \('a', 'b', 'c'\)"):
            gwet_ac(counted, categories=other)
        with pytest.raises(ParameterError, match=r"on the scale \('a', 'b', 'c'\)"):
            gwet_ac(counted.coded, categories=other)


def test_ordered_categories_of_a_frame_are_its_scale() -> None:
    scale = ["mild", "bad", "awful", "worst"]
    rows = [["mild", "bad"], ["bad", "bad"], ["awful", "mild"]]
    frame = pd.DataFrame(rows).astype(pd.CategoricalDtype(scale, ordered=True))
    weighed = gwet_ac(frame, weights="linear")
    assert weighed == gwet_ac(rows, categories=scale, weights="linear")
    # not where pandas has no order, or columns have scales of their own
    unordered = pd.DataFrame(rows).astype(pd.CategoricalDtype(scale))
    assert gwet_ac(unordered).n_categories == 3
    mixed = frame.assign(
        **{"1": pd.Categorical(["bad", "bad", "mild"], scale[:2], ordered=True)}
    )
    assert gwet_ac(mixed).n_categories == 3


def test_a_set_of_labels_is_a_category() -> None:
    sets = [[{"a"}, {"a", "b"}], [{"b", "a"}, frozenset("ab")], [set(), set()]]
    text = [["a", "a; b"], ["a; b", "a; b"], ["∅", "∅"]]
    assert fleiss_kappa(sets) == fleiss_kappa(text)
    scale = [{"a"}, {"a", "b"}, set()]
    declared = fleiss_kappa(sets, categories=scale)  # type: ignore[arg-type]
    assert declared.value == fleiss_kappa(text).value
    with pytest.raises(RatingsError, match="row 0, column 1: needs one of 'a' or"):
        fleiss_kappa(sets, categories=["a"])
    with pytest.raises(RatingsError, match="no semicolon, which separates them"):
        fleiss_kappa([[{"a;b"}, {"a"}]])

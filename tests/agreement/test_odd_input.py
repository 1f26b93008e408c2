"""Input that is nearly ratings: read as what it says, or refused by name."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from masrel.agreement import (
    code_long,
    code_ratings,
    cohen_kappa,
    count_items,
    count_ratings,
    count_table,
    fleiss_kappa,
    gwet_ac,
    icc,
    kendall_w,
    robinson_a,
    stratified_kappa,
)
from masrel.errors import CountsError, ParameterError, RatingsError, RatingsWarning
from masrel.intervals import analytic, estimate, jackknife
from masrel.ratings import read_ratings

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


@pytest.mark.parametrize("function", [icc, kendall_w, robinson_a])
@pytest.mark.parametrize("infinite", [np.inf, -np.inf])
def test_statistics_of_numbers_refuse_infinite_ones(
    function: Callable[..., object], infinite: float
) -> None:
    with pytest.raises(RatingsError, match=r"row 1, column 0: needs a finite.*inf"):
        function(np.array([[1.0, 2.0], [infinite, 2.0]]))


@pytest.mark.parametrize(
    "rows", [[{"r1": 1, "r2": 2}], [{1, 2}], [b"ab"], ["ab"], [3], [None]]
)
def test_a_row_without_order_is_refused(rows: list[object]) -> None:
    with pytest.raises(RatingsError, match="row 0 needs one rating per rater"):
        fleiss_kappa(rows)


def test_an_array_in_place_of_a_label_is_not_a_missing_rating() -> None:
    label = np.array([2, 3])
    with pytest.raises(RatingsError, match=r"row 0, column 1.*array"):
        fleiss_kappa([[1, label], [1, 1]], categories=[1, 2])
    with pytest.raises(RatingsError, match="labels need to be text or numbers"):
        fleiss_kappa([[1, label], [1, 1]])


def test_missing_in_the_ways_of_pandas_is_missing() -> None:
    plain = gwet_ac([["a", None], ["b", "b"], ["a", "b"]])
    for missing in (pd.NA, float("nan"), np.float64("nan"), pd.NaT):
        assert gwet_ac([["a", missing], ["b", "b"], ["a", "b"]]) == plain


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


def test_an_interval_warns_once_of_text_that_is_no_grade() -> None:
    rows = [["b", "a", "a"], ["a", "None", "b"], ["b", "b", "b"], ["a", "a", "a"]] * 4
    for method in (estimate, jackknife, analytic):
        with pytest.warns(RatingsWarning) as noted:
            method("fleiss_kappa", rows, target="items")  # type: ignore[operator]
        assert [w.category for w in noted] == [RatingsWarning]
        assert noted[0].filename == __file__


def test_long_ratings_have_the_same_rules() -> None:
    frame = pd.DataFrame(
        {"item": [1, 1, 2, 2], "rater": ["A", "B"] * 2, "grade": ["a", "", "a", "b"]}
    )
    with pytest.raises(RatingsError, match="row 1, column 'grade': needs a label, or"):
        code_long(frame)
    assert code_long(frame, categories=["", "a", "b"]).codes.tolist() == [
        [1, 0],
        [1, 2],
    ]
    with pytest.warns(RatingsWarning, match=r"'nan' \(1 times\)"):
        code_long(frame.replace("", "nan"))


def test_a_file_says_what_looks_missing_in_its_own_words(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("item,A,B\n1,a,b\n2,a,\n3,b,b\n", encoding="utf-8")
    part = read_ratings(path).parts[0]
    assert fleiss_kappa(part.counted).value == fleiss_kappa(part.ratings).value
    path.write_text("item,A,B\n1,a,b\n2,a,nan\n3,b,b\n", encoding="utf-8")
    options = {"categories": ("a", "b", "nan")}
    part = read_ratings(path, **options).parts[0]  # type: ignore[arg-type]
    assert fleiss_kappa(part.ratings).n_categories == 3  # and no warning


def test_ragged_tables_are_refused_as_what_they_are() -> None:
    with pytest.raises(CountsError, match="counts: needs rows of the same length"):
        fleiss_kappa(count_items([[1, 2], [1]]))
    with pytest.raises(CountsError, match="rows of the same length"):
        cohen_kappa(count_table([[1, 2], [1]]))
    with pytest.raises(ParameterError, match="weights: needs rows of the same length"):
        fleiss_kappa([[1, 2], [2, 2]], weights=[[1, 0], [1]])
    with pytest.raises(RatingsError, match=r"two dimensions .* shape"):
        fleiss_kappa(pd.Series([1, 2, 3]))


def test_categories_may_be_an_array_and_must_be_many() -> None:
    numbers = [[1, 2], [2, 3], [3, 3]]
    for function in (icc, kendall_w, robinson_a, fleiss_kappa):
        declared = function(numbers, categories=np.array([1, 2, 3]))
        assert declared.value == function(numbers, categories=[1, 2, 3]).value
        assert declared.n_categories == 3
        with pytest.raises(RatingsError, match="categories: needs a sequence"):
            function(numbers, categories=5)


@pytest.mark.parametrize("population", [1, 2.5, float("nan"), "many", -3])
def test_a_population_is_a_whole_number_of_items(population: object) -> None:
    with pytest.raises(ParameterError, match="population: needs a whole number"):
        fleiss_kappa([[1, 2], [2, 2]], population=population)  # type: ignore[arg-type]


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


class Frame:
    """A table of another library: it gives an array, and knows no pandas."""

    shape = (2, 2)

    def to_numpy(self) -> np.ndarray:
        """Return the labels."""
        return np.array([["a", None], ["b", "b"]], dtype=object)


def test_a_frame_of_another_library_is_its_array() -> None:
    assert gwet_ac(Frame()) == gwet_ac([["a", None], ["b", "b"]])


def test_pairs_of_a_rater_need_two_grades_each() -> None:
    with pytest.raises(RatingsError, match=r"rater 0, item 1: needs two grades, got 3"):
        stratified_kappa([[["a", "b"], 3]])
    with pytest.raises(RatingsError, match="rater 1, item 0: needs two grades, got"):
        stratified_kappa([[["a", "b"]], [["a"]]])


def test_a_label_that_is_no_label_is_named_with_its_place() -> None:
    said = r"row 0, column 0: labels need to be text or numbers, .*got \(1, 2\)"
    for ratings in ([[(1, 2), 3], [3, (1, 2)]], [[(1, 2), "a"], ["a", (1, 2)]]):
        with pytest.raises(RatingsError, match=said):
            fleiss_kappa(ratings)
        table = np.empty((2, 2), dtype=object)
        for i, row in enumerate(ratings):
            for j, label in enumerate(row):
                table[i, j] = label
        with pytest.raises(RatingsError, match=said):
            fleiss_kappa(table)
        with pytest.raises(RatingsError, match=said):
            fleiss_kappa(pd.DataFrame(table))
    with pytest.raises(RatingsError, match=r"row 1, column 1: labels .* got \[3\]"):
        fleiss_kappa([[1, 2], [2, [3]]])
    with pytest.raises(RatingsError, match="text and numbers cannot be mixed"):
        fleiss_kappa([[1, "a"], ["a", 1]])


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

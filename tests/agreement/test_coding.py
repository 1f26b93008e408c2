"""Labels to codes: forms of input, what is missing, and what is refused by name."""

import re
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import masrel
from masrel.agreement import (
    code_long,
    code_ratings,
    coefficient,
    cohen_kappa,
    contingency_table,
    count_ratings,
    fleiss_kappa,
    gwet_ac,
    icc,
    icc_f_test,
    kendall_w,
    krippendorff_alpha,
    robinson_a,
    scott_pi,
)
from masrel.errors import ParameterError, RatingsError, RatingsWarning

GRADES = ["0", "1", "1+", "2", "3", "4"]


def test_codes_are_positions_in_the_declared_scale() -> None:
    coded = code_ratings([["1+", "4"], ["0", None]], GRADES)
    assert coded.codes.tolist() == [[2, 5], [0, -1]]
    assert (coded.n_items, coded.n_raters, coded.n_categories) == (2, 2, 6)


def test_numbers_are_ordered_by_value_and_not_as_text() -> None:
    assert code_ratings([[10, 9], [2, 10]]).categories == (2, 9, 10)


def test_every_kind_of_missing_value_is_missing() -> None:
    frame = pd.DataFrame({"a": ["x", None], "b": [pd.NA, "y"], "c": [np.nan, "x"]})
    assert code_ratings(frame).codes.tolist() == [[0, -1, -1], [-1, 1, 0]]
    nothing = code_ratings(np.full((2, 2), np.nan), [1, 2])
    assert nothing.codes.tolist() == [[-1, -1], [-1, -1]]
    assert code_ratings(np.array([[1.0, np.nan], [2.0, 1.0]])).codes.tolist() == [
        [0, -1],
        [1, 0],
    ]
    assert code_ratings([[1, pd.NaT], [1, 2]]).codes.tolist() == [[0, -1], [0, 1]]


SCALE = ["1", "1+", "2", "3"]


def long(*rows: tuple[object, object, object]) -> pd.DataFrame:
    return pd.DataFrame(list(rows), columns=["item", "rater", "grade"])


def test_items_and_raters_are_in_the_order_in_which_they_are_met() -> None:
    frame = long(("y", "B", "2"), ("x", "A", "1"), ("y", "A", "1+"), ("x", "B", "3"))
    coded = code_long(frame, categories=SCALE)
    # rows y, x; columns B, A
    assert coded.codes.tolist() == [[2, 1], [3, 0]]
    assert coded.categories == tuple(SCALE)


def test_a_rating_that_is_not_there_or_empty_is_missing() -> None:
    frame = long(("x", "A", "1"), ("x", "B", None), ("y", "B", "2"), ("z", "A", None))
    coded = code_long(frame, categories=SCALE)
    assert coded.codes.tolist() == [[0, -1], [-1, 2], [-1, -1]]
    assert (coded.n_items, coded.n_raters) == (2, 2)


TWICE = long(("x", "A", "1"), ("x", "B", "2"), ("x", "A", "3"), ("y", "A", "2"))


@pytest.mark.parametrize(("policy", "kept"), [("first", 0), ("last", 3)])
def test_a_named_policy_keeps_one_of_them(policy: Any, kept: int) -> None:
    coded = code_long(TWICE, categories=SCALE, repeated=policy)
    assert coded.codes.tolist() == [[kept, 2], [2, -1]]


KIM, LEE = ["x", "y", "y", None, "x"], ["x", "y", "x", "x", "x"]
MEASURES = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9]]


# ---- two sequences ----


@pytest.mark.parametrize(
    "form",
    [
        *(list, tuple, pd.Series, pd.Index, pl.Series, pa.array, iter),
        lambda labels: np.array(labels, dtype=object),
        lambda labels: pa.chunked_array([labels]),
    ],
)
def test_two_sequences_are_the_raters_of_a_table(form: Callable[..., Any]) -> None:
    rows = list(zip(KIM, LEE, strict=True))
    assert cohen_kappa(form(KIM), form(LEE)) == cohen_kappa(rows)
    assert scott_pi(form(KIM), form(LEE)) == scott_pi(rows)
    table = contingency_table(form(KIM), form(LEE))
    assert table.tolist() == contingency_table(rows).tolist()


@pytest.mark.parametrize(
    ("first", "second", "why"),
    [
        (KIM, LEE[:3], "got 5 and 3 labels"),
        ([KIM, LEE], LEE, "one sequence for each"),
        (
            pd.DataFrame({"Kim": KIM}),
            LEE,
            "one sequence for each, .* got DataFrame and list",
        ),
        (pl.DataFrame({"Kim": KIM}), LEE, "one sequence for each"),
        (pa.table({"Kim": KIM}), LEE, "one sequence for each"),
        (KIM, np.array([LEE]), "one sequence for each"),
        (KIM, dict.fromkeys("abcde"), "one sequence for each"),
        ("xyyxx", "xyxxx", "one sequence for each"),
        (
            pd.Series(KIM),
            pd.Series(LEE, index=range(1, 6)),
            "two Series with the same index",
        ),
        ([], [], "at least one item and one rater"),
    ],
)
def test_what_may_be_something_else_is_refused(
    first: Any, second: Any, why: str
) -> None:
    with pytest.raises(RatingsError, match=why):
        cohen_kappa(first, second)


# ---- names ----

ICC_NAMES = {
    "ICC(1)": ("ICC(1)", "ICC(1,1)", "ICC1", "icc_1"),
    "ICC(1,k)": ("ICC(1,k)", "ICC(k)", "ICC1k", "icc_1k", "ICC(1, k)"),
    "ICC(C,1)": ("ICC(C,1)", "ICC(3,1)", "ICC3", "icc3", "icc_c1"),
    "ICC(C,k)": ("ICC(C,k)", "ICC(3,k)", "ICC3k", "icc3k", "icc_ck"),
    "ICC(A,1)": ("ICC(A,1)", "ICC(2,1)", "ICC2", "icc2", "icc(2,1)", "icc_a1"),
    "ICC(A,k)": ("ICC(A,k)", "ICC(2,k)", "ICC2k", "ICC2K", "icc_2k", "icc_ak"),
}


@pytest.mark.parametrize("form", ICC_NAMES)
def test_names_of_an_intraclass_correlation(form: Any) -> None:
    for name in ICC_NAMES[form]:
        assert icc(MEASURES, form=name) == icc(MEASURES, form=form)
        assert icc_f_test(MEASURES, form=name) == icc_f_test(MEASURES, form=form)
        assert coefficient(name).title == form


def test_the_word_of_the_krippendorff_package() -> None:
    for metric in ("nominal", "ordinal", "interval", "ratio"):
        ours = krippendorff_alpha(MEASURES, metric=metric)  # type: ignore[arg-type]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert krippendorff_alpha(MEASURES, level_of_measurement=metric) == ours  # type: ignore[arg-type]


def test_raters_by_items_as_that_package_takes_them_are_refused() -> None:
    turned = [list(column) for column in zip(*MEASURES, strict=True)]
    with pytest.raises(ParameterError, match=r"4 rows and 5 columns .* transpose the"):
        krippendorff_alpha(turned, level_of_measurement="interval")
    assert krippendorff_alpha(turned, metric="interval").n_items == 4


KIM, LEE, ANN = [1, 1, 2, 2, 3, 3], [1, 1, 2, 3, 3, 3], [1, 2, 2, 2, 3, 3]
RATERS = {"Kim": KIM, "Lee": LEE}
SIX, TEXTS = [*range(1, 7)], ["p1", "p2", "p3", "p4", "p5", "p6"]
PAIRS = np.repeat(["d1", "d2", "d3"], 2)
TWO = ["Kim", "Lee"] * 3

ITEMS = {
    "item": {"item": SIX, **RATERS},
    "text": {"item": TEXTS, **RATERS},
    "spelling": {"Subject ID": SIX, **RATERS},
    "last": {**RATERS, "id": SIX},
    "of floats": {"item": [float(n) for n in SIX], **RATERS},
    "another name": {"code": TEXTS, **RATERS},
    "one rater": {"item": TEXTS, "Kim": KIM},
    "grades of text": {"patient": TEXTS, "Kim": list("xxyyzz"), "Lee": list("xxyzzz")},
}
LONG = {
    "names": ({"item": PAIRS, "rater": TWO, "grade": KIM}, "item rater grade"),
    "other names": (
        {"subject": PAIRS, "annotator": TWO, "score": KIM},
        "subject annotator score",
    ),
    "numbers": (
        {"grade": KIM, "rater": [1, 2] * 3, "item": np.repeat([1, 2, 3], 2)},
        "item rater grade",
    ),
    "one unknown": (
        {"doc": PAIRS, "rater": TWO, "label": list("xyxxyy")},
        "… rater label",
    ),
    "one unknown number": (
        {"subject": np.repeat([1, 2, 3], 2), "coder": [1, 2] * 3, "verdict": KIM},
        "subject coder …",
    ),
    "unknown": ({"doc": PAIRS, "who": TWO, "verdict": KIM}, "… … …"),
    "unknown text": ({"doc": PAIRS, "who": TWO, "verdict": list("xyxxyy")}, "… … …"),
    "more columns": (
        {"site": list("NNNSSS"), "item": PAIRS, "rater": TWO, "score": KIM},
        "item rater score",
    ),
}  # fmt: skip


@pytest.mark.parametrize("library", [pd.DataFrame, pl.DataFrame])
@pytest.mark.parametrize("case", ITEMS)
def test_a_column_of_items_is_refused(case: str, library: Any) -> None:
    frame, (name, *_) = pd.DataFrame(ITEMS[case]), ITEMS[case]
    name = "id" if case == "last" else name
    with pytest.raises(RatingsError, match=re.escape(f"agree(frame, item={name!r})")):
        fleiss_kappa(library(ITEMS[case]))
    if len(frame.columns) > 2:  # and what it suggests is right
        kappa = fleiss_kappa(frame.set_index(name)).value
        assert masrel.agree(frame, item=name).estimates[1].value == kappa


@pytest.mark.parametrize("library", [pd.DataFrame, pl.DataFrame])
@pytest.mark.parametrize("case", LONG)
def test_a_row_a_rating_is_refused(case: str, library: Any) -> None:
    data, names = LONG[case]
    roles = dict(zip(("item", "rater", "grade"), names.split(), strict=True))
    call = ", ".join(f"{k}={v if v == '…' else repr(v)}" for k, v in roles.items())
    with pytest.raises(RatingsError) as refused:
        fleiss_kappa(library(data))
    assert f"masrel.agree(frame, {call})" in str(refused.value)
    assert f"code_long(frame, {call})" in str(refused.value)
    if "…" not in names:  # and what it suggests is right
        frame = pd.DataFrame(data)
        kappa = fleiss_kappa(code_long(frame, **roles)).value  # type: ignore[arg-type]
        assert masrel.agree(frame, **roles).estimates[1].value == kappa  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "data",
    [
        RATERS,
        {1: KIM, 2: LEE, 3: ANN},
        {"rater": KIM, "rater 2": LEE},
        {"rater 1": list("xxyyzz"), "rater 2": list("xxyzzz")},
        {"label": KIM, "judge": LEE},
        {"model": KIM, "judge": LEE, "human": ANN},
        {"model": list("xxyyxy"), "reviewer": list("xxyxxy"), "author": list("xyyyxy")},
        {"item": KIM, "Kim": LEE},  # the items of no table
        {"model": SIX, "human": [2, 1, 3, 4, 6, 5]},
        {"model": [0.11, 0.52, 0.33, 0.74, 0.95, 0.16], "human": KIM},
        {"subject": [0.5, 1.5, 2.5], "observer": [0.6, 1.4, 2.5], "lab": [0.5, 1.6, 2]},
        {"Kim": ["a", None, "b"], "Lee": [None, "a", "b"]},
        {"one": ["a"], "two": ["b"], "three": ["c"]},
    ],
)  # fmt: skip
def test_frames_of_raters_rate_as_before(data: dict[Any, Any]) -> None:
    coefficient: Any = icc if isinstance(next(iter(data.values()))[0], float) else None
    coefficient = coefficient or fleiss_kappa
    frame = pd.DataFrame(data)
    assert coefficient(frame) == coefficient(frame.to_numpy().tolist())
    assert coefficient(pl.DataFrame({str(k): v for k, v in data.items()})).n_items


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
        assert f"{text!r} ×{n}" in str(noted[0].message)
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


def test_a_set_of_labels_is_a_category() -> None:
    sets = [[{"a"}, {"a", "b"}], [{"b", "a"}, frozenset("ab")], [set(), set()]]
    text = [["a", "a; b"], ["a; b", "a; b"], ["∅", "∅"]]
    assert fleiss_kappa(sets) == fleiss_kappa(text)
    scale = [{"a"}, {"a", "b"}, set()]
    declared = fleiss_kappa(sets, categories=scale)  # type: ignore[arg-type]
    assert declared.value == fleiss_kappa(text).value
    with pytest.raises(RatingsError, match="row 0, column 1: needs one of 'a' or"):
        fleiss_kappa(sets, categories=["a"])
    with pytest.raises(RatingsError, match="a semicolon, which separates them"):
        fleiss_kappa([[{"a;b"}, {"a"}]])

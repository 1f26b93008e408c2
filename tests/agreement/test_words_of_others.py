"""What callers of other packages write: two sequences, other names of a number."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

from masrel.agreement import (
    coefficient,
    cohen_kappa,
    contingency_table,
    icc,
    icc_f_test,
    krippendorff_alpha,
    limits_of_agreement,
    lin_ccc,
    scott_pi,
)
from masrel.errors import MasrelError, ParameterError, RatingsError

KIM, LEE = ["x", "y", "y", None, "x"], ["x", "y", "x", "x", "x"]
GRADES = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9]]


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


def test_two_sequences_of_measurements() -> None:
    first, second = [1.0, 3.0, 5.0, 6.5], [2.0, 3.5, 7.0, 6.0]
    rows = np.column_stack([first, second])
    assert lin_ccc(first, second) == lin_ccc(rows)
    assert limits_of_agreement(first, second).upper == limits_of_agreement(rows).upper


def test_missing_numbers_of_a_masked_array_are_missing() -> None:
    masked = np.ma.masked_equal([1, 2, 9, 1], 9)
    assert cohen_kappa(masked, [1, 2, 1, 2]) == cohen_kappa(
        [1, 2, None, 1], [1, 2, 1, 2]
    )


def test_ordered_categories_of_two_series_are_the_scale() -> None:
    kind = pd.CategoricalDtype(["mild", "none", "severe"], ordered=True)
    first, second = (
        pd.Series(labels, dtype=kind)
        for labels in (["mild", "severe", "mild"], ["none", "severe", "mild"])
    )
    value = cohen_kappa(first, second, weights="linear").value
    assert value == cohen_kappa([0, 2, 0], [1, 2, 0], weights="linear").value


@pytest.mark.parametrize(
    ("first", "second", "why"),
    [
        (KIM, LEE[:3], "got 5 and 3 labels"),
        ([KIM, LEE], LEE, "a sequence each"),
        (pd.DataFrame({"Kim": KIM}), LEE, "a sequence each, .* got DataFrame and list"),
        (pl.DataFrame({"Kim": KIM}), LEE, "a sequence each"),
        (pa.table({"Kim": KIM}), LEE, "a sequence each"),
        (KIM, np.array([LEE]), "a sequence each"),
        (KIM, dict.fromkeys("abcde"), "a sequence each"),
        ("xyyxx", "xyxxx", "a sequence each"),
        (pd.Series(KIM), pd.Series(LEE, index=range(1, 6)), "two Series of one index"),
        ([], [], "at least one of each"),
    ],
)
def test_what_may_be_something_else_is_refused(
    first: Any, second: Any, why: str
) -> None:
    with pytest.raises(RatingsError, match=why):
        cohen_kappa(first, second)


# ---- names ----

FORMS = {
    "ICC(1)": ("ICC(1)", "ICC(1,1)", "ICC1", "icc_1"),
    "ICC(1,k)": ("ICC(1,k)", "ICC(k)", "ICC1k", "icc_1k", "ICC(1, k)"),
    "ICC(C,1)": ("ICC(C,1)", "ICC(3,1)", "ICC3", "icc3", "icc_c1"),
    "ICC(C,k)": ("ICC(C,k)", "ICC(3,k)", "ICC3k", "icc3k", "icc_ck"),
    "ICC(A,1)": ("ICC(A,1)", "ICC(2,1)", "ICC2", "icc2", "icc(2,1)", "icc_a1"),
    "ICC(A,k)": ("ICC(A,k)", "ICC(2,k)", "ICC2k", "ICC2K", "icc_2k", "icc_ak"),
}
# other numbers elsewhere, such as Bliese's ICC(2), or none
NOT_FORMS = ("ICC(2)", "ICC(3)", "ICC(2,4)", "ICC", "ICC4", "2,1", "", None)


@pytest.mark.parametrize("form", FORMS)
def test_names_of_an_intraclass_correlation(form: Any) -> None:
    for name in FORMS[form]:
        assert icc(GRADES, form=name) == icc(GRADES, form=form)
        assert icc_f_test(GRADES, form=name) == icc_f_test(GRADES, form=form)
        assert coefficient(name).title == form


@pytest.mark.parametrize("name", NOT_FORMS)
def test_a_name_that_may_be_another_form_is_refused(name: Any) -> None:
    for call in (lambda: icc(GRADES, form=name), lambda: coefficient(name)):
        with pytest.raises(ParameterError, match="needs one of"):
            call()


def test_the_word_of_the_krippendorff_package() -> None:
    for metric in ("nominal", "ordinal", "interval", "ratio"):
        ours = krippendorff_alpha(GRADES, metric=metric)  # type: ignore[arg-type]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert krippendorff_alpha(GRADES, level_of_measurement=metric) == ours  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"level_of_measurement": "ordinl"}, "needs one of nominal"),
        ({"level_of_measurement": "ordinal", "metric": "ordinal"}, "one of them"),
        ({"level_of_measurement": "ordinal", "weights": "linear"}, "one of them"),
    ],
)
def test_a_wrong_level_of_measurement(options: Any, why: str) -> None:
    with pytest.raises(MasrelError, match=why):
        krippendorff_alpha(GRADES, **options)


def test_raters_by_items_as_that_package_takes_them_are_refused() -> None:
    turned = [list(column) for column in zip(*GRADES, strict=True)]
    with pytest.raises(ParameterError, match=r"4 rows and 5 columns .* turn the table"):
        krippendorff_alpha(turned, level_of_measurement="interval")
    assert krippendorff_alpha(turned, metric="interval").n_items == 4

"""What established packages get wrong, each on the smallest case that shows it.

The value that is right is derived, and the one that was printed is in a comment. None
of the packages is needed here.
"""

import math
from fractions import Fraction

import pandas as pd
import pytest

from masrel.agreement import (
    COEFFICIENTS,
    Coefficient,
    code_long,
    cohen_kappa,
    count_items,
    count_table,
    fleiss_kappa,
    fleiss_null,
    icc,
    icc_f_test,
    krippendorff_alpha,
    light_kappa,
    p_value,
    percent_agreement,
    stuart_maxwell,
)
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.intervals import analytic

# Three raters of whom the last two always agree.
THREE = [["a", "a", "a"], ["b", "b", "b"], ["a", "b", "b"]]

pooled = pytest.mark.parametrize(
    "entry",
    [
        pytest.param(entry, id=name)
        for name, entry in COEFFICIENTS.items()
        if entry.chance_corrected and entry.formula and entry.shape == "ratings"
    ],
)


def test_ten_comes_after_two() -> None:
    # irr::kappa2 and scikit-learn sort labels as strings: 1, 10, 2.
    # (1 1), (1 2), (10 10), linear by place: D_o = (1/2)/3; shares 2/3 0 1/3 and 1/3
    # each, D_e = 2/9 · 1/2 + 2/9 + 1/9 + 1/9 · 1/2 = 1/2: 2/3, and 1/4 with 10 between.
    text = [["1", "1"], ["1", "2"], ["10", "10"]]
    found = cohen_kappa(text, categories=["1", "2", "10"], weights="linear")
    assert found.value == pytest.approx(float(Fraction(2, 3)), abs=1e-14)
    # Numbers count by value: D_o = (1/9)/3, D_e = 2/81 + 18/81 + 9/81 + 8/81 = 37/81.
    numbers = cohen_kappa([[int(g) for g in row] for row in text], weights="linear")
    assert numbers.value == pytest.approx(34 / 37, abs=1e-14)


def test_one_plus_comes_where_the_scale_has_it() -> None:
    # Strings: 1, 1+, 1-. The same three items on a scale from 1- to 1+: 2/3, and 1/4
    # with 1 below both of the others.
    text = [["1-", "1-"], ["1-", "1"], ["1+", "1+"]]
    found = cohen_kappa(text, categories=["1-", "1", "1+"], weights="linear")
    assert found.value == pytest.approx(float(Fraction(2, 3)), abs=1e-14)


def test_a_category_that_nobody_used_keeps_its_place() -> None:
    # irr::kappa2 weighs the categories met as if they were neighbours. (I II), (IV IV),
    # quadratic, of four: D_o = (1/9)/2, D_e = (1/9 + 1 + 4/9 + 0)/4 = 7/18: 1 - 1/7. As
    # neighbours: D_o = (1/4)/2, D_e = (1/4 + 1 + 1/4 + 0)/4 = 3/8: 2/3.
    scale = ["I", "II", "III", "IV"]
    table = [["I", "II"], ["IV", "IV"]]
    found = cohen_kappa(table, categories=scale, weights="quadratic")
    assert found.value == pytest.approx(6 / 7, abs=1e-14)


def test_alpha_of_complete_ratings_of_three_raters() -> None:
    # irr::kripp.alpha counts every pair twice where nothing is missing, and so 18
    # ratings: 1 - (18 - 1)/2 · 2/40 = 0.575.
    # a a b, b b b, a a a: A = 4/2, five a and four b: B = 2 · 20: 1 - (9 - 1) · 2/40.
    table = [["a", "a", "b"], ["b", "b", "b"], ["a", "a", "a"]]
    assert krippendorff_alpha(table).value == pytest.approx(0.6, abs=1e-14)
    # A rating less, and all is as before: of 8, A = 2, B = 2 · 16.
    holed = [*table[:2], ["a", "a", None]]
    assert krippendorff_alpha(holed).value == 1 - 7 * 2 / 32


def test_p_value_of_lights_kappa_is_that_of_its_error() -> None:
    # irr::kappam.light prints z = 0.014 for kappa 0.76 of 400 items by four raters.
    # 0.6 with an error of 0.32 (derived where Light's kappa is tested): t = 15/8, with
    # two degrees p = 1 - t/√(t² + 2).
    t = 15 / 8
    assert p_value(light_kappa(THREE)) == pytest.approx(1 - t / math.sqrt(t * t + 2))


def test_interval_of_the_mean_of_raters_is_that_of_one_stepped_up() -> None:
    # irr and rel take degrees of freedom at ICC(A,k) where ICC(A,1) is meant, and print
    # 0.039 to 0.929 for Shrout and Fleiss' table; psych prints 0.071 to 0.927.
    table = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9]]
    table.append([6, 2, 4, 7])
    single, mean = icc(table).interval, icc(table, form="ICC(A,k)").interval
    assert single is not None
    assert mean is not None
    assert (mean.low, mean.high) == pytest.approx((0.0711, 0.9272), abs=5e-5)
    for of_mean, rho in ((mean.low, single.low), (mean.high, single.high)):
        assert of_mean == pytest.approx(4 * rho / (1 + 3 * rho), rel=1e-13)
    # and a p of the hypothesis that it is 0: F(5, 15), not F(5, 4.2)
    assert icc_f_test(table, form="ICC(A,k)").df == (5.0, 15.0)


def test_a_category_of_equal_margins_is_tested_with_the_others() -> None:
    # irr::stuart.maxwell.mh drops it. One change 1 to 2, one 2 to 3: d = (1, 0, -1),
    # V = [[1, -1], [-1, 2]] of the first two, its inverse's corner 2: X = 2 with two
    # degrees; without the category in the middle X = 1 with one.
    found = stuart_maxwell([[0, 1, 0], [0, 0, 1], [0, 0, 0]])
    assert found.statistic == pytest.approx(2.0, rel=1e-14)
    assert found.df == (2.0,)
    assert found.p_value == pytest.approx(math.exp(-1.0), rel=1e-13)


def test_error_of_weighted_kappa_tells_rows_from_columns() -> None:
    # psych takes the rows' mean weights for the columns'; only a table that is not
    # symmetric shows it. Rows 3 2 1, columns 2 2 2 of 6, linear: p_o = 5/6, p_e = 5/9,
    # kappa 5/8. Mean weights of rows 1/2, 2/3, 1/2 (from columns' shares), of columns
    # 2/3, 2/3, 1/3. Terms w - (3/8)(row + column), in sixteenths: 9 twice, 1, 8, 2, 11:
    # Σ = 352/1536 = 33/144; less (kappa - p_e (1 - kappa))² = 25/144: 1/18, over (4/9)²
    # 9/32. Over n - 1 = 5. Turned round: 9 twice, 0, 8, 1, 11, and 87/1280.
    table = [[2, 1, 0], [0, 1, 1], [0, 0, 1]]
    found = cohen_kappa(count_table(table), weights="linear")
    assert found.value == 0.625
    assert found.standard_error == pytest.approx(math.sqrt(9 / 160), rel=1e-13)


def test_p_of_a_negative_kappa_is_a_probability() -> None:
    # irrCAC: 2 (1 - P(T < t)), up to 2, or one-sided. kappa -1/3 with error 4/9
    # (derived where Fleiss' kappa is tested): t = -3/4 with one degree of freedom:
    # 1 - (2/π) atan(3/4) = 0.590, and not 1.410.
    found = p_value(fleiss_kappa([["a", "a"], ["a", "b"]]))
    assert found == pytest.approx(1 - 2 / math.pi * math.atan(0.75), rel=1e-13)


@pooled
def test_one_item_has_a_value_and_no_error(entry: Coefficient) -> None:
    # irrCAC (Python): ZeroDivisionError.
    found = entry([["a", "b"]], categories=["a", "b"])
    assert found.reason is None
    assert found.value <= 0.0
    assert math.isnan(found.standard_error)


@pooled
def test_one_category_is_a_reason_and_no_error(entry: Coefficient) -> None:
    # Every package its own: nan, 1, 0, ZeroDivisionError, ValueError.
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        found = entry([["a", "a"], ["a", "a"]], categories=["a"])
    assert math.isnan(found.value)
    assert "0/0" in (found.reason or "")


def test_items_may_have_different_numbers_of_raters() -> None:
    # statsmodels: AssertionError. (2 0), (1 2), (0 2): P = 1, 1/3, 1: 7/9; shares 1,
    # 1/3, 0: 4/9 and 5/9: p_e = 41/81: (63 - 41)/(81 - 41).
    found = fleiss_kappa(count_items([[2, 0], [1, 2], [0, 2]]))
    assert found.value == pytest.approx(float(Fraction(22, 40)), abs=1e-14)


@pytest.mark.parametrize("gap", [None, math.nan, pd.NA, pd.NaT])
def test_what_is_missing_is_no_category(gap: object) -> None:
    # statsmodels' aggregate_raters counts nan as one more: all agree here.
    found = percent_agreement([["a", "a", gap], ["b", "b", gap]])
    assert (found.value, found.n_categories, found.n_raters) == (1.0, 2, 2)
    assert fleiss_kappa([["a", "a", gap], ["b", "b", gap]]).value == 1.0


def test_fleiss_kappa_has_an_error() -> None:
    # statsmodels: none. 4/9, derived where Fleiss' kappa is tested.
    found = fleiss_kappa([["a", "a"], ["a", "b"]]).standard_error
    assert found == pytest.approx(4 / 9, rel=1e-14)


def test_repeated_ratings_are_named_and_not_averaged() -> None:
    # pingouin takes the mean, of 1 and 3 a 2 that nobody gave.
    frame = pd.DataFrame(
        [("x", "Kim", 1), ("x", "Kim", 3), ("x", "Lee", 2), ("y", "Kim", 1)],
        columns=["item", "rater", "grade"],
    )
    with pytest.raises(RatingsError, match="'x' by 'Kim'"):
        code_long(frame)


def test_nothing_is_rounded() -> None:
    # pingouin: two decimals of the ends of intervals.
    interval = icc([[1, 2], [3, 3], [5, 4]]).interval
    assert interval is not None
    for end in (interval.low, interval.high):
        assert end != round(end, 6)
    assert fleiss_kappa([["a", "a"], ["a", "b"]]).value == pytest.approx(
        -1 / 3, abs=1e-16
    )


def test_a_mistyped_option_is_named_with_those_there_are() -> None:
    # The package krippendorff says that a 'str' object is not callable.
    said = "metric: needs one of nominal, ordinal, interval, ratio, .* got 'ordinl'"
    with pytest.raises(ParameterError, match=said):
        krippendorff_alpha([[1, 2], [2, 2]], metric="ordinl")  # type: ignore[arg-type]
    with pytest.raises(
        ParameterError, match=r"weights: needs one of identity, .*'linr'"
    ):
        fleiss_kappa([[1, 2], [2, 2]], weights="linr")  # type: ignore[arg-type]


def test_the_error_without_agreement_makes_no_interval() -> None:
    # Several: kappa ± 1.96 of the error under the hypothesis that it is 0. Ten items
    # a a, ten b b and two a b: kappa ± t(21) of its own error, which is smaller.
    table = [["a", "a"]] * 10 + [["b", "b"]] * 10 + [["a", "b"]] * 2
    found = fleiss_kappa(table)
    interval = analytic("fleiss_kappa", table, target="items")
    # t(21; .975) of any table of Student's t
    assert found.value - interval.low == pytest.approx(
        2.0796 * found.standard_error, 1e-4
    )
    # under the hypothesis √(2/(N n (n - 1))) = √(1/22): its interval would be other
    under_it = found.value / fleiss_null(table).statistic
    assert under_it == pytest.approx(math.sqrt(1 / 22), rel=1e-13)
    assert under_it > 1.5 * found.standard_error


def test_ordinal_weights_and_ordinal_metric_are_two_things() -> None:
    # irrCAC's weights go by places: 1/3 between neighbours of three, else 1. Three 1,
    # one 2, two 3: A = 2/3, B = 2 (3 · 1/3 + 6 · 1 + 2 · 1/3) = 46/3:
    # 1 - 5 · (2/3)/(46/3) = 18/23.
    # Krippendorff's metric goes by the ratings between, half of those at the ends: 1 to
    # 2 (3 + 1)/2, 2 to 3 (1 + 2)/2, 1 to 3 3/2 + 1 + 1, squared 4, 9/4, 49/4. A = 8,
    # B = 2 (3 · 4 + 6 · 49/4 + 2 · 9/4) = 180: 1 - 5 · 8/180 = 7/9.
    table = [[1, 1], [1, 2], [3, 3]]
    assert krippendorff_alpha(table, weights="ordinal").value == float(Fraction(18, 23))
    assert krippendorff_alpha(table, metric="ordinal").value == float(Fraction(7, 9))

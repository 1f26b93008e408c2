"""Intraclass correlations: Shrout and Fleiss' table, scipy's F, hand-worked means."""

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from masrel.agreement import (
    COEFFICIENTS,
    IccForm,
    icc,
    icc_f_test,
    variance_components,
)
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning

FORMS = get_args(IccForm)

# Shrout and Fleiss (1979), Table 2: six targets, four judges.
TABLE_2 = [
    [9, 2, 5, 8],
    [6, 1, 3, 2],
    [8, 4, 6, 8],
    [7, 1, 2, 6],
    [10, 5, 6, 9],
    [6, 2, 4, 7],
]


def test_shrout_and_fleiss_worked_in_whole_numbers() -> None:
    # Row sums 24, 12, 26, 16, 30, 19 (127), column sums 46, 15, 26, 40, Σx² = 841.
    # With 127²/24 = 16129/24: SS_rows = (576 + 144 + 676 + 256 + 900 + 361)/4 - C
    # = 2913/4 - C = 1349/24; SS_columns = (2116 + 225 + 676 + 1600)/6 - C
    # = 4617/6 - C = 2339/24; SS_total = 841 - C = 4055/24; residual 367/24.
    rows, columns, residual = 1349 / 24 / 5, 2339 / 24 / 3, 367 / 24 / 15
    within = (2339 + 367) / 24 / 18
    by_hand = {
        "ICC(1)": (rows - within) / (rows + 3 * within),
        "ICC(1,k)": (rows - within) / rows,
        "ICC(C,1)": (rows - residual) / (rows + 3 * residual),
        "ICC(C,k)": (rows - residual) / rows,
        "ICC(A,1)": (rows - residual)
        / (rows + 3 * residual + 4 * (columns - residual) / 6),
        "ICC(A,k)": (rows - residual) / (rows + (columns - residual) / 6),
    }
    for form, value in by_hand.items():
        found = icc(TABLE_2, form=form)  # type: ignore[arg-type]
        assert found.value == pytest.approx(value, rel=1e-14)
        assert (found.n_items, found.n_raters) == (6, 4)
        assert found.weights == "identity"
        assert COEFFICIENTS[found.coefficient].title == form


def test_variances_of_shrout_and_fleiss_by_hand() -> None:
    rows, columns, residual = 1349 / 24 / 5, 2339 / 24 / 3, 367 / 24 / 15
    result = variance_components(1000 * np.array(TABLE_2) + 7)
    by_hand = [(rows - residual) / 4, (columns - residual) / 6, residual]
    parts = [result.items, result.raters, result.residual]
    assert parts == pytest.approx([1e6 * part for part in by_hand], rel=1e-14)
    assert (result.method, result.negative, result.reason) == ("ANOVA", (), None)


def test_a_variance_below_0_is_0_and_named() -> None:
    # means 3/2 of every item: mean squares 0 and, of the residual, 2/3
    result = variance_components([[1, 2], [2, 1], [1, 2]])
    assert (result.items, result.raters) == (0.0, 0.0)
    assert result.residual == pytest.approx(2 / 3)
    assert result.negative == ("items", "raters")


def test_intervals_from_the_quantiles_of_f() -> None:
    # one-way, of Shrout and Fleiss: F/F(.975; 5, 18) and F · F(.975; 18, 5)
    f = icc_f_test(TABLE_2, form="ICC(1)").statistic
    low, high = f / stats.f.ppf(0.975, 5, 18), f * stats.f.ppf(0.975, 18, 5)
    found = icc(TABLE_2, form="ICC(1)").interval
    assert found is not None
    assert found.low == pytest.approx((low - 1) / (low + 3), rel=1e-9)
    assert found.high == pytest.approx((high - 1) / (high + 3), rel=1e-9)
    # of the mean of k: 1 - 1/F
    found = icc(TABLE_2, form="ICC(1,k)").interval
    assert found is not None
    assert found.low == pytest.approx(1 - 1 / low, rel=1e-9)
    f = icc_f_test(TABLE_2, form="ICC(C,1)").statistic
    low = f / stats.f.ppf(0.95, 5, 15)
    found = icc(TABLE_2, form="ICC(C,1)", level=0.9).interval
    assert found is not None
    assert found.low == pytest.approx((low - 1) / (low + 3), rel=1e-9)
    assert (found.level, found.kind, found.target) == (0.9, "confidence", "items")


def test_published_interval_of_absolute_agreement() -> None:
    # as R's psych and irr print it for Table 2: ICC(A,1) 0.29 (0.019, 0.761)
    found = icc(TABLE_2, interval="F").interval
    assert found is not None
    assert (found.low, found.high) == pytest.approx((0.0188, 0.7611), abs=5e-4)
    assert (found.target, found.method) == ("both", "F distribution")
    assert icc(TABLE_2).interval != found
    for form in ("ICC(1)", "ICC(C,k)"):  # exact by F, whatever is asked for
        assert icc(TABLE_2, form=form, interval="F") == icc(TABLE_2, form=form)  # type: ignore[arg-type]


def test_a_missing_cell_changes_the_interval_of_agreement_by_little() -> None:
    rng = np.random.default_rng(2)
    ratings = rng.normal(size=(60, 1)) + [0.9, 0.0, -0.4] + rng.normal(size=(60, 3)) / 2
    for form in ("ICC(A,1)", "ICC(A,k)"):
        whole = icc(ratings, form=form).interval  # type: ignore[arg-type]
        gap = ratings.copy()
        gap[0, 0] = np.nan
        other = icc(gap, form=form).interval  # type: ignore[arg-type]
        assert whole is not None
        assert other is not None
        assert (whole.low, whole.high) == pytest.approx(
            (other.low, other.high), abs=3e-3
        )
        assert whole.method == "profile likelihood"


def test_a_value_below_0_draws_the_interval_out_to_it() -> None:
    found = icc([[1, 4, 2], [4, 1, 3], [2, 3, 3], [3, 2, 2]])
    assert found.interval is not None
    assert found.interval.low == found.value < 0.0 < found.interval.high
    assert "takes a variance as less than 0" in found.interval.notes[0]
    assert icc(TABLE_2).interval.notes == ()  # type: ignore[union-attr]


tables = st.integers(2, 4).flatmap(
    lambda k: st.lists(
        st.lists(st.integers(0, 9), min_size=k, max_size=k), min_size=3, max_size=7
    ).map(np.array)
)


@given(tables.filter(lambda table: table.var(axis=1).sum() > 0))
def test_one_way_f_against_scipy(table: "np.ndarray[tuple[int, int]]") -> None:  # type: ignore[type-var]
    if (table.mean(axis=1) == table.mean()).all():
        table = table + np.arange(len(table))[:, None]
    other = stats.f_oneway(*table)
    found = icc_f_test(table, form="ICC(1)")
    assert found.statistic == pytest.approx(other.statistic, rel=1e-9)
    assert found.p_value == pytest.approx(other.pvalue, rel=1e-8)
    n, k = table.shape
    assert found.df == (n - 1, n * (k - 1))


def test_a_rater_who_is_stricter_matters_to_agreement_alone() -> None:
    table = np.array(TABLE_2)
    stricter = table + np.array([0, 3, -2, 7])
    for form in ("ICC(C,1)", "ICC(C,k)"):
        same = icc(table, form=form).value  # type: ignore[arg-type]
        assert icc(stricter, form=form).value == pytest.approx(same, rel=1e-13)  # type: ignore[arg-type]
    for form in ("ICC(A,1)", "ICC(1)"):
        assert icc(stricter, form=form).value < icc(table, form=form).value  # type: ignore[arg-type]


@pytest.mark.parametrize("form", FORMS)
def test_perfect_agreement_is_one_and_so_is_its_interval(form: IccForm) -> None:
    found = icc([[1, 1, 1], [2, 2, 2], [5, 5, 5]], form=form)
    assert found.value == 1.0
    assert found.interval is not None
    assert found.interval.low == found.interval.high == 1.0
    test = icc_f_test([[1, 1, 1], [2, 2, 2], [5, 5, 5]], form=form)
    assert (test.statistic, test.p_value) == (math.inf, 0.0)


def test_text_counts_by_rank_and_numbers_by_value() -> None:
    scale = ["1", "1+", "2"]
    text = [["1", "1+"], ["2", "2"], ["1+", "1"]]
    assert icc(text, categories=scale).value == icc([[1, 2], [3, 3], [2, 1]]).value
    uneven = icc([[1, 2], [4, 4], [2, 1]], categories=[1, 2, 4])
    assert uneven.value == icc(np.array([[1, 2], [4, 4], [2, 1]])).value
    with pytest.raises(RatingsError, match=r"declared scale in order.*text"):
        icc(text)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("table", "why"),
    [
        ([[1, 2]], "fewer than two items"),
        ([[1], [2]], "fewer than two raters"),
        ([[3, 3], [3, 3]], "0/0: neither items nor ratings"),
    ],
)
def test_undefined_with_a_reason(
    form: IccForm, table: list[list[int]], why: str
) -> None:
    for function in (icc, icc_f_test):
        with pytest.warns(UndefinedStatisticWarning, match=why):
            found = function(table, form=form)  # type: ignore[operator]
        assert why in found.reason
    assert math.isnan(found.p_value)


def test_mean_of_raters_on_items_that_do_not_differ_is_a_division_by_zero() -> None:
    # items' means are equal, ratings within are not: (0 - W)/0
    with pytest.warns(UndefinedStatisticWarning, match="division by 0"):
        assert math.isnan(icc([[1, 2], [2, 1]], form="ICC(1,k)").value)
    # F is 0 and says: no difference, whatever the total variance is
    for form in FORMS:
        found = icc_f_test([[1, 2], [2, 1]], form=form)
        assert (found.statistic, found.p_value, found.reason) == (0.0, 1.0, None)


def test_wrong_options_are_one_sentence() -> None:
    with pytest.raises(
        ParameterError, match=r"form: needs one of ICC\(1\), .*'ICC\(2\)'"
    ):
        icc(TABLE_2, form="ICC(2)")
    with pytest.raises(ParameterError, match=r"interval: needs one of auto, .*, F"):
        icc(TABLE_2, interval="f")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match='interval: "F" needs every rating'):
        icc([*TABLE_2, [1, 2, 3, None]], interval="F")
    for level in (0.0, 1.0, 95, math.nan):
        with pytest.raises(ParameterError, match=r"level: needs \(0, 1\), got"):
            icc(TABLE_2, level=level)


def test_the_interval_of_a_mean_has_no_end_beyond_its_pole() -> None:
    # Spearman and Brown's 2 ρ / (1 + ρ) falls to -∞ at ρ = -1; the low end of
    # ICC(A,1) lies below that here, so that of ICC(A,2) has no bound.
    ratings = np.array([[2, 2], [5, 4], [2, 3]])
    single = icc(ratings, form="ICC(A,1)", interval="F")
    mean = icc(ratings, form="ICC(A,k)", interval="F")
    assert single.interval is not None
    assert mean.interval is not None
    assert single.interval.low < -1 < single.interval.high < 1
    high = single.interval.high
    assert mean.interval.low == -math.inf
    assert mean.interval.high == pytest.approx(2 * high / (1 + high), rel=1e-14)


@pytest.mark.parametrize("factor", [1e150, 1e-160, 1e-300, 1e300])
def test_ratings_times_any_number_have_the_same_icc(factor: float) -> None:
    ratings = np.random.default_rng(0).normal(size=(10, 3))
    assert icc(ratings * factor).value == pytest.approx(icc(ratings).value, rel=1e-13)
    table = (ratings * factor).tolist()
    assert icc(table).value == pytest.approx(icc(ratings).value, rel=1e-13)

"""Intraclass correlations: Shrout and Fleiss' table, scipy's F, hand-worked means."""

import math

import numpy as np
import pytest

from masrel.agreement import (
    icc,
    variance_components,
)
from masrel.errors import ParameterError, RatingsError

# Shrout and Fleiss (1979), Table 2: six targets, four judges.
TABLE_2 = [
    [9, 2, 5, 8],
    [6, 1, 3, 2],
    [8, 4, 6, 8],
    [7, 1, 2, 6],
    [10, 5, 6, 9],
    [6, 2, 4, 7],
]


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


def test_text_counts_by_rank_and_numbers_by_value() -> None:
    scale = ["1", "1+", "2"]
    text = [["1", "1+"], ["2", "2"], ["1+", "1"]]
    assert icc(text, categories=scale).value == icc([[1, 2], [3, 3], [2, 1]]).value
    uneven = icc([[1, 2], [4, 4], [2, 1]], categories=[1, 2, 4])
    assert uneven.value == icc(np.array([[1, 2], [4, 4], [2, 1]])).value
    with pytest.raises(RatingsError, match=r"declared scale in order.*text"):
        icc(text)


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
        with pytest.raises(
            ParameterError, match=r"level: needs a number in \(0, 1\), got"
        ):
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

"""Lin's concordance: R's epiR, moments by hand, a jackknife, simulated coverage."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from masrel.agreement import icc, lin_ccc
from masrel.errors import ParameterError, UndefinedStatisticWarning

(SETTING,) = (
    setting
    for setting in json.loads(
        (Path(__file__).parents[1] / "oracles" / "measurement.json").read_text("utf-8")
    )["settings"]
    if setting["kind"] == "lin_ccc"
)
PAIRS = np.column_stack([SETTING["data"]["x"], SETTING["data"]["y"]])


def test_value_error_and_interval_are_those_of_epir() -> None:
    expected = SETTING["reference"]
    result = lin_ccc(PAIRS)
    assert result.value == pytest.approx(expected["ccc_divisor_n"], rel=1e-8)
    assert result.standard_error == pytest.approx(expected["se"], rel=1e-8)
    assert result.interval is not None
    ends = (result.interval.low, result.interval.high)
    assert ends == pytest.approx(expected["ci_z"], rel=1e-8)
    assert result.interval.target == "items"


def test_by_hand() -> None:
    # x 1, 3, 5 and y 2, 3, 7: variances over 3 are 8/3 and 14/3, the covariance 10/3,
    # the means 3 and 4: 2 · 10/3 / (8/3 + 14/3 + 1) = 20/25
    ratings = [[1, 2], [3, 3], [5, 7]]
    assert lin_ccc(ratings).value == pytest.approx(20 / 25, rel=1e-14)


def test_of_three_raters_pairs_are_added_up() -> None:
    ratings = np.array([[1.0, 2, 1], [3, 3, 4], [5, 7, 6], [2, 1, 4]])
    numerator = denominator = 0.0
    for first, second in ((0, 1), (0, 2), (1, 2)):
        x, y = ratings[:, first], ratings[:, second]
        numerator += 2.0 * float(np.mean((x - x.mean()) * (y - y.mean())))
        denominator += float(x.var() + y.var() + (x.mean() - y.mean()) ** 2)
    result = lin_ccc(ratings)
    assert result.value == pytest.approx(numerator / denominator, rel=1e-13)
    assert (result.n_items, result.n_raters) == (4, 3)


def test_error_of_three_raters_is_that_of_a_jackknife() -> None:
    rng = np.random.default_rng(5)
    ratings = (
        rng.normal(size=(2000, 1)) + 0.6 * rng.normal(size=(2000, 3)) + [0, 0.2, 1]
    )
    result = lin_ccc(ratings)
    parts = np.array([lin_ccc(np.delete(ratings, i, axis=0)).value for i in range(400)])
    # of the first 400 items alone: their share of the sum of squares, which is random
    error = math.sqrt(1999 / 400 * ((parts - result.value) ** 2).sum())
    assert result.standard_error == pytest.approx(error, rel=0.15)


def test_interval_of_three_raters_leaves_out_each_item() -> None:
    ratings = np.array([[1.0, 2, 1], [3, 3, 4], [5, 7, 6], [2, 1, 4], [6, 6, 7]])
    z = [math.atanh(lin_ccc(np.delete(ratings, i, axis=0)).value) for i in range(5)]
    width = stats.t.ppf(0.975, 4) * math.sqrt(4 / 5 * np.sum((z - np.mean(z)) ** 2))
    result = lin_ccc(ratings)
    assert result.interval is not None
    ends = np.tanh(math.atanh(result.value) + width * np.array([-1.0, 1.0]))
    assert (result.interval.low, result.interval.high) == pytest.approx(ends, rel=1e-10)
    assert result.interval.method == "item jackknife, t(4) on Fisher's z"


@given(
    st.lists(st.tuples(*[st.integers(0, 9)] * 3), min_size=3, max_size=8, unique=True)
)
def test_with_itself_shifted_it_falls(rows: list[tuple[int, int, int]]) -> None:
    ratings = np.array(rows, dtype=float)
    if (ratings == ratings[0, 0]).all():
        return
    value = lin_ccc(ratings).value
    assert -1.0 - 1e-12 <= value <= 1.0
    for moved in (ratings + 100.0, -2.0 * ratings, ratings * 1e200, ratings[:, ::-1]):
        assert lin_ccc(moved).value == pytest.approx(value, rel=1e-9, abs=1e-12)
    shifted = ratings + np.array([100.0, 0.0, 0.0])
    assert abs(lin_ccc(shifted).value) <= abs(value) + 1e-12


def test_it_is_near_icc_of_absolute_agreement() -> None:
    # which has the same terms with n - 1
    rng = np.random.default_rng(1)
    ratings = rng.normal(size=(3000, 1)) + rng.normal(size=(3000, 2)) + [0.0, 0.5]
    assert lin_ccc(ratings).value == pytest.approx(icc(ratings).value, rel=2e-3)


def test_perfect_agreement_is_one_and_so_is_its_interval() -> None:
    for ratings in ([[1, 1], [4, 4], [6, 6]], [[1] * 3, [4] * 3, [6] * 3]):
        result = lin_ccc(ratings)
        assert result.value == 1.0
        assert result.interval is not None
        assert (result.interval.low, result.interval.high) == (1.0, 1.0)


def test_undefined_with_a_reason() -> None:
    for ratings, why in (
        ([[1, 2], [3, None]], "fewer than two items are rated by every rater"),
        ([[1], [2]], "fewer than two raters"),
        ([[2, 2], [2, 2]], "0/0: all ratings are the same"),
    ):
        with pytest.warns(UndefinedStatisticWarning, match=why):
            result = lin_ccc(ratings)
        assert math.isnan(result.value)
        assert result.interval is None
    for rows in ([[1, 2], [3, 4]], [[1, 2], [1, 4], [1, 1]]):
        result = lin_ccc(rows)
        assert result.interval is not None
        assert math.isnan(result.interval.low)
        assert result.interval.reason is not None


def test_wrong_level_is_one_sentence() -> None:
    with pytest.raises(ParameterError, match=r"level: needs \(0, 1\), got 2"):
        lin_ccc(PAIRS, level=2)


@pytest.mark.slow
@pytest.mark.parametrize("k", [2, 3])
def test_coverage_of_fishers_z(k: int) -> None:
    # 2000 studies of 40 items; binomial error .005, and what a law of large numbers
    # misses at 40 items
    rng, covered = np.random.default_rng(9), 0
    levels = np.array([0.0, 0.4, 0.2])[:k]
    pairs = [(i, j) for i in range(k) for j in range(i)]
    apart = np.mean([(levels[i] - levels[j]) ** 2 for i, j in pairs])
    truth = 2.0 / (2.0 * 1.5 + apart)
    for _ in range(2000):
        ratings = rng.normal(size=(40, 1)) + 0.5**0.5 * rng.normal(size=(40, k))
        interval = lin_ccc(ratings + levels).interval
        assert interval is not None
        covered += interval.low <= truth <= interval.high
    assert 0.93 <= covered / 2000 <= 0.965

"""Lin's concordance: R's epiR, moments by hand, a jackknife, simulated coverage."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from masrel.agreement import lin_ccc
from masrel.errors import UndefinedStatisticWarning

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


def test_interval_of_three_raters_leaves_out_each_item() -> None:
    ratings = np.array([[1.0, 2, 1], [3, 3, 4], [5, 7, 6], [2, 1, 4], [6, 6, 7]])
    z = [math.atanh(lin_ccc(np.delete(ratings, i, axis=0)).value) for i in range(5)]
    width = stats.t.ppf(0.975, 4) * math.sqrt(4 / 5 * np.sum((z - np.mean(z)) ** 2))
    result = lin_ccc(ratings)
    assert result.interval is not None
    ends = np.tanh(math.atanh(result.value) + width * np.array([-1.0, 1.0]))
    assert (result.interval.low, result.interval.high) == pytest.approx(ends, rel=1e-10)
    assert result.interval.method == "item jackknife, t(4) on Fisher's z"


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
    # fewer than three items; a rater without variance; no item moves the value
    no_error = [[1, 2], [3, 4]], [[1, 2], [1, 4], [1, 1]], [[1, 1, 1], [1, 1, 2]] * 2
    for rows in no_error:
        result = lin_ccc(rows)
        assert result.interval is not None
        assert math.isnan(result.interval.low)
        assert result.interval.reason is not None

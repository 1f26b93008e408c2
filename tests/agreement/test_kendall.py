"""Kendall's W: ranks by hand, a published table, plain fractions, Friedman's test."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import kendall_w, kendall_w_test

Array = NDArray[Any]

# Siegel (1956), Nonparametric Statistics, ch. 9: three sets of ranks of ten things,
# with ties, thing by thing.
SIEGEL = [
    [1, 2.5, 2],
    [4.5, 1, 1],
    [2, 2.5, 4.5],
    [4.5, 4.5, 4.5],
    [3, 4.5, 4.5],
    [7.5, 8, 4.5],
    [6, 9, 8],
    [9, 6.5, 8],
    [7.5, 10, 8],
    [10, 6.5, 10],
]


def test_published_ranks_with_ties() -> None:
    # There: s = 591, W = .828, and .796 without the correction. ΣT = 6 + 6, 6 + 6 + 6,
    # 60 + 24 = 114; 12 · 591 / (9 · 990 - 3 · 114) = 7092/8568.
    found = kendall_w(SIEGEL)
    assert found.value == pytest.approx(0.828, abs=5e-4)
    assert found.value == 7092 / 8568
    assert kendall_w(SIEGEL, ties=False).value == pytest.approx(0.796, abs=5e-4)
    # chi-squared = 3 · 9 · .828 = 22.35 with 9, beyond the 1 % point 21.67
    test = kendall_w_test(SIEGEL)
    assert test.statistic == pytest.approx(27 * 7092 / 8568, rel=1e-15)
    assert (test.df, test.n_items) == ((9.0,), 10)
    assert 0.001 < test.p_value < 0.01


def weighted_w(ratings: list[list[int]], shares: Array, *, ties: bool) -> Any:
    """W of items that are so large shares of very many, ties being raters' own."""
    x = np.array(ratings)
    below = (x[:, None] < x) + 0.5 * (x[:, None] == x)  # [i, j, rater]: of i below j
    ranks = np.einsum("i,ijr->jr", shares, below) - 0.5
    squares = (shares[:, None] * ranks**2).sum(axis=0)
    spread = squares.sum() if ties else x.shape[1] / 12.0
    return (shares * ranks.sum(axis=1) ** 2).sum() / (x.shape[1] * spread)


@pytest.mark.parametrize("ties", [True, False])
@pytest.mark.parametrize("levels", [3, 1000])
def test_the_error_is_of_what_each_item_moves_w_by(ties: bool, levels: int) -> None:
    ratings = np.random.default_rng(levels).integers(0, levels, (15, 4)).tolist()
    even = np.full(15, 1 / 15)
    moves = np.array([
        weighted_w(ratings, even + 1e-30j * (np.eye(15)[i] - even), ties=ties).imag
        for i in range(15)
    ])  # fmt: skip
    found = kendall_w(ratings, ties=ties)
    scale = 1.0 if ties else 1.0 / (1.0 - 1.0 / 15**2)  # (n³ - n)/n³
    error = scale * 1e30 * math.sqrt((moves**2).sum() / (14 * 13))
    assert found.standard_error == pytest.approx(error, rel=1e-9)


def test_the_interval_is_students_t_on_the_logit() -> None:
    found = kendall_w(SIEGEL, level=0.9)
    assert found.interval is not None
    low, high = (
        math.log(x / (1 - x)) for x in (found.interval.low, found.interval.high)
    )
    w = found.value
    assert (low + high) / 2 == pytest.approx(math.log(w / (1 - w)), rel=1e-9)
    t = stats.t.ppf(0.95, found.n_items - 1)
    error = found.standard_error / (w * (1 - w))
    assert (high - low) / 2 == pytest.approx(t * error, rel=1e-9)
    assert (found.interval.target, found.interval.level) == ("items", 0.9)
    for table in ([[1, 1], [2, 2], [3, 3]], [[1, 2], [2, 1]]):
        nothing = kendall_w(table).interval
        assert nothing is not None
        assert nothing.reason is not None
        assert math.isnan(nothing.low)

"""Intervals of Krippendorff's alpha by his metrics, and its bootstraps by name."""

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from masrel.agreement import Metric, krippendorff_alpha
from masrel.intervals import bootstrap, jackknife

pytestmark = pytest.mark.filterwarnings(
    "ignore::masrel.errors.SmallSampleWarning",
    "ignore::masrel.errors.UndefinedStatisticWarning",
)

METRICS: list[Metric] = ["nominal", "ordinal", "interval", "ratio"]

RATINGS = [
    [1, 1, 2], [2, 2, 3], [4, 3, 4], [5, 5, 5], [1, 2, 1], [3, 3, None],
    [5, 4, 5], [2, 1, 2], [None, 4, 4], [1, 1, 1], [3, 5, 3],
]  # fmt: skip


@pytest.mark.parametrize("metric", METRICS)
def test_the_jackknife_leaves_items_out_of_the_metric_too(metric: Metric) -> None:
    n = len(RATINGS)
    without = [
        krippendorff_alpha(
            RATINGS[:i] + RATINGS[i + 1 :], categories=range(1, 6), metric=metric
        ).value
        for i in range(n)
    ]
    half = stats.t.ppf(0.975, n - 1) * math.sqrt(
        (n - 1) ** 2 / n * np.var(without, ddof=1)
    )
    result = jackknife("krippendorff_alpha", RATINGS, target="items", metric=metric)
    value = krippendorff_alpha(RATINGS, metric=metric).value
    assert result.low == pytest.approx(value - half, rel=1e-9)
    assert result.high == pytest.approx(min(value + half, 1.0), rel=1e-9)


@pytest.mark.parametrize("metric", METRICS)
def test_every_resample_has_the_metric_of_its_ratings(metric: Metric) -> None:
    rows = [[1, 2], [3, 3], [2, 4], [4, 4]]
    values = [
        krippendorff_alpha(list(drawn), categories=range(1, 5), metric=metric).value
        for drawn in itertools.product(rows, repeat=4)
    ]
    values = sorted(value for value in values if not math.isnan(value))
    result = bootstrap("krippendorff_alpha", rows, target="items", metric=metric)
    assert result.distribution is not None
    met, weights = result.distribution.values, result.distribution.weights
    assert met @ weights == pytest.approx(np.mean(values), rel=1e-9)
    assert met**2 @ weights == pytest.approx(np.mean(np.square(values)), rel=1e-9)
    assert met[[0, -1]] == pytest.approx([values[0], values[-1]], rel=1e-9)

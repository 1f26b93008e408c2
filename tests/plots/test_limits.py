"""Differences over means: where the lines of limits are, and their bands."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from masrel.agreement import limits_of_agreement, limits_with_mean, limits_with_repeats
from masrel.plots import bland_altman
from tests.plots.made import blank, texts_of

X = np.array([10.0, 12.0, 15.0, 21.0, 24.0, 30.0])
Y = np.array([9.0, 12.5, 13.0, 20.0, 21.0, 26.0])
FRAME = pd.DataFrame({"item": range(6), "x": X, "y": Y, "z": X[::-1]})
METHODS: Any = {"item": "item", "first": "x", "second": "y"}


def lines_of(axes: Any) -> list[Any]:
    # the first is of no difference
    return [line.get_xydata().tolist() for line in axes.lines]


def test_level_lines_go_from_side_to_side() -> None:
    found = limits_of_agreement(np.column_stack([X, Y]))
    axes = bland_altman(found, ax=blank())
    values = (0.0, found.upper, found.mean, found.lower)
    assert lines_of(axes) == [[[0.0, value], [1.0, value]] for value in values]
    assert len(axes.collections) == 4  # three bands, and the items
    assert "95 % confidence interval, exact" in texts_of(axes)


def test_limits_on_a_line_follow_it_with_their_bands() -> None:
    found = limits_with_repeats(FRAME, **METHODS, kind="proportional")
    axes = bland_altman(found, raters=("Kim", "Lee"), unit="ml", ax=blank())
    ends = [found.at(found.averages.min()), found.at(found.averages.max())]
    for end, of in zip((0, -1), ends, strict=True):
        points = [line[end] for line in lines_of(axes)[1:]]
        known = [[of.average, value] for value in (of.high, of.bias, of.low)]
        assert points == [pytest.approx(point) for point in known]
    assert axes.get_ylabel() == "Kim − Lee (ml)"
    assert axes.get_ylim()[0] < ends[0].low_interval.low
    assert axes.get_ylim()[1] > ends[1].high_interval.high


def test_ratios_and_limits_with_the_mean() -> None:
    ratio = limits_with_repeats(FRAME, **METHODS, kind="ratio")
    axes = bland_altman(ratio, ax=blank())
    assert axes.get_ylabel() == "first / second"
    assert lines_of(axes)[0] == [[0.0, 1.0], [1.0, 1.0]]
    mean = limits_with_mean(FRAME, item="item", observers=["x", "y", "z"])
    axes = bland_altman(mean, raters=("x", "y", "z"), ax=blank())
    heights = [line[0][1] for line in lines_of(axes)]
    assert heights == [0.0, mean.limit.value, -mean.limit.value]
    assert mean.limit.interval is not None
    band = np.array(axes.collections[1].get_paths()[0].vertices)[:, 1]
    assert band.min() == pytest.approx(-mean.limit.interval.high)
    assert axes.get_xlabel() == "mean of 3 raters"

"""The hierarchical model of test-retest agreement against textbooks and samplers."""

import math

import pytest

from masrel.errors import UndefinedStatisticWarning
from masrel.intervals import retest_model


def test_where_there_is_nothing_to_learn_it_is_undefined() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="no rater has a pair"):
        result = retest_model([[["a", None], [None, "b"]]])
    assert math.isnan(result.kappa.value)
    assert result.kappa.interval.reason == "no rater has a pair of grades"
    with pytest.warns(UndefinedStatisticWarning, match="one category"):
        retest_model([[["a", "a"], ["a", "a"]]])

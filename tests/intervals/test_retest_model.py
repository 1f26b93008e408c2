"""The hierarchical model of test-retest agreement against textbooks and samplers."""

import math

import pytest

from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.intervals import retest_model


def test_where_there_is_nothing_to_learn_it_is_undefined() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="no rater has a pair"):
        result = retest_model([[["a", None], [None, "b"]]])
    assert math.isnan(result.kappa.value)
    assert result.kappa.interval.reason == "no rater has a pair of grades"
    with pytest.warns(UndefinedStatisticWarning, match="one category"):
        retest_model([[["a", "a"], ["a", "a"]]])


@pytest.mark.parametrize(
    "options", [{"level": 1.0}, {"prior": "flat"}, {"concentration": 0.0}]
)
def test_what_is_no_question_is_refused(options: dict[str, object]) -> None:
    with pytest.raises(ParameterError):
        retest_model([[["a", "a"], ["b", "b"]]], **options)  # type: ignore[arg-type]

"""What the library says of a statistic that is undefined: nan, a warning, a reason."""

import math
from collections.abc import Callable
from typing import Any, get_args

import numpy as np
import pytest

from masrel import agreement
from masrel.agreement import IccForm, Significance, lin_ccc
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.estimates import Estimate

ONE_ITEM, ONE_RATER, ALIKE = [[1, 2]], [[1], [2]], [[3, 3], [3, 3]]
APART, CONSTANT = [[1, None], [None, 2]], [["a", "a"], ["a", "a"]]
TOO_FEW = "too few ratings to separate raters"
NO_CHANGE, NO_PAIR = "0/0: no item changed", "no item has ratings of two"
AB = {"categories": ["a", "b"]}

# functions, ratings or cells, options, why
UNDEFINED: list[tuple[str, Any, dict[str, Any], str]] = [
    ("fleiss_kappa cohen_kappa", CONSTANT, AB, "0/0: .*one category"),
    *(
        ("icc icc_f_test", table, {"form": form}, why)
        for form in get_args(IccForm)
        for table, why in (
            (ONE_ITEM, "fewer than two items"),
            (ONE_RATER, "fewer than two raters"),
            (ALIKE, "0/0: there are no differences between items"),
        )
    ),
    ("icc", APART, {}, "no item has two ratings"),
    ("icc mdc", [[1, 2], [3, None]], {}, TOO_FEW),
    ("icc", [[1, None, 2], [None, 3, None]], {}, TOO_FEW),
    (
        "icc",
        [[2, 2, 2], [2, 2, None]],
        {},
        "0/0: there are no differences between items",
    ),
    (
        *("icc", [[1, 2, None, None], [3, 4, None, None], [None, None, 5, 7]], {}),
        "there is no residual, and some raters are not linked",
    ),
    ("mdc", ONE_ITEM, {}, "fewer than two items"),
    ("mdc lin_ccc", ONE_RATER, {}, "fewer than two raters"),
    ("lin_ccc", [[1, 2], [3, None]], {}, "fewer than two items are rated by every"),
    ("lin_ccc", [[2, 2], [2, 2]], {}, "0/0: all ratings are the same"),
    *(
        ("robinson_a", table, {}, "fewer than two items or raters")
        for table in (ONE_ITEM, ONE_RATER, APART)
    ),
    *(
        ("robinson_a", table, {}, "0/0: there is no variance except between raters")
        for table in ([[1, 2], [1, 2], [1, 2]], ALIKE)
    ),
    *(
        ("bowker stuart_maxwell bhapkar", cells, {}, NO_CHANGE)
        for cells in ([[3, 0], [0, 4]], [[5]], [[0, 0], [0, 0]])
    ),
    ("prevalence_index bias_index kappa_max", [[0, 0], [0, 0]], {}, NO_PAIR),
    ("fleiss_null", CONSTANT, AB, "0/0: all ratings are in one category"),
    ("fleiss_null", [["a"], ["b"]], AB, "fewer than two raters"),
    ("fleiss_null", [["a", None], [None, "b"]], AB, "no item is rated by every rater"),
]


def assert_undefined(
    call: Callable[[], Estimate | Significance | float], why: str = ""
) -> None:
    """Hold a call to nan, a warning, and a reason where it returns a result."""
    with pytest.warns(UndefinedStatisticWarning, match=why):
        result = call()
    if isinstance(result, float):
        assert math.isnan(result)
        return
    if isinstance(result, Estimate):
        assert math.isnan(result.value)
        assert math.isnan(result.standard_error)
        assert result.interval is None
    else:
        assert math.isnan(result.p_value)
    assert f"undefined ({result.reason})" in str(result)


@pytest.mark.parametrize(("names", "ratings", "options", "why"), UNDEFINED)
def test_undefined_with_a_reason(
    names: str, ratings: Any, options: dict[str, Any], why: str
) -> None:
    for name in names.split():
        function = getattr(agreement, name)
        assert_undefined(lambda of=function: of(ratings, **options), why)


def test_limits_that_are_none() -> None:
    limits_of = agreement.limits_of_agreement
    with pytest.warns(UndefinedStatisticWarning, match="fewer than two items"):
        limits = limits_of([[1, 2], [None, 3]])
    assert math.isnan(limits.lower)
    assert limits.lower_interval.reason == limits.reason
    with pytest.raises(RatingsError, match=r"need the ratings of two raters, got 3"):
        limits_of([[1, 2, 3], [3, 4, 4]])
    for name in ("share", "level"):
        with pytest.raises(
            ParameterError, match=rf"{name}: needs a number in \(0, 1\), got 95"
        ):
            limits_of([[1, 2], [2, 2]], **{name: 95})


@pytest.mark.parametrize(
    "rows",
    # fewer than three items; a rater without variance; no item moves the value
    [[[1, 2], [3, 4]], [[1, 2], [1, 4], [1, 1]], [[1, 1, 1], [1, 1, 2]] * 2],
)
def test_a_concordance_without_an_error_has_no_interval(rows: list[list[int]]) -> None:
    interval = lin_ccc(np.array(rows)).interval
    assert interval is not None
    assert math.isnan(interval.low)
    assert interval.reason is not None

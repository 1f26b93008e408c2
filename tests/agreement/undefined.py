"""What the library says of a statistic that is undefined."""

import math
from collections.abc import Callable

import pytest

from masrel.agreement import Significance
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate


def assert_undefined(call: Callable[[], Estimate | Significance | float]) -> None:
    """Hold a call to nan, a warning, and a reason where it returns a result."""
    with pytest.warns(UndefinedStatisticWarning):
        result = call()
    if isinstance(result, float):
        assert math.isnan(result)
        return
    value = result.value if isinstance(result, Estimate) else result.statistic
    assert math.isnan(value)
    assert result.reason

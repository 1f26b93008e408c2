"""A loop that is away too often or for too long is named."""

import pytest

from masrel.errors import LimitExceededError
from masrel.hess import DeviceLimits
from masrel.hess._guard import check_overrun


def test_one_missed_tick_too_many_is_named() -> None:
    limits = DeviceLimits(missed_ticks=3)
    check_overrun(limits, 3, 0.005)
    with pytest.raises(LimitExceededError, match=r"at most 3 .* missed 4") as caught:
        check_overrun(limits, 4, 0.005)
    assert caught.value.kind == "overrun"


def test_a_gap_as_long_as_the_watchdog_waits_is_named() -> None:
    limits = DeviceLimits(missed_ticks=100)
    check_overrun(limits, 49, 0.0499)
    words = r"silence: needs a command every 50 ms.* for 50\.0 ms"
    with pytest.raises(LimitExceededError, match=words) as caught:
        check_overrun(limits, 49, 0.05)
    assert caught.value.kind == "overrun"

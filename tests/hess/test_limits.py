import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import LimitExceededError, ParameterError
from masrel.hess import DeviceLimits

LIMITS = DeviceLimits(
    torque=20.0, speed=7.0, missed_ticks=3, lowest_angle=0.0, highest_angle=2.7
)


@given(st.floats(-20.0, 20.0))
def test_a_torque_within_the_limit_passes(torque: float) -> None:
    LIMITS.check_torque(torque)


@pytest.mark.parametrize("torque", [20.001, -20.001, math.inf, -math.inf, math.nan])
def test_a_torque_beyond_it_either_way_is_named(torque: float) -> None:
    with pytest.raises(LimitExceededError, match="torque: needs at most 20 N·m"):
        LIMITS.check_torque(torque)


@pytest.mark.parametrize("angle", [-0.001, 2.701, math.nan, math.inf])
def test_an_angle_out_of_range_is_named(angle: float) -> None:
    with pytest.raises(LimitExceededError, match=r"range: needs 0\.0 to 154\.7 deg"):
        LIMITS.check_motion(angle, 0.0)


@pytest.mark.parametrize("velocity", [7.001, -7.001, math.nan])
def test_a_speed_either_way_is_named(velocity: float) -> None:
    with pytest.raises(LimitExceededError, match="speed: needs at most 401 deg/s"):
        LIMITS.check_motion(1.0, velocity)


def test_what_lies_on_the_limits_passes() -> None:
    LIMITS.check_motion(0.0, -7.0)
    LIMITS.check_motion(2.7, 7.0)
    LIMITS.check_missed(3)
    LIMITS.check_torque(20.0)
    LIMITS.check_torque(-20.0)


def test_by_default_an_end_stop_may_give_way_by_five_degrees() -> None:
    limits = DeviceLimits(torque=20.0, speed=7.0, missed_ticks=3)
    for angle_deg in (-4.9, 184.9):
        limits.check_motion(math.radians(angle_deg), 0.0)
    for angle_deg in (-5.1, 185.1):
        with pytest.raises(LimitExceededError, match=r"needs -5\.0 to 185\.0 deg"):
            limits.check_motion(math.radians(angle_deg), 0.0)


def test_one_missed_tick_too_many_is_named() -> None:
    with pytest.raises(LimitExceededError, match=r"at most 3 .* missed 4"):
        LIMITS.check_missed(4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"torque": 0.0}, "torque: needs a finite limit > 0, got 0.0"),
        ({"torque": math.inf}, "torque: needs"),
        ({"speed": math.nan}, "speed: needs"),
        ({"missed_ticks": -1}, "missed_ticks: needs 0 or more, got -1"),
        ({"lowest_angle": 3.3}, "lowest_angle, highest_angle: need"),
        ({"highest_angle": math.inf}, "lowest_angle, highest_angle: need"),
    ],
)
def test_limits_that_limit_nothing_are_refused(
    change: dict[str, float], words: str
) -> None:
    with pytest.raises(ParameterError, match=words):
        DeviceLimits(**{"torque": 20.0, "speed": 7.0, "missed_ticks": 3, **change})

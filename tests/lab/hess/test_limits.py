import math

import pytest

from masrel.errors import ParameterError
from masrel.lab.hess import DeviceLimits


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"torque": 0.0}, "torque: needs a finite limit > 0, got 0.0"),
        ({"torque": math.inf}, "torque: needs"),
        ({"speed": math.nan}, "speed: needs"),
        ({"torque_rate": 0.0}, "torque_rate: needs a finite limit > 0"),
        ({"missed_ticks": -1}, "missed_ticks: needs 0 or more, got -1"),
        ({"missed_replies": -1}, "missed_replies: needs 0 or more, got -1"),
        ({"soft_stop_torque": math.nan}, "soft_stop_torque: needs 0 or more"),
        ({"soft_stop_width": 2.0}, "soft_stop_width: needs at most half of the range"),
        ({"ramp_time": 0.101}, "ramp_time: needs 0 to 0.1 s, got 0.101"),
        ({"ramp_time": math.nan}, "ramp_time: needs"),
        *(
            ({name: -1.0}, f"{name}: needs a finite limit > 0, got -1.0")
            for name in (
                "stale_time",
                "frozen_time",
                "jump_angle",
                "standing_time",
                "standing_torque",
                "watchdog_time",
            )
        ),
        ({"lowest_angle": 3.3}, "lowest_angle, highest_angle: need"),
        ({"highest_angle": math.inf}, "lowest_angle, highest_angle: need"),
    ],
)
def test_limits_that_limit_nothing_are_refused(
    change: dict[str, float], words: str
) -> None:
    with pytest.raises(ParameterError, match=words):
        DeviceLimits(**change)

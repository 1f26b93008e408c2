"""Each limit passes what lies on it, and names what lies beyond."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import degrees, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import LimitExceededError
from masrel.lab.elbow import STANDARD_MODELS, MinimumJerk, trace
from masrel.lab.hess import DeviceLimits
from masrel.lab.hess._guard import Guard

PERIOD = 0.001
STEP = radians(0.005)  # of the encoder
END = radians(146.0)


def guard(**limits: float) -> Guard:
    return Guard(DeviceLimits(**limits), PERIOD)


def begun(**limits: float) -> Guard:
    made = guard(**limits)
    made.torque(-PERIOD, 0.0)  # so that a tick may have any torque
    return made


def fed(made: Guard, angles: list[float], start: int = 0) -> Guard:
    for tick, angle in enumerate(angles, start):
        made.reading(tick * PERIOD, angle, 0.0)
    return made


@contextmanager
def raises_limit(kind: str, words: str) -> Iterator[None]:
    with pytest.raises(LimitExceededError, match=words) as caught:
        yield
    assert caught.value.kind == kind


# Torque


@given(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
def test_a_torque_within_the_limit_passes_slowly(first: float, second: float) -> None:
    made = begun(torque=20.0)
    made.torque(0.0, 0.6 * first)
    made.torque(1.0, second)  # a second later
    with raises_limit("torque", "torque: needs at most 20 N·m, got"):
        made.torque(2.0, math.copysign(20.001, second))


@pytest.mark.parametrize("torque", [20.001, -20.001, math.inf, -math.inf, math.nan])
def test_a_torque_beyond_it_either_way_is_named(torque: float) -> None:
    with raises_limit("torque", "torque: needs at most 20 N·m"):
        guard(torque=20.0).torque(0.0, torque)


@pytest.mark.parametrize(
    ("before", "after"), [(0.0, 12.1), (3.0, 15.2), (-3.0, 9.2), (-1.0, -13.2)]
)
def test_a_torque_that_builds_up_too_fast_is_named(before, after) -> None:
    made = begun(torque_rate=12_000.0)
    made.torque(0.0, before)
    with raises_limit("torque-rate", r"torque rate: needs at most 12000 N·m/s, got"):
        made.torque(PERIOD, after)


@pytest.mark.parametrize(
    ("before", "after"), [(0.0, 11.9), (11.0, 0.0), (-11.0, 0.0), (11.0, 0.5)]
)
def test_torque_is_taken_away_as_fast_as_it_likes(before, after) -> None:
    made = begun(torque_rate=12_000.0)
    made.torque(0.0, before)
    made.torque(PERIOD, after)
    made = guard(torque_rate=1.0)
    with raises_limit("torque-rate", "torque rate"):
        made.torque(0.0, 0.002)  # the very first counts from zero
    made = guard(torque_rate=1.0)
    made.torque(0.0, 0.001)
    made.torque(PERIOD, 0.0)


@pytest.mark.parametrize("torque", [2.001, -2.001, 11.0])
def test_an_arm_away_from_its_start_is_not_loaded_at_once(torque: float) -> None:
    made = fed(guard(), [2.5])
    words = r"start: needs at most 2 N·m in the first tick, an arm at 143\.2 deg asks"
    with raises_limit("start", words):
        made.torque(0.0, torque)
    made = guard()
    made.torque(0.0, math.copysign(2.0, torque))
    made.torque(PERIOD, torque)  # what comes later may be more


# HM4 needs more than 20 N·m from 85 deg/s on.
WITHIN = [
    (model, speed)
    for model in sorted(STANDARD_MODELS)
    for speed in (60.0, 72.0, 80.0, 93.0, 131.0)
    if model != "HM4" or speed <= 80.0
]


@pytest.mark.parametrize(("model", "speed"), WITHIN)
def test_the_law_itself_passes_the_defaults(model: str, speed: float) -> None:
    motion = MinimumJerk(start=radians(30.0), end=END, mean_speed=radians(speed))
    made = trace(STANDARD_MODELS[model], motion)
    watching = guard()
    for time_s, angle, velocity, torque in zip(
        made.time, made.angle, made.velocity, made.torque, strict=True
    ):
        watching.reading(time_s, round(angle / STEP) * STEP, 0.0)
        watching.speed(velocity)
        watching.torque(time_s, torque)
    assert watching.n_without_reading == 0


# Angle and speed


@pytest.mark.parametrize("angle", [-0.001, 2.701, math.nan, math.inf])
def test_an_angle_out_of_range_is_named(angle: float) -> None:
    made = guard(lowest_angle=0.0, highest_angle=2.7)
    with raises_limit("range", r"range: needs 0\.0 to 154\.7 deg"):
        made.reading(0.0, angle, 0.0)


@pytest.mark.parametrize("velocity", [7.001, -7.001, math.nan])
def test_a_speed_either_way_is_named(velocity: float) -> None:
    with raises_limit("speed", "speed: needs at most 401 deg/s"):
        guard(speed=7.0).speed(velocity)


def test_what_lies_on_the_limits_passes() -> None:
    made = begun(torque=20.0, speed=7.0, torque_rate=1e6)
    made.speed(-7.0)
    made.speed(7.0)
    made.torque(0.0, 20.0)
    made.torque(PERIOD, -20.0)
    made.reading(0.0, radians(-5.0), 0.005)
    guard().reading(0.0, radians(185.0), -0.001)
    assert made.n_without_reading == 0


# The encoder


def test_a_reading_that_is_too_old_or_from_the_future_is_named() -> None:
    for age in (0.00501, -0.00101, math.nan):
        with raises_limit(
            "stale", "stale: needs a reading at most 5 ms old, got one of"
        ):
            guard().reading(0.0, 1.0, age)


def test_a_jump_is_named_where_it_happens() -> None:
    # 100 deg/s, then 0.35 deg beyond where that leads
    angles = [1.0 + radians(0.1) * tick for tick in range(20)]
    made = fed(guard(), angles)
    with raises_limit("jump", r"jump: needs an angle within 0\.3 deg .* 0\.35 deg"):
        made.reading(0.020, angles[-1] + radians(0.45), 0.0)
    made = fed(guard(), angles)
    made.reading(0.020, angles[-1] + radians(0.39), 0.0)


@pytest.mark.parametrize("jump_deg", [0.35, -0.35, 54.0, -60.0])
def test_a_jump_at_rest_is_named_at_once(jump_deg: float) -> None:
    made = fed(guard(), [1.5] * 5)
    with raises_limit("jump", "jump: needs"):
        made.reading(0.005, 1.5 + radians(jump_deg), 0.0)


def test_a_gap_widens_what_may_follow() -> None:
    # 20 ticks without a reading: an arm can have gained 300 deg/s in each of them
    made = fed(guard(), [1.5] * 3)
    made.reading(0.022, 1.5 + radians(0.3 * 19.9), 0.0)
    made = fed(guard(), [1.5] * 3)
    with raises_limit("jump", r"got one 0\.3\d deg a tick from there"):
        made.reading(0.022, 1.5 + radians(0.3 * 20.5), 0.0)


def test_an_arm_that_stops_dead_is_named_after_ten_milliseconds() -> None:
    angles = [1.0 + radians(0.03) * tick for tick in range(20)]  # 30 deg/s
    made = fed(guard(), angles + [angles[-1]] * 9)
    with raises_limit("frozen", r"frozen: needs .* within 10 ms .* not for 11\.5 ms"):
        made.reading(0.0305, angles[-1], 0.0)


def test_an_arm_may_come_to_rest_while_nobody_looks() -> None:
    # At 30 deg/s, then a gap of 15 ms in which it met its end stop
    angles = [1.0 + radians(0.03) * tick for tick in range(20)]
    made = fed(guard(), angles)
    fed(made, [angles[-1] + radians(0.4)] * 400, start=35)
    assert made.is_new(0.435)


def test_a_slow_arm_may_come_to_rest() -> None:
    angles = [1.0 + radians(0.015) * tick for tick in range(20)]  # 15 deg/s
    made = fed(guard(), angles + [angles[-1]] * 1000)
    assert made.is_new(1.020)


@pytest.mark.parametrize(
    ("speed_deg_s", "after_s"), [(5.0, 0.5), (-5.0, 0.5), (4.0, 10.0), (0.0, 10.0)]
)
def test_a_standing_torque_is_named_after_half_a_second_or_10_s_if_it_was_held(
    speed_deg_s: float, after_s: float
) -> None:
    made = begun()
    made.torque(0.0, 2.1)
    fed(made, [1.5, 1.5 + STEP])
    made.speed(radians(speed_deg_s))
    fed(made, [1.5 + STEP] * round(after_s * 1000), start=2)
    with raises_limit(
        "standing-torque",
        rf"standing torque: needs at most 2 N·m .* {after_s * 1e3:g} ms, got 2\.100",
    ):
        made.reading(after_s + 0.0025, 1.5 + STEP, 0.0)


def test_an_arm_that_bounced_off_its_end_and_settled_may_be_held() -> None:
    # the estimated speed is still that of the bounce when the angle changes last
    made = begun()
    made.torque(0.0, 2.1)
    fed(made, [1.5 + STEP * n for n in (0, 4, 1, 0, -1, -1, -1, 0)])
    made.speed(radians(5.3))
    fed(made, [1.5] * 9000, start=8)
    assert made.is_new(9.01)


def test_at_most_2_n_m_may_stand_for_ever() -> None:
    made = guard()
    made.torque(0.0, -2.0)
    fed(made, [1.5] * 12000)
    assert made.is_new(12.0)


def test_an_arm_that_trembles_by_one_step_may_be_held_for_long() -> None:
    made = begun()
    made.torque(0.0, 10.0)
    fed(made, [1.5 + STEP * (tick // 300 % 2) for tick in range(3000)])
    assert made.is_new(3.0)


# Replies and ticks


def test_replies_may_be_missed_twice_in_a_row() -> None:
    made = guard()
    for tick in range(0, 9, 3):
        made.no_reading(tick * PERIOD, "no answer")
        made.no_reading((tick + 1) * PERIOD, "no answer")
        made.reading((tick + 2) * PERIOD, 1.0, 0.0)
    assert made.n_without_reading == 6
    made.no_reading(0.009, "no answer")
    made.no_reading(0.010, "no answer")
    with raises_limit("missed-replies", r"at most 2 ticks .* 3 in a row \(no answer\)"):
        made.no_reading(0.011, "no answer")


def missing(made: Guard, lost: Callable[[int], bool], n_ticks: int) -> int | None:
    """Lose the replies of some ticks -> the tick that was one too many."""
    for tick in range(n_ticks):
        if not lost(tick):
            made.reading(tick * PERIOD, 1.0, 0.0)
            continue
        try:
            made.no_reading(tick * PERIOD, "no answer")
        except LimitExceededError as error:
            return tick if error.kind == "missed-replies" else None
    return None


@pytest.mark.parametrize(
    ("every", "at"), [(2, 20), (4, 40), (9, 90), (10, None), (50, None)]
)
def test_a_share_of_missed_replies_is_named_at_the_eleventh_of_a_hundred(
    every: int, at: int | None
) -> None:
    # Every ninth from 0 on: 0, 9, ..., 90 are eleven of the ticks 0 to 99. Every
    # tenth are ten of any hundred, for ever.
    assert missing(guard(), lambda tick: tick % every == 0, 1000) == at


@given(
    st.sets(st.integers(0, 400)), st.integers(0, 100), st.sampled_from([0.001, 0.0025])
)
def test_the_share_is_that_of_any_hundred_ticks(
    lost: set[int], limit: int, period: float
) -> None:
    # The same by counting, in a window that ends with each lost reply
    def too_many(tick: int) -> bool:
        return len([one for one in lost if tick - 99 <= one <= tick]) > limit

    limits = DeviceLimits(missed_replies=1000, missed_replies_per_100=limit)
    watching = Guard(limits, period)
    for tick in sorted(lost):
        if too_many(tick):
            with raises_limit(
                "missed-replies", rf"at most {limit} of 100 ticks without"
            ):
                watching.no_reading(tick * period, "no answer")
            return
        watching.no_reading(tick * period, "no answer")
    assert watching.n_without_reading == len(lost)


def test_every_refusal_says_degrees_where_it_speaks_of_angles() -> None:
    with pytest.raises(LimitExceededError, match=f"at {degrees(3.5):.1f} deg"):
        guard().reading(0.0, 3.5, 0.0)


# A loop that is away too often or for too long is named


def test_one_missed_tick_too_many_is_named() -> None:
    watching = guard(missed_ticks=3)
    for first, after in ((5, 8), (2007, 2008), (2100, 2102)):
        watching.missed(first, after, 0.005)
    words = r"at most 3 of any 2000, the loop missed 4 of 1994"
    with pytest.raises(LimitExceededError, match=words) as caught:
        watching.missed(4000, 4001, 0.005)
    assert (caught.value.kind, watching.n_missed_ticks) == ("overrun", 7)


def test_a_gap_as_long_as_the_watchdog_waits_is_named() -> None:
    watching = guard()
    watching.silence(0.0499)
    words = r"silence: needs a command every 50 ms.* for 50\.0 ms"
    with pytest.raises(LimitExceededError, match=words) as caught:
        watching.silence(0.05)
    assert caught.value.kind == "overrun"


# Springs before the ends of the range push back, and nothing does between them


def test_they_push_back_from_five_degrees_before_the_ends() -> None:
    watching = guard()
    assert watching.soft_stop(radians(-5.0)) == pytest.approx(-10.0)
    assert watching.soft_stop(radians(182.5)) == pytest.approx(5.0)  # resists extension
    assert watching.soft_stop(radians(-1.0)) == pytest.approx(-2.0)
    for angle in (0.0, 90.0, 180.0):
        assert watching.soft_stop(radians(angle)) == 0.0


def test_there_may_be_none() -> None:
    watching = guard(soft_stop_torque=0.0)
    assert watching.soft_stop(radians(184.0)) == 0.0

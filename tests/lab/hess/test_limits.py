"""Each limit passes what lies on it, and names what lies beyond; noise and drift."""

import math
import re
from collections.abc import Callable
from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from masrel.lab.elbow import STANDARD_MODELS, MinimumJerk
from masrel.lab.hess import (
    DeviceLimits,
    Reading,
    StretchRules,
    render,
)

from . import faults as f
from .rig import (
    CATCH,
    END,
    MODELS,
    START,
    ActingClock,
    Joint,
    ScriptedDevice,
    controls,
    missing,
    present,
    scripted,
    stretching,
)

STEP = radians(0.005)  # of the encoder
MS = 1e-3


def ticks(*parts: tuple[int, float]) -> Callable[[float], float]:
    """An angle by parts: so many ticks at so many deg/s, the last for ever."""
    ends = np.cumsum([0, *(n for n, _ in parts)]) * MS
    speeds = [speed for _, speed in parts]
    angles = np.concatenate(
        ([1.0], 1.0 + np.cumsum(np.diff(ends) * np.radians(speeds)))
    )
    return lambda time_s: float(np.interp(time_s, ends, angles))


def stepped(*steps: int) -> Callable[[float], float]:
    """An angle in steps of the encoder, tick by tick, the last for ever."""
    return lambda time_s: 1.5 + STEP * steps[min(round(time_s / MS), len(steps) - 1)]


def at(time_s: float, before: float, after: float) -> Callable[[float], float]:
    return lambda time: before if time < time_s - 1e-9 else after


def jumping(by_deg: float) -> Callable[[float], float]:
    """At 100 deg/s until 20 ms, and then so far beyond where that leads."""
    even = ticks((300, 100.0))
    return lambda time: even(time) + (radians(by_deg) if time > 19.5 * MS else 0.0)


REST = ticks((1, 0.0))
STOPPED = ticks((20, 30.0), (1, 0.0))  # dead, from 30 deg/s
BOUNCE = (0, 12, 24, 36, 48, 60, 61)  # the estimated speed is still that of before
NOTHING = at(math.inf, 0.0, 0.0)
GRADUAL = {"torque_rate": 1e9, "standing_torque": 100.0}
TIMES = {"standing_time": 100.0}


# angle of time, torque of time, limits -> the fault, the tick it is noticed in, words
ROWS = {
    # Torque
    "20 N·m": (REST, at(MS, 0, 20.0), GRADUAL, None, 0, ""),
    "more": (
        REST,
        at(MS, 0, 20.001),
        GRADUAL,
        "torque",
        1,
        "at most 20 N·m, got 20.001",
    ),
    "more towards extension": (
        REST,
        at(MS, 0, -20.1),
        GRADUAL,
        "torque",
        1,
        "got -20.100",
    ),
    "11.9 N·m in a tick": (REST, at(MS, 0, 11.9), TIMES, None, 0, ""),
    "12.1": (
        REST,
        at(MS, 0, 12.1),
        TIMES,
        "torque-rate",
        1,
        "most 12000 N·m/s, got 0.000 ",
    ),
    "12.2 more": (
        REST,
        at(200 * MS, 1, 13.2),
        TIMES,
        "torque-rate",
        200,
        "1.000 and then 13.200",
    ),
    "12.2 to the other side": (
        REST,
        at(200 * MS, -1, 11.2),
        TIMES,
        "torque-rate",
        200,
        "-1.000 and",
    ),
    "12.2 towards extension": (
        REST,
        at(200 * MS, -1, -13.2),
        TIMES,
        "torque-rate",
        200,
        "then -13.2",
    ),
    "taken away": (REST, at(2 * MS, 2, 0), {"torque_rate": 2e3}, None, 0, ""),
    "a part of it": (REST, at(2 * MS, -2, -0.5), {"torque_rate": 2e3}, None, 0, ""),
    "the first from zero": (
        REST,
        at(MS, 0, 0.002),
        {"torque_rate": 1.0},
        "torque-rate",
        1,
        "",
    ),
    "2 N·m at once": (REST, at(math.inf, 2.0, 0), {}, None, 0, ""),
    "2.001": (
        ticks((1, 0.0)),
        at(9, 2.001, 0),
        {},
        "start",
        0,
        "at 57.3 deg the model asks for 2.0",
    ),
    "so much towards extension": (
        REST,
        at(9, -2.001, 0),
        {},
        "start",
        0,
        "most 2 N·m in the f",
    ),
    # Angle and speed
    "5 deg beyond flexion": (
        at(9, radians(-5.0), 0),
        NOTHING,
        {"soft_stop_torque": 0.0},
        None,
        0,
        "",
    ),
    "beyond that": (
        at(9, radians(-5.01), 0),
        NOTHING,
        {},
        "range",
        0,
        "needs -5.0 to 185.0 deg",
    ),
    "185 deg": (
        at(9, radians(185.0), 0),
        NOTHING,
        {"soft_stop_torque": 0.0},
        None,
        0,
        "",
    ),
    "200 deg": (at(9, 3.5, 0), NOTHING, {}, "range", 0, "the arm is at 200.5 deg"),
    "no number": (at(9, math.nan, 0), NOTHING, {}, "range", 0, ""),
    "infinite": (at(9, math.inf, 0), NOTHING, {}, "range", 0, ""),
    "slower than 10 deg/s": (
        ticks((300, 9.9)),
        NOTHING,
        {"speed": radians(10.0)},
        None,
        0,
        "",
    ),
    "faster": (
        ticks((300, 11.0)),
        NOTHING,
        {"speed": radians(10.0)},
        "speed",
        14,
        "most 10 deg/s",
    ),
    "faster in flexion": (
        ticks((300, -11.0)),
        NOTHING,
        {"speed": radians(10.0)},
        "speed",
        14,
        "at -10 deg/s",
    ),
    # The encoder
    "0.29 deg off": (jumping(0.29), NOTHING, {"drift_speed": 1e-3}, None, 0, ""),
    "0.35 deg": (
        jumping(0.35),
        NOTHING,
        {},
        "jump",
        20,
        "within 0.3 deg of the one .* got 0.35 deg",
    ),
    "-0.35 deg": (
        jumping(-0.35),
        NOTHING,
        {},
        "jump",
        20,
        "-0.35 deg a tick from it",
    ),
    "0.35 deg at rest": (
        at(5 * MS, 1.5, 1.5 + radians(0.35)),
        NOTHING,
        {},
        "jump",
        5,
        "",
    ),
    "60 deg back": (at(5 * MS, 1.5, 1.5 - radians(60.0)), NOTHING, {}, "jump", 5, ""),
    "stopped dead": (
        STOPPED,
        NOTHING,
        {},
        "frozen",
        30,
        r"within 10 ms .* none for 10\.0 ms",
    ),
    "for 9 ms": (lambda t: STOPPED(t) + STEP * (t > 0.0285), NOTHING, {}, None, 0, ""),
    "from 15 deg/s": (ticks((20, 15.0), (1, 0.0)), NOTHING, {}, None, 0, ""),
    # A torque that stands
    "on a still arm": (REST, at(9, 2.0, 0), {"standing_time": 0.01}, None, 0, ""),
    "too much": (
        ticks((2, 50.0), (1, 0.0)),
        at(MS, 0, 2.1),
        TIMES | {"standing_time": 0.1, "frozen_time": 9.0},
        "standing-torque",
        103,
        "100 ms, got 2.100",
    ),
    "in flexion": (
        ticks((2, -50.0), (1, 0.0)),
        at(MS, 0, -2.1),
        {"standing_time": 0.1, "frozen_time": 9.0},
        "standing-torque",
        103,
        "got -2.100",
    ),
    "that was held": (
        REST,
        at(MS, 0, 2.1),
        {"standing_time": 0.01},
        "standing-torque",
        201,
        "at most 2 N·m .* 200 ms",
    ),
    "that bounced and settled": (
        stepped(*BOUNCE, 61, 60, 61, 60),
        at(MS, 0, 2.1),
        {"standing_time": 0.02},
        None,
        0,
        "",
    ),
    "that has not settled": (
        stepped(*BOUNCE),
        at(MS, 0, 2.1),
        {"standing_time": 0.02},
        "standing-torque",
        26,
        "",
    ),
    "that trembles by a step": (
        lambda t: 1.5 + STEP * (round(t / MS) // 30 % 2),
        at(MS, 0, 10.0),
        {"standing_time": 0.01},
        None,
        0,
        "",
    ),
}


@pytest.mark.parametrize("row", ROWS)
def test_what_lies_on_a_limit_passes_and_what_lies_beyond_is_named(row: str) -> None:
    angle, torque, limits, kind, tick, words = ROWS[row]
    law = Joint(lambda time_s, _a, _v: float(torque(time_s)), is_passive=True)
    device, presented = scripted(
        angle,
        controls(law, compensation=0.0),
        limits=DeviceLimits(**limits),
        max_duration_s=0.3,
        end_angle=10.0,
    )
    fault = presented.fault
    if kind is None:
        assert fault is None
        return
    assert fault is not None
    assert fault.kind == kind
    assert fault.time_s == pytest.approx(tick * MS)
    assert re.search(words, fault.message)
    sent = {abs(torque) for _, torque in device.commands}
    assert max(sent) <= 20.0
    assert tick or sent == {0.0}


# 20 ticks without a reading: an arm can have gained 300 deg/s in each of them, or have
# come to rest against an end stop
@pytest.mark.parametrize(
    ("moved_deg", "is_a_jump"), [(0.3 * 19.9, False), (0.3 * 20.5, True), (0.6, False)]
)
def test_a_gap_widens_what_may_follow(moved_deg: float, is_a_jump: bool) -> None:
    speed_deg_s = 30.0 if moved_deg == 0.6 else 0.0
    before = ticks((2, speed_deg_s), (1, 0.0))
    device = ScriptedDevice(
        angle=lambda t: before(t) + radians(moved_deg) * (t > 2.5 * MS),
        is_lost=lambda tick: 3 <= tick < 22,
    )
    limits = DeviceLimits(missed_replies=99, missed_replies_per_100=100)
    fault = scripted(device=device, limits=limits, max_duration_s=0.3)[1].fault
    assert (fault is not None) is is_a_jump
    if fault is not None:
        assert fault.kind == "jump"
        assert re.search(r"got 0\.3\d deg a tick from it", fault.message)


@pytest.mark.parametrize(
    ("late_ms", "is_stale"), [(5.0, False), (5.01, True), (-1.0, False), (-1.01, True)]
)
def test_a_reading_that_is_too_old_or_from_the_future_is_named(
    late_ms: float, is_stale: bool
) -> None:
    device = ScriptedDevice(late_ns=round(late_ms * 1e6))
    _, presented = scripted(device=device)
    if not is_stale:
        assert presented.fault is None
        return
    assert presented.fault is not None
    assert presented.fault.message == (
        f"stale: needs a reading at most 5 ms old, got one of {late_ms:.1f} ms"
    )


@pytest.mark.parametrize(
    ("is_lost", "tick", "words"),
    [
        (lambda tick: 4 <= tick % 10 <= 5 and tick < 50, None, ""),
        (
            lambda tick: 4 <= tick <= 6,
            6,
            r"at most 2 ticks in a row without a new reading, got 3 \(",
        ),
        # Every ninth from 0 on: 0, 9, ..., 90 are eleven of the ticks 0 to 99. Every
        # tenth are ten of any hundred, for ever.
        (lambda tick: tick % 2 == 0, 20, "at most 10 of 100 ticks without"),
        (lambda tick: tick % 9 == 0, 90, "got 11 within 90.0 ms"),
        (lambda tick: tick % 10 == 0, None, ""),
    ],
)
def test_two_readings_in_a_row_may_be_lost_and_ten_of_a_hundred(
    is_lost: Callable[[int], bool], tick: int | None, words: str
) -> None:
    device = ScriptedDevice(is_lost=is_lost)
    _, presented = scripted(device=device, max_duration_s=1.0)
    fault = presented.fault
    if tick is None:
        assert fault is None
        n_lost = sum(map(is_lost, range(1000)))
        assert presented.recording.facts["n_missed_replies"] == n_lost
        return
    assert fault is not None
    assert (fault.kind, fault.time_s) == ("missed-replies", pytest.approx(tick * MS))
    assert re.search(words, fault.message)


@settings(deadline=None, max_examples=40)
@given(st.sets(st.integers(0, 400)), st.integers(0, 100), st.sampled_from([1000, 400]))
def test_the_share_is_that_of_any_hundred_ticks(
    lost: set[int], limit: int, rate_hz: int
) -> None:
    # The same by counting, in a window that ends with each lost reply
    too_many = (
        tick
        for tick in sorted(lost)
        if len([one for one in lost if tick - 99 <= one <= tick]) > limit
    )
    limits = DeviceLimits(
        missed_replies=1000, missed_replies_per_100=limit, watchdog_time=9.0
    )
    _, presented = scripted(
        device=ScriptedDevice(is_lost=lost.__contains__),
        limits=limits,
        rate_hz=rate_hz,
        max_duration_s=401 / rate_hz,
    )
    noticed = (
        None if presented.fault is None else round(presented.fault.time_s * rate_hz)
    )
    assert noticed == next(too_many, None)


# Tick and how late it is, ms, for some ticks -> what is said, and how many were missed
@pytest.mark.parametrize(
    ("late_ms", "limits", "words", "n_missed"),
    [
        (
            {5: 3.4, 2003: 1.2},
            {"missed_ticks": 3},
            "at most 3 of any 2000, the loop missed 4 of 1999",
            4,
        ),
        ({5: 3.4, 2008: 1.2, 2100: 2.2}, {"missed_ticks": 3}, None, 6),
        (
            {5: 3.4},
            {"missed_ticks": 2},
            "at most 2 of any 2000, the loop missed 3 of 3",
            3,
        ),
        ({5: 48.9}, {"missed_ticks": 99}, None, 48),
        (
            {5: 49.0},
            {"missed_ticks": 99},
            "silence: needs a command every 50 ms.* for 50.0 ms",
            49,
        ),
    ],
)
@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")
def test_a_loop_that_is_away_too_often_or_too_long_is_named(
    late_ms: dict[int, float], limits: dict, words: str | None, n_missed: int
) -> None:
    gaps = {tick * 1e-3: ms * 1e-3 for tick, ms in late_ms.items()}
    device, presented = scripted(
        clock=ActingClock(missing(gaps)),
        limits=DeviceLimits(**limits),
        max_duration_s=2.2,
    )
    assert presented.n_missed_ticks == n_missed
    if words is None:
        assert presented.fault is None
        return
    assert presented.fault is not None
    assert presented.fault.kind == "overrun"
    assert re.search(words, presented.fault.message)
    assert device.commands[-1][1] == 0.0


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("speed_deg_s", [60.0, 72.0, 80.0, 93.0, 131.0])
def test_the_law_itself_passes_the_defaults(model: str, speed_deg_s: float) -> None:
    # HM4 needs more than 20 N·m from 85 deg/s on.
    if model != "HM4" or speed_deg_s <= 80.0:
        motion = MinimumJerk(start=START, end=END, mean_speed=radians(speed_deg_s))
        assert render(STANDARD_MODELS[model], motion).presented.fault is None


# Drift


def resting(angle_deg_s: float, start_s: float = 0.0, **options):
    """Long before this hand moves the encoder does."""
    drift = f.drifting(start_s, radians(angle_deg_s))
    return present(hand=stretching(57.3, delay=60.0), read_fault=drift, **options)


@pytest.mark.parametrize("start_s", [0.0, 0.5])
@pytest.mark.parametrize("rate", [-20.0, -8.0, 4.0, 10.0, 15.0, 20.0, 24.0])
def test_a_resting_arm_that_creeps_is_a_fault_below_half_a_newton_metre(
    rate: float, start_s: float
) -> None:
    shown = resting(rate, start_s)
    assert shown.fault is not None
    assert shown.fault.kind == "drift"
    assert shown.fault.message.startswith(
        "drift: needs an arm that starts from rest, got an encoder that read "
    )
    assert shown.fault.time_s == pytest.approx(start_s + 3.0 / abs(rate), abs=0.005)
    assert np.abs(shown.recording.columns["command_torque_nm"]).max() < 0.5


@pytest.mark.parametrize(
    ("rate", "start_s"), [(-3.0, 0.0), (-2.0, 1.23), (1.0, 0.0), (3.0, 1.23)]
)
def test_one_that_creeps_too_slowly_for_that_is_one_below_a_newton_metre(
    rate: float, start_s: float
) -> None:
    shown = resting(rate, start_s, max_duration_s=60.0)
    assert shown.fault is not None
    assert shown.fault.kind == "drift"
    assert shown.fault.message == (
        "drift: needs an arm that rests or is faster than 4.5 deg/s, got an encoder "
        "that crept by 15 deg"
    )
    assert shown.fault.time_s == pytest.approx(start_s + 15.0 / abs(rate), rel=0.02)
    assert np.abs(shown.recording.columns["command_torque_nm"]).max() < 1.0


def test_one_that_creeps_slower_still_is_a_stretch_that_does_not_end() -> None:
    shown = resting(0.5, stretches=StretchRules(n=None, stretch_limit=5.0))
    assert shown.fault is not None
    assert shown.fault.kind == "stretch-limit"
    assert np.abs(shown.recording.columns["command_torque_nm"]).max() < 1.0


@pytest.mark.parametrize("speed", [2.0, 4.0, 4.5, 5.0, 7.5, 10.0, 15.0, 20.0, 24.0])
@pytest.mark.parametrize("start_deg", [30.0, 100.003])
def test_a_slow_stretch_is_no_drift(speed: float, start_deg: float) -> None:
    hand = stretching(speed, start=radians(start_deg))
    # until it has gone as far as a drift may
    assert present(hand=hand, max_duration_s=0.2 + 3.0 / speed).fault is None


@pytest.mark.parametrize("speed_deg_s", [5.0, 10.0])
def test_a_whole_stretch_that_is_slow_does_not_creep(speed_deg_s: float) -> None:
    shown = present(speed_deg_s=speed_deg_s, max_duration_s=30.0)
    assert (shown.fault, shown.recording.facts["ended"]) == (None, "arrived")


def test_how_far_a_drift_may_go_and_how_fast_and_in_whole_steps() -> None:
    further = resting(20.0, limits=DeviceLimits(drift_angle=radians(6.0))).fault
    assert further is not None
    assert further.time_s == pytest.approx(0.3, abs=0.005)
    other = resting(20.0, limits=DeviceLimits(drift_speed=radians(15.0))).fault
    assert other is not None
    assert other.kind == "range"
    in_steps = scripted(
        lambda t: START + round(radians(20.0) * t / STEP) * STEP, max_duration_s=10.0
    )[1].fault
    assert in_steps is not None
    assert in_steps.kind == "drift"


# Noise and arrival


def noisy(deviation_deg: float) -> f.ReadFault:
    rng = np.random.default_rng(3)

    def fault(_time_s: float, reading: Reading) -> Reading:
        off = radians(deviation_deg) * float(rng.standard_normal())
        return reading._replace(angle=reading.angle + off)

    return fault


def test_an_encoder_with_noise_arrives_where_its_noise_is_stated() -> None:
    stated = DeviceLimits(encoder_noise=radians(0.02))
    shown = present(read_fault=noisy(0.02), limits=stated)
    assert (shown.fault, shown.recording.facts["ended"]) == (None, "arrived")
    assert shown.recording.columns["time_s"][-1] < 2.0
    silent = present(read_fault=noisy(0.02), max_duration_s=2.5)
    assert silent.recording.facts["ended"] == "max-duration"


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("speed_deg_s", [75.0, 105.0])
def test_a_grip_is_lost_by_a_slip_and_not_by_the_noise_of_the_encoder(
    model: str, speed_deg_s: float
) -> None:
    limits = DeviceLimits(encoder_noise=radians(0.025))

    def shown(slip_time: float | None = None):
        return present(
            model,
            speed_deg_s,
            slip_time=slip_time,
            read_fault=noisy(0.025),
            limits=limits,
        ).recording

    held = shown()
    assert (held.facts["ended"], held.facts["grip_lost"]) == ("arrived", False)
    caught = np.flatnonzero(held.columns["phase"] == CATCH)
    slip_s = float(held.columns["time_s"][caught[caught.size // 3]])
    loose = shown(slip_s)
    released = (loose.columns["time_s"] > slip_s) & (loose.columns["phase"] == 0)
    assert loose.facts["grip_lost"] is True
    # 8 ms without noise; at most 19 ms in 60 slips with 0.03 deg
    assert loose.columns["time_s"][released][0] < slip_s + 0.025


def test_each_part_of_an_arrival_is_a_setting() -> None:
    def n_ticks(**limits: float) -> int:
        return present(limits=DeviceLimits(**limits)).recording.n_presented

    usual = n_ticks()
    # slow enough only at the end, where it was before
    assert n_ticks(arrival_angle=radians(60.0)) == usual
    assert n_ticks(arrival_speed=radians(200.0)) < usual
    assert n_ticks(arrival_time=0.2) == pytest.approx(usual + 100, abs=1)
    # 46 deg before the end of range
    for limits, ended in (
        (DeviceLimits(arrival_angle=radians(60.0)), "arrived"),
        (DeviceLimits(), "max-duration"),
    ):
        short = present(
            hand=stretching(86.0, end=radians(100.0)), limits=limits, max_duration_s=1.3
        )
        assert short.recording.facts["ended"] == ended

"""The loop of one presentation: pace, faults, endings, and the same result twice."""

import gc
import json
import math
import warnings
from dataclasses import replace
from math import radians

import numpy as np
import pytest

from masrel.errors import (
    DeviceError,
    OverrunWarning,
    ParameterError,
)
from masrel.lab.hess import (
    DeviceLimits,
    Reading,
    RealClock,
    SimulatedClock,
    open_device,
    run_presentation,
)
from masrel.lab.recording import RECORDING_COLUMNS, write_recording

from .rig import (
    LIMITS,
    START,
    ActingClock,
    Heard,
    Joint,
    ScriptedDevice,
    assert_straight_ramp,
    controls,
    missing,
    present,
    scripted,
    stretching,
)

PERIOD_NS = 1_000_000
# For arms that begin where the model asks for torque at once
LOADED = replace(LIMITS, standing_torque=20.0)


def ticks_ms(device: ScriptedDevice) -> list[float]:
    # When a torque was sent during the ticks: the closing zeros are left out.
    return [time_ns / PERIOD_NS for time_ns, _ in device.commands[:-2]]


# Pace


@pytest.mark.parametrize(
    ("late", "options", "ticks", "n_missed"),
    [
        ({}, {}, range(20), 0),
        ({}, {"rate_hz": 250}, range(0, 20, 4), 0),
        # With relative waits the last of 20 ticks would be 5.7 ms late.
        (
            dict.fromkeys(range(1, 21), 0.3),
            {},
            [0, *(n + 0.3 for n in range(1, 20))],
            0,
        ),
        # The sleep for tick 5 returns at 8.4 ms: 5, 6 and 7 are over, 8 is due.
        ({5: 3.4}, {}, [0, 1, 2, 3, 4, 8.4, *range(9, 20)], 3),
        # One nanosecond before the next it is late, not missed
        ({5: 0.999_999}, {}, [0, 1, 2, 3, 4, 5.999_999, *range(6, 20)], 0),
        # 15 to 19 are missed: there was no 20th to miss
        ({15: 30}, {"limits": DeviceLimits(missed_ticks=30)}, range(15), 5),
    ],
)
@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")
def test_ticks_come_at_absolute_deadlines_or_are_skipped_and_counted(
    late: dict[int, float], options: dict, ticks: list[float], n_missed: int
) -> None:
    clock = ActingClock(missing({n * 1e-3: ms * 1e-3 for n, ms in late.items()}))
    device, presented = scripted(clock=clock, **options)
    assert ticks_ms(device) == pytest.approx(list(ticks), abs=1e-9)
    assert presented.n_missed_ticks == n_missed
    assert presented.recording.facts["n_missed_ticks"] == n_missed
    assert presented.recording.facts["ended"] == "max-duration"


def test_the_time_in_the_recording_begins_at_zero_and_shows_the_gap() -> None:
    clock = ActingClock(missing({0.001: 0.002}), start_ns=999_000_005)
    with pytest.warns(OverrunWarning, match="missed 2 ticks, which were skipped"):
        _, presented = scripted(clock=clock)
    time_ms = presented.recording.columns["time_s"] * 1e3
    assert time_ms == pytest.approx([0, *range(3, 20)], abs=1e-9)


@pytest.mark.parametrize(("apart_s", "fault"), [(0.11, None), (0.09, "overrun")])
@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")
def test_a_long_presentation_may_miss_ticks_at_the_rate_of_a_short_one(
    apart_s: float, fault: str | None
) -> None:
    # one tick every 0.11 s: 18 or 19 of any 2000, but 45 in 5 s
    at = (round(n * apart_s, 3) for n in range(1, 500))
    clock = ActingClock(missing({at_s: 0.0012 for at_s in at if at_s < 5.0}))
    _, presented = scripted(clock=clock, max_duration_s=5.0)
    assert (presented.fault and presented.fault.kind) == fault
    assert presented.n_missed_ticks == (45 if fault is None else 21)


# Faults


def test_too_fast_an_arm_is_a_fault_that_is_named_and_latched() -> None:
    clock = SimulatedClock()
    device = open_device("simulated", clock=clock, hand=stretching(130.0))
    limits = DeviceLimits(speed=radians(100.0))
    presented = run_presentation(device, controls(), clock=clock, limits=limits)
    assert presented.fault is not None
    assert presented.fault.message.startswith(
        "speed: needs at most 100 deg/s, the arm moves"
    )
    assert not device.is_open
    with pytest.raises(DeviceError, match="needs an open device to present on"):
        run_presentation(device, controls(), clock=clock, limits=LIMITS)


def test_a_fault_leaves_the_recording_up_to_its_moment() -> None:
    limits = DeviceLimits(speed=radians(100.0))
    presented = present("HM3", 130.0, limits=limits)
    columns, facts = presented.recording.columns, presented.recording.facts
    assert facts["fault"] == presented.fault.message
    assert (facts["fault_kind"], facts["ended"]) == ("speed", "fault")
    before = columns["time_s"] < presented.fault.time_s
    assert np.all(np.abs(columns["velocity_deg_s"][before]) <= 100.0)
    # From then on what was too much is held, and the torque goes down to zero.
    assert np.all(columns["velocity_deg_s"][~before] > 100.0)
    assert np.unique(columns["angle_deg"][~before]).size == 1
    whole = present("HM3", 130.0).recording.columns
    for name in RECORDING_COLUMNS[:-1]:  # a stretch is one after 3 deg only
        kept = columns[name][before]
        np.testing.assert_array_equal(kept, whole[name][: kept.size])


# 0.5 rad from where the model begins its spring gives 3.15 times that, until the arm is
# where it cannot be.
@pytest.mark.parametrize(
    ("rate_hz", "ramp_time"),
    [
        *((1000, time_s) for time_s in (0.0, 0.02, 0.05, 0.0505, 0.1)),
        *((300, 0.1), (100, 0.095), (7, 0.1)),
    ],
)
def test_a_fault_brings_the_torque_to_zero_in_a_straight_line(
    rate_hz: int, ramp_time: float
) -> None:
    device, presented = scripted(
        lambda t: START + 0.5 if t < 0.5 else radians(-8.0),
        rate_hz=rate_hz,
        max_duration_s=2.0,
        limits=DeviceLimits(ramp_time=ramp_time, watchdog_time=1.0),
    )
    fault, columns = presented.fault, presented.recording.columns
    assert fault is not None
    assert fault.torque_nm == pytest.approx(1.575)  # sent in the last tick before
    since_s = [time_ns * 1e-9 - fault.time_s for time_ns, _ in device.commands]
    torques = [torque for _, torque in device.commands]
    zero_s = next(
        at_s
        for at_s, torque in zip(since_s, torques, strict=True)
        if at_s > -0.1 and torque == 0.0
    )
    assert zero_s == pytest.approx(ramp_time, abs=1e-9)
    for at_s, torque in zip(since_s, torques, strict=True):
        if 0.0 < at_s < zero_s:
            assert torque == pytest.approx(1.575 * (1.0 - at_s / ramp_time))
    assert columns["command_torque_nm"][-1] == 0.0
    assert columns["time_s"][-1] <= fault.time_s + ramp_time + 1e-9


def test_a_watchdog_that_ends_does_not_make_the_torque_fall_at_once() -> None:
    heard = Heard(ends_ms=200.0)
    device, presented = scripted(
        lambda _: START + 0.5, clock=heard.clock, watchdog=heard, max_duration_s=0.4
    )
    assert presented.fault is not None
    assert presented.fault.message == (
        "watchdog: has ended; ramping down: watchdog: has ended"
    )
    ramp = [torque for time_ns, torque in device.commands if time_ns > 200 * PERIOD_NS]
    assert ramp[:50] == pytest.approx([1.575 * (1 - n / 50) for n in range(1, 51)])


@pytest.mark.parametrize(
    ("duration_s", "limits", "said"),
    [
        (0.021, LIMITS, [0.0, 5.0, 10.0, 15.0, 20.0, "rest"]),
        # four times before it would be too late
        (0.005, DeviceLimits(watchdog_time=0.004), [0.0, 1.0, 2.0, 3.0, 4.0, "rest"]),
    ],
)
def test_the_watchdog_hears_in_time_and_is_let_rest_at_the_end(
    duration_s: float, limits: DeviceLimits, said: list
) -> None:
    heard = Heard()
    scripted(
        clock=heard.clock, watchdog=heard, max_duration_s=duration_s, limits=limits
    )
    assert heard.said == said


def test_at_a_fault_zero_is_the_last_torque_and_the_device_is_let_go() -> None:
    device, presented = scripted(lambda t: START if t < 0.0095 else radians(-8.0))
    assert presented.fault.message == (
        "range: needs -5.0 to 185.0 deg, the arm is at -8.0 deg"
    )
    assert device.commands[-1] == (10 * PERIOD_NS, 0.0)  # at rest: nothing to ramp
    assert device.stopped
    assert len(device.commands) == 12  # ticks 0 to 9, and zero twice


SILENT = (
    "missed replies: needs at most 2 ticks in a row without a new reading, got 3 "
    "(scripted: no answer)"
)
DEAF = "scripted: does not listen"


def even(time_s: float) -> float:
    return START + 2.0 * time_s


# Two ticks without a reading are let pass, a command that is not taken is not.
@pytest.mark.parametrize(
    ("after", "kind", "message", "last_s"),
    [
        # and the ramp
        ({"is_lost": lambda n: n >= 6}, "missed-replies", SILENT, 58e-3),
        (
            {"deaf_after": 6},
            "no-answer",
            f"{DEAF}; ramping down: {DEAF}; closing it: {DEAF}",
            7e-3,
        ),
        (
            {"is_lost": lambda n: n >= 6, "deaf_after": 6},
            "missed-replies",
            f"{SILENT}; ramping down: {DEAF}; closing it: {DEAF}",
            9e-3,
        ),
        ({"is_lost": lambda _n: True}, "missed-replies", SILENT, None),
    ],
)
def test_a_device_that_fails_is_a_fault_with_its_own_words(
    after: dict[str, int], kind: str, message: str, last_s: float | None, tmp_path
) -> None:
    device, presented = scripted(device=ScriptedDevice(angle=even, **after))
    assert presented.fault is not None
    assert (presented.fault.kind, presented.fault.message) == (kind, message)
    assert not device.is_open
    assert device.stopped  # also when it does not take the zero
    write_recording(presented.recording, tmp_path / "a.npz")
    times = presented.recording.columns["time_s"].tolist()
    # nothing was moved by one that never answers
    assert times[-1:] == ([] if last_s is None else [pytest.approx(last_s)])


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf, radians(200.0)])
def test_a_fault_of_the_encoder_leaves_a_recording_that_can_be_written(
    angle: float, tmp_path
) -> None:
    # The arm moves at 57 deg/s, 1 rad/s, when the encoder fails.
    _, presented = scripted(lambda t: START + t if t < 0.0175 else angle)
    assert presented.fault is not None
    assert presented.fault.message.startswith("range: ")
    write_recording(presented.recording, tmp_path / "fault.npz")
    facts = json.loads((tmp_path / "fault.json").read_text())
    assert facts["fault"] == presented.fault.message
    assert facts["mean_speed_deg_s"] is None  # no catch, and the last angle is wrong


@pytest.mark.parametrize(
    "reading", [None, "1.0", (1, 2.0), Reading(0, "2.0"), Reading(0.5, 2.0)]
)
def test_what_is_no_reading_is_a_fault_with_the_ramp(reading: object) -> None:
    def wrong(time_s: float, right: Reading) -> object:
        return right if time_s < 1.1 else reading

    presented = present(read_fault=wrong)
    assert_straight_ramp(presented, "device")
    assert presented.fault.torque_nm > 1.0


def test_what_is_faded_in_never_pushes_the_other_way() -> None:
    joint = Joint(lambda t, _a, _v: 1.5 if t < 0.03 else 0.2, is_passive=True)
    columns = scripted(model=joint, max_duration_s=0.12)[1].recording.columns
    torque = columns["command_torque_nm"]
    assert torque[0] == 0.0
    assert np.all(torque >= 0.0)
    np.testing.assert_allclose(torque[100:120], 0.2, rtol=1e-12)


@pytest.mark.parametrize(
    ("angle_deg", "pushed_nm"),
    [(183.0, 6.0), (182.5, 5.0), (-2.0, -4.0), (0.0, 0.0), (180.0, 0.0)],
)
def test_a_soft_stop_pushes_back_and_the_model_does_not_know(
    angle_deg: float, pushed_nm: float
) -> None:
    # 10 N·m over 5 deg: 3 deg into the upper one 6 N·m, 2 deg into the lower one -4.
    start = radians(angle_deg)
    for limits, expected in (
        (LOADED, pushed_nm),
        (replace(LOADED, soft_stop_torque=0.0), 0.0),
    ):
        _, presented = scripted(
            lambda _: start, controls(start_angle=start), limits=limits
        )
        columns = presented.recording.columns
        pushed = columns["command_torque_nm"][: presented.recording.n_presented]
        # all of it after 100 ms, from nothing on
        np.testing.assert_allclose(pushed[100:], expected, rtol=1e-12, atol=1e-12)
        assert pushed[0] == 0.0
        np.testing.assert_array_equal(columns["model_torque_nm"], 0.0)


def test_the_device_is_asked_for_its_state_every_50_ms() -> None:
    asked = []

    class Asked(ScriptedDevice):
        def _check(self) -> None:
            asked.append(self.clock.now_ns() / PERIOD_NS)

    scripted(device=Asked(SimulatedClock()), max_duration_s=0.21)
    assert asked == [50.0, 100.0, 150.0, 200.0]


# Exceptions that are no fault of the device


# In a tick, with a device that takes no zero, and within the ramp of a fault, which is
# noticed in tick 12: ten ticks, and eight commands of the ramp
@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit, OSError])
@pytest.mark.parametrize(
    ("at_ms", "after", "n_sent"),
    [
        (7, {}, 8),
        (7, {"deaf_after": 7}, 7),
        (21, {"is_lost": lambda n: n >= 10, "deaf_after": 18}, 18),
    ],
)
def test_an_exception_leaves_zero_torque_and_a_closed_device(
    interruption: type[BaseException], at_ms: int, after: dict[str, int], n_sent: int
) -> None:
    def interrupt(_clock: SimulatedClock) -> None:
        raise interruption

    clock = ActingClock({at_ms * 1e-3: interrupt})
    device = ScriptedDevice(clock, even, **after)
    with pytest.raises(interruption) as caught:
        scripted(device=device, max_duration_s=1.0)
    assert len(device.commands) == n_sent
    assert device.stopped
    assert not device.is_open
    if not after:
        assert device.commands[-1] == (at_ms * PERIOD_NS, 0.0)
    else:
        said = ["closing the device: scripted: does not listen"]
        assert caught.value.__notes__ == said


@pytest.mark.parametrize("collecting", [True, False])
def test_the_collector_is_off_during_the_ticks_and_as_before_afterwards(
    collecting: bool,
) -> None:
    seen = []

    def angle(_time_s: float) -> float:
        seen.append(gc.isenabled())
        return START

    was = gc.isenabled()
    try:
        (gc.enable if collecting else gc.disable)()
        scripted(angle)
        assert gc.isenabled() is collecting
    finally:
        (gc.enable if was else gc.disable)()
    assert not any(seen)


# Endings


def test_it_ends_when_the_arm_has_rested_at_the_end() -> None:
    presented = present("HM2", 90.0)
    columns, facts = presented.recording.columns, presented.recording.facts
    assert facts["ended"] == "arrived"
    resting = (columns["angle_deg"] >= 143.0) & (np.abs(columns["velocity_deg_s"]) <= 5)
    end = presented.recording.n_presented
    since = end - int(np.argmin(resting[:end][::-1]))
    rested_s = columns["time_s"][end - 1] - columns["time_s"][since]
    assert rested_s == pytest.approx(0.1, abs=1e-9)


@pytest.mark.parametrize(("start_deg", "end_deg"), [(0.0, 146.0), (30.0, 180.0)])
def test_a_stretch_may_use_the_whole_range(start_deg: float, end_deg: float) -> None:
    # The end stop gives way by 0.03 deg: beyond 180 deg, and no fault.
    start, end = radians(start_deg), radians(end_deg)
    hand = stretching(90.0, start=start, end=end)
    presented = present(hand=hand, range_end=end, end_angle=end)
    assert presented.fault is None
    assert presented.recording.facts["ended"] == "arrived"


def test_a_rest_before_the_end_does_not_end_it() -> None:
    device, presented = scripted(
        lambda _: radians(142.9), max_duration_s=0.3, limits=LOADED
    )
    assert presented.recording.facts["ended"] == "max-duration"
    assert presented.recording.n_presented == 300
    assert len(ticks_ms(device)) == 400  # and the ramp


def test_a_rest_that_is_broken_off_begins_anew() -> None:
    # At 145 deg, but between 50 and 60 ms back at 120 deg.
    lenient = {"speed": 1e5, "torque": 1e5, "torque_rate": 1e9, "jump_angle": 10.0}
    _, presented = scripted(
        lambda time_s: radians(120.0 if 0.0495 < time_s < 0.0605 else 145.0),
        max_duration_s=1.0,
        limits=DeviceLimits(**lenient, frozen_time=1.0, standing_torque=20.0),
    )
    # There again at 61 ms, at rest when the low-pass has forgotten the jump.
    assert presented.recording.facts["ended"] == "arrived"
    assert presented.recording.columns["time_s"][-1] > 0.161


def test_without_a_fault_it_ends_with_zero_torque_and_stays_open() -> None:
    clock = SimulatedClock()
    with ScriptedDevice(clock, lambda _: radians(145.0)) as device:
        used = controls()
        presented = run_presentation(device, used, clock=clock, limits=LOADED)
        assert presented.recording.facts["ended"] == "arrived"
        assert device.is_open
        assert [torque for _, torque in device.commands[-2:]] == [0.0, 0.0]
        assert device.commands[-3][1] > 0.0
        with pytest.raises(ParameterError, match="controller: needs a new one"):
            run_presentation(device, used, clock=clock, limits=LOADED)
        assert device.is_open


# The result


# What is refused


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rate_hz": 0}, "rate_hz"),
        ({"max_duration_s": 0.0}, "max_duration_s"),
        ({"max_duration_s": math.inf}, "max_duration_s"),
        ({"max_duration_s": math.nan}, "max_duration_s"),
        ({"end_angle": math.nan}, "end_angle"),
        ({"end_angle": math.inf}, "end_angle"),
        ({"rate_hz": 250}, "needs the controller's 1000 Hz, got 250"),
        # A watchdog that cannot hear every tick in time
        (
            {"limits": DeviceLimits(watchdog_time=0.0015)},
            "watchdog_time: needs two ticks or more",
        ),
        ({"rate_hz": 7}, "watchdog_time: needs two ticks or more, at 7 Hz"),
    ],
)
def test_what_cannot_be_run_is_refused_before_anything_moves(
    change: dict, words: str
) -> None:
    device = ScriptedDevice(SimulatedClock())
    with device:
        with pytest.raises(ParameterError, match=words):
            scripted(device=device, model=controls(), **change)
        assert device.n_reads == 0
        assert device.commands == []


def test_with_a_real_clock_it_goes_the_same_way() -> None:
    # A short stretch, 100 to 146 deg at 110 deg/s: about 0.6 s with the rests. How
    # late the machine is may differ, so every tick may be missed without a fault, and
    # a reading may be as old as the machine was away.
    limits = DeviceLimits(missed_ticks=2_000, watchdog_time=1.0, stale_time=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OverrunWarning)
        real, simulated = (
            present(
                "HM1",
                hand=stretching(110.0, start=radians(100.0)),
                clock=clock,
                limits=limits,
                max_duration_s=1.4,
            ).recording
            for clock in (RealClock(), SimulatedClock())
        )
    assert real.facts["fault"] is None
    assert real.facts["ended"] == simulated.facts["ended"] == "arrived"
    assert real.facts["phases"] == simulated.facts["phases"]
    times = real.columns["time_s"]
    assert np.all(np.diff(times) > 0.0)
    # Every tick was run or counted as missed.
    n_ticks = real.n_samples + real.facts["n_missed_ticks"]
    assert n_ticks == math.floor(times[-1] * 1000) + 1
    angles = np.interp(
        times, simulated.columns["time_s"], simulated.columns["angle_deg"]
    )
    np.testing.assert_allclose(real.columns["angle_deg"], angles, atol=2.0)

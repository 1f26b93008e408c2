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
    DeviceTimeoutError,
    OverrunWarning,
    ParameterError,
)
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    RealClock,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.recording import RECORDING_COLUMNS, write_recording

from .rig import LIMITS, START, ScriptedDevice, present

PERIOD_NS = 1_000_000


class LateClock(SimulatedClock):
    """A simulated clock whose sleep returns late at chosen deadlines."""

    __slots__ = ("deadlines", "overshoots")

    def __init__(self, overshoots: dict[int, int], start_ns: int = 0) -> None:
        super().__init__(start_ns)
        self.overshoots = overshoots  # deadline ns -> how late, ns
        self.deadlines: list[int] = []

    def sleep_until_ns(self, deadline_ns: int) -> None:
        self.deadlines.append(deadline_ns)
        late_ns = self.overshoots.get(deadline_ns, 0)
        super().sleep_until_ns(deadline_ns + late_ns)


def rest(clock, *, angle=lambda _time_s: START, limits=LIMITS, **options):
    # One presentation of HM3 on a scripted device -> device, presented
    device = ScriptedDevice(clock, angle)
    options = {"max_duration_s": 0.02, "rate_hz": 1000, **options}
    controller = Controller(
        STANDARD_MODELS["HM3"], start_angle=START, rate_hz=options["rate_hz"]
    )
    device.open()
    presented = run_presentation(
        device, controller, clock=clock, limits=limits, **options
    )
    device.close()
    return device, presented


def ticks_ms(device: ScriptedDevice) -> list[float]:
    # When a torque was sent during the ticks: the closing zeros are left out.
    return [time_ns / PERIOD_NS for time_ns, _ in device.commands[:-2]]


# Pace


def test_every_tick_comes_at_its_absolute_deadline() -> None:
    device, _ = rest(SimulatedClock(start_ns=7_000_000))
    assert ticks_ms(device) == list(range(7, 27))


def test_a_little_lateness_does_not_move_the_deadlines_after_it() -> None:
    # Every sleep returns 0.3 ms late: with relative waits the last of 20 ticks would
    # be 5.7 ms late.
    clock = LateClock({n * PERIOD_NS: 300_000 for n in range(1, 21)})
    device, presented = rest(clock)
    assert ticks_ms(device) == [0.0, *(n + 0.3 for n in range(1, 20))]
    assert clock.deadlines == [n * PERIOD_NS for n in range(1, 21)]
    assert presented.n_missed_ticks == 0


def test_a_late_tick_is_skipped_and_counted_never_sent_in_a_burst() -> None:
    # The sleep for tick 5 returns at 8.4 ms: 5, 6 and 7 are over, 8 is due.
    clock = LateClock({5 * PERIOD_NS: 3_400_000})
    with pytest.warns(OverrunWarning, match="missed 3 ticks, which were skipped"):
        device, presented = rest(clock)
    assert ticks_ms(device) == [0, 1, 2, 3, 4, 8.4, *range(9, 20)]
    assert presented.n_missed_ticks == 3
    assert presented.recording.facts["n_missed_ticks"] == 3
    assert presented.fault is None


def test_a_tick_one_nanosecond_before_the_next_one_is_late_but_not_missed() -> None:
    clock = LateClock({5 * PERIOD_NS: PERIOD_NS - 1})
    device, presented = rest(clock)
    assert presented.n_missed_ticks == 0
    assert len(ticks_ms(device)) == 20


def test_the_presentation_is_not_prolonged_by_what_it_missed() -> None:
    clock = LateClock({15 * PERIOD_NS: 30 * PERIOD_NS})
    with pytest.warns(OverrunWarning):
        device, presented = rest(clock, limits=limits_with(missed_ticks=30))
    assert ticks_ms(device) == list(range(15))
    assert presented.recording.facts["ended"] == "max-duration"
    assert presented.n_missed_ticks == 5  # 15 to 19: there was no 20th to miss


def test_the_time_in_the_recording_begins_at_zero_and_shows_the_gap() -> None:
    clock = LateClock({1_000_000_005: 2_000_000}, start_ns=999_000_005)
    with pytest.warns(OverrunWarning):
        _, presented = rest(clock)
    time_ms = presented.recording.columns["time_s"] * 1e3
    assert time_ms == pytest.approx([0, *range(3, 20)], abs=1e-9)


def test_another_rate_has_another_period() -> None:
    device, presented = rest(SimulatedClock(), rate_hz=250)
    assert ticks_ms(device) == [0, 4, 8, 12, 16]
    assert presented.recording.facts["rate_hz"] == 250


# Faults


# For arms that begin where the model asks for torque at once
LOADED = replace(LIMITS, standing_torque=20.0)


def limits_with(**change: float) -> DeviceLimits:
    usual = {"torque": 20.0, "speed": radians(400.0), "missed_ticks": 20}
    return DeviceLimits(**{**usual, **change})


def test_too_fast_an_arm_is_a_fault_that_is_named_and_latched() -> None:
    clock = SimulatedClock()
    hand = SimulatedHand(start=START, end=radians(146.0), mean_speed=radians(130.0))
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    device = open_device("simulated", clock=clock, hand=hand)
    presented = run_presentation(
        device, controller, clock=clock, limits=limits_with(speed=radians(100.0))
    )
    assert presented.fault is not None
    assert presented.fault.message.startswith(
        "speed: needs at most 100 deg/s, the arm moves"
    )
    assert not device.is_open
    for act in (device.open, device.read, lambda: device.command(0.0)):
        with pytest.raises(DeviceError):
            act()
    fresh = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with pytest.raises(DeviceError, match="needs an open device to present on"):
        run_presentation(device, fresh, clock=clock, limits=LIMITS)


def test_a_fault_leaves_the_recording_up_to_its_moment() -> None:
    presented = present("HM3", 130.0, limits=limits_with(speed=radians(100.0)))
    columns, facts = presented.recording.columns, presented.recording.facts
    assert facts["fault"] == presented.fault.message
    assert facts["fault_kind"] == "speed"
    assert facts["ended"] == "fault"
    before = columns["time_s"] < presented.fault.time_s
    assert np.all(np.abs(columns["velocity_deg_s"][before]) <= 100.0)
    # From then on what was too much is held, and the torque goes down to zero.
    assert np.all(columns["velocity_deg_s"][~before] > 100.0)
    assert np.unique(columns["angle_deg"][~before]).size == 1
    whole = present("HM3", 130.0).recording.columns
    for name in RECORDING_COLUMNS[:-1]:  # a stretch is one after 3 deg only
        kept = columns[name][before]
        np.testing.assert_array_equal(kept, whole[name][: kept.size])


@pytest.mark.parametrize("ramp_time", [0.0, 0.02, 0.05, 0.1])
def test_a_fault_brings_the_torque_to_zero_in_a_straight_line(ramp_time) -> None:
    limits = limits_with(torque=9.0, ramp_time=ramp_time)
    presented = present("HM4", 110.0, limits=limits)
    columns, fault = presented.recording.columns, presented.fault
    since = columns["time_s"] - fault.time_s
    torque = columns["command_torque_nm"][since >= 0.0]
    since = since[since >= 0.0]
    assert fault.torque_nm > 4.0  # what was sent in the last tick before
    line = fault.torque_nm * (1.0 - since / ramp_time) if ramp_time else [0.0]
    np.testing.assert_allclose(torque, line, atol=1e-9)
    assert torque[-1] == 0.0
    assert since[-1] <= ramp_time + 1e-9


@pytest.mark.parametrize(
    ("rate_hz", "ramp_time"), [(300, 0.1), (100, 0.095), (7, 0.1), (1000, 0.0505)]
)
def test_a_ramp_is_over_in_time_at_any_rate(rate_hz: int, ramp_time: float) -> None:
    # 0.5 rad from where the model begins its spring gives 3.15 times that, until the
    # arm is where it cannot be.
    device, presented = rest(
        SimulatedClock(),
        angle=lambda t: START + 0.5 if t < 0.5 else radians(-8.0),
        rate_hz=rate_hz,
        max_duration_s=2.0,
        limits=limits_with(ramp_time=ramp_time, watchdog_time=1.0),
    )
    fault = presented.fault
    assert fault is not None
    assert fault.torque_nm == pytest.approx(1.575)
    since_s = [time_ns * 1e-9 - fault.time_s for time_ns, _ in device.commands]
    torques = [torque for _, torque in device.commands]
    zero_s = since_s[torques.index(0.0)]
    assert zero_s == pytest.approx(ramp_time, abs=1e-9)
    for at_s, torque in zip(since_s, torques, strict=True):
        if 0.0 < at_s < zero_s:
            assert torque == pytest.approx(1.575 * (1.0 - at_s / ramp_time))


def test_a_watchdog_that_ends_does_not_make_the_torque_fall_at_once() -> None:
    class Ending:
        def beat(self) -> None:
            if clock.now_ns() >= 200 * PERIOD_NS:
                raise DeviceError("watchdog: has ended")

        rest = beat

    clock = SimulatedClock()
    device, presented = rest(
        clock,
        angle=lambda _: START + 0.5,
        max_duration_s=0.4,
        watchdog=Ending(),
    )
    assert presented.fault is not None
    assert presented.fault.message == (
        "watchdog: has ended; ramping down: watchdog: has ended"
    )
    ramp = [torque for time_ns, torque in device.commands if time_ns > 200 * PERIOD_NS]
    assert ramp[:50] == pytest.approx([1.575 * (1 - n / 50) for n in range(1, 51)])


def test_at_a_fault_zero_is_the_last_torque_and_the_device_is_let_go() -> None:
    clock = SimulatedClock()
    device, presented = rest(
        clock, angle=lambda t: START if t < 0.0095 else radians(-8.0)
    )
    assert presented.fault.message == (
        "range: needs -5.0 to 185.0 deg, the arm is at -8.0 deg"
    )
    assert device.commands[-1] == (10 * PERIOD_NS, 0.0)  # at rest: nothing to ramp
    assert device.stopped
    assert len(device.commands) == 12  # ticks 0 to 9, and zero twice


def test_more_missed_ticks_than_allowed_are_a_fault() -> None:
    clock = LateClock({5 * PERIOD_NS: 3_400_000})
    with pytest.warns(OverrunWarning, match="missed 3 ticks"):
        device, presented = rest(clock, limits=limits_with(missed_ticks=2))
    assert presented.fault.message == (
        "missed ticks: needs at most 2 of any 2000, the loop missed 3 of 3"
    )
    assert device.commands[-1] == (8_400_000, 0.0)
    assert presented.n_missed_ticks == 3
    assert presented.recording.columns["time_s"][-1] == pytest.approx(8.4e-3)


@pytest.mark.parametrize(("apart_s", "fault"), [(0.11, None), (0.09, "overrun")])
def test_a_long_presentation_may_miss_ticks_at_the_rate_of_a_short_one(
    apart_s: float, fault: str | None
) -> None:
    # one tick every 0.11 s: 18 or 19 of any 2000, but 45 in 5 s
    at = (round(n * apart_s * 1e3) for n in range(1, 500))
    clock = LateClock({tick * PERIOD_NS: 1_200_000 for tick in at if tick < 5000})
    with pytest.warns(OverrunWarning):
        _, presented = rest(clock, max_duration_s=5.0)
    assert (presented.fault and presented.fault.kind) == fault
    assert presented.n_missed_ticks == (45 if fault is None else 21)


def test_a_torque_above_the_limit_is_never_sent_and_stops_the_presentation() -> None:
    presented = present("HM4", 110.0, limits=limits_with(torque=5.0))
    columns = presented.recording.columns
    assert presented.fault is not None
    assert presented.fault.message.startswith("torque: needs at most 5 N·m, got 1")
    assert presented.recording.facts["ended"] == "fault"
    assert np.max(np.abs(columns["command_torque_nm"])) <= 5.0
    # The last samples keep what the model asked for, in the first tick of the catch.
    since = columns["time_s"] >= presented.fault.time_s
    assert np.all(columns["model_torque_nm"][since] > 5.0)
    assert columns["command_torque_nm"][-1] == 0.0
    assert set(columns["phase"][since]) == {1}
    assert columns["phase"][~since][-1] == 0


def test_a_torque_that_is_no_number_is_a_fault() -> None:
    clock = SimulatedClock()
    device = ScriptedDevice(clock)
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=math.nan)
    with device:
        presented = run_presentation(device, controller, clock=clock, limits=LIMITS)
    words = "model: needs a torque that is a finite number, got nan"
    assert presented.fault.message == words
    assert [torque for _, torque in device.commands] == [0.0, 0.0]  # end, closing


@pytest.mark.parametrize("attribute", ["silent_after", "deaf_after"])
def test_a_device_that_fails_is_a_fault_with_its_own_words(attribute: str) -> None:
    clock = SimulatedClock()
    device = ScriptedDevice(clock)
    setattr(device, attribute, 6)
    device.open()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    presented = run_presentation(device, controller, clock=clock, limits=LIMITS)
    assert presented.fault is not None
    assert "scripted: " in presented.fault.message
    assert not device.is_open
    assert device.stopped  # also when it does not take the zero
    # Two ticks without a reading are let pass, a command that is not taken is not.
    late = {"silent_after": 8e-3, "deaf_after": 6e-3}[attribute]
    assert presented.recording.columns["time_s"][-1] == pytest.approx(late)
    kind = {"silent_after": "missed-replies", "deaf_after": "no-answer"}[attribute]
    assert presented.fault.kind == kind


def test_what_goes_wrong_while_closing_is_added_to_the_fault() -> None:
    clock = SimulatedClock()
    device = ScriptedDevice(clock)
    device.silent_after = device.deaf_after = 6
    device.open()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    presented = run_presentation(device, controller, clock=clock, limits=LIMITS)
    assert presented.fault.message == (
        "missed replies: needs a new reading after at most 2 ticks without, got 3 in a "
        "row (scripted: no answer); ramping down: scripted: does not listen; "
        "closing it: scripted: does not listen"
    )


def test_replies_that_come_again_after_two_ticks_are_no_fault() -> None:
    class Patchy(ScriptedDevice):
        def _read(self):
            reading = super()._read()
            if 4 <= self.n_reads % 10 <= 5:
                raise DeviceTimeoutError("scripted: no answer")
            return reading

    clock = SimulatedClock()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with Patchy(clock) as device:
        presented = run_presentation(
            device, controller, clock=clock, limits=LIMITS, max_duration_s=0.03
        )
    assert presented.fault is None
    assert presented.recording.facts["n_missed_replies"] == 6
    assert presented.recording.n_samples == 24  # nothing is recorded without a reading


def test_readings_that_are_not_newer_than_the_last_one_are_a_fault() -> None:
    class StuckDevice(ScriptedDevice):
        def _read(self):
            reading = super()._read()
            return reading._replace(time_ns=min(reading.time_ns, 5 * PERIOD_NS))

    clock = SimulatedClock()
    device = StuckDevice(clock)
    device.open()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    presented = run_presentation(device, controller, clock=clock, limits=LIMITS)
    assert presented.fault is not None
    assert presented.fault.kind == "missed-replies"
    assert presented.fault.message.endswith("(one of 0.005000 s again)")
    assert not device.is_open


def test_a_device_that_never_answers_leaves_an_empty_recording(tmp_path) -> None:
    clock = SimulatedClock()
    device = ScriptedDevice(clock)
    device.silent_after = 0
    device.open()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    presented = run_presentation(device, controller, clock=clock, limits=LIMITS)
    assert presented.fault.message.endswith("(scripted: no answer)")
    assert presented.recording.n_samples == 0
    assert presented.recording.facts["phases"] == ""
    write_recording(presented.recording, tmp_path / "empty.npz")


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf, radians(200.0)])
def test_a_fault_of_the_encoder_leaves_a_recording_that_can_be_written(
    angle: float, tmp_path
) -> None:
    # The arm moves at 57 deg/s, 1 rad/s, when the encoder fails.
    _, presented = rest(
        SimulatedClock(), angle=lambda t: START + t if t < 0.0175 else angle
    )
    assert presented.fault is not None
    assert presented.fault.message.startswith("range: ")
    write_recording(presented.recording, tmp_path / "fault.npz")
    facts = json.loads((tmp_path / "fault.json").read_text())
    assert facts["fault"] == presented.fault.message
    assert facts["mean_speed_deg_s"] is None  # no catch, and the last angle is wrong


@pytest.mark.parametrize(("angle_deg", "pushed_nm"), [(183.0, 6.0), (-2.0, -4.0)])
def test_a_soft_stop_pushes_back_and_the_model_does_not_know(
    angle_deg: float, pushed_nm: float
) -> None:
    # 10 N·m over 5 deg: 3 deg into the upper one 6 N·m, 2 deg into the lower one -4.
    clock = SimulatedClock()
    start = radians(angle_deg)
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=start)
    with ScriptedDevice(clock, lambda _: start) as device:
        presented = run_presentation(
            device, controller, clock=clock, limits=LOADED, max_duration_s=0.05
        )
    columns = presented.recording.columns
    pushed = columns["command_torque_nm"][: presented.recording.n_presented]
    np.testing.assert_allclose(pushed, pushed_nm, rtol=1e-12)
    np.testing.assert_array_equal(columns["model_torque_nm"], 0.0)


def test_an_arm_that_is_not_at_its_start_is_a_fault_before_any_torque() -> None:
    # At 145 deg the spring alone would ask for 3.15 · 115° = 6.3 N·m.
    device, presented = rest(SimulatedClock(), angle=lambda _: radians(145.0))
    fault = presented.fault
    assert fault is not None
    assert fault.kind == "start"
    assert "at 145.0 deg asks for 6.322 N·m; bring it to where" in fault.message
    assert fault.torque_nm == 0.0
    assert [torque for _, torque in device.commands] == [0.0] * len(device.commands)


def test_the_device_is_asked_for_its_state_every_50_ms() -> None:
    asked = []

    class Asked(ScriptedDevice):
        def _check(self) -> None:
            asked.append(self.clock.now_ns() / PERIOD_NS)

    clock = SimulatedClock()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with Asked(clock) as device:
        run_presentation(
            device, controller, clock=clock, limits=LIMITS, max_duration_s=0.21
        )
    assert asked == [50.0, 100.0, 150.0, 200.0]


def test_the_watchdog_hears_every_5_ms_and_is_let_rest_at_the_end() -> None:
    heard = []

    class Watching:
        def beat(self) -> None:
            heard.append(clock.now_ns() / PERIOD_NS)

        def rest(self) -> None:
            heard.append("rest")

    clock = SimulatedClock()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with ScriptedDevice(clock) as device:
        run_presentation(
            device,
            controller,
            clock=clock,
            limits=LIMITS,
            max_duration_s=0.021,
            watchdog=Watching(),
        )
    assert heard == [0.0, 5.0, 10.0, 15.0, 20.0, "rest"]


def test_a_watchdog_that_waits_less_hears_more_often() -> None:
    heard = []

    class Watching:
        def beat(self) -> None:
            heard.append(clock.now_ns() / PERIOD_NS)

        def rest(self) -> None:
            pass

    clock = SimulatedClock()
    limits = limits_with(watchdog_time=0.004)
    rest(clock, watchdog=Watching(), limits=limits, max_duration_s=0.005)
    assert heard == [0.0, 1.0, 2.0, 3.0, 4.0]  # four times before it would be too late


# Exceptions that are no fault of the device


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit, OSError])
def test_an_exception_leaves_zero_torque_and_a_closed_device(interruption) -> None:
    class InterruptedClock(SimulatedClock):
        def sleep_until_ns(self, deadline_ns: int) -> None:
            super().sleep_until_ns(deadline_ns)
            if deadline_ns == 7 * PERIOD_NS:
                raise interruption

    clock = InterruptedClock()
    device = ScriptedDevice(clock)
    device.open()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with pytest.raises(interruption):
        run_presentation(device, controller, clock=clock, limits=LIMITS)
    assert device.commands[-1] == (7 * PERIOD_NS, 0.0)
    assert device.stopped
    assert not device.is_open


def test_an_exception_says_when_the_zero_was_not_taken() -> None:
    class InterruptedClock(SimulatedClock):
        def sleep_until_ns(self, deadline_ns: int) -> None:
            raise KeyboardInterrupt(deadline_ns)

    clock = InterruptedClock()
    device = ScriptedDevice(clock)
    device.deaf_after = 1
    device.open()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with pytest.raises(KeyboardInterrupt) as caught:
        run_presentation(device, controller, clock=clock, limits=LIMITS)
    assert caught.value.__notes__ == ["closing the device: scripted: does not listen"]


def test_an_exception_within_the_ramp_of_a_fault_is_treated_alike() -> None:
    class InterruptedClock(SimulatedClock):
        def sleep_until_ns(self, deadline_ns: int) -> None:
            super().sleep_until_ns(deadline_ns)
            if deadline_ns > 20 * PERIOD_NS:  # the fault is noticed in tick 12
                raise KeyboardInterrupt

    clock = InterruptedClock()
    device = ScriptedDevice(clock, lambda time_s: START + 2.0 * time_s)
    device.silent_after = 10
    device.deaf_after = 18  # ten ticks, and eight commands of the ramp
    device.open()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with pytest.raises(KeyboardInterrupt) as caught:
        run_presentation(device, controller, clock=clock, limits=LIMITS)
    assert len(device.commands) == 18
    assert caught.value.__notes__ == ["closing the device: scripted: does not listen"]
    assert device.stopped


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
        rest(SimulatedClock(), angle=angle)
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
    start, end, clock = radians(start_deg), radians(end_deg), SimulatedClock()
    hand = SimulatedHand(start=start, end=end, mean_speed=radians(90.0))
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=start)
    with open_device("simulated", clock=clock, hand=hand, range_end=end) as device:
        presented = run_presentation(
            device, controller, clock=clock, limits=LIMITS, end_angle=end
        )
    assert presented.fault is None
    assert presented.recording.facts["ended"] == "arrived"


def test_a_rest_before_the_end_does_not_end_it() -> None:
    device, presented = rest(
        SimulatedClock(),
        angle=lambda _: radians(142.9),
        max_duration_s=0.3,
        limits=LOADED,
    )
    assert presented.recording.facts["ended"] == "max-duration"
    assert presented.recording.n_presented == 300
    assert len(ticks_ms(device)) == 400  # and the ramp


def test_a_rest_that_is_broken_off_begins_anew() -> None:
    # At 145 deg, but between 50 and 60 ms back at 120 deg.
    def angle(time_s: float) -> float:
        return radians(120.0 if 0.0495 < time_s < 0.0605 else 145.0)

    lenient = {"speed": 1e5, "torque": 1e5, "torque_rate": 1e9, "jump_angle": 10.0}

    _, presented = rest(
        SimulatedClock(),
        angle=angle,
        max_duration_s=1.0,
        limits=limits_with(**lenient, frozen_time=1.0, standing_torque=20.0),
    )
    # There again at 61 ms, at rest when the low-pass has forgotten the jump.
    assert presented.recording.facts["ended"] == "arrived"
    assert presented.recording.columns["time_s"][-1] > 0.161


def test_a_hand_that_never_arrives_is_stopped_at_the_longest_duration() -> None:
    presented = present("HM3", 90.0, slip_time=0.3, max_duration_s=0.8)
    columns = presented.recording.columns
    assert presented.recording.facts["ended"] == "max-duration"
    assert presented.recording.n_presented == 800
    assert columns["time_s"][799] == pytest.approx(0.799)


def test_without_a_fault_it_ends_with_zero_torque_and_stays_open() -> None:
    clock = SimulatedClock()
    device = ScriptedDevice(clock, lambda _: radians(145.0))
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with device:
        presented = run_presentation(device, controller, clock=clock, limits=LOADED)
        assert presented.recording.facts["ended"] == "arrived"
        assert device.is_open
        assert [torque for _, torque in device.commands[-2:]] == [0.0, 0.0]
        assert device.commands[-3][1] > 0.0


# The result


def test_the_same_presentation_twice_is_the_same_to_the_last_bit() -> None:
    first, second = present("HM4", 73.0), present("HM4", 73.0)
    assert first.recording.facts == second.recording.facts
    for name in RECORDING_COLUMNS:
        column = first.recording.columns[name]
        assert column.tobytes() == second.recording.columns[name].tobytes()


@pytest.mark.parametrize("start_ns", [1, 86_400_000_000_000])
def test_the_zero_of_the_clock_changes_nothing_but_rounding(start_ns: int) -> None:
    first, second = present("HM2", 100.0), present("HM2", 100.0, start_ns=start_ns)
    for name in RECORDING_COLUMNS:
        np.testing.assert_allclose(
            second.recording.columns[name], first.recording.columns[name], atol=1e-9
        )


def test_the_facts_say_how_it_went() -> None:
    presented = present("HM3", 92.0)
    facts = presented.recording.facts
    assert facts["simulated"] is True
    assert facts["device"] == "simulated"
    assert facts["fault"] is None
    assert facts["phases"] == "pre-catch, catch, post-catch, pre-catch"
    # θ_catch = L - α v̄ of (2) at the mean speed that the recording gives
    assert facts["catch_angle_deg"] == pytest.approx(
        115.0 - 0.35 * facts["mean_speed_deg_s"], abs=0.2
    )
    assert presented.n_missed_ticks == 0


def test_with_a_real_clock_it_goes_the_same_way() -> None:
    # A short stretch, 100 to 146 deg at 110 deg/s: about 0.6 s with the rests. How
    # late the machine is may differ, so every tick may be missed without a fault.
    start, hand = radians(100.0), {"end": radians(146.0), "mean_speed": radians(110.0)}
    found = []
    for clock in (RealClock(), SimulatedClock()):
        controller = Controller(STANDARD_MODELS["HM1"], start_angle=start)
        moved = SimulatedHand(start=start, **hand)
        with open_device("simulated", clock=clock, hand=moved) as device:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", OverrunWarning)
                presented = run_presentation(
                    device,
                    controller,
                    clock=clock,
                    limits=limits_with(missed_ticks=2_000, watchdog_time=1.0),
                    max_duration_s=1.4,
                )
        found.append(presented)
    real, simulated = (presented.recording for presented in found)
    assert real.facts["fault"] is None
    assert real.facts["ended"] == simulated.facts["ended"] == "arrived"
    assert real.facts["phases"] == simulated.facts["phases"]
    assert np.all(np.diff(real.columns["time_s"]) > 0.0)
    # Every tick was run or counted as missed.
    n_ticks = real.n_samples + found[0].n_missed_ticks
    assert n_ticks == math.floor(real.columns["time_s"][-1] * 1000) + 1
    angles = np.interp(
        real.columns["time_s"],
        simulated.columns["time_s"],
        simulated.columns["angle_deg"],
    )
    np.testing.assert_allclose(real.columns["angle_deg"], angles, atol=2.0)


# What is refused


@pytest.mark.parametrize(
    "change",
    [
        {"rate_hz": 0},
        {"max_duration_s": 0.0},
        {"max_duration_s": math.inf},
        {"max_duration_s": math.nan},
        {"end_angle": math.nan},
        {"end_angle": math.inf},
    ],
)
def test_what_cannot_be_run_is_refused_before_anything_moves(change) -> None:
    clock = SimulatedClock()
    device = ScriptedDevice(clock)
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    options = {"rate_hz": 1000, "max_duration_s": 1.0, **change}
    name = next(iter(change))
    with device:
        with pytest.raises(ParameterError, match=name):
            run_presentation(device, controller, clock=clock, limits=LIMITS, **options)
        assert device.n_reads == 0
        assert device.commands == []


@pytest.mark.parametrize(("rate_hz", "watchdog_time"), [(7, 0.1), (1000, 0.0015)])
def test_a_watchdog_that_cannot_hear_every_tick_in_time_is_refused(
    rate_hz: int, watchdog_time: float
) -> None:
    clock = SimulatedClock()
    limits = limits_with(watchdog_time=watchdog_time)
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START, rate_hz=rate_hz)
    with (
        ScriptedDevice(clock) as device,
        pytest.raises(ParameterError, match="watchdog_time: needs two ticks or more"),
    ):
        run_presentation(
            device, controller, clock=clock, limits=limits, rate_hz=rate_hz
        )


def test_a_rate_that_is_not_the_controllers_is_refused() -> None:
    clock = SimulatedClock()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START, rate_hz=250)
    with (
        ScriptedDevice(clock) as device,
        pytest.raises(ParameterError, match="needs the controller's 250 Hz, got 1000"),
    ):
        run_presentation(device, controller, clock=clock, limits=LIMITS)


def test_a_controller_that_has_been_used_is_refused() -> None:
    clock = SimulatedClock()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with ScriptedDevice(clock, lambda _: radians(145.0)) as device:
        run_presentation(device, controller, clock=clock, limits=LOADED)
        with pytest.raises(ParameterError, match="controller: needs a new one"):
            run_presentation(device, controller, clock=clock, limits=LOADED)
        assert device.is_open


def test_a_closed_device_is_refused() -> None:
    clock = SimulatedClock()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with pytest.raises(DeviceError, match="scripted: needs an open device to present"):
        run_presentation(ScriptedDevice(clock), controller, clock=clock, limits=LIMITS)

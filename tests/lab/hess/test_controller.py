"""The controller of Fig. 7: phases, the law sample by sample, friction, lost grip."""

import csv
import math
from collections.abc import Callable
from math import radians
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    STANDARD_MODELS,
    ConstantSpeed,
    MinimumJerk,
    Motion,
    SampledJoint,
    trace,
)
from masrel.lab.hess import Controller, Friction
from masrel.lab.recording import PHASES

from .rig import END, START, present

STUDY = Path(__file__).parents[3] / "studies" / "hess2012"
PRE_CATCH, CATCH, POST_CATCH = range(3)
MODELS = ("HM1", "HM2", "HM3", "HM4")


def table_5() -> list[tuple[str, float]]:
    # Every model with every mean speed at which a rater stretched it
    with (STUDY / "ratings" / "published.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [(row["model"], float(row["mean_speed_deg_s"])) for row in rows]


def controller(model: str = "HM3", **options) -> Controller:
    return Controller(STANDARD_MODELS[model], start_angle=START, **options)


def stretched(
    model: str = "HM3", speed_deg_s: float = 92.0, until_deg: float = 85.0, **options
) -> tuple[Controller, float]:
    # A controller that has seen a stretch at constant speed -> it, the time, s
    made = controller(model, **options)
    n = round((until_deg - 30.0) / speed_deg_s * 1e3)
    for tick in range(n + 1):
        angle = START + radians(speed_deg_s) * tick * 1e-3
        made.step(tick * 1e-3, angle, radians(speed_deg_s))
    return made, n * 1e-3


# The law


def test_table_5_is_whole() -> None:
    assert len(table_5()) == 32
    assert {model for model, _ in table_5()} == set(MODELS)


def constant_speed(start: float, end: float, speed: float) -> Motion:
    return ConstantSpeed(start=start, end=end, speed=speed)


def minimum_jerk(start: float, end: float, speed: float) -> Motion:
    return MinimumJerk(start=start, end=end, mean_speed=speed)


@pytest.mark.parametrize("movement", [constant_speed, minimum_jerk])
@pytest.mark.parametrize(("model", "speed_deg_s"), table_5())
def test_it_asks_for_the_torque_of_the_trace_bit_for_bit(
    model: str, speed_deg_s: float, movement: Callable[[float, float, float], Motion]
) -> None:
    motion = movement(START, END, radians(speed_deg_s))
    made = trace(STANDARD_MODELS[model], motion, rate_hz=1000)
    stepped = controller(model)
    samples = zip(
        made.time.tolist(), made.angle.tolist(), made.velocity.tolist(), strict=True
    )
    asked = []
    for sample in samples:
        stepped.step(*sample)
        asked.append((stepped.model_torque, stepped.phase))
    torque, phase = np.array(asked).T
    assert torque.tobytes() == made.torque.tobytes()
    np.testing.assert_array_equal(phase, made.phase)
    assert not stepped.grip_lost


@pytest.mark.parametrize("model", MODELS)
def test_what_a_presentation_records_is_the_law_of_what_it_read(model: str) -> None:
    columns = present(model, 95.0).recording.columns
    joint = SampledJoint(STANDARD_MODELS[model], start_angle=START)
    law = [
        joint.step(time_s, radians(angle_deg), radians(velocity_deg_s))
        for time_s, angle_deg, velocity_deg_s in zip(
            columns["time_s"].tolist(),
            columns["angle_deg"].tolist(),
            columns["velocity_deg_s"].tolist(),
            strict=True,
        )
    ]
    np.testing.assert_allclose(columns["model_torque_nm"], law, rtol=0, atol=1e-9)


# Phases


@pytest.mark.parametrize("model", ["HM2", "HM3", "HM4"])
def test_the_phases_come_in_the_order_of_figure_7(model: str) -> None:
    facts = present(model, 100.0).recording.facts
    assert facts["phases"] == "pre-catch, catch, post-catch, pre-catch"


def test_hm1_reaches_the_end_of_range_within_the_catch() -> None:
    assert present("HM1", 100.0).recording.facts["phases"] == "pre-catch, catch"


def test_a_stretch_below_the_speed_threshold_never_catches() -> None:
    presented = present("HM4", 18.0)
    assert presented.recording.facts["phases"] == "pre-catch"
    assert presented.recording.facts["ended"] == "arrived"


def test_the_torque_of_each_phase_by_hand() -> None:
    # HM3 at 80 deg/s from 30 deg; (2): the catch is at 115 - 0.35 × 80 = 87 deg, and
    # it is over after D = 30 deg.
    speed = radians(80.0)
    made = controller()
    found = {}
    for tick in range(1_450):
        angle = START + speed * tick * 1e-3
        made.step(tick * 1e-3, angle, speed)
        found[tick] = (made.phase, made.model_torque)
    law = STANDARD_MODELS["HM3"]
    caught = next(tick for tick, (phase, _) in found.items() if phase == CATCH)
    left = next(tick for tick, (phase, _) in found.items() if phase == POST_CATCH)
    assert caught == 713  # the first sample beyond 57 deg / 80 deg/s = 0.7125 s
    # 30 deg beyond 87.04 deg, where the catch began: 375 ms later, or one sample
    # more, for an angle that has to be exceeded.
    assert left - caught in (375, 376)

    def pre_catch(tick: int) -> float:
        return 1.26 * speed + 3.15 * speed * tick * 1e-3

    assert found[712] == (PRE_CATCH, pytest.approx(pre_catch(712)))
    rise = 2.8 * speed
    assert found[caught][1] == pytest.approx(pre_catch(caught) + rise)
    assert found[caught + 99][1] == pytest.approx(pre_catch(caught) + rise)
    assert found[caught + 101][1] == pytest.approx(pre_catch(caught) + 0.6 * rise)
    climb = 5.8 * speed * 1e-3 * 50
    assert found[left + 50] == (
        POST_CATCH,
        pytest.approx(pre_catch(caught) + 0.6 * rise + climb),
    )
    assert law.catch_torque_constant == pytest.approx(2.8)


def test_post_catch_ends_when_the_arm_is_slower_than_the_threshold() -> None:
    made, time_s = stretched("HM4", until_deg=100.0)
    assert made.phase == POST_CATCH
    # Slowing down by 2 deg/s a millisecond, 20 in 10 ms: no lost grip.
    speed_deg_s, angle = 92.0, radians(100.0)
    while made.phase == POST_CATCH:
        speed_deg_s -= 2.0
        time_s += 1e-3
        angle += radians(speed_deg_s) * 1e-3
        made.step(time_s, angle, radians(speed_deg_s))
    assert speed_deg_s == 18.0
    assert made.phase == PRE_CATCH
    assert not made.grip_lost


# Friction


@pytest.mark.parametrize("speed_deg_s", [60.0, -60.0])
def test_compensation_helps_the_motion(speed_deg_s: float) -> None:
    # 0.9 (0.168 × 1.0472 + 0.189) = 0.3284 N·m less to resist an extension, as much
    # more to resist a flexion.
    made = controller()
    command = made.step(0.0, START, radians(speed_deg_s))
    helping = math.copysign(0.9 * (0.168 * radians(60.0) + 0.189), speed_deg_s)
    assert command == pytest.approx(made.model_torque - helping, rel=1e-12)
    assert (made.model_torque - command) * speed_deg_s > 0.0


@given(st.floats(-6.0, 6.0), st.floats(0.3, 2.5))
def test_by_default_friction_is_under_compensated(
    velocity: float, angle: float
) -> None:
    # The hand feels the command and the friction: never less than the model's
    # torque against its motion, and at most a tenth of B more, or β within the ramp.
    made = controller()
    command = made.step(0.0, angle, velocity)
    friction = 0.168 * velocity + math.copysign(0.189, velocity)
    excess = (command + friction - made.model_torque) * math.copysign(1.0, velocity)
    assert excess >= 0.0
    if abs(velocity) >= radians(5.0):
        assert excess == pytest.approx(0.1 * abs(friction), rel=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_share_scales_the_compensation(share: float) -> None:
    made = controller(compensation=share, friction=Friction(viscous=0.2, coulomb=0.1))
    command = made.step(0.0, START, 2.0)
    assert made.model_torque - command == pytest.approx(share * 0.5)


def test_friction_changes_the_command_and_not_the_model() -> None:
    with_it, without = controller(), controller(compensation=0.0)
    for made in (with_it, without):
        made.step(0.0, 1.0, 1.5)
    assert with_it.model_torque == without.model_torque
    assert without.step(0.001, 1.0015, 1.5) == without.model_torque


# Lost grip


def pre_catch_torque(angle: float, velocity: float) -> float:
    return 1.26 * velocity + 3.15 * (angle - START)  # (1), m = 0


@pytest.mark.parametrize(
    ("until_deg", "phase"), [(84.0, CATCH), (95.0, CATCH), (120.0, POST_CATCH)]
)
def test_a_sudden_fall_of_speed_releases_to_pre_catch_at_once(
    until_deg: float, phase: int
) -> None:
    made, time_s = stretched(until_deg=until_deg)
    assert made.phase == phase
    before = made.model_torque
    angle, speed = radians(until_deg), radians(92.0 - 41.0)
    made.step(time_s + 1e-3, angle, speed)
    assert PHASES[made.phase] == "pre-catch"
    assert made.grip_lost
    assert made.model_torque == pytest.approx(pre_catch_torque(angle, speed), rel=1e-12)
    assert made.model_torque < before


def braked(share: float, rate_hz: int = 1000, **options: float) -> tuple[bool, float]:
    """Take `share` of what a loose arm loses off it -> grip lost, and after which s."""
    made = controller(rate_hz=rate_hz, **options)
    speed, angle = radians(92.0), START
    period, tick = 1.0 / rate_hz, 0
    while angle < radians(95.0):
        made.step(tick * period, angle, speed)
        angle, tick = angle + speed * period, tick + 1
    assert made.phase == CATCH
    began = tick
    while speed > radians(30.0) and not made.grip_lost:
        speed -= share * made.model_torque / 0.06 * period
        made.step(tick * period, angle, speed)
        tick += 1
    return made.grip_lost, (tick - began) * period


@pytest.mark.parametrize("rate_hz", [500, 1000, 4000])
def test_an_arm_that_nothing_but_the_torque_brakes_has_been_let_go(
    rate_hz: int,
) -> None:
    lost, after_s = braked(1.0, rate_hz)
    assert lost
    assert after_s <= 0.006


@pytest.mark.parametrize("rate_hz", [500, 1000, 4000])
def test_an_arm_that_gives_way_half_as_fast_is_held(rate_hz: int) -> None:
    assert not braked(0.5, rate_hz)[0]
    assert braked(0.7, rate_hz)[0]


def test_what_a_loose_arm_loses_goes_by_its_inertia() -> None:
    assert not braked(1.0, loose_inertia=0.03)[0]
    assert braked(0.5, loose_inertia=0.08)[0]


def test_ticks_that_are_missed_are_no_lost_grip() -> None:
    # An arm that gives way by a fifth of what a loose one would, 20 ms later
    made, time_s = stretched()
    speed = radians(92.0) - 0.2 * made.model_torque / 0.06 * 0.02
    made.step(time_s + 0.02, radians(86.5), speed)
    assert not made.grip_lost


def test_an_arm_that_is_led_back_slowly_and_then_faster_has_not_been_let_go() -> None:
    made, time_s = stretched()
    for tick in range(1, 400):
        speed = radians(92.0) - 0.3 * tick * 1e-3 * made.model_torque / 0.06
        made.step(time_s + tick * 1e-3, radians(85.0), max(speed, radians(-21.0)))
    assert (made.phase, made.grip_lost) == (PRE_CATCH, False)  # the law's own end


def test_in_pre_catch_a_fall_of_speed_means_nothing() -> None:
    made, time_s = stretched(until_deg=60.0)
    made.step(time_s + 1e-3, radians(60.0), radians(-60.0))
    assert not made.grip_lost


def test_the_end_of_range_stops_the_arm_without_a_lost_grip() -> None:
    for beyond_deg, lost in ((142.9, True), (143.1, False)):
        made, time_s = stretched("HM2", until_deg=142.5)
        assert made.phase == POST_CATCH
        made.step(time_s + 1e-3, radians(beyond_deg), radians(10.0))
        assert made.grip_lost is lost


def test_after_a_lost_grip_the_arm_that_runs_on_is_not_caught_again() -> None:
    made, time_s = stretched()
    for tick in range(1, 400):
        angle, speed = radians(85.0 + 0.05 * tick), radians(50.0)
        made.step(time_s + tick * 1e-3, angle, speed)
        assert made.phase == PRE_CATCH
        assert made.model_torque == pytest.approx(pre_catch_torque(angle, speed))


def test_moved_back_and_stretched_again_it_catches_again() -> None:
    made, time_s = stretched()
    made.step(time_s + 1e-3, radians(85.0), radians(-50.0))
    assert (made.phase, made.grip_lost) == (PRE_CATCH, True)
    time_s += 0.01
    for tick in range(700):
        angle = START + radians(92.0) * tick * 1e-3
        made.step(time_s + tick * 1e-3, angle, radians(92.0))
    assert made.phase == CATCH
    assert made.grip_lost  # it was, in this presentation


def test_a_hand_that_slips_off_the_simulated_arm_is_noticed() -> None:
    held = present("HM4", 100.0)
    caught_s = held.recording.columns["time_s"][
        np.flatnonzero(held.recording.columns["phase"] == CATCH)[0]
    ]
    slipped = present("HM4", 100.0, slip_time=float(caught_s) + 0.02)
    columns = slipped.recording.columns
    assert slipped.fault is None
    assert slipped.recording.facts["grip_lost"] is True
    assert held.recording.facts["grip_lost"] is False
    # 11.3 N·m on 0.06 kg·m² take 40 deg/s in 3.7 ms; the estimate follows 5.6 ms later.
    lost = np.flatnonzero((columns["phase"] == 0) & (columns["time_s"] > caught_s))[0]
    assert 0.0 < columns["time_s"][lost] - caught_s - 0.02 <= 0.010
    assert columns["command_torque_nm"][lost - 1] > 10.0
    assert abs(columns["command_torque_nm"][lost]) < 4.0
    assert np.all(columns["phase"][lost:] == 0)


# What is refused


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"slip_speed_drop": 0.0}, "slip_speed_drop: needs more than 0"),
        ({"slip_speed_drop": math.nan}, "slip_speed_drop: needs more than 0"),
        ({"loose_inertia": 0.0}, "loose_inertia: needs more than 0"),
        ({"rate_hz": 0}, "rate_hz: needs 1 or more, got 0"),
        ({"compensation": 1.1}, r"share: needs \[0, 1\], got 1.1"),
    ],
)
def test_an_impossible_controller_is_refused(change, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        controller(**change)

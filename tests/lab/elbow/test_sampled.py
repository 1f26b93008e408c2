"""The sampled law: against the exact one, sample by sample by hand, and released."""

from dataclasses import replace
from math import floor, isnan, radians

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    Motion,
    SampledJoint,
    events,
    torque,
)
from masrel.lab.elbow.sampled import CATCH, POST_CATCH, PRE_CATCH
from masrel.lab.recording import PHASES
from tests.lab.elbow.stretches import constant, joints, minimum_jerk, motions

HM3 = STANDARD_MODELS["HM3"]

Sample = tuple[float, float, float]


def samples(joint: ElbowParameters, motion: Motion, rate_hz: float) -> list[Sample]:
    end = events(joint, motion).end
    times = np.arange(floor(end * rate_hz) + 1) / rate_hz
    columns = (times, motion.angle(times), motion.velocity(times))
    return list(zip(*(column.tolist() for column in columns), strict=True))


def stepped(
    parameters: ElbowParameters, motion: Motion, rate_hz: float
) -> tuple[SampledJoint, list[int], list[float]]:
    joint = SampledJoint(parameters, start_angle=motion.start)
    phases, torques = [], []
    for sample in samples(parameters, motion, rate_hz):
        torques.append(joint.step(*sample))
        phases.append(joint.phase)
    return joint, phases, torques


def first(phases: list[int], code: int) -> int | None:
    return phases.index(code) if code in phases else None


def move(joint: SampledJoint, angle_deg: float, speed_deg_s: float, time: float) -> int:
    joint.step(time, radians(angle_deg), radians(speed_deg_s))
    return joint.phase


# Against the exact law


def test_the_window_of_the_end_of_range_is_that_of_the_exact_law_and_a_sample() -> None:
    # 146.95 deg is passed 0.05 deg before 147.0, that is 0.4 ms at 123 deg/s: one
    # sample at 10 kHz, none at 1 kHz. HM2 at 70 deg/s is 0.1 deg short of the end of
    # its catch at 145.4 deg, at any rate.
    def reaches_post_catch(
        model: str, speed: float, range_end_deg: float, rate_hz: float
    ) -> bool:
        joint = replace(STANDARD_MODELS[model], range_end=radians(range_end_deg))
        motion = constant(speed, end_deg=range_end_deg)
        return POST_CATCH in stepped(joint, motion, rate_hz)[1]

    for rate_hz in (1000.0, 10000.0):
        assert not reaches_post_catch("HM2", 70.0, 145.4, rate_hz)
        assert reaches_post_catch("HM2", 70.0, 145.7, rate_hz)
        assert not reaches_post_catch("HM1", 123.0, 146.9, rate_hz)
    assert not reaches_post_catch("HM1", 123.0, 147.0, 1000.0)
    assert reaches_post_catch("HM1", 123.0, 147.0, 10000.0)


# A sample sees an event up to one period late; the end of the catch is measured from
# a catch seen late, so up to two. Movement onset is seen late as well, which makes the
# mean speed of minimum jerk larger and its catch earlier by less than one period.
@pytest.mark.parametrize("rate_hz", [250.0, 1000.0, 4000.0, 16000.0])
@pytest.mark.parametrize("model", STANDARD_MODELS)
@pytest.mark.parametrize("motion", [constant(97.3), minimum_jerk(97.3)])
def test_sampled_events_approach_the_exact_ones(
    rate_hz: float, model: str, motion: Motion
) -> None:
    joint = STANDARD_MODELS[model]
    found = events(joint, motion)
    sampled, phases, _ = stepped(joint, motion, rate_hz)
    assert -1 < sampled.catch_time * rate_hz - found.catch * rate_hz <= 1 + 1e-9
    if found.catch_end is None:
        assert POST_CATCH not in phases
    else:
        late = first(phases, POST_CATCH) - found.catch_end * rate_hz
        assert -1 < late <= 3
    # angles follow at the speed of the motion, at most 1.875 times the mean
    slack = 1.875 * radians(97.3) / rate_hz
    assert sampled.catch_angle == pytest.approx(found.catch_angle, abs=slack)
    # v̄ moves with the onset seen late: by at most (v̄ - ν_th)·period/(t_c - onset)
    share = 1.0 / rate_hz / (found.catch - found.onset)
    assert sampled.mean_speed == pytest.approx(found.mean_speed, rel=2 * share)


@given(joint=joints(inertia=False), motion=motions())
def test_sampled_torque_is_the_exact_torque_away_from_events(
    joint: ElbowParameters, motion: Motion
) -> None:
    rate_hz = 500.0
    found = events(joint, motion)
    reached = {PHASES.index(span.name) for span in found.phases}
    sampled, phases, torques = stepped(joint, motion, rate_hz)
    # no event within a few samples of the end or of the threshold
    assume(set(phases) == reached)
    # θ and θ_catch do not run all but side by side: see below
    assume(
        found.catch is None
        or -1 < (sampled.catch_time - found.catch) * rate_hz <= 1 + 1e-9
    )
    marks = [span.start for span in found.phases] + [found.end]
    if found.peak_end is not None:
        marks.append(found.peak_end)
    times = np.arange(len(torques)) / rate_hz
    distance = np.abs(times[:, np.newaxis] - np.array(marks)).min(axis=1)
    away = (distance > 5 / rate_hz) & (times <= found.end)
    exact = torque(joint, motion, times[away])
    # The catch is seen up to one period late, at another angle and speed: the levels
    # that it sets differ by as much as the laws move in two periods.
    speed = 1.875 * (motion.end - motion.start) / motion.duration
    acceleration = 5.7736 * speed / motion.duration
    law = joint.stiffness + 2 * joint.post_catch_stiffness
    moved = law * speed + (joint.damping + joint.catch_torque_constant) * acceleration
    error = np.abs(np.array(torques)[away] - exact)
    assert (error <= 3 * moved / rate_hz + 1e-12).all()


def test_a_catch_that_all_but_fails_may_be_seen_some_periods_early() -> None:
    # Late in this stretch θ_catch rises with the falling mean, nearly as fast as θ: the
    # onset, seen late, moves the catch by more than itself. With L larger by 0.02 deg
    # there is no catch at all. It is still found as the rate grows.
    joint = replace(HM3, catch_angle_constant=radians(127.82), catch_slope=0.3)
    motion = minimum_jerk(71.5, start_deg=0.0, end_deg=102.125)
    exact = events(joint, motion).catch
    assert exact is not None
    larger = replace(joint, catch_angle_constant=radians(127.84))
    assert events(larger, motion).catch is None
    late = [
        stepped(joint, motion, rate_hz)[0].catch_time - exact
        for rate_hz in (500.0, 4000.0, 64000.0)
    ]
    assert -5 / 500 < late[0] < -4 / 500
    assert abs(late[2]) < abs(late[1]) < abs(late[0])
    assert abs(late[2]) < 5e-5


# By hand: HM3, stretched from 30 deg at 100 deg/s, seen at nine times only.
#   0.00 s  30 deg  onset, and θ_rest
#   0.45 s  75 deg  v̄ = 45/0.45 = 100; θ_catch = 115 - 35 = 80 deg, not exceeded
#   0.60 s  90 deg  exceeded: the catch, seen late
#   0.65 s  95 deg  0.05 s since the catch: the peak
#   0.75 s 105 deg  0.15 s since the catch: the residual level
#   0.89 s 119 deg  29 deg travelled since 90, not more than D = 30
#   1.00 s 130 deg  40 deg travelled: post-catch, from here
#   1.10 s 140 deg  10 deg further
# Torque in N·m·deg/rad: pre-catch 1.26 · 100 + 3.15 · (θ - 30); at 90 deg 126 + 189 =
# 315; H·v_c = 280: peak 595; residual 315 + 168 = 483; then 483 + 5.8 · 10 = 541.
def test_the_coarse_stretch_by_hand() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    rows = [
        (0.0, 30.0, PRE_CATCH, 126.0),
        (0.25, 55.0, PRE_CATCH, 126.0 + 3.15 * 25),
        (0.45, 75.0, PRE_CATCH, 126.0 + 3.15 * 45),
        (0.6, 90.0, CATCH, 595.0),
        (0.65, 95.0, CATCH, 595.0),
        (0.75, 105.0, CATCH, 483.0),
        (0.89, 119.0, CATCH, 483.0),
        (1.0, 130.0, POST_CATCH, 483.0),
        (1.1, 140.0, POST_CATCH, 541.0),
    ]
    for time, angle_deg, phase, level in rows:
        value = joint.step(time, radians(angle_deg), radians(100.0))
        assert joint.phase == phase
        assert value == pytest.approx(radians(level), rel=1e-13)
    assert joint.catch_time == 0.6
    assert joint.catch_angle == radians(90.0)
    assert joint.mean_speed == pytest.approx(radians(100.0), rel=1e-15)


def test_mean_speed_starts_at_movement_onset_not_at_the_first_sample() -> None:
    # Half a second at rest, then 100 deg/s for 0.6 s: the mean of the whole time would
    # be 54 deg/s and the catch angle, clamped, 94 deg; from the onset it is 80 deg.
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    for i in range(500):
        assert move(joint, 30.0, 0.0, i / 1000) == PRE_CATCH
    phases = [move(joint, 30.0 + 0.1 * i, 100.0, 0.5 + i / 1000) for i in range(600)]
    # 80 deg itself is sample 500; the first one above it is 501, or 500 by rounding
    assert first(phases, CATCH) in (500, 501)


def test_a_pause_below_the_threshold_starts_the_mean_anew() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    move(joint, 30.0, 100.0, 0.0)
    move(joint, 50.0, 100.0, 0.2)
    move(joint, 51.0, 10.0, 0.3)
    move(joint, 51.0, 100.0, 5.0)  # onset again
    move(joint, 61.0, 100.0, 5.1)
    assert joint.mean_speed == pytest.approx(radians(100.0))


# Slow, flexed, released


@given(
    speeds=st.lists(st.floats(-19.9, 20.0), min_size=1, max_size=50),
    model=st.sampled_from(list(STANDARD_MODELS)),
)
@example(speeds=[20.0] * 5, model="HM4")  # ν_th itself moves, and does not catch
def test_slow_movement_is_a_damper_and_a_spring_and_never_catches(
    speeds: list[float], model: str
) -> None:
    parameters = STANDARD_MODELS[model]
    joint = SampledJoint(parameters, start_angle=radians(30.0))
    angle = radians(100.0)  # beyond every catch angle at 100 deg/s
    for i, speed in enumerate(speeds):
        velocity = radians(speed)
        angle += velocity * 0.01
        value = joint.step(0.01 * i, angle, velocity)
        assert joint.phase == PRE_CATCH
        assert value == 1.26 * velocity + 3.15 * (angle - radians(30.0))
    assert isnan(joint.catch_time)
    assert isnan(joint.catch_angle)


@pytest.mark.parametrize("until", [0.6, 1.05])  # in the catch, in post-catch
def test_release_returns_to_pre_catch_and_the_stretch_does_not_catch_again(
    until: float,
) -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    time = 0.0
    while time < until:
        move(joint, 30.0 + 100.0 * time, 100.0, time)
        time += 0.01
    assert joint.phase in (CATCH, POST_CATCH)
    joint.release()
    assert joint.phase == PRE_CATCH
    angle, velocity = radians(30.0 + 100.0 * time), radians(100.0)
    value = joint.step(time, angle, velocity)
    assert value == 1.26 * velocity + 3.15 * (angle - radians(30.0))
    for i in range(1, 20):
        assert move(joint, 30.0 + 100.0 * time + i, 100.0, time + 0.01 * i) == PRE_CATCH


def test_a_joint_released_before_its_catch_catches_only_after_flexing() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    joint.release()
    for i in range(100):
        assert move(joint, 30.0 + i, 100.0, 0.01 * i) == PRE_CATCH
    move(joint, 30.0, -60.0, 2.0)
    phases = [move(joint, 30.0 + i, 100.0, 3.0 + 0.01 * i) for i in range(100)]
    assert CATCH in phases


def test_flexing_ends_the_stretch_and_arms_the_next() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))

    def stretch(start: float) -> list[int]:
        return [move(joint, 30.0 + i, 100.0, start + 0.01 * i) for i in range(1, 110)]

    once = stretch(0.0)
    assert first(once, CATCH) is not None
    assert once[-1] == POST_CATCH
    assert move(joint, 139.0, 0.0, 1.2) == PRE_CATCH  # it stopped
    # moved on without having been flexed: not another catch
    assert {move(joint, 139.0 + i, 100.0, 1.3 + 0.01 * i) for i in range(5)} == {
        PRE_CATCH
    }
    assert move(joint, 100.0, -60.0, 2.0) == PRE_CATCH
    assert stretch(3.0) == once


def test_flexing_in_the_catch_ends_it() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    for i in range(56):
        move(joint, 30.0 + i, 100.0, 0.01 * i)
    assert joint.phase == CATCH
    assert move(joint, 84.0, -20.0, 0.6) == PRE_CATCH

"""The sampled law: by hand, against the exact one, released; traces, and lines."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    STANDARD_MODELS,
    Hold,
    Joined,
    Motion,
    SampledJoint,
    events,
    outline,
    torque,
    trace,
)
from masrel.lab.recording import PHASES
from tests.lab.elbow.scenes import KINDS, random_scene
from tests.lab.elbow.stretches import constant, minimum_jerk
from tests.lab.elbow.tone.joints import stepped

HM3 = STANDARD_MODELS["HM3"]
PRE_CATCH, CATCH, POST_CATCH = range(len(PHASES))


def move(joint: SampledJoint, angle_deg: float, speed_deg_s: float, time: float) -> int:
    joint.step(time, radians(angle_deg), radians(speed_deg_s))
    return joint.phase


# Against the exact law


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
    found, made = events(joint, motion), trace(joint, motion, rate_hz=rate_hz)
    catch, post = (np.flatnonzero(made.phase == code) for code in (CATCH, POST_CATCH))
    assert -1 < catch[0] - found.catch * rate_hz <= 1 + 1e-9
    assert (found.catch_end is None) == (post.size == 0)
    if found.catch_end is not None:
        assert -1 < post[0] - found.catch_end * rate_hz <= 3
    # angles follow at the speed of the motion, at most 1.875 times the mean
    slack = 1.875 * radians(97.3) / rate_hz
    assert made.angle[catch[0]] == pytest.approx(found.catch_angle, abs=slack)


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


# Slow, flexed, released


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rate_hz", [50.0, 333.0])
def test_a_trace_equals_stepping_sample_by_sample_bit_for_bit(
    kind: str, rate_hz: float
) -> None:
    rng = np.random.default_rng(KINDS.index(kind))
    scenes = [random_scene(rng, kind, wide=False) for _ in range(20)]
    for joint, motion in scenes:
        if motion.start < joint.range_end:
            made = trace(joint, motion, rate_hz=rate_hz)
            times, torque, phase = stepped(joint, motion, rate_hz)
            n = min(made.time.size, times.size)  # it is cut at the end of range
            assert n >= made.time.size - 1
            np.testing.assert_array_equal(made.torque[:n], torque[:n])
            np.testing.assert_array_equal(made.phase[:n], phase[:n])


def test_a_trace_is_cut_at_the_end_of_range() -> None:
    # From 30 to 146 deg at 58 deg/s: 2 s, whether aimed at 146 or at 170 deg
    made = trace(HM3, constant(58.0, end_deg=170.0), rate_hz=100.0)
    assert made.time.size in (200, 201)  # 2 s itself, but for rounding
    assert made.angle.max() <= radians(146.0) + 1e-12


def test_the_arrays_are_read_only_and_the_trace_is_frozen() -> None:
    made = trace(HM3, minimum_jerk(92.0), rate_hz=50.0)
    for column in (made.time, made.angle, made.velocity, made.torque, made.phase):
        assert column.shape == made.time.shape
        with pytest.raises(ValueError, match="read-only"):
            column[0] = 1


def test_inertia_is_not_commanded() -> None:
    heavy = replace(HM3, inertia=0.2)
    motion = minimum_jerk(92.0)
    assert trace(heavy, motion).torque.tolist() == trace(HM3, motion).torque.tolist()


# Lines to draw


@pytest.mark.parametrize("motion", [constant(92.0), minimum_jerk(92.0)])
def test_points_are_of_the_torque_on_both_sides_of_a_jump(motion) -> None:
    made = outline(HM3, motion, n_points=200)
    jumps = np.flatnonzero(np.diff(made.time) == 0.0)
    catch = made.events.catch
    (at,) = [i for i in jumps if made.time[i] == catch]
    rise = 2.8 * made.events.catch_speed  # H·v_c
    assert made.torque[at + 1] - made.torque[at] == pytest.approx(rise, rel=1e-12)
    inside = np.diff(made.time, append=9.0) > 0.0
    inside[1:] &= np.diff(made.time) > 0.0
    expected = torque(HM3, motion, made.time[inside])
    assert made.torque[inside] == pytest.approx(expected, abs=1e-12)
    spans = made.events.phases
    codes = made.phase[np.append(True, np.diff(made.phase) != 0)]
    assert [PHASES[code] for code in codes] == [span.name for span in spans]


def test_a_day_of_rest_takes_no_more_points_than_a_second() -> None:
    # At 1 kHz it would be 86 million samples; 800 pixels need a thousand.
    day = Hold(start=radians(30.0), duration=86_400.0)
    made = outline(HM3, Joined([day, minimum_jerk(92.0)]), n_points=800)
    assert made.time.size < 820
    assert made.events.catch > 86_400.0


def test_one_point_is_no_line() -> None:
    with pytest.raises(ParameterError, match="n_points: needs 2 or more, got 1"):
        outline(HM3, constant(92.0), n_points=1)


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


def test_flexing_ends_the_stretch_and_arms_the_next() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))

    def stretch(start: float) -> list[int]:
        return [move(joint, 30.0 + i, 100.0, start + 0.01 * i) for i in range(1, 110)]

    once = stretch(0.0)
    assert CATCH in once
    assert once[-1] == POST_CATCH
    assert move(joint, 139.0, 0.0, 1.2) == PRE_CATCH  # it stopped
    # moved on without having been flexed: not another catch
    assert {move(joint, 139.0 + i, 100.0, 1.3 + 0.01 * i) for i in range(5)} == {
        PRE_CATCH
    }
    assert move(joint, 100.0, -60.0, 2.0) == PRE_CATCH
    assert stretch(3.0) == once
    assert move(joint, 100.0, -60.0, 5.0) == PRE_CATCH
    for i in range(60):
        last = move(joint, 30.0 + i, 100.0, 6.0 + 0.01 * i)
    assert last == CATCH
    assert move(joint, 84.0, -20.0, 6.6) == PRE_CATCH  # flexing ends a catch, too

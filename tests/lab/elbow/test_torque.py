"""Torque at any time and its peak: by hand, at its jumps, and on dense grids."""

from dataclasses import replace
from itertools import pairwise
from math import nan, nextafter, pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    MinimumJerk,
    Motion,
    events,
    peak_torque,
    torque,
    trace,
)
from tests.lab.elbow.stretches import (
    CountedMotion,
    constant,
    joints,
    minimum_jerk,
    motions,
)

HM3, HM4 = STANDARD_MODELS["HM3"], STANDARD_MODELS["HM4"]

# At a constant speed in deg/s, b·v, k·(θ - θ_rest), H·v and k_post·(θ - θ_post) all
# carry the same factor, so the hand values below are in N·m·deg/rad until the end.
DEG = pi / 180


def one(joint: ElbowParameters, motion: Motion, time: float) -> float:
    return float(torque(joint, motion, [time])[0])


# HM3 at 92 deg/s from rest at 30 deg, with Table III: b 1.26, k 3.15, H 2.8, Q 0.6,
# k_post 5.8; catch at 82.8 deg, post-catch from 112.8 deg (test_events.py):
#   start            1.26 · 92                         = 115.92 -> 2.0232 N·m
#   end of pre-catch 115.92 + 3.15 · 52.8 (= 166.32)   = 282.24 -> 4.9260
#   peak             282.24 + 2.8 · 92 (= 257.6)       = 539.84 -> 9.4220
#   residual         282.24 + 0.6 · 257.6 (= 154.56)   = 436.80 -> 7.6236
#   at 146 deg       436.80 + 5.8 · 33.2 (= 192.56)    = 629.36 -> 10.9844
HM3_LEVELS = [
    (0.0, 115.92, 2.0232),
    (nextafter(52.8 / 92, 0.0) - 1e-12, 282.24, 4.9260),
    (52.8 / 92 + 1e-12, 539.84, 9.4220),
    (52.8 / 92 + 0.1 - 1e-12, 539.84, 9.4220),
    (52.8 / 92 + 0.1 + 1e-12, 436.80, 7.6236),
    (0.9 - 1e-12, 436.80, 7.6236),
    (0.9 + 1e-12, 436.80, 7.6236),
    (116 / 92 - 1e-12, 629.36, 10.9844),
]


@pytest.mark.parametrize(("time", "level", "printed"), HM3_LEVELS)
def test_hm3_at_92_deg_s_by_hand(time: float, level: float, printed: float) -> None:
    value = one(HM3, constant(92.0), time)
    assert value == pytest.approx(level * DEG, abs=1e-10)
    assert value == pytest.approx(printed, abs=5e-5)


def test_peak_torque_of_hm3_at_92_deg_s_is_at_the_end_of_range() -> None:
    assert peak_torque(HM3, constant(92.0)) == pytest.approx(629.36 * DEG, rel=1e-14)


def test_peak_torque_of_a_shorter_stretch_is_the_peak_of_the_catch() -> None:
    # Only 539.84 - 436.80 = 103.04 above the residual: below 112.8 + 103.04/5.8 deg
    # = 130.57 deg the catch is the largest.
    assert peak_torque(HM3, constant(92.0, end_deg=130.5)) == pytest.approx(
        539.84 * DEG, rel=1e-14
    )
    assert peak_torque(HM3, constant(92.0, end_deg=130.6)) > 539.84 * DEG


# HM4 at 120 deg/s: H 3.8, Q 0.8, catch at 68 deg after 38/120 s, its end at 78 deg
# after 0.4 s, 0.083 s later, so that the 0.1 s of the peak are cut short:
#   end of pre-catch 1.26 · 120 + 3.15 · 38 = 151.2 + 119.7 = 270.9
#   peak             270.9 + 3.8 · 120 (= 456)              = 726.9
#   residual         270.9 + 0.8 · 456 (= 364.8)            = 635.7, at 78 deg
#   at 146 deg       635.7 + 5.8 · 68 (= 394.4)             = 1030.1
@pytest.mark.parametrize(
    ("time", "level"),
    [
        (38 / 120 - 1e-12, 270.9),
        (38 / 120 + 1e-12, 726.9),
        (0.4 - 1e-12, 726.9),
        (0.4 + 1e-12, 635.7),
        (116 / 120 - 1e-12, 1030.1),
    ],
)
def test_hm4_at_120_deg_s_steps_from_the_peak_into_post_catch(
    time: float, level: float
) -> None:
    assert one(HM4, constant(120.0), time) == pytest.approx(level * DEG, abs=1e-10)


# Table III's footnote lists m, b and k for (5) too: the pre-catch law goes on, and the
# torque jumps by k·D at the end of the catch. HM3 at 92 deg/s:
#   just after 112.8 deg  115.92 + 3.15 · 82.8 (= 260.82) + 154.56      = 531.30
#   at 146 deg            115.92 + 3.15 · 116 (= 365.4) + 154.56 + 192.56 = 828.44
@pytest.mark.parametrize(
    ("time", "level"),
    [
        (0.9 - 1e-12, 436.80),
        (0.9 + 1e-12, 531.30),
        (116 / 92 - 1e-12, 828.44),
    ],
)
def test_the_additive_reading_by_hand(time: float, level: float) -> None:
    joint = replace(HM3, post_catch="additive")
    assert one(joint, constant(92.0), time) == pytest.approx(level * DEG, abs=1e-10)


def test_inertia_adds_to_pre_catch_by_hand() -> None:
    # Quintic from 0.5 to 2.5 rad at 1 rad/s: at 0.5 s 2.8125 rad/s² (test_motions.py),
    # 270/256 rad/s and 212/1024 rad of travel.
    joint = replace(HM3, inertia=0.05)
    motion = MinimumJerk(start=0.5, end=2.5, mean_speed=1.0)
    expected = 0.05 * 2.8125 + 1.26 * 270 / 256 + 3.15 * 212 / 1024
    assert events(joint, motion).catch > 0.5
    assert one(joint, motion, 0.5) == pytest.approx(expected, rel=1e-15)


@given(rest_deg=st.floats(0.0, 90.0), share=st.floats(0.0, 1.0))
def test_a_rest_angle_shifts_every_torque_by_the_spring(
    rest_deg: float, share: float
) -> None:
    motion = constant(92.0)
    time = share * events(HM3, motion).end
    moved = one(replace(HM3, rest_angle=radians(rest_deg)), motion, time)
    shift = 3.15 * (30.0 - rest_deg) * DEG
    assert moved == pytest.approx(one(HM3, motion, time) + shift, abs=1e-13)


@given(joint=joints(inertia=False), share=st.floats(0.0, 1.0), speed=st.floats(1, 19.9))
def test_a_slow_stretch_is_a_damper_and_a_spring(
    joint: ElbowParameters, share: float, speed: float
) -> None:
    motion = constant(speed)
    time = share * events(joint, motion).end
    travel = float(motion.angle(time)) - motion.start
    expected = joint.damping * radians(speed) + joint.stiffness * travel
    assert one(joint, motion, time) == pytest.approx(expected, rel=1e-14)


# What section III.C says of the four traces, at one speed


@pytest.mark.parametrize("speed_deg_s", [71.0, 92.0, 131.0])
def test_higher_grades_resist_more_catch_sooner_and_shorter(speed_deg_s: float) -> None:
    motion = constant(speed_deg_s)
    stretches = [(joint, events(joint, motion)) for joint in STANDARD_MODELS.values()]
    peaks = [one(joint, motion, found.catch) for joint, found in stretches]
    assert all(low < high for low, high in pairwise(peaks))
    catch_angles = [found.catch_angle for _, found in stretches]
    assert all(late > early for late, early in pairwise(catch_angles))
    # HM1 meets the limit in the catch; the others compare at 146 deg and in length
    ends = [one(joint, motion, found.end) for joint, found in stretches[1:]]
    assert all(low < high for low, high in pairwise(ends))
    lengths = [found.catch_end - found.catch for _, found in stretches[1:]]
    assert all(long > short for long, short in pairwise(lengths))


# Jumps and continuity


def jump(joint: ElbowParameters, motion: Motion, time: float) -> float:
    before, after = torque(joint, motion, [nextafter(time, 0.0), time])
    return float(after - before)


@given(joint=joints(inertia=False), motion=motions())
def test_torque_jumps_at_catch_and_end_of_peak_as_the_law_says(
    joint: ElbowParameters, motion: Motion
) -> None:
    found = events(joint, motion)
    if found.catch is None:
        assert {span.name for span in found.phases} == {"pre-catch"}
        assert found.peak_end is None
        return
    rise = joint.catch_torque_constant * found.catch_speed  # H·v_c
    fall = -(1.0 - joint.residual_ratio) * rise
    if found.catch > 0.0:
        assert jump(joint, motion, found.catch) == pytest.approx(rise, abs=1e-9)
    if found.peak_end == found.catch + joint.peak_duration:
        falls = jump(joint, motion, found.peak_end)
        if found.peak_end != found.catch_end:
            assert falls == pytest.approx(fall, abs=1e-9)
    if found.catch_end is None or found.post_catch_end == found.catch_end:
        return
    cut_short = found.peak_end == found.catch_end
    expected = fall if cut_short else 0.0
    if joint.post_catch == "additive":  # the pre-catch law has gone on meanwhile
        speed = float(motion.velocity(found.catch_end))
        expected += joint.stiffness * joint.catch_travel
        expected += joint.damping * (speed - found.catch_speed)
    assert jump(joint, motion, found.catch_end) == pytest.approx(expected, abs=1e-9)


# Peak


def test_the_largest_may_be_the_last_of_a_phase() -> None:
    # An arm that stops by itself: post-catch grows until the speed is below ν_th, and
    # at that instant the spring and damper of pre-catch, far less, are back.
    motion = minimum_jerk(90.0)
    end = events(HM3, motion).post_catch_end
    last = one(HM3, motion, nextafter(end, 0.0))
    assert peak_torque(HM3, motion) == pytest.approx(last, rel=1e-14)
    assert one(HM3, motion, end) < 0.7 * last


@pytest.mark.parametrize("speed_deg_s", [190.0, 22.0])
@pytest.mark.parametrize("kind", [constant, minimum_jerk])
def test_peak_torque_makes_no_trace(kind, speed_deg_s: float) -> None:
    # A trace of 5.3 s at 1 kHz is of 5300 samples; the peak asks for none.
    motion = CountedMotion(kind(speed_deg_s))
    peak_torque(HM3, motion)
    assert motion.n_calls == 0
    trace(HM3, motion)
    assert motion.largest > 600  # the counter does count


# Calls


def test_at_an_event_the_later_phase_holds() -> None:
    for row in (60.0, 71.3, 92.0, 110.0, 131.0):
        motion = constant(row)
        found = events(HM3, motion)
        at = torque(HM3, motion, [found.catch, found.peak_end, found.catch_end])
        after = torque(
            HM3,
            motion,
            [time + 1e-13 for time in (found.catch, found.peak_end, found.catch_end)],
        )
        assert at == pytest.approx(after, abs=1e-11)


def test_no_times_give_no_torque() -> None:
    assert torque(HM3, constant(92.0), []).shape == (0,)


@pytest.mark.parametrize("times", [[-0.001], [0.0, 1.3], [nan]])
def test_times_outside_the_stretch_are_refused(times: list[float]) -> None:
    said = r"^times: need 0 to 1\.26087 s, the end of the stretch, got "
    with pytest.raises(ParameterError, match=said):
        torque(HM3, constant(92.0), times)

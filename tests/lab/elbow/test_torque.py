"""Torque, its peak, work and impulse: by hand, and by quadrature."""

from dataclasses import replace
from itertools import pairwise
from math import isnan, nextafter, pi

import numpy as np
import pytest

from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    Events,
    MinimumJerk,
    Motion,
    events,
    impulse,
    peak_torque,
    residual_torque,
    torque,
    work,
)
from tests.lab.elbow.scenes import KINDS, random_scene
from tests.lab.elbow.stretches import constant, minimum_jerk

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

# HM4 at 120 deg/s: H 3.8, Q 0.8, catch at 68 deg after 38/120 s, its end at 78 deg
# after 0.4 s, 0.083 s later, so that the 0.1 s of the peak are cut short:
#   end of pre-catch 1.26 · 120 + 3.15 · 38 = 151.2 + 119.7 = 270.9
#   peak             270.9 + 3.8 · 120 (= 456)              = 726.9
#   residual         270.9 + 0.8 · 456 (= 364.8)            = 635.7, at 78 deg
#   at 146 deg       635.7 + 5.8 · 68 (= 394.4)             = 1030.1

# Table III's footnote lists m, b and k for (5) too: the pre-catch law goes on, and the
# torque jumps by k·D at the end of the catch. HM3 at 92 deg/s:
#   just after 112.8 deg  115.92 + 3.15 · 82.8 (= 260.82) + 154.56      = 531.30
#   at 146 deg            115.92 + 3.15 · 116 (= 365.4) + 154.56 + 192.56 = 828.44
ADDITIVE = replace(HM3, post_catch="additive")
LEVELS = [
    (HM3, 92.0, 0.0, 115.92),
    (HM3, 92.0, nextafter(52.8 / 92, 0.0) - 1e-12, 282.24),
    (HM3, 92.0, 52.8 / 92 + 1e-12, 539.84),
    (HM3, 92.0, 52.8 / 92 + 0.1 - 1e-12, 539.84),
    (HM3, 92.0, 52.8 / 92 + 0.1 + 1e-12, 436.80),
    (HM3, 92.0, 0.9 - 1e-12, 436.80),
    (HM3, 92.0, 0.9 + 1e-12, 436.80),
    (HM3, 92.0, 116 / 92 - 1e-12, 629.36),
    (HM4, 120.0, 38 / 120 - 1e-12, 270.9),
    (HM4, 120.0, 38 / 120 + 1e-12, 726.9),
    (HM4, 120.0, 0.4 - 1e-12, 726.9),
    (HM4, 120.0, 0.4 + 1e-12, 635.7),
    (HM4, 120.0, 116 / 120 - 1e-12, 1030.1),
    (ADDITIVE, 92.0, 0.9 - 1e-12, 436.80),
    (ADDITIVE, 92.0, 0.9 + 1e-12, 531.30),
    (ADDITIVE, 92.0, 116 / 92 - 1e-12, 828.44),
]


@pytest.mark.parametrize(("joint", "speed_deg_s", "time", "level"), LEVELS)
def test_torque_by_hand(
    joint: ElbowParameters, speed_deg_s: float, time: float, level: float
) -> None:
    value = one(joint, constant(speed_deg_s), time)
    assert value == pytest.approx(level * DEG, abs=1e-10)


def test_peak_torque_of_a_shorter_stretch_is_the_peak_of_the_catch() -> None:
    # Only 539.84 - 436.80 = 103.04 above the residual: below 112.8 + 103.04/5.8 deg
    # = 130.57 deg the catch is the largest.
    assert peak_torque(HM3, constant(92.0, end_deg=130.5)) == pytest.approx(
        539.84 * DEG, rel=1e-14
    )
    assert peak_torque(HM3, constant(92.0, end_deg=130.6)) > 539.84 * DEG


def test_inertia_adds_to_pre_catch_by_hand() -> None:
    # Quintic from 0.5 to 2.5 rad at 1 rad/s: at 0.5 s 2.8125 rad/s² (test_motions.py),
    # 270/256 rad/s and 212/1024 rad of travel.
    joint = replace(HM3, inertia=0.05)
    motion = MinimumJerk(start=0.5, end=2.5, mean_speed=1.0)
    expected = 0.05 * 2.8125 + 1.26 * 270 / 256 + 3.15 * 212 / 1024
    assert events(joint, motion).catch > 0.5
    assert one(joint, motion, 0.5) == pytest.approx(expected, rel=1e-15)


def test_the_torque_jumps_by_h_times_the_speed_at_the_catch() -> None:
    # (3), with v_c the speed there, 1.63 times the mean speed until then
    motion = minimum_jerk(92.0)
    at = events(HM3, motion).catch
    jump = one(HM3, motion, at) - one(HM3, motion, nextafter(at, 0.0))
    assert jump == pytest.approx(2.8 * float(motion.velocity(at)), rel=1e-12)


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


# Peak


def test_the_largest_may_be_the_last_of_a_phase() -> None:
    # An arm that stops by itself: post-catch grows until the speed is below ν_th, and
    # at that instant the spring and damper of pre-catch, far less, are back.
    motion = minimum_jerk(90.0)
    end = events(HM3, motion).post_catch_end
    last = one(HM3, motion, nextafter(end, 0.0))
    assert peak_torque(HM3, motion) == pytest.approx(last, rel=1e-14)
    assert one(HM3, motion, end) < 0.7 * last


# Calls


# HM3 at 92 deg/s (as above): 282.24 at the end of pre-catch, which rises from
# 115.92 over 52.8 deg; 539.84 for 9.2 deg of the peak; 436.80 for 20.8 deg more;
# from there to 629.36 over 33.2 deg. In N·m·deg/rad times deg:
#   (115.92 + 282.24)/2 · 52.8 + 539.84 · 9.2 + 436.80 · 20.8
#   + (436.80 + 629.36)/2 · 33.2 = 10511.424 + 4966.528 + 9085.44 + 17698.256
WORK = 42261.648


def test_work_and_impulse_of_hm3_at_92_deg_s_by_hand() -> None:
    motion = constant(92.0)
    assert work(HM3, motion) == pytest.approx(WORK * DEG**2, rel=1e-14)
    # at constant speed the impulse is the work over the speed
    assert impulse(HM3, motion) == pytest.approx(WORK * DEG / 92.0, rel=1e-14)
    assert residual_torque(HM3, motion) == pytest.approx(436.80 * DEG, rel=1e-14)
    assert peak_torque(HM3, motion) == pytest.approx(629.36 * DEG, rel=1e-14)


def test_section_iii_c_reads_q_as_the_decrease() -> None:
    # 1 - 0.6 of 257.6 above 282.24
    joint = replace(HM3, residual_reading="decrease")
    found = residual_torque(joint, constant(92.0))
    assert found == pytest.approx((282.24 + 0.4 * 257.6) * DEG, rel=1e-14)
    assert joint.residual_share == pytest.approx(0.4)


def test_a_smoothed_onset_takes_half_its_rise_off_the_impulse() -> None:
    # 3y² - 2y³ has a mean of 1/2: half of H·v_c = 257.6 is missing for 0.02 s
    smooth = replace(HM3, catch_rise=0.02)
    missing = impulse(HM3, constant(92.0)) - impulse(smooth, constant(92.0))
    assert missing == pytest.approx(0.5 * 0.02 * 257.6 * DEG, rel=1e-12)
    found = events(smooth, constant(92.0))
    times = [found.catch, found.catch + 0.005, found.catch + 0.02]
    levels = torque(smooth, constant(92.0), times)
    # y = 1/4: 3/16 - 2/64 = 10/64
    expected = [282.24, 282.24 + 257.6 * 10 / 64, 539.84]
    assert levels / DEG == pytest.approx(expected, rel=1e-12)


def test_a_stretch_without_a_catch_has_no_residual() -> None:
    assert isnan(residual_torque(HM3, constant(10.0)))


def marks_of(joint: ElbowParameters, motion: Motion, found: Events) -> list[float]:
    marks = {0.0, found.end}
    for stretch in found.stretches:
        marks |= {stretch.onset, stretch.catch, stretch.peak_end, stretch.catch_end}
        marks |= {stretch.post_catch_end}
        if stretch.catch is not None:
            marks.add(min(stretch.catch + joint.catch_rise, found.end))
    time = 0.0
    for piece in motion.pieces():
        time += float(piece.length)
        marks.add(min(time, found.end))
    return sorted(mark for mark in marks if mark is not None)


def by_quadrature(
    joint: ElbowParameters, motion: Motion
) -> tuple[float, float, float, float]:
    """Work, impulse, their scale, and the largest torque seen."""
    # Ten points a smooth part: exact to degree 19; τω has degree 9 at most.
    found = events(joint, motion)
    shares, weights = np.polynomial.legendre.leggauss(10)
    done = pushed = scale = 0.0
    largest = -np.inf
    for low, high in pairwise(marks_of(joint, motion, found)):
        if high <= low:
            continue
        times = 0.5 * (low + high) + 0.5 * (high - low) * shares
        tau = torque(joint, motion, times)
        omega = motion.velocity(times)
        width = 0.5 * (high - low)
        done += width * float(weights @ (tau * omega))
        pushed += width * float(weights @ tau)
        scale += width * float(weights @ (np.abs(tau) * (1.0 + np.abs(omega))))
        dense = torque(joint, motion, np.linspace(low, high, 99)[1:-1])
        largest = max(largest, float(dense.max()))
    return done, pushed, scale, largest


@pytest.mark.parametrize("kind", KINDS)
def test_integrals_agree_with_quadrature_and_peaks_with_dense_grids(kind: str) -> None:
    for seed in range(12):
        rng = np.random.default_rng([seed, KINDS.index(kind), 7])
        joint, motion = random_scene(rng, kind, wide=False)
        if motion.start >= joint.range_end:
            continue
        done, pushed, scale, largest = by_quadrature(joint, motion)
        assert work(joint, motion) == pytest.approx(done, abs=1e-12 * scale + 1e-15)
        assert impulse(joint, motion) == pytest.approx(
            pushed, abs=1e-12 * scale + 1e-15
        )
        peak = peak_torque(joint, motion)
        assert peak >= largest - 1e-12 * abs(largest) - 1e-15
        ends = 0.2 * (abs(peak) + 1.0)  # a hundredth of a phase from its end
        assert peak - largest <= ends

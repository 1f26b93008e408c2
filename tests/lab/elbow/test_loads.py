"""Peak, residual, work and impulse: by hand, by quadrature, and by an ODE solver."""

from dataclasses import replace
from itertools import pairwise
from math import isnan, pi

import numpy as np
import pytest

from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    Events,
    Motion,
    events,
    impulse,
    peak_torque,
    residual_torque,
    torque,
    work,
)
from tests.lab.elbow.ode import Ode
from tests.lab.elbow.scenes import KINDS, corner_cases, random_scene
from tests.lab.elbow.stretches import constant, minimum_jerk

HM3 = STANDARD_MODELS["HM3"]
DEG = pi / 180

# HM3 at 92 deg/s (test_torque.py): 282.24 at the end of pre-catch, which rises from
# 115.92 over 52.8 deg; 539.84 for 9.2 deg of the peak; 436.80 for 20.8 deg more;
# from there to 629.36 over 33.2 deg. In N·m·deg/rad times deg:
#   (115.92 + 282.24)/2 · 52.8 + 539.84 · 9.2 + 436.80 · 20.8
#   + (436.80 + 629.36)/2 · 33.2 = 10511.424 + 4966.528 + 9085.44 + 17698.256
WORK = 42261.648


def test_hm3_at_92_deg_s_by_hand() -> None:
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


@pytest.mark.parametrize("name", ["reversed in the peak", "interrupted in the peak"])
def test_corner_cases_agree_with_quadrature(name: str) -> None:
    joint, motion = corner_cases()[name]
    done, pushed, scale, _ = by_quadrature(joint, motion)
    assert work(joint, motion) == pytest.approx(done, abs=1e-13 * scale)
    assert impulse(joint, motion) == pytest.approx(pushed, abs=1e-13 * scale)


# An ODE solver that detects events: θ' = ω(t), with the work and the impulse as further
# states, restarted at every event of Fig. 7, with a tolerance of 1e-11.
@pytest.mark.parametrize("model", STANDARD_MODELS)
@pytest.mark.parametrize("motion", [constant(97.0), minimum_jerk(97.0)])
def test_an_ode_solver_finds_the_same(model: str, motion: Motion) -> None:
    joint = STANDARD_MODELS[model]
    exact = events(joint, motion)
    ode = Ode(joint, motion, rtol=1e-11, max_step=0.01)
    for name in ("onset", "catch", "catch_end", "post_catch_end"):
        value = getattr(exact, name)
        assert (name in ode.found) == (value is not None), name
        if value is not None:
            assert ode.found[name] == pytest.approx(value, abs=1e-8), name
    assert ode.state[1] == pytest.approx(work(joint, motion), abs=1e-7)
    assert ode.state[2] == pytest.approx(impulse(joint, motion), abs=1e-7)

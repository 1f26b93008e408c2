"""Traces: the sampled law stepped over a stretch, bit for bit."""

from dataclasses import FrozenInstanceError
from math import floor, inf, nan, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    Motion,
    SampledJoint,
    events,
    peak_torque,
    trace,
)
from masrel.lab.recording import PHASES
from tests.lab.elbow.stretches import constant, joints, minimum_jerk, motions, table_v

HM3 = STANDARD_MODELS["HM3"]


@given(joint=joints(), motion=motions(), rate_hz=st.sampled_from([50.0, 333.0]))
def test_a_trace_equals_stepping_sample_by_sample_bit_for_bit(
    joint: ElbowParameters, motion: Motion, rate_hz: float
) -> None:
    made = trace(joint, motion, rate_hz=rate_hz)
    stepped = SampledJoint(joint, start_angle=motion.start)
    torques, phases = [], []
    for i in range(made.time.size):
        time = i / rate_hz
        torques.append(
            stepped.step(time, float(made.angle[i]), float(made.velocity[i]))
        )
        phases.append(stepped.phase)
    assert made.torque.tolist() == torques
    assert made.phase.tolist() == phases
    assert made.angle.tolist() == motion.angle(made.time).tolist()
    assert made.velocity.tolist() == motion.velocity(made.time).tolist()


def test_samples_lie_a_period_apart_within_the_stretch() -> None:
    # 116 deg at 92 deg/s take 1.26087 s: samples 0 to 1260 at 1 kHz
    made = trace(HM3, constant(92.0))
    assert made.rate_hz == 1000.0
    assert made.time.size == 1261
    assert made.time[-1] == 1.26
    assert made.time.tolist() == [i / 1000 for i in range(1261)]


def test_a_trace_is_cut_at_the_end_of_range() -> None:
    # From 30 to 146 deg at 58 deg/s: 2 s, whether aimed at 146 or at 170 deg
    made = trace(HM3, constant(58.0, end_deg=170.0), rate_hz=100.0)
    assert made.time.size in (200, 201)  # 2 s itself, but for rounding
    assert made.angle.max() <= radians(146.0) + 1e-12


def test_phases_of_a_trace_are_positions_in_the_names() -> None:
    made = trace(HM3, constant(92.0))
    assert made.phase.dtype == np.int8
    seen = [PHASES[code] for code in sorted(set(made.phase.tolist()))]
    assert seen == ["pre-catch", "catch", "post-catch"]


def test_the_peak_of_a_trace_is_near_the_exact_one() -> None:
    # Sampling sees neither the last of the stretch nor the catch itself in time; each
    # costs less than two samples: at 131 deg/s, 2.3 rad/s, k_post · 2 ms = 0.027 N·m.
    for model, speed_deg_s in table_v():
        joint, motion = STANDARD_MODELS[model], constant(speed_deg_s)
        sampled = float(trace(joint, motion).torque.max())
        assert sampled == pytest.approx(peak_torque(joint, motion), abs=0.03)


def test_the_arrays_are_read_only_and_the_trace_is_frozen() -> None:
    made = trace(HM3, minimum_jerk(92.0), rate_hz=50.0)
    for column in (made.time, made.angle, made.velocity, made.torque, made.phase):
        assert column.shape == made.time.shape
        with pytest.raises(ValueError, match="read-only"):
            column[0] = 1
    with pytest.raises(FrozenInstanceError):
        made.rate_hz = 1.0  # type: ignore[misc]


def test_inertia_is_not_commanded() -> None:
    heavy = ElbowParameters(
        catch_angle_constant=HM3.catch_angle_constant,
        catch_torque_constant=HM3.catch_torque_constant,
        residual_ratio=HM3.residual_ratio,
        catch_travel=HM3.catch_travel,
        inertia=0.2,
    )
    motion = minimum_jerk(92.0)
    assert trace(heavy, motion).torque.tolist() == trace(HM3, motion).torque.tolist()


def test_a_stretch_shorter_than_a_period_has_its_first_sample() -> None:
    made = trace(HM3, constant(92.0), rate_hz=0.5)
    assert floor(events(HM3, constant(92.0)).end * 0.5) == 0
    assert made.time.tolist() == [0.0]


@pytest.mark.parametrize("rate_hz", [0.0, -1000.0, nan, inf])
def test_rates_that_give_no_samples_are_refused(rate_hz: float) -> None:
    with pytest.raises(
        ParameterError, match=rf"^rate_hz: needs more than 0.*, got {rate_hz}"
    ):
        trace(HM3, constant(92.0), rate_hz=rate_hz)


def test_a_trace_beyond_the_range_is_refused() -> None:
    with pytest.raises(ParameterError, match="start: needs less than the end of range"):
        trace(HM3, constant(92.0, start_deg=146.0, end_deg=150.0))

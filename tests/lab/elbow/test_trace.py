"""Traces, stepped bit for bit; and lines to draw: few points, jumps as jumps."""

from dataclasses import replace
from math import inf, nan, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    Hold,
    Joined,
    Motion,
    SampledJoint,
    outline,
    torque,
    trace,
)
from masrel.lab.recording import PHASES
from tests.lab.elbow.stretches import (
    constant,
    joints,
    minimum_jerk,
    motions,
)

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


@pytest.mark.parametrize("rate_hz", [0.0, -1000.0, nan, inf])
def test_rates_that_give_no_samples_are_refused(rate_hz: float) -> None:
    with pytest.raises(
        ParameterError, match=rf"^rate_hz: needs more than 0.*, got {rate_hz}"
    ):
        trace(HM3, constant(92.0), rate_hz=rate_hz)


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

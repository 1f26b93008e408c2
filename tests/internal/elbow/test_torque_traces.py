"""Many traces in one array: the bits of one trace, or the torque at exact events."""

from dataclasses import replace
from math import inf, isnan

import numpy as np
import pytest

from masrel.elbow import (
    STANDARD_MODELS,
    ConstantSpeed,
    ElbowParameters,
    MinimumJerk,
    Motion,
    events,
    torque,
    torque_traces,
    trace,
)
from masrel.elbow.scenes import traces
from masrel.errors import ParameterError
from tests.elbow.scenes import KINDS, random_scene
from tests.elbow.stretches import constant, counted, minimum_jerk, table_v

HM3 = STANDARD_MODELS["HM3"]


def assert_rows_are_traces(joints, motions, rate_hz: float) -> None:
    made = torque_traces(joints, motions, rate_hz=rate_hz, reading="sampled")
    for row, joint, motion in zip(made, joints, motions, strict=True):
        one = trace(joint, motion, rate_hz=rate_hz).torque
        assert row[: one.size].tolist() == one.tolist()
        assert np.isnan(row[one.size :]).all()
    assert not np.isnan(made).all(axis=0).any()  # no longer than the longest


@pytest.mark.parametrize("rate_hz", [77.0, 1000.0])
@pytest.mark.parametrize("kind", KINDS)
def test_every_row_has_the_bits_of_one_trace(kind: str, rate_hz: float) -> None:
    n = 120 if kind in ("constant", "minimum jerk") else 6
    scenes = [
        random_scene(np.random.default_rng([seed, 13]), kind, wide=False)
        for seed in range(2 * n)
    ]
    # at most 5 s, to be quick
    scenes = [s for s in scenes if s[1].start < s[0].range_end and s[1].duration < 5.0]
    joints, motions = zip(*scenes[:n], strict=True)
    assert_rows_are_traces(joints, motions, rate_hz)


# From catches at once to none, from slow to fast, and ends that cut every phase
@pytest.mark.parametrize("kind", [constant, minimum_jerk])
def test_a_grid_of_stretches_has_the_bits(kind) -> None:
    scenes = [
        (joint, kind(speed, start_deg=start, end_deg=end))
        for joint in STANDARD_MODELS.values()
        for speed in (11.0, 20.0, 21.0, 60.0, 93.0, 142.9, 200.0, 900.0)
        for start, end in ((30.0, 146.0), (0.0, 175.0), (95.0, 120.0), (30.0, 80.0))
    ]
    joints, motions = zip(*scenes, strict=True)
    assert_rows_are_traces(joints, motions, 250.0)


def test_plain_stretches_are_not_stepped_through_alone() -> None:
    rows = table_v()
    joints = [STANDARD_MODELS[row.model] for row in rows]
    for kind in (constant, minimum_jerk):
        with counted(traces, "trace") as n_traces:
            stretches = [kind(row.speed_deg_s) for row in rows]
            torque_traces(joints, stretches, reading="sampled")
            assert n_traces == [0]
    additive = replace(HM3, post_catch="additive")
    with counted(traces, "trace") as n_traces:
        torque_traces([HM3, additive], constant(92.0), reading="sampled")
        assert n_traces == [1]  # the counter does count


def test_mixed_motions_keep_their_rows() -> None:
    motions = [minimum_jerk(92.0), constant(92.0), minimum_jerk(46.0), constant(46.0)]
    assert isinstance(motions[0], MinimumJerk)
    assert_rows_are_traces([HM3] * 4, motions, 100.0)
    made = torque_traces(HM3, motions, rate_hz=100.0, reading="sampled")
    assert isnan(made[0, -1])
    assert not isnan(made[2, -1])


# Exact events


def largest_term(joint: ElbowParameters, motion: Motion) -> float:
    """Of (1), (3) and (5): a bound of each term over the motion, N·m."""
    time = np.linspace(0.0, motion.duration, 65)
    speed = np.abs(motion.velocity(time)).max()
    rest = motion.start if joint.rest_angle is None else joint.rest_angle
    return max(
        joint.stiffness * max(abs(motion.start - rest), abs(motion.end - rest)),
        joint.damping * speed,
        joint.inertia * np.abs(motion.acceleration(time)).max(),
        joint.catch_torque_constant * speed,
        joint.post_catch_stiffness * (motion.end - motion.start),
    )


def assert_rows_are_torques(joints, motions, rate_hz: float) -> set[str]:
    """Compare every sample with `torque`; return which phases there were."""
    made = torque_traces(joints, motions, rate_hz=rate_hz)
    seen = set()
    for row, joint, motion in zip(made, joints, motions, strict=True):
        found = events(joint, motion)
        seen |= {span.name for span in found.phases}
        n = trace(joint, motion, rate_hz=rate_hz).time.size
        time = np.minimum(np.arange(n) / rate_hz, found.end)
        one = torque(joint, motion, time, found=found)
        # a sample in the wrong phase would be off by far more
        assert np.abs(row[:n] - one).max() <= 2e-14 * largest_term(joint, motion)
        assert np.isnan(row[n:]).all()
    return seen


@pytest.mark.parametrize("rate_hz", [77.0, 1000.0])
@pytest.mark.parametrize("kind", KINDS)
def test_exact_rows_are_the_torque_of_one_scene(kind: str, rate_hz: float) -> None:
    # with inertia, smoothed onsets and the additive law among them
    n = 100 if kind in ("constant", "minimum jerk") else 6
    scenes = [
        random_scene(np.random.default_rng([seed, 14]), kind, wide=False)
        for seed in range(2 * n)
    ]
    scenes = [s for s in scenes if s[1].start < s[0].range_end and s[1].duration < 5.0]
    joints, motions = zip(*scenes[:n], strict=True)
    seen = assert_rows_are_torques(joints, motions, rate_hz)
    assert {"pre-catch", "catch", "post-catch"} <= seen or n == 6


@pytest.mark.parametrize("kind", [constant, minimum_jerk])
def test_a_grid_of_exact_stretches_is_the_torque_of_one(kind) -> None:
    # 64 and 65 deg/s: events at samples of 250 Hz; slow ones do not catch
    scenes = [
        (joint, kind(speed, start_deg=start, end_deg=end))
        for joint in STANDARD_MODELS.values()
        for speed in (11.0, 20.0, 21.0, 64.0, 93.0, 142.9, 200.0, 900.0, 1e5)
        for start, end in ((30.0, 146.0), (0.0, 175.0), (95.0, 120.0), (30.0, 80.0))
    ]
    joints, motions = zip(*scenes, strict=True)
    assert assert_rows_are_torques(joints, motions, 250.0) == {
        "pre-catch",
        "catch",
        "post-catch",
    }


def test_scenes_at_a_sample_begin_the_later_phase() -> None:
    # 0.25 rad at 0.5 rad/s: θ = 0.5 t, θ_catch = 1 - 0.5 α, all of them binary
    joint = replace(
        HM3,
        catch_angle_constant=1.0,
        catch_slope=1.0,
        slowest_mean_speed=0.0,
        smallest_catch_angle=0.0,
        catch_travel=0.25,
        peak_duration=0.25,
        speed_threshold=0.25,
    )
    stretch = ConstantSpeed(start=0.0, end=1.5, speed=0.5)
    (row,) = torque_traces(joint, stretch, rate_hz=8.0)
    before, peak, residual = (
        joint.damping * 0.5
        + joint.stiffness * 0.5
        + share * joint.catch_torque_constant * 0.5
        for share in (0.0, 1.0, joint.residual_ratio)
    )
    # θ = 0.5 at 1 s, sample 8; the peak ends at 1.25 s, the catch at 1.5 s, sample 12
    assert row[7] < before < row[8]
    assert row[8:10].tolist() == pytest.approx([peak] * 2, rel=1e-14)
    assert row[10:12].tolist() == pytest.approx([residual] * 2, rel=1e-14)
    climbed = residual + joint.post_catch_stiffness * 0.5 / 8.0 * np.arange(13)
    assert row[12:].tolist() == pytest.approx(climbed.tolist(), rel=1e-14)


def test_mixed_motions_keep_their_rows_when_exact() -> None:
    motions = [minimum_jerk(92.0), constant(92.0), minimum_jerk(46.0), constant(46.0)]
    assert_rows_are_torques([HM3] * 120, motions * 30, 100.0)


def test_exact_plain_stretches_are_not_led_through_alone() -> None:
    additive = replace(HM3, post_catch="additive", inertia=0.1)
    for kind in (constant, minimum_jerk):
        with counted(traces, "torque") as n_alone:
            torque_traces([HM3, additive], kind(92.0))
            assert n_alone == [0]
    smoothed = replace(HM3, catch_rise=0.05)
    with counted(traces, "torque") as n_alone:
        torque_traces([HM3, smoothed], constant(92.0))
        assert n_alone == [1]  # the counter does count


def test_exact_and_sampled_agree_but_for_the_sample_after_an_event() -> None:
    for kind in (constant, minimum_jerk):
        stretches = [kind(speed) for speed in (60.0, 92.0, 131.0)]
        sampled = torque_traces(HM3, stretches, rate_hz=1e4, reading="sampled")
        exact = torque_traces(HM3, stretches, rate_hz=1e4)
        off = np.abs(exact - sampled) > 0.01  # N·m
        # the catch, the peak's end and the catch's end, each seen two samples late
        assert (off.sum(axis=1) <= 6).all()


def test_an_unknown_reading_is_refused() -> None:
    with pytest.raises(ParameterError, match=r'^reading: needs "exact" or "sampled"'):
        torque_traces(HM3, constant(92.0), reading="continuous")


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, inf])
def test_rates_that_give_no_samples_are_refused(rate_hz: float) -> None:
    with pytest.raises(ParameterError, match=r"^rate_hz: needs more than 0"):
        torque_traces(HM3, constant(92.0), rate_hz=rate_hz)


def test_a_stretch_beyond_the_range_is_refused_with_its_number() -> None:
    beyond = constant(92.0, start_deg=150.0, end_deg=160.0)
    with pytest.raises(ParameterError, match=r"^motions\[1\]\.start: needs less"):
        torque_traces(HM3, [constant(92.0), beyond])

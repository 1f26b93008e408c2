"""Whole columns against the stepping loop: the same bits, whatever the movement."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.elbow import STANDARD_MODELS, ElbowParameters, SampledJoint, columns, trace
from masrel.elbow.columns import sampled_columns
from tests.elbow.scenes import KINDS, random_scene
from tests.elbow.stretches import joints, motions

HM3 = STANDARD_MODELS["HM3"]


def assert_same_bits(
    joint: ElbowParameters, start: float, *samples: np.ndarray
) -> set[int]:
    """Compare with stepping, bit for bit, and return the phases seen."""
    stepped = SampledJoint(joint, start_angle=start)
    torques, phases = [], []
    for sample in zip(*(column.tolist() for column in samples), strict=True):
        torques.append(stepped.step(*sample))
        phases.append(stepped.phase)
    torque, phase = sampled_columns(joint, start, *samples)
    assert torque.tolist() == torques
    assert phase.tolist() == phases
    return set(phases)


@pytest.mark.parametrize("rate_hz", [90.0, 1000.0])
@pytest.mark.parametrize("kind", KINDS)
def test_random_motions_give_the_same_bits(kind: str, rate_hz: float) -> None:
    seen = set()
    for seed in range(40):
        rng = np.random.default_rng([seed, KINDS.index(kind), 3])
        joint, motion = random_scene(rng, kind, wide=False)
        if motion.start >= joint.range_end:
            continue
        made = trace(joint, motion, rate_hz=rate_hz)
        columns = (made.time, made.angle, made.velocity)
        seen |= assert_same_bits(joint, motion.start, *columns)
        torque, _ = sampled_columns(joint, motion.start, *columns)
        assert made.torque.tolist() == torque.tolist()
    assert seen == {0, 1, 2}


@given(joint=joints(), motion=motions(), rate_hz=st.floats(20.0, 400.0))
def test_any_stretch_gives_the_same_bits(joint, motion, rate_hz: float) -> None:
    made = trace(joint, motion, rate_hz=rate_hz)
    assert_same_bits(joint, motion.start, made.time, made.angle, made.velocity)


# Speeds that have nothing to do with the angles, at, above and below both thresholds:
# every change of the state machine follows every other.
@given(
    rows=st.lists(
        st.tuples(
            st.floats(0.001, 0.3),
            st.sampled_from([-120.0, -20.0, -19.9, 0.0, 19.9, 20.0, 20.1, 60.0, 150.0]),
            st.floats(0.0, 2.6),
        ),
        min_size=1,
        max_size=60,
    ),
    model=st.sampled_from(list(STANDARD_MODELS)),
    additive=st.booleans(),
    rise=st.sampled_from([0.0, 0.05]),
)
def test_any_samples_give_the_same_bits(
    rows, model: str, additive, rise: float
) -> None:
    joint = replace(
        STANDARD_MODELS[model],
        post_catch="additive" if additive else "continuous",
        catch_rise=rise,
    )
    widths, speeds, angles = (np.array(column) for column in zip(*rows, strict=True))
    assert_same_bits(joint, 0.5, np.cumsum(widths), angles, np.radians(speeds))


def test_at_the_very_end_of_the_peak_the_torque_has_fallen() -> None:
    # Samples every 1/64 s, exactly, and a peak of 8 of them: 100 deg/s from 60 deg
    # passes 80 deg in sample 13, and sample 21 is exactly ΔT_peak later.
    joint = replace(HM3, peak_duration=0.125)
    times = np.arange(30) / 64.0
    angles = np.radians(60.0) + np.radians(100.0) * times
    speeds = np.full(30, np.radians(100.0))
    assert_same_bits(joint, np.radians(60.0), times, angles, speeds)
    torque, phase = sampled_columns(joint, np.radians(60.0), times, angles, speeds)
    catch = int((phase == 1).argmax())
    assert catch == 13
    assert len(set(torque[catch : catch + 8].tolist())) == 1
    assert torque[catch + 8] < torque[catch + 7]


@pytest.mark.parametrize("block", [1, 2, 7])
def test_blocks_of_any_size_give_the_same_bits(
    block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(columns, "_BLOCK", block)
    for kind in KINDS:
        joint, motion = random_scene(np.random.default_rng(5), kind, wide=False)
        made = trace(joint, motion, rate_hz=200.0)
        assert_same_bits(joint, motion.start, made.time, made.angle, made.velocity)


def test_no_samples_give_nothing() -> None:
    none = np.empty(0)
    torque, phase = sampled_columns(HM3, 0.5, none, none, none)
    assert torque.size == phase.size == 0

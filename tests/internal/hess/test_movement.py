"""What a recording's facts say of the movement."""

from math import degrees, radians

import numpy as np
import pytest

from masrel.elbow import STANDARD_MODELS, SampledJoint
from masrel.hess._presented import (
    Columns,
    catch_angle_deg,
    mean_speed_deg_s,
    movement_facts,
    phase_sequence,
)
from masrel.recording import RECORDING_COLUMNS
from tests.hess.rig import START, present

THRESHOLD = radians(20.0)


def columns(
    velocity_deg_s: list[float], *, angle_deg: list[float], phase: list[int]
) -> Columns:
    n = len(velocity_deg_s)
    values = {
        "time_s": np.arange(n) * 0.1,
        "angle_deg": np.array(angle_deg),
        "velocity_deg_s": np.array(velocity_deg_s),
        "phase": np.array(phase, dtype=float),
    }
    return {name: values.get(name, np.zeros(n)) for name in RECORDING_COLUMNS}


def test_the_mean_speed_goes_from_the_onset_to_the_catch() -> None:
    # ν_th is reached at 32 deg, 0.1 s, the catch is at 58 deg, 0.4 s: 26 / 0.3.
    found = columns(
        [0, 20, 90, 90, 90, 10],
        angle_deg=[30, 32, 40, 49, 58, 60],
        phase=[0, 0, 0, 0, 1, 0],
    )
    assert mean_speed_deg_s(found, THRESHOLD) == pytest.approx(26.0 / 0.3)
    assert catch_angle_deg(found) == 58.0
    assert phase_sequence(found) == ("pre-catch", "catch", "pre-catch")


def test_an_arm_that_hesitated_has_begun_anew() -> None:
    # As for the joint: 45 to 58 deg from 0.3 to 0.4 s, without the rest before.
    found = columns(
        [50, 50, 10, 90, 90],
        angle_deg=[30, 35, 36, 45, 58],
        phase=[0, 0, 0, 0, 1],
    )
    assert mean_speed_deg_s(found, THRESHOLD) == pytest.approx(130.0)


def test_without_a_catch_it_goes_to_the_last_fast_sample() -> None:
    found = columns([0, 30, 30, 30, 0], angle_deg=[30, 31, 34, 37, 38], phase=[0] * 5)
    assert mean_speed_deg_s(found, THRESHOLD) == pytest.approx(30.0)


@pytest.mark.parametrize("velocity", [[0, 19, 19, 0], [0, 25, 0, 0], [0, -60, -60, 0]])
def test_without_an_extension_there_is_none(velocity: list[float]) -> None:
    found = columns(velocity, angle_deg=[30, 31, 32, 33], phase=[0] * 4)
    assert mean_speed_deg_s(found, THRESHOLD) is None


def test_a_fault_before_the_catch_leaves_no_mean_speed() -> None:
    found = columns([0, 30, 30, 999], angle_deg=[30, 33, 36, 136], phase=[0] * 4)
    assert movement_facts(found, THRESHOLD, False)["mean_speed_deg_s"] is not None
    assert movement_facts(found, THRESHOLD, True)["mean_speed_deg_s"] is None


def test_a_fault_after_the_catch_leaves_it() -> None:
    found = columns([0, 30, 30, 999], angle_deg=[30, 33, 36, 136], phase=[0, 0, 1, 1])
    facts = movement_facts(found, THRESHOLD, True)
    assert facts["mean_speed_deg_s"] == pytest.approx(30.0)


def test_no_samples_have_no_phases() -> None:
    assert phase_sequence(columns([], angle_deg=[], phase=[])) == ()


@pytest.mark.parametrize("model", sorted(STANDARD_MODELS))
def test_it_is_the_mean_speed_that_the_joint_decided_by(model: str) -> None:
    recording = present(model, 85.0).recording
    joint = SampledJoint(STANDARD_MODELS[model], start_angle=START)
    time_s, angle, velocity = (
        recording.columns[name].tolist()
        for name in ("time_s", "angle_deg", "velocity_deg_s")
    )
    for sample in zip(time_s, np.radians(angle), np.radians(velocity), strict=True):
        joint.step(*sample)
        if joint.phase == 1:
            break
    assert recording.facts["mean_speed_deg_s"] == pytest.approx(
        degrees(joint.mean_speed), rel=1e-9
    )

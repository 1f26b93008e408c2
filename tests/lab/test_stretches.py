"""What the columns of a recording say of each stretch."""

from math import degrees

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS, SampledJoint
from masrel.lab.recording import RECORDING_COLUMNS, Recording, Stretch, stretches
from tests.lab.hess.rig import START, present

THRESHOLD = {"speed_threshold_deg_s": 20.0}


def recorded(
    velocity_deg_s: list[float],
    *,
    angle_deg: list[float],
    phase: list[int],
    stretch: list[int] | None = None,
    facts: dict[str, str | float] = THRESHOLD,
    **others: list[float],
) -> Recording:
    n = len(velocity_deg_s)
    values = {
        "time_s": np.arange(n) * 0.1,
        "angle_deg": np.array(angle_deg),
        "velocity_deg_s": np.array(velocity_deg_s),
        "phase": np.array(phase, dtype=float),
        "stretch": np.ones(n) if stretch is None else np.array(stretch, dtype=float),
        **{name: np.array(values, dtype=float) for name, values in others.items()},
    }
    columns = {name: values.get(name, np.zeros(n)) for name in RECORDING_COLUMNS}
    return Recording(columns=columns, facts=facts)


def single(recording: Recording) -> Stretch:
    (stretch,) = stretches(recording)
    return stretch


FAULT = {**THRESHOLD, "fault": "speed: too much"}


@pytest.mark.parametrize(
    ("velocity", "angle", "phase", "facts", "mean_speed", "catch_angle"),
    [
        # ν_th is reached at 32 deg, 0.1 s, the catch is at 58 deg, 0.4 s: 26 / 0.3
        (
            *([0, 20, 90, 90, 90, 10], [30, 32, 40, 49, 58, 60], [0, 0, 0, 0, 1, 0]),
            *(THRESHOLD, 26.0 / 0.3, 58.0),
        ),
        # an arm that hesitated has begun anew, as for the joint: 45 to 58 deg in 0.1 s
        (
            *([50, 50, 10, 90, 90], [30, 35, 36, 45, 58], [0, 0, 0, 0, 1]),
            *(THRESHOLD, 130.0, 58.0),
        ),
        # without a catch it goes to the last fast sample
        ([0, 30, 30, 30, 0], [30, 31, 34, 37, 38], [0] * 5, THRESHOLD, 30.0, None),
        # without an extension there is none
        ([0, 19, 19, 0], [30, 31, 32, 33], [0] * 4, THRESHOLD, None, None),
        ([0, 25, 0, 0], [30, 31, 32, 33], [0] * 4, THRESHOLD, None, None),
        ([0, -60, -60, 0], [30, 31, 32, 33], [0] * 4, THRESHOLD, None, None),
        # a fault before the catch leaves none, and one after it does
        ([0, 30, 30, 999], [30, 33, 36, 136], [0] * 4, FAULT, None, None),
        ([0, 30, 30, 999], [30, 33, 36, 136], [0, 0, 1, 1], FAULT, 30.0, 36.0),
    ],
)
def test_the_mean_speed_goes_from_the_onset_to_the_catch(
    velocity: list[float],
    angle: list[float],
    phase: list[int],
    facts: dict[str, str | float],
    mean_speed: float | None,
    catch_angle: float | None,
) -> None:
    found = single(recorded(velocity, angle_deg=angle, phase=phase, facts=facts))
    assert found.mean_speed_deg_s == (mean_speed and pytest.approx(mean_speed))
    assert found.catch_angle_deg == catch_angle
    assert found.reached_threshold is (max(velocity) >= 20)
    if catch_angle is None:
        assert found.residual_torque_nm is None
    else:
        assert found.catch_time_s == pytest.approx(0.1 * phase.index(1))


def test_a_fault_takes_nothing_from_a_stretch_that_was_over() -> None:
    found = recorded(
        [0, 30, 30, 30, 0, -30, 30, 30],
        angle_deg=[30, 31, 34, 37, 38, 35, 38, 41],
        phase=[0] * 8,
        stretch=[1, 1, 1, 1, 1, 0, 2, 2],
        facts={**THRESHOLD, "fault": "speed: too much"},
    )
    assert [s.mean_speed_deg_s is None for s in stretches(found)] == [False, True]
    without = recorded([0, 30, 30, 999], angle_deg=[30, 33, 36, 136], phase=[0] * 4)
    assert single(without).mean_speed_deg_s is not None


def test_each_stretch_has_its_own_facts() -> None:
    first, second = stretches(
        recorded(
            [0, 30, 30, 0, -40, -40, 30, 60, 60, 10],
            angle_deg=[30, 33, 36, 37, 34, 30, 32, 36, 42, 44],
            phase=[0, 0, 0, 0, 0, 0, 0, 1, 1, 2],
            stretch=[0, 1, 1, 1, 0, 0, 2, 2, 2, 2],
            model_torque_nm=[0, 1, 2, 1, 9, 9, 1, 6, 4, 3],
        )
    )
    assert (first.number, second.number) == (1, 2)
    assert (first.onset_s, first.end_s) == pytest.approx((0.1, 0.3))
    assert (second.onset_s, second.end_s) == pytest.approx((0.6, 0.9))
    assert (first.peak_torque_nm, second.peak_torque_nm) == (2.0, 6.0)
    assert (first.residual_torque_nm, second.residual_torque_nm) == (None, 4.0)
    assert first.mean_speed_deg_s == pytest.approx(30.0)
    assert second.mean_speed_deg_s == pytest.approx(40.0)
    assert second.phases == ("pre-catch", "catch", "post-catch")


def test_no_samples_are_no_stretch() -> None:
    assert stretches(recorded([], angle_deg=[], phase=[])) == ()


def test_before_recordings_had_the_column_there_was_one() -> None:
    made = recorded([0, 30, 30, 0], angle_deg=[30, 33, 36, 37], phase=[0] * 4)
    columns = {n: c for n, c in made.columns.items() if n not in ("stretch", "ramp")}
    old = Recording(columns=columns, facts={"fault_time_s": 0.3})
    assert old.columns["stretch"].tolist() == [1.0, 1.0, 1.0, 0.0]
    assert single(old).mean_speed_deg_s == pytest.approx(30.0)


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
    assert single(recording).mean_speed_deg_s == pytest.approx(
        degrees(joint.mean_speed), rel=1e-9
    )
    assert recording.facts["mean_speed_deg_s"] == single(recording).mean_speed_deg_s

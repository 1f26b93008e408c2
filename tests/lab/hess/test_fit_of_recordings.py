"""What the device measured itself gives back the models, and the device."""

from dataclasses import replace
from math import radians
from pathlib import Path

import pytest

from masrel.errors import RecordingError, RecordingWarning
from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    Joined,
    MinimumJerk,
    Motion,
    Reversed,
    fit,
    fit_friction,
)
from masrel.lab.elbow.identification import ElbowFit, read_movement
from masrel.lab.hess import MotionHand, SimulatedOptions, TorqueSensor
from masrel.lab.recording import (
    MEASURED_TORQUE,
    Recording,
    read_recording,
    write_recording,
)

from .rig import controls, present

# A joint that asks for no torque at all: the device alone
NOTHING = replace(
    STANDARD_MODELS["HM1"],
    damping=0.0,
    stiffness=0.0,
    catch_torque_constant=0.0,
    post_catch_stiffness=0.0,
)


def measured(
    joint: ElbowParameters, motion: Motion, *, compensation: float = 0.9, seed: int = 0
) -> Recording:
    """One presentation of a joint that is led along a motion."""
    presented = present(
        controls(joint, start_angle=motion.start, compensation=compensation),
        hand=MotionHand(motion),
        backend=SimulatedOptions(torque_sensor=TorqueSensor(seed=seed)),
        max_duration_s=motion.duration,
        end_angle=10.0,  # never
    )
    assert presented.fault is None
    return presented.recording


def stretch(mean_speed_deg_s: float) -> MinimumJerk:
    """A slow stretch over 30 deg, or one over the whole range."""
    end = 60.0 if mean_speed_deg_s < 20.0 else 145.0
    return MinimumJerk(
        start=radians(30.0), end=radians(end), mean_speed=radians(mean_speed_deg_s)
    )


def to_and_fro(*mean_speeds_deg_s: float) -> Joined:
    """Forth and back by minimum jerk between 35 and 135 deg, once at each speed."""
    ways = []
    for speed in mean_speeds_deg_s:
        forth = MinimumJerk(
            start=radians(35.0), end=radians(135.0), mean_speed=radians(speed)
        )
        ways += [forth, Reversed(motion=forth)]
    return Joined(ways)


MEASURED = MEASURED_TORQUE.column
SPEEDS = (6.0, 7.0, 8.0, 9.0, 65.0, 75.0, 85.0, 95.0, 100.0)


def without_sensor(recording: Recording) -> Recording:
    columns = {k: v for k, v in recording.columns.items() if k != MEASURED}
    return Recording(columns=columns, facts=recording.facts)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """HM3 stretched slowly and fast."""
    folder = tmp_path_factory.mktemp("HM3")
    paths = [folder / f"{number}.npz" for number in range(len(SPEEDS))]
    for seed, (path, speed) in enumerate(zip(paths, SPEEDS, strict=True)):
        joint = STANDARD_MODELS["HM3"]
        write_recording(measured(joint, stretch(speed), seed=seed), path)
    return paths


@pytest.fixture(scope="module")
def fitted(recordings: list[Path]) -> ElbowFit:
    """From the measured torque, with what a device has beside the law."""
    return fit(recordings, arm_inertia="fitted", lag="fitted")


def test_measured_torque_gives_the_model_back(fitted: ElbowFit) -> None:
    joint = STANDARD_MODELS["HM3"]
    # A tenth of B = 0.168 is left of the device's friction
    assert fitted["damping"].value == pytest.approx(joint.damping + 0.0168, rel=0.005)
    assert fitted["stiffness"].value == pytest.approx(joint.stiffness, rel=0.005)
    constant = fitted["catch_angle_constant"].value
    assert constant == pytest.approx(joint.catch_angle_constant, abs=radians(0.3))
    assert fitted["catch_slope"].value == pytest.approx(joint.catch_slope, rel=0.02)
    travel = fitted["catch_travel"].value
    assert travel == pytest.approx(joint.catch_travel, abs=radians(0.5))
    ratio = fitted["residual_ratio"].value
    assert ratio == pytest.approx(joint.residual_ratio, rel=0.015)
    after = fitted["post_catch_stiffness"].value
    assert after == pytest.approx(joint.post_catch_stiffness, rel=0.015)
    # This hand is 7 deg/s slower some ms after a catch, where the fit has one speed
    height = fitted["catch_torque_constant"].value
    assert height == pytest.approx(joint.catch_torque_constant, rel=0.05)


def test_and_what_else_is_behind_the_sensor(fitted: ElbowFit) -> None:
    # I of (7); 0.8 ms of the sensor, 1 ms of the motor, of which a tick is the loop's
    assert fitted["arm_inertia"].value == pytest.approx(0.0097, abs=0.002)
    assert 0.0008 < fitted["lag"].value < 0.0018


def test_a_fit_says_which_torque_it_took(
    recordings: list[Path], fitted: ElbowFit, tmp_path: Path
) -> None:
    said = "The torque of 9 of 9 recordings was measured by the device's sensor"
    assert fitted.remarks[0].startswith(said)
    assert read_movement(recordings[0]).torque_source == "sensor"
    bare = [tmp_path / path.name for path in recordings]
    for path, copy in zip(recordings, bare, strict=True):
        write_recording(without_sensor(read_recording(path)), copy)
    of_model = fit(bare)
    assert of_model.remarks[0] == (
        "The torque of 9 of 9 recordings was commanded by the joint model, not measured"
    )
    assert of_model["damping"].value == pytest.approx(1.26, rel=0.005)
    both = fit([*recordings[:4], *bare[4:]])
    assert [remark[:20] for remark in both.remarks[:2]] == [
        "The torque of 4 of 9",
        "The torque of 5 of 9",
    ]


def test_a_sensor_that_failed_is_said_again_where_it_is_read(tmp_path: Path) -> None:
    recording = measured(STANDARD_MODELS["HM3"], stretch(90.0))
    path = tmp_path / "a.npz"
    facts = {**recording.facts, "channel_faults": "measured_torque_nm: stays at 1 N·m"}
    write_recording(replace(recording, facts=facts), path)
    with pytest.warns(RecordingWarning, match=r"a\.npz: measured_torque_nm: stays"):
        read_movement(path)


def test_presentations_of_two_models_are_not_fitted_as_one(tmp_path: Path) -> None:
    paths = [tmp_path / "a.npz", tmp_path / "b.npz"]
    for path, model in zip(paths, ("HM2", "HM1"), strict=True):
        recording = measured(STANDARD_MODELS[model], stretch(90.0))
        facts = {**recording.facts, "model": model}
        write_recording(replace(recording, facts=facts), path)
    with pytest.raises(RecordingError, match=r"one model; .* name HM1, HM2"):
        fit(paths)


@pytest.mark.parametrize("compensation", [0.0, 0.9])
def test_what_is_measured_beyond_what_was_sent_is_the_device(
    tmp_path: Path, compensation: float
) -> None:
    motion = to_and_fro(45.0, 60.0, 75.0)
    path = tmp_path / "a.npz"
    write_recording(measured(NOTHING, motion, compensation=compensation), path)
    friction = fit_friction([path])
    assert friction["inertia"].value == pytest.approx(0.0097, abs=0.0005)
    assert friction["viscous"].value == pytest.approx(0.168, rel=0.03)
    assert friction["coulomb"].value == pytest.approx(0.189, rel=0.03)


def test_without_a_sensor_nothing_tells_of_the_device(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write_recording(without_sensor(measured(NOTHING, to_and_fro(60.0))), path)
    with pytest.raises(RecordingError, match=f"needs the column {MEASURED}: only a"):
        fit_friction([path])

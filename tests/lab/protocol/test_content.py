"""Degrees become radians once, and every constant reaches the joint model."""

from dataclasses import fields
from math import radians
from pathlib import Path

from masrel.lab.elbow.parameters import STANDARD_MODELS, ElbowParameters
from masrel.lab.protocol import joint_model, read_protocol
from tests.lab.protocol.documents import changed, write

ELBOW = {
    "inertia_kg_m2": 0.01,
    "damping_nms_rad": 1.1,
    "stiffness_nm_rad": 3.0,
    "catch_slope_s": 0.2,
    "peak_duration_s": 0.05,
    "post_catch_stiffness_nm_rad": 5.0,
    "speed_threshold_deg_s": 18.0,
    "slowest_mean_speed_deg_s": 45.0,
    "smallest_catch_angle_deg": 36.0,
    "range_end_deg": 150.0,
    "rest_angle_deg": 18.0,
    "post_catch": "additive",
    "residual_reading": "decrease",
    "catch_rise_s": 0.02,
}


def test_every_constant_is_taken_and_degrees_become_radians(tmp_path: Path) -> None:
    protocol = read_protocol(write(changed("elbow", to=ELBOW), tmp_path))
    joint = joint_model(protocol, "D1")
    assert joint == ElbowParameters(
        catch_angle_constant=radians(125.5),
        catch_torque_constant=1.7,
        residual_ratio=0.2,
        catch_travel=radians(55.0),
        inertia=0.01,
        damping=1.1,
        stiffness=3.0,
        catch_slope=0.2,
        peak_duration=0.05,
        post_catch_stiffness=5.0,
        speed_threshold=radians(18.0),
        slowest_mean_speed=radians(45.0),
        smallest_catch_angle=radians(36.0),
        range_end=radians(150.0),
        rest_angle=radians(18.0),
        post_catch="additive",
        residual_reading="decrease",
        catch_rise=0.02,
    )
    # each has a key: it differs from its default
    plain = STANDARD_MODELS["HM1"]
    alike = [f.name for f in fields(joint)
             if getattr(joint, f.name) == getattr(plain, f.name)]  # fmt: skip
    assert alike == []


def test_a_models_own_constants_take_the_place_of_the_shared_ones(
    tmp_path: Path,
) -> None:
    own = {"damping_nms_rad": 0.9, "catch_slope_s": 0.3}
    protocol = read_protocol(write(changed("models", 0, "constants", to=own), tmp_path))
    first = joint_model(protocol, "HM1")
    second = joint_model(protocol, "D1")
    assert (first.damping, first.catch_slope) == (0.9, 0.3)
    assert first.stiffness == second.stiffness
    assert second.damping == protocol.elbow.damping_nms_rad

"""Degrees become radians once, and every constant reaches the joint model."""

import math
from dataclasses import fields
from pathlib import Path

import pytest

from masrel.lab.elbow.parameters import STANDARD_MODELS
from masrel.lab.protocol import elbow_parameters, read_protocol
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
    found = elbow_parameters(protocol, "D1")
    assert found.catch_angle_constant == pytest.approx(125.5 / 180 * math.pi, rel=1e-15)
    assert found.catch_travel == pytest.approx(55 / 180 * math.pi, rel=1e-15)
    assert (found.catch_torque_constant, found.residual_ratio) == (1.7, 0.2)
    assert (found.inertia, found.damping, found.stiffness) == (0.01, 1.1, 3.0)
    assert (found.catch_slope, found.peak_duration) == (0.2, 0.05)
    assert found.post_catch_stiffness == 5.0
    assert found.speed_threshold == pytest.approx(math.pi / 10, rel=1e-15)
    assert found.slowest_mean_speed == pytest.approx(math.pi / 4, rel=1e-15)
    assert found.smallest_catch_angle == pytest.approx(math.pi / 5, rel=1e-15)
    assert found.range_end == pytest.approx(math.pi * 5 / 6, rel=1e-15)
    assert found.rest_angle == pytest.approx(math.pi / 10, rel=1e-15)
    assert (found.post_catch, found.residual_reading) == ("additive", "decrease")
    assert found.catch_rise == 0.02


def test_every_parameter_of_a_joint_has_a_key(tmp_path: Path) -> None:
    # Each key differs from the default above, or is one of a model's four.
    protocol = read_protocol(write(changed("elbow", to=ELBOW), tmp_path))
    found, plain = elbow_parameters(protocol, "D1"), STANDARD_MODELS["HM1"]
    alike = {f.name for f in fields(found)} - {
        f.name
        for f in fields(found)
        if getattr(found, f.name) != getattr(plain, f.name)
    }
    assert alike == set()


def test_a_models_own_constants_take_the_place_of_the_shared_ones(
    tmp_path: Path,
) -> None:
    own = {"damping_nms_rad": 0.9, "catch_slope_s": 0.3}
    protocol = read_protocol(write(changed("models", 0, "constants", to=own), tmp_path))
    first = elbow_parameters(protocol, "HM1")
    second = elbow_parameters(protocol, "D1")
    assert (first.damping, first.catch_slope) == (0.9, 0.3)
    assert first.stiffness == second.stiffness
    assert second.damping == protocol.elbow.damping_nms_rad

"""Parameters: Table III in SI, the clamps of the catch angle, refusals."""

from dataclasses import FrozenInstanceError, fields, replace
from math import inf, nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import MasrelError, ParameterError
from masrel.lab.elbow import STANDARD_MODELS, ElbowParameters
from tests.lab.elbow.stretches import joints

DEG = pi / 180

# Table III of Park, Kim and Damiano (2012): L (deg), H (N·m·s/rad), Q, D (deg)
TABLE_III = {
    "HM1": (130, 1.4, 0.15, 60),
    "HM2": (120, 2.0, 0.30, 50),
    "HM3": (115, 2.8, 0.60, 30),
    "HM4": (110, 3.8, 0.80, 10),
}

PLAIN = ElbowParameters(
    catch_angle_constant=2.0,
    catch_torque_constant=2.0,
    residual_ratio=0.5,
    catch_travel=0.5,
)


@pytest.mark.parametrize("model", TABLE_III)
def test_standard_models_are_table_iii(model: str) -> None:
    length, torque, ratio, travel = TABLE_III[model]
    joint = STANDARD_MODELS[model]
    assert joint.catch_angle_constant == pytest.approx(length * DEG, rel=1e-15)
    assert joint.catch_torque_constant == torque
    assert joint.residual_ratio == ratio
    assert joint.catch_travel == pytest.approx(travel * DEG, rel=1e-15)


def test_there_are_four_standard_models_in_the_order_of_the_grades() -> None:
    assert list(STANDARD_MODELS) == list(TABLE_III)


@pytest.mark.parametrize("model", TABLE_III)
def test_the_common_constants_are_table_iii_and_the_text(model: str) -> None:
    joint = STANDARD_MODELS[model]
    assert joint.inertia == 0.0
    assert joint.damping == 1.26
    assert joint.stiffness == 3.15
    assert joint.catch_slope == 0.35
    assert joint.peak_duration == 0.1
    assert joint.post_catch_stiffness == 5.8
    assert joint.speed_threshold == pytest.approx(20 * DEG, rel=1e-15)
    assert joint.slowest_mean_speed == pytest.approx(60 * DEG, rel=1e-15)
    assert joint.smallest_catch_angle == pytest.approx(60 * DEG, rel=1e-15)
    assert joint.range_end == pytest.approx(146 * DEG, rel=1e-15)
    assert joint.rest_angle is None
    assert joint.post_catch == "continuous"


@pytest.mark.parametrize(
    ("model", "fastest_deg_s"),
    # (6): L - 60 deg, over 0.35 s
    [("HM1", 200.0), ("HM2", 1200 / 7), ("HM3", 1100 / 7), ("HM4", 1000 / 7)],
)
def test_fastest_mean_speed_by_hand(model: str, fastest_deg_s: float) -> None:
    found = STANDARD_MODELS[model].fastest_mean_speed
    assert found == pytest.approx(fastest_deg_s * DEG, rel=1e-14)


@pytest.mark.parametrize(
    ("speed_deg_s", "catch_deg"),
    # HM2: 120 - 0.35 v between 60 and 171.4 deg/s, 99 and 60 deg outside
    [(0, 99), (59, 99), (60, 99), (100, 85), (170, 60.5), (172, 60), (1000, 60)],
)
def test_catch_angle_of_hm2_by_hand(speed_deg_s: float, catch_deg: float) -> None:
    found = STANDARD_MODELS["HM2"].catch_angle(speed_deg_s * DEG)
    assert found == pytest.approx(catch_deg * DEG, rel=1e-14)


@given(joint=joints(), speed=st.floats(0.0, 6.0), more=st.floats(0.0, 1.0))
def test_catch_angle_falls_with_speed_without_jumps_within_its_bounds(
    joint: ElbowParameters, speed: float, more: float
) -> None:
    here, further = joint.catch_angle(speed), joint.catch_angle(speed + more)
    assert further <= here + 1e-15
    assert here - further <= joint.catch_slope * more + 1e-14
    assert joint.smallest_catch_angle - 1e-15 <= further
    assert here < joint.catch_angle_constant


NUMBERS = [
    field.name
    for field in fields(ElbowParameters)
    if field.name not in ("post_catch", "residual_reading")
]


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_every_number_must_be_finite(name: str, value: float) -> None:
    with pytest.raises(
        ParameterError, match=rf"^{name}: needs a finite number, got {value}"
    ):
        replace(PLAIN, **{name: value})


@pytest.mark.parametrize("name", ["catch_angle_constant", "catch_travel", "range_end"])
@pytest.mark.parametrize("value", [0.0, -0.1, 3.2])
def test_angles_lie_above_0_and_at_most_180_degrees(name: str, value: float) -> None:
    said = rf"^{name}: needs \(0, 180\] degrees, got {value} \(SI units\)"
    with pytest.raises(ParameterError, match=said):
        replace(PLAIN, **{name: value})
    assert getattr(replace(PLAIN, **{name: pi}), name) == pi


@pytest.mark.parametrize("name", ["catch_slope", "peak_duration", "speed_threshold"])
@pytest.mark.parametrize("value", [0.0, -0.1])
def test_slope_duration_and_threshold_are_above_0(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=rf"^{name}: needs more than 0, got"):
        replace(PLAIN, **{name: value})


@pytest.mark.parametrize(
    "name",
    [
        "catch_torque_constant",
        "inertia",
        "damping",
        "stiffness",
        "post_catch_stiffness",
        "slowest_mean_speed",
        "smallest_catch_angle",
    ],
)
def test_what_may_be_0_may_not_be_less(name: str) -> None:
    assert getattr(replace(PLAIN, **{name: 0.0}), name) == 0.0
    with pytest.raises(ParameterError, match=rf"^{name}: needs 0 or more, got -0.1"):
        replace(PLAIN, **{name: -0.1})


@pytest.mark.parametrize("value", [-0.01, 1.0, 1.5])
def test_the_residual_is_less_than_the_peak(value: float) -> None:
    said = rf"^residual_ratio: needs \[0, 1\), got {value}"
    with pytest.raises(ParameterError, match=said):
        replace(PLAIN, residual_ratio=value)
    assert replace(PLAIN, residual_ratio=0.0).residual_ratio == 0.0


def test_the_reading_of_equation_5_is_one_of_two_words() -> None:
    said = '^post_catch: needs "continuous" or "additive", got \'both\''
    with pytest.raises(ParameterError, match=said):
        replace(PLAIN, post_catch="both")


def test_refusals_are_errors_of_the_package_and_values() -> None:
    with pytest.raises(MasrelError) as caught:
        replace(PLAIN, stiffness=-1.0)
    assert isinstance(caught.value, ValueError)


def test_parameters_are_frozen_and_equal_by_value() -> None:
    with pytest.raises(FrozenInstanceError):
        PLAIN.stiffness = 1.0  # type: ignore[misc]
    assert replace(PLAIN) == PLAIN

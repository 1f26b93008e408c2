"""Parameters: Table III in SI, the clamps of the catch angle, refusals."""

from dataclasses import replace
from math import inf, nan, pi

import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import STANDARD_MODELS, ElbowParameters

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
    ("speed_deg_s", "catch_deg"),
    # HM2: 120 - 0.35 v between 60 and 171.4 deg/s, 99 and 60 deg outside
    [(0, 99), (59, 99), (60, 99), (100, 85), (170, 60.5), (172, 60), (1000, 60)],
)
def test_catch_angle_of_hm2_by_hand(speed_deg_s: float, catch_deg: float) -> None:
    found = STANDARD_MODELS["HM2"].catch_angle(speed_deg_s * DEG)
    assert found == pytest.approx(catch_deg * DEG, rel=1e-14)


OF_ANGLES = "needs \\(0, 180\\] degrees, got"
OUTSIDE = [  # a value of each that is refused, and one at the edge that is not
    *((name, 3.2, pi, OF_ANGLES) for name in ("catch_travel", "range_end")),
    *((name, 0.0, 0.1, OF_ANGLES) for name in ("catch_angle_constant", "range_end")),
    *(
        (name, 0.0, 1e-9 if name != "peak_duration" else 0.1, "needs more than 0, got")
        for name in ("catch_slope", "peak_duration", "speed_threshold")
    ),
    *(
        (name, -0.1, 0.0, "needs 0 or more, got -0.1")
        for name in (
            "catch_torque_constant",
            "inertia",
            "damping",
            "stiffness",
            "post_catch_stiffness",
            "slowest_mean_speed",
            "smallest_catch_angle",
        )
    ),
    ("residual_ratio", 1.0, 0.0, r"needs \[0, 1\), got 1.0"),
    ("residual_ratio", -0.01, 0.99, r"needs \[0, 1\), got -0.01"),
    ("catch_rise", 0.2, 0.1, "needs 0 to peak_duration, 0.1 s, got 0.2 s"),
    ("post_catch", "both", "additive", 'needs "continuous" or "additive", got \'both'),
    ("rest_angle", -inf, None, "needs a finite number, got -inf"),
]


@pytest.mark.parametrize(("name", "wrong", "right", "said"), OUTSIDE)
def test_a_parameter_outside_its_range_is_refused_by_name(
    name: str, wrong: float, right: float, said: str
) -> None:
    assert getattr(replace(PLAIN, **{name: right}), name) == right
    with pytest.raises(ParameterError, match=f"^{name}: {said}"):
        replace(PLAIN, **{name: wrong})
    if isinstance(wrong, float):
        for value in (nan, inf):
            with pytest.raises(ParameterError, match=f"^{name}: needs a finite number"):
                replace(PLAIN, **{name: value})

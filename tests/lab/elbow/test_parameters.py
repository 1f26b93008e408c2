"""Parameters: Table III in SI, the clamps of the catch angle, refusals."""

from dataclasses import asdict, replace
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


COMMON = {
    "inertia": 0.0,
    "damping": 1.26,
    "stiffness": 3.15,
    "catch_slope": 0.35,
    "peak_duration": 0.1,
    "post_catch_stiffness": 5.8,
    "speed_threshold": 20 * DEG,
    "slowest_mean_speed": 60 * DEG,
    "smallest_catch_angle": 60 * DEG,
    "range_end": 146 * DEG,
    "catch_rise": 0.0,
}
WORDS = {"rest_angle": None, "post_catch": "continuous", "residual_reading": "residual"}


@pytest.mark.parametrize("model", TABLE_III)
def test_standard_models_are_table_iii_and_the_text(model: str) -> None:
    length, torque, ratio, travel = TABLE_III[model]
    values = asdict(STANDARD_MODELS[model])
    assert {name: values.pop(name) for name in WORDS} == WORDS
    assert values == pytest.approx(
        {
            "catch_angle_constant": length * DEG,
            "catch_torque_constant": torque,
            "residual_ratio": ratio,
            "catch_travel": travel * DEG,
            **COMMON,
        },
        rel=1e-15,
    )


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
    ("residual_ratio", 1.0, 0.0, r"needs \[0, 1\), got 1"),
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

"""A model file says what it holds to the last digit; dummies lie between neighbours."""

import tomllib
from dataclasses import fields, replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.lab.elbow import STANDARD_MODELS, intermediate_models
from masrel.lab.elbow.identification import as_toml, model_document
from masrel.lab.protocol import joint_model, read_protocol


@given(
    st.dictionaries(
        st.text("abcdefgh_", min_size=1),
        st.one_of(
            st.text(),
            st.booleans(),
            st.integers(-(2**60), 2**60),
            st.floats(allow_nan=False, allow_infinity=False),
            st.lists(st.text(), max_size=3),
        ),
    ),
    st.text(),
)
def test_what_is_written_is_what_is_read(values: dict[str, object], text: str) -> None:
    document = {"remark": text, "model": values, "rows": [values, {"one": 1}]}
    assert tomllib.loads(as_toml(document)) == document


def test_degrees_stand_where_the_key_says_so() -> None:
    made = model_document(STANDARD_MODELS["HM3"], simulated=True, made_from="a test")
    assert made["simulated"] is True
    read = tomllib.loads(as_toml(made))
    assert read["model"]["catch_angle_constant_deg"] == pytest.approx(115.0, rel=1e-15)
    assert read["model"]["catch_travel_deg"] == pytest.approx(30.0, rel=1e-15)
    assert read["constants"] == {
        "inertia_kg_m2": 0.0,
        "damping_nms_rad": 1.26,
        "stiffness_nm_rad": 3.15,
        "catch_slope_s": 0.35,
        "post_catch_stiffness_nm_rad": 5.8,
        "post_catch": "continuous",
        "residual_reading": "residual",
    }


def test_a_file_says_how_its_numbers_are_to_be_read() -> None:
    joint = replace(
        STANDARD_MODELS["HM3"],
        post_catch="additive",
        residual_reading="decrease",
        rest_angle=0.0,  # a rest at full flexion
        catch_rise=0.02,
    )
    made = model_document(joint, simulated=True, made_from="a test")
    constants = tomllib.loads(as_toml(made))["constants"]
    of_reading = {"post_catch": "additive", "residual_reading": "decrease"}
    assert constants.items() >= of_reading.items()
    assert (constants["rest_angle_deg"], constants["catch_rise_s"]) == (0.0, 0.02)


# Dummies

STUDY = Path(__file__).parents[4] / "studies" / "hess2012" / "protocol.toml"


def test_the_twelve_dummies_of_the_bundled_study_are_these() -> None:
    # its protocol has them as written out by hand
    protocol = read_protocol(STUDY)
    made = intermediate_models(STANDARD_MODELS, 12)
    assert list(made) == [f"D{i:02}" for i in range(1, 13)]
    for name, model in made.items():
        written = joint_model(protocol, name)
        for field in fields(model):
            expected = getattr(written, field.name)
            if isinstance(expected, float):
                expected = pytest.approx(expected, rel=1e-12)
            assert getattr(model, field.name) == expected, (name, field.name)


def test_what_differs_is_interpolated_and_the_rest_is_kept() -> None:
    one = STANDARD_MODELS["HM1"]
    two = replace(one, damping=2.0, catch_torque_constant=2.4)
    (made,) = intermediate_models({"a": one, "b": two}, 1).values()
    assert made.damping == pytest.approx(1.63, rel=1e-15)
    assert made.catch_torque_constant == pytest.approx(1.9, rel=1e-15)
    assert replace(made, damping=1.26, catch_torque_constant=1.4) == one

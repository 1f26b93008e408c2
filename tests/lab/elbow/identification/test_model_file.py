"""A model file is TOML that says what it holds, to the last digit."""

import math
import tomllib
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.lab.elbow.identification import as_toml, model_document
from masrel.lab.elbow.parameters import STANDARD_MODELS


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
        rest_angle=math.radians(20.0),
        catch_rise=0.02,
    )
    made = model_document(joint, simulated=True, made_from="a test")
    constants = tomllib.loads(as_toml(made))["constants"]
    assert constants["post_catch"] == "additive"
    assert constants["residual_reading"] == "decrease"
    assert constants["rest_angle_deg"] == pytest.approx(20.0, rel=1e-15)
    assert constants["catch_rise_s"] == 0.02


def test_a_rest_at_full_flexion_is_written() -> None:
    joint = replace(STANDARD_MODELS["HM3"], rest_angle=0.0)
    made = model_document(joint, simulated=True, made_from="a test")
    assert made["constants"]["rest_angle_deg"] == 0.0


@pytest.mark.parametrize("value", [float("nan"), float("inf"), None, b"x"])
def test_what_the_file_cannot_hold_is_refused(value: object) -> None:
    with pytest.raises(ParameterError, match="needs text, a finite number or a list"):
        as_toml({"value": value})

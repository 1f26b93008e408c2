"""Dummies lie on the straight lines between their neighbours."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import STANDARD_MODELS, intermediate_models
from masrel.lab.protocol import elbow_parameters, read_protocol

STUDY = Path(__file__).parents[4] / "studies" / "hess2012" / "protocol.toml"


def test_the_twelve_dummies_of_the_bundled_study_are_these() -> None:
    # its protocol has them as written out by hand
    protocol = read_protocol(STUDY)
    made = intermediate_models(STANDARD_MODELS, 12)
    assert list(made) == [f"D{i:02}" for i in range(1, 13)]
    for name, model in made.items():
        written = elbow_parameters(protocol, name)
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


@pytest.mark.parametrize("n_models", [0, 2, 13])
def test_gaps_that_would_be_unlike_are_refused(n_models: int) -> None:
    with pytest.raises(ParameterError, match="number of models: needs a multiple of 3"):
        intermediate_models(STANDARD_MODELS, n_models)


def test_one_model_has_no_neighbour() -> None:
    with pytest.raises(ParameterError, match="models: need two or more, got 1"):
        intermediate_models({"a": STANDARD_MODELS["HM1"]}, 1)


def test_neighbours_that_read_the_law_differently_are_refused() -> None:
    one = STANDARD_MODELS["HM1"]
    two = replace(STANDARD_MODELS["HM2"], post_catch="additive")
    with pytest.raises(ParameterError, match="a and b need one post_catch"):
        intermediate_models({"a": one, "b": two}, 1)

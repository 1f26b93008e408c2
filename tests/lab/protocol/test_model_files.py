"""A model file's numbers are in the protocol as if they stood there."""

import copy
from pathlib import Path
from typing import Any

import pytest

from masrel.errors import ProtocolError
from masrel.lab.elbow.identification import as_toml, model_document
from masrel.lab.elbow.parameters import STANDARD_MODELS
from masrel.lab.protocol import (
    elbow_parameters,
    presented_hash,
    protocol_hash,
    read_protocol,
)
from tests.lab.protocol.documents import VALID, write

KEYS = (
    "catch_angle_constant_deg",
    "catch_torque_nms_rad",
    "residual_ratio",
    "catch_travel_deg",
)


def named(file: str = "s3.toml", **more: object) -> dict[str, Any]:
    """The valid protocol, its first model in a file."""
    document = copy.deepcopy(VALID)
    for key in KEYS:
        document["models"][0].pop(key, None)
    document["models"][0] |= {"file": file, **more}
    return document


def put(folder: Path, name: str = "s3.toml", **changes: dict[str, object]) -> Path:
    """A model file of HM3, with changes of its tables."""
    made = model_document(STANDARD_MODELS["HM3"], simulated=True, made_from="a test")
    for table, values in changes.items():
        made[table] = {**made[table], **values}  # type: ignore[dict-item]
    path = folder / name
    path.write_text(as_toml(made), encoding="utf-8")
    return path


def test_a_named_model_is_the_one_in_the_file(tmp_path: Path) -> None:
    put(tmp_path, constants={"damping_nms_rad": 0.77})
    protocol = read_protocol(write(named(), tmp_path))
    found = elbow_parameters(protocol, protocol.models[0].id)
    expected = STANDARD_MODELS["HM3"]
    assert found.damping == 0.77
    assert found.catch_torque_constant == expected.catch_torque_constant
    assert found.catch_angle_constant == pytest.approx(
        expected.catch_angle_constant, rel=1e-15
    )


def test_a_file_keeps_the_law_its_numbers_were_fitted_with(tmp_path: Path) -> None:
    # Q of a fit is a residual; under a study's other reading it would be another joint.
    put(tmp_path)
    document = named()
    document["elbow"] = {"residual_reading": "decrease", "post_catch": "additive"}
    protocol = read_protocol(write(document, tmp_path))
    filed = elbow_parameters(protocol, protocol.models[0].id)
    assert (filed.residual_reading, filed.post_catch) == ("residual", "continuous")
    assert filed.residual_share == 0.6
    beside = elbow_parameters(protocol, protocol.models[1].id)
    assert (beside.residual_reading, beside.post_catch) == ("decrease", "additive")


def test_a_file_written_before_laws_were_is_presented_as_it_was(tmp_path: Path) -> None:
    path = put(tmp_path)
    after = read_protocol(write(named(), tmp_path))
    lines = path.read_text(encoding="utf-8").splitlines()
    old = [one for one in lines if not one.startswith(("post_catch =", "residual_re"))]
    assert len(old) == len(lines) - 2
    path.write_text("\n".join(old), encoding="utf-8")
    before = read_protocol(write(named(), tmp_path))
    assert presented_hash(before) == presented_hash(after)


def test_a_file_says_whether_it_comes_from_simulated_recordings(tmp_path: Path) -> None:
    put(tmp_path)
    protocol = read_protocol(write(named(), tmp_path))
    assert [model.simulated for model in protocol.models] == [True, False]
    with pytest.raises(ProtocolError) as raised:
        read_protocol(write(named(simulated=False), tmp_path))
    (problem,) = raised.value.problems
    assert problem.endswith(
        "models[0].simulated: needed in s3.toml or here, got it in both"
    )


def test_of_a_file_that_does_not_say_it_the_protocol_may(tmp_path: Path) -> None:
    path = put(tmp_path)
    text = path.read_text("utf-8").replace("simulated = true\n", "")
    path.write_text(text, "utf-8")
    for said in (False, True):
        protocol = read_protocol(write(named(simulated=said), tmp_path))
        assert protocol.models[0].simulated is said


def test_what_is_presented_does_not_depend_on_the_files_name(tmp_path: Path) -> None:
    put(tmp_path)
    put(tmp_path, "other.toml")
    one = read_protocol(write(named(), tmp_path))
    two = read_protocol(write(named("other.toml"), tmp_path))
    assert presented_hash(one) == presented_hash(two)
    assert protocol_hash(one) != protocol_hash(two)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, r"models\[0\].file: needed a model file, got .*s3.toml: No such file"),
        ("x = [", r"models\[0\].file: needed a model file, got .*s3.toml"),
        ("x = 1\n", r'models\[0\].file: needed .* format is "masrel joint model 1"'),
        (
            'format = "masrel joint model 1"\n[model]\nid = "X"\n',
            r"models\[0\].file: needed keys of \[model\] among .*, got id in",
        ),
        (
            'format = "masrel joint model 1"\nmodel = 5\n',
            r"models\[0\].file: needed a table \[model\], got 5 in .*s3.toml",
        ),
        (
            'format = "masrel joint model 1"\nconstants = ["damping_nms_rad"]\n',
            r"models\[0\].file: needed a table \[constants\], got an array of 1 in",
        ),
    ],
)
def test_a_file_that_is_no_model_file_is_one_problem(
    tmp_path: Path, content: str | None, said: str
) -> None:
    if content is not None:
        (tmp_path / "s3.toml").write_text(content, encoding="utf-8")
    with pytest.raises(ProtocolError, match=said) as raised:
        read_protocol(write(named(), tmp_path))
    assert len(raised.value.problems) == 1


def test_a_number_in_both_places_is_refused(tmp_path: Path) -> None:
    put(tmp_path)
    document = named(residual_ratio=0.2, constants={"damping_nms_rad": 1.0})
    with pytest.raises(ProtocolError) as raised:
        read_protocol(write(document, tmp_path))
    said = "\n".join(raised.value.problems)
    assert "models[0].residual_ratio: needed in s3.toml or here" in said
    assert "models[0].constants.damping_nms_rad: needed in s3.toml or here" in said


def test_a_number_out_of_range_is_named_by_its_key(tmp_path: Path) -> None:
    put(tmp_path, model={"residual_ratio": 1.5}, constants={"catch_slope_s": -1.0})
    with pytest.raises(ProtocolError) as raised:
        read_protocol(write(named(), tmp_path))
    said = "\n".join(raised.value.problems)
    assert "models[0].residual_ratio: needed a number at least 0" in said
    assert "models[0].constants.catch_slope_s: needed a number above 0" in said


def test_the_rule_of_catch_angles_uses_the_models_own_slope(tmp_path: Path) -> None:
    # L 115 deg - 1.0 s · 60 deg/s = 55 deg, below the smallest catch angle
    put(tmp_path, constants={"catch_slope_s": 1.0})
    with pytest.raises(ProtocolError, match=r"115 - 1 \* 60 = 55"):
        read_protocol(write(named(), tmp_path))

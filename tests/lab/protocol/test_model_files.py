"""A model file's numbers are in the protocol as if they stood there."""

import copy
import re
from pathlib import Path
from typing import Any

import pytest

from masrel.lab.elbow.identification import as_toml, model_document
from masrel.lab.elbow.parameters import STANDARD_MODELS
from masrel.lab.protocol import (
    joint_model,
    presented_hash,
    protocol_hash,
    read_protocol,
)
from tests.files import edit
from tests.lab.protocol.documents import VALID, problems_of, write

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
    found = joint_model(protocol, protocol.models[0].id)
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
    filed = joint_model(protocol, protocol.models[0].id)
    assert (filed.residual_reading, filed.post_catch) == ("residual", "continuous")
    assert filed.residual_share == 0.6
    beside = joint_model(protocol, protocol.models[1].id)
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
    path = tmp_path / "s3.toml"  # of one that does not say it the protocol may
    edit(path, "simulated = true\n", "")
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
    (problem,) = problems_of(named(), tmp_path)
    assert re.match(said, problem)


IN_BOTH = "needed in s3.toml or here, got it in both"


@pytest.mark.parametrize(
    ("of_file", "of_protocol", "problems"),
    [
        (
            {},
            {"residual_ratio": 0.2, "constants": {"damping_nms_rad": 1.0}},
            [f"residual_ratio: {IN_BOTH}", f"constants.damping_nms_rad: {IN_BOTH}"],
        ),
        ({}, {"simulated": False}, [f"simulated: {IN_BOTH}"]),
        (
            {"model": {"residual_ratio": 1.5}, "constants": {"catch_slope_s": -1.0}},
            {},
            [
                "residual_ratio: needed a number at least 0 and below 1, got 1.5",
                "constants.catch_slope_s: needed a number above 0, got -1.0",
            ],
        ),
        (  # L 115 deg - 1.0 s · 60 deg/s = 55 deg, below the smallest catch angle
            {"constants": {"catch_slope_s": 1.0}},
            {},
            [
                "catch_angle_constant_deg: needed a catch angle at "
                "elbow.slowest_mean_speed_deg_s of at least "
                "elbow.smallest_catch_angle_deg (60), got 115 - 1 * 60 = 55"
            ],
        ),
    ],
)
def test_what_is_wrong_with_the_numbers_of_a_file_is_named_by_its_key(
    tmp_path: Path,
    of_file: dict[str, dict[str, object]],
    of_protocol: dict[str, object],
    problems: list[str],
) -> None:
    put(tmp_path, **of_file)
    said = problems_of(named(**of_protocol), tmp_path)
    assert [text.removesuffix(' (id "HM1")') for text in said] == [
        f"models[0].{problem}" for problem in problems
    ]

"""Models of other kinds than the spastic elbow in a protocol file."""

import math
import re
from pathlib import Path
from typing import Any

import pytest

from masrel.lab.elbow import MODELS, ElbowParameters
from masrel.lab.elbow.tone import Contracture
from masrel.lab.protocol import (
    joint_model,
    read_protocol,
)
from tests.lab.protocol.documents import VALID, changed, problems_of, write
from tests.lab.protocol.test_hashes import hashes

KINDS = [kind for kind in MODELS if kind != ElbowParameters.kind]
PAGE = Path(__file__).parents[3] / "docs" / "reference" / "protocol.md"


def of_kind(kind: str, **parameters: object) -> dict[str, Any]:
    """The valid protocol with a third model, of another kind."""
    model: dict[str, Any] = {"id": "K", "kind": kind, "intended_grade": "2"}
    if parameters:
        model["parameters"] = parameters
    return changed("models", to=[*VALID["models"], model])


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_defaults_for_all_its_keys(kind: str, tmp_path: Path) -> None:
    protocol = read_protocol(write(of_kind(kind), tmp_path))
    assert joint_model(protocol, "K") == MODELS[kind]()
    assert isinstance(joint_model(protocol, "HM1"), ElbowParameters)


def test_keys_have_their_units_and_angles_are_degrees(tmp_path: Path) -> None:
    document = of_kind(
        "contracture",
        end_angle_deg=100,
        range_end_deg=110.0,
        end_steepness_per_rad=9.0,
        stiffness_nm_rad=1.5,
        speed_threshold_deg_s=15.0,
    )
    protocol = read_protocol(write(document, tmp_path))
    assert joint_model(protocol, "K") == Contracture(
        end_angle=math.radians(100),
        range_end=math.radians(110.0),
        end_steepness=9.0,
        stiffness=1.5,
        speed_threshold=math.radians(15.0),
    )


def test_the_page_has_every_kind_with_its_keys_and_defaults(tmp_path: Path) -> None:
    text = PAGE.read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `([a-z-]+)` \| (`.*) \|$", text, flags=re.MULTILINE))
    assert sorted(set(rows) & set(KINDS)) == sorted(KINDS)
    for kind in KINDS:
        listed = dict(re.findall(r"`(\w+)` (none|[-\d.]+)", rows[kind]))
        numbers = {k: float(v) for k, v in listed.items() if v != "none"}
        protocol = read_protocol(write(of_kind(kind, **numbers), tmp_path))
        assert joint_model(protocol, "K") == MODELS[kind]()
        # ... and one more is none of its keys
        (problem,) = problems_of(of_kind(kind, zzz=1.0), tmp_path)
        known = re.search(r"\((.*)\), got", problem)
        assert known is not None
        assert known[1].split(", ") == list(listed)


def test_all_that_is_wrong_with_the_numbers_of_a_kind_comes_at_once(
    tmp_path: Path,
) -> None:
    document = of_kind(
        "lead-pipe-rigidity",
        coulomb_torque_nm=-1.0,
        rest_angle_deg=200.0,
        stifness_nm_rad=1.0,
        damping_nms_rad=0.3,
    )
    keys = ", ".join(
        (
            "range_end_deg",
            "speed_threshold_deg_s",
            "coulomb_torque_nm",
            "stiffness_nm_rad",
            "damping_nms_rad",
            "bristle_travel_deg",
            "rest_angle_deg",
        )
    )
    assert sorted(problems_of(document, tmp_path)) == [
        'models[2].parameters.coulomb_torque_nm: needed 0 or more, got -1.0 (id "K")',
        "models[2].parameters.rest_angle_deg: needed 0 to 180 degrees, got 200.0 "
        '(id "K")',
        'models[2].parameters.stifness_nm_rad: needed a key of kind "lead-pipe-'
        f'rigidity" ({keys}), got "stifness_nm_rad"; did you mean stiffness_nm_rad? '
        '(id "K")',
    ]


ELBOWS = 'needed for kind "spastic-elbow" only, got it for "dystonia"; its numbers'
WRONG: list[tuple[dict[str, Any], str]] = [
    (
        {"kind": "lead-pipe-rigidty"},
        f"kind: needed one of spastic-elbow, {', '.join(KINDS)}, got "
        '"lead-pipe-rigidty"; did you mean lead-pipe-rigidity?',
    ),
    (
        {"kind": "clasp-knife", "parameters": {"arming_angle_deg": 80.0}},
        "parameters.arming_angle_deg: needed at most ",
    ),
    (
        {"kind": "cogwheel-rigidity", "parameters": {"gap_share": 0.0}},
        "parameters: gap_edge: needs at most half a gap",
    ),
    (
        {"kind": "dystonia", "catch_angle_constant_deg": 120.0},
        f"catch_angle_constant_deg: {ELBOWS}",
    ),
    ({"kind": "dystonia", "residual_ratio": 0.0}, f"residual_ratio: {ELBOWS}"),
    (
        {"kind": "dystonia", "constants": {"stiffness_nm_rad": 1.0}},
        f"constants.stiffness_nm_rad: {ELBOWS}",
    ),
    *(
        (
            {"kind": "clonus", "parameters": {"beat_rate_hz": value}},
            "parameters.beat_rate_hz: needed a number, got ",
        )
        for value in ("1", True, [1.0], {"a": 1.0}, math.inf, math.nan)
    ),
]


@pytest.mark.parametrize(("model", "problem"), WRONG)
def test_what_is_wrong_with_a_model_of_a_kind_is_said_once(
    tmp_path: Path, model: dict[str, Any], problem: str
) -> None:
    document = changed("models", to=[*VALID["models"], {"id": "K", **model}])
    (said,) = problems_of(document, tmp_path)
    assert said.startswith(f"models[2].{problem}")
    assert said.endswith('(id "K")')


def test_the_numbers_of_a_kind_enter_but_not_at_their_defaults(tmp_path: Path) -> None:
    plain = hashes(of_kind("lead-pipe-rigidity"), tmp_path)
    defaults = of_kind("lead-pipe-rigidity", coulomb_torque_nm=1.6, rest_angle_deg=60)
    assert hashes(defaults, tmp_path) == plain
    other = of_kind("lead-pipe-rigidity", coulomb_torque_nm=1.7)
    assert hashes(other, tmp_path) != plain
    assert hashes(of_kind("cogwheel-rigidity"), tmp_path) != plain

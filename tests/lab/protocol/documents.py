"""A valid protocol as plain values, to be changed and written as TOML."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from masrel.errors import ProtocolError
from masrel.lab.protocol import read_protocol

VALID: dict[str, Any] = {
    "study": {"id": "pilot", "title": "A pilot"},
    "scale": {"name": "MAS", "grades": ["0", "1", "1+", "2"]},
    "elbow": {},
    "models": [
        {
            "id": "HM1",
            "intended_grade": "1",
            "catch_angle_constant_deg": 130,
            "catch_torque_nms_rad": 1.4,
            "residual_ratio": 0.15,
            "catch_travel_deg": 60.0,
        },
        {
            "id": "D1",
            "role": "dummy",
            "catch_angle_constant_deg": 125.5,
            "catch_torque_nms_rad": 1.7,
            "residual_ratio": 0.2,
            "catch_travel_deg": 55.0,
        },
    ],
    "raters": [{"id": "R1"}, {"id": "R2"}],
    "sessions": [
        {"id": "test", "raters": ["R1", "R2"]},
        {"id": "retest", "raters": ["R1"]},
    ],
    "schedule": {"seed": 5},
    "stretch": {},
    "device": {},
    "analysis": {
        "estimates": [
            {
                "id": "kappa",
                "kind": "inter-rater",
                "coefficient": "fleiss_kappa",
                "sessions": ["test"],
                "target": "raters",
            },
            {
                "id": "again",
                "kind": "test-retest",
                "coefficient": "stratified_kappa",
                "sessions": ["test", "retest"],
                "target": "items",
            },
        ]
    },
    "report": {},
}


def changed(*path: str | int, to: Any) -> dict[str, Any]:
    """The valid protocol with the value at `path` replaced."""
    document = copy.deepcopy(VALID)
    place: Any = document
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = to
    return document


def without(*path: str | int) -> dict[str, Any]:
    """The valid protocol without the key at `path`."""
    document = copy.deepcopy(VALID)
    place: Any = document
    for step in path[:-1]:
        place = place[step]
    del place[path[-1]]
    return document


def write(document: dict[str, Any], folder: Path) -> Path:
    """Write a protocol as TOML, every table inline; its path."""
    path = folder / "protocol.toml"
    lines = [f"{key} = {_inline(value)}" for key, value in document.items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        inside = ", ".join(f"{key} = {_inline(part)}" for key, part in value.items())
        return "{" + inside + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_inline(part) for part in value) + "]"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)


def problems_of(document: dict[str, Any], folder: Path) -> list[str]:
    """The problems of a protocol, without the file they all start with."""
    path = write(document, folder)
    with pytest.raises(ProtocolError) as caught:
        read_protocol(path)
    assert all(text.startswith(f"{path}: ") for text in caught.value.problems)
    return [text.removeprefix(f"{path}: ") for text in caught.value.problems]

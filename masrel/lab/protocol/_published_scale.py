"""A scale that a protocol calls by its name, in place of a table ``[scale]``."""

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from masrel.lab.protocol._decode import got
from masrel.scales import PUBLISHED_SCALES, PublishedScale


def spell_out_scale(raw: dict[str, object]) -> str | None:
    """Put the table of a scale in the place of its name; return what is wrong.

    The angles that belong to a scale are asked for in a questionnaire of its name. A
    name that cannot be used is taken out.
    """
    problem = _misplaced(raw)
    if problem is not None or not isinstance(raw.get("scale"), str):
        return problem
    name = str(raw.pop("scale"))
    if name in PUBLISHED_SCALES:
        published = PUBLISHED_SCALES[name]
        scale, others = published.scale, raw.get("questionnaires", [])
        raw["scale"] = {"name": scale.name, "grades": list(scale.grades)}
        if published.angles and isinstance(others, list) and not _has(others, name):
            raw["questionnaires"] = [_angles(published), *others]
        return None
    near = get_close_matches(name, PUBLISHED_SCALES, n=1)
    return (
        f"scale: needed a table [scale] or one of "
        f"{', '.join(map(got, PUBLISHED_SCALES))}, got {got(name)}"
        + (f"; did you mean {near[0]}?" if near else "")
    )


def _has(questionnaires: list[Any], name: str) -> bool:
    # whether the study asks for the angles in a way of its own
    return any(isinstance(q, Mapping) and q.get("id") == name for q in questionnaires)


def _angles(published: PublishedScale) -> dict[str, object]:
    return {
        "id": published.id,
        "title": "Angles",
        "when": "presentation",
        "questions": [
            {
                "id": name,
                "text": f"{name}, {meaning}, deg",
                "type": "whole",
                "low": 0,
                "high": 180,
                "required": False,  # without a catch there is no such angle
                "public": True,
            }
            for name, meaning in published.angles
        ],
    }


def _misplaced(raw: dict[str, object]) -> str | None:
    # TOML takes a key below the head of a table for one of that table
    for key, table in raw.items():
        if "scale" not in raw and isinstance(table, Mapping) and "scale" in table:
            raw[key] = {name: value for name, value in table.items() if name != "scale"}
            return (
                f"{key}.scale: needed above the first table of the file, got it in "
                f"[{key}]"
            )
    return None

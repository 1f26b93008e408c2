"""A scale that a protocol calls by its name, in place of a table ``[scale]``."""

from collections.abc import Mapping
from difflib import get_close_matches

from masrel.protocol._decode import got
from masrel.scales import PUBLISHED_SCALES


def spell_out_scale(raw: dict[str, object]) -> str | None:
    """Put the table of a scale in the place of its name; return what is wrong.

    A name that cannot be used is taken out.
    """
    problem = _misplaced(raw)
    if problem is not None or not isinstance(raw.get("scale"), str):
        return problem
    name = str(raw.pop("scale"))
    if name in PUBLISHED_SCALES:
        scale = PUBLISHED_SCALES[name].scale
        raw["scale"] = {"name": scale.name, "grades": list(scale.grades)}
        return None
    near = get_close_matches(name, PUBLISHED_SCALES, n=1)
    return (
        f"scale: needed a table [scale] or one of "
        f"{', '.join(map(got, PUBLISHED_SCALES))}, got {got(name)}"
        + (f"; did you mean {near[0]}?" if near else "")
    )


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

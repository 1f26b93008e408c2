"""The kinds a model may be of: the keys of each, and its law in SI units.

In: a kind, and numbers by keys with their units in the name. Out: a `JointModel`, or
what is wrong with them.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

from masrel.errors import ParameterError
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.elbow.tone import MODELS, JointModel, ToneModel
from masrel.lab.protocol._decode import closest, got

DEFAULT_KIND = ElbowParameters.kind
"""The paper's own law, whose numbers have keys of their own."""

# Unit of a parameter in Python to the end of its key; angles are degrees there
_SUFFIXES = {
    "": "",
    "rad": "_deg",
    "rad/s": "_deg_s",
    "1/rad": "_per_rad",
    "s": "_s",
    "Hz": "_hz",
    "N·m": "_nm",
    "N·m/rad": "_nm_rad",
    "N·m·s/rad": "_nms_rad",
    "N·m·s/rad²": "_nms_rad2",
    "kg": "_kg",
    "kg·m²": "_kg_m2",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """One key of `[models.parameters]`."""

    parameter: str  # the parameter it sets
    is_angle: bool  # in degrees, or degrees a second
    default: float | None  # of the parameter in Python; None for where a stretch starts

    def in_si(self, value: float) -> float:
        """Return a value of the file as the parameter has it."""
        return math.radians(value) if self.is_angle else float(value)


def keys_of(kind: str) -> dict[str, Key]:
    """Return the keys of `[models.parameters]` for a kind; none for the default one."""
    model = MODELS[kind]
    if not issubclass(model, ToneModel):
        return {}
    quantities = model.quantities()
    defaults: dict[str, Any] = {entry.name: entry.default for entry in fields(model)}
    return {
        name + _SUFFIXES[known.unit]: Key(
            parameter=name,
            is_angle=known.unit.startswith("rad"),
            default=defaults[name],
        )
        for name, known in quantities.items()
    }


def model_of_kind(kind: str, values: Mapping[str, float]) -> JointModel:
    """Return the law of a kind with these values, by key; defaults for the rest."""
    keys = keys_of(kind)
    changes: dict[str, Any] = {
        keys[key].parameter: keys[key].in_si(v) for key, v in values.items()
    }
    return MODELS[kind](**changes)


def without_defaults(kind: str, values: Mapping[str, float]) -> dict[str, float]:
    """Return the values that differ from what they are without their keys."""
    keys = keys_of(kind)
    return {
        key: value
        for key, value in values.items()
        if keys[key].in_si(value) != keys[key].default
    }


def all_values(kind: str, values: Mapping[str, float]) -> dict[str, float | None]:
    """Return a value for every key of a kind, those of the file and the defaults."""
    every: dict[str, float | None] = {}
    for key, known in keys_of(kind).items():
        value = known.default
        if known.is_angle and value is not None:
            # what was entered in degrees comes back: 115.00000000000001 is 115
            value = float(f"{math.degrees(value):.12g}")
        every[key] = values.get(key, value)
    return every


def kind_problem(kind: str) -> str | None:
    """Say what is wrong with the name of a kind; None if nothing is."""
    if kind in MODELS:
        return None
    return f"needed one of {', '.join(MODELS)}, got {got(kind)}{closest(kind, MODELS)}"


def value_problems(kind: str, values: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Yield a key, or "", and what is wrong with it, of all that is wrong."""
    keys = keys_of(kind)
    for key in values.keys() - keys:
        yield (
            key,
            f"needed a key of kind {got(kind)} ({', '.join(keys)}), got {got(key)}"
            f"{closest(key, keys)}",
        )
    left = {key: value for key, value in values.items() if key in keys}
    while True:
        try:
            model_of_kind(kind, left)
        except ParameterError as error:
            name, _, needs = str(error).partition(": needs ")
            at_fault = [key for key in left if keys[key].parameter == name]
            if not at_fault:
                yield "", str(error)
                return
            # What is needed is in the message, what came is shown as it was entered.
            needed = needs.partition(", got ")[0]
            value = left.pop(at_fault[0])
            yield at_fault[0], f"needed {needed}, got {got(value)}"
        else:
            return

"""Model files that a protocol names: their numbers take the place of its own."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from masrel.elbow.identification.model_file import (
    CONSTANT_KEYS,
    FORMAT,
    MODEL_KEYS,
    READING_KEYS,
    VARIANT_KEYS,
)
from masrel.elbow.parameters import ElbowParameters
from masrel.errors import ProtocolError
from masrel.protocol.decode import decode_table
from masrel.protocol.definition import ElbowConstants, Model
from masrel.protocol.joint_rules import joint_rules
from masrel.protocol.models import joint_of
from masrel.protocol.wording import got

__all__ = ["Resolved", "read_model_file", "resolve_model_files"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolved:
    """A protocol's content with the numbers of its model files in it."""

    raw: dict[str, object]  # the content
    # what is wrong with the files, each with the key that names one
    problems: list[str] = field(default_factory=list)
    # places of the models whose file could not be used: their keys are missing for that
    # reason alone
    unread: list[int] = field(default_factory=list)


def resolve_model_files(raw: Mapping[str, object], folder: Path) -> Resolved:
    """Read the model files that a protocol names."""
    resolved = Resolved(raw=dict(raw))
    models = raw.get("models")
    if not isinstance(models, list):
        return resolved
    made = list(models)
    for index, entry in enumerate(models):
        if isinstance(entry, Mapping) and isinstance(entry.get("file"), str):
            where = f"models[{index}]"
            read = _read(folder / entry["file"])
            if isinstance(read, str):
                resolved.problems.append(f"{where}.file: {read}")
                resolved.unread.append(index)
                continue
            made[index] = _merged(entry, read, where, resolved.problems)
    resolved.raw["models"] = made
    return resolved


def read_model_file(path: Path) -> ElbowParameters:
    """Read the joint in a model file, with the usual constants for all else."""
    read = _read(path)
    if isinstance(read, str):
        raise ProtocolError(read)
    raw = {**read.get("model", {}), "constants": read.get("constants", {})}
    decoded = decode_table({"id": "model", **raw}, Model)
    elbow = ElbowConstants()
    numbers = {key: value for key, value in decoded.values.items() if key != "id"}
    rules = joint_rules({"elbow": msgspec.to_builtins(elbow), "models": [numbers]})
    problems = [*decoded.problems, *(rule.removeprefix("models[0].") for rule in rules)]
    if problems:
        raise ProtocolError(*(f"{path}: {problem}" for problem in problems))
    return joint_of(msgspec.convert({"id": "model", **raw}, Model), elbow)


def _read(path: Path) -> dict[str, Any] | str:
    # the tables of a model file, or what is wrong with it
    try:
        content = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        return f"needed a model file, got {path}: {error.strerror or error}"
    except ValueError as error:  # not UTF-8, or not TOML
        return f"needed a model file, got {path}: {error}"
    if content.get("format") != FORMAT:
        return (
            f'needed a model file, whose format is "{FORMAT}", got {path} with '
            f"{got(content.get('format', 'none'))}"
        )
    constants = (*CONSTANT_KEYS, *READING_KEYS, *VARIANT_KEYS)
    for table, known in (("model", tuple(MODEL_KEYS)), ("constants", constants)):
        keys = content.get(table, {})
        if not isinstance(keys, dict):
            return f"needed a table [{table}], got {got(keys)} in {path}"
        foreign = [key for key in keys if key not in known]
        if foreign:
            return (
                f"needed keys of [{table}] among {', '.join(known)}, got "
                f"{', '.join(foreign)} in {path}"
            )
    return content


def _merged(
    entry: Mapping[str, Any], read: Mapping[str, Any], where: str, problems: list[str]
) -> dict[str, object]:
    model, constants = read.get("model", {}), read.get("constants", {})
    if "simulated" in read:
        model = {**model, "simulated": read["simulated"]}
    own = entry.get("constants", {})
    for key in model:
        if key in entry:
            problems.append(
                f"{where}.{key}: needed in {entry['file']} or here, got it in both"
            )
    if isinstance(own, Mapping):
        for key in own:
            if key in constants:
                problems.append(
                    f"{where}.constants.{key}: needed in {entry['file']} or here, got "
                    "it in both"
                )
        own = {**constants, **own}
    return {**model, **entry, "constants": own}

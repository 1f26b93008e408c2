"""Read a protocol file, or a model file, and say everything wrong with it at once."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import chain, islice
from pathlib import Path
from typing import Any

import msgspec

from masrel._input import not_utf8
from masrel.errors import ProtocolError
from masrel.lab._bounded_files import (
    MAX_SMALL,
    format_problem,
    parse_toml,
    read_regular,
)
from masrel.lab.elbow.identification._model_file import (
    CONSTANT_KEYS,
    FORMAT,
    MODEL_KEYS,
    READING_KEYS,
    VARIANT_KEYS,
)
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.protocol._decode import decode_table, got
from masrel.lab.protocol._published_scale import spell_out_scale
from masrel.lab.protocol._rules import broken_rules, joint_rules, kind_rules
from masrel.lab.protocol.content import _joint_of
from masrel.lab.protocol.definition import ElbowConstants, Model, Protocol

_MAX_PROBLEMS = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class _Resolved:
    """A protocol's content with the numbers of its model files in it."""

    raw: dict[str, object]  # the content
    # what is wrong with the files, each with the key that names one
    problems: list[str] = field(default_factory=list)
    # places of the models whose file could not be used: their keys are missing for that
    # reason alone
    unread: list[int] = field(default_factory=list)


def read_protocol(path: Path) -> Protocol:
    """Read a protocol file.

    Parameters
    ----------
    path : Path
        A TOML file; ``docs/protocol.md`` has its keys.

    Returns
    -------
    Protocol
        The protocol, every key checked alone and against the others.

    Raises
    ------
    ProtocolError
        If there is no such file, it is not TOML, or any key is wrong. Its
        `problems` are all there are, or the first 200, each ``FILE: key[index].key:
        needed ..., got ...``, entries counted from 0.

    Notes
    -----
    A model that names a model file gets its numbers from there, and the protocol has
    them as if they stood in it: hashes follow the numbers, not the file.

    Rules across keys are applied to what could be decoded, so that one wrong key
    hides no other problem.
    """
    content = _read_toml(path)
    problem = format_problem(content.pop("format", 1), newest=1)
    if problem is not None:
        raise ProtocolError(f"{path}: {problem}")
    resolved = _resolve_model_files(content, path.parent)
    raw = resolved.raw
    # A model whose file could not be used lacks its keys for that reason alone; so
    # does a protocol its scale.
    unread = tuple(f"models[{index}]." for index in resolved.unread)
    if (problem := spell_out_scale(raw)) is not None:
        resolved.problems.append(problem)
        unread += ("scale:",)
    decoded = decode_table(raw, Protocol)
    of_content = (
        problem
        for problem in chain(decoded.problems, broken_rules(decoded.values))
        if not (problem.startswith(unread) and ", got none" in problem)
    )
    problems = list(islice(chain(resolved.problems, of_content), _MAX_PROBLEMS + 1))
    if problems:
        if len(problems) > _MAX_PROBLEMS:
            problems[-1] = "there are more problems"
        raise ProtocolError(*(f"{path}: {problem}" for problem in problems))
    return msgspec.convert(raw, Protocol)


def _read_toml(path: Path) -> dict[str, object]:
    try:
        return parse_toml(read_regular(path, most=MAX_SMALL))
    except NotADirectoryError as error:
        raise ProtocolError(
            f"{path.parent}: needed the folder of a study, got a file"
        ) from error
    except OSError as error:
        reason = error.strerror or str(error)
        raise ProtocolError(f"{path}: needed a protocol file, got: {reason}") from error
    except UnicodeDecodeError as error:
        raise ProtocolError(f"{path}: {not_utf8(error)}") from error
    except ValueError as error:  # TOMLDecodeError says line and column
        raise ProtocolError(f"{path}: needed valid TOML, got: {error}") from error


def _resolve_model_files(raw: Mapping[str, object], folder: Path) -> _Resolved:
    """Read the model files that a protocol names."""
    resolved = _Resolved(raw=dict(raw))
    models = raw.get("models")
    if not isinstance(models, list):
        return resolved
    resolved_models = list(models)
    for index, entry in enumerate(models):
        if isinstance(entry, Mapping) and isinstance(entry.get("file"), str):
            where = f"models[{index}]"
            read = _read_tables(folder / entry["file"])
            if isinstance(read, str):
                resolved.problems.append(f"{where}.file: {read}")
                resolved.unread.append(index)
                continue
            resolved_models[index] = _merged(entry, read, where, resolved.problems)
    resolved.raw["models"] = resolved_models
    return resolved


def read_model_file(path: Path) -> ElbowParameters:
    """Read the joint of a model file.

    Parameters
    ----------
    path : Path
        A TOML file that ``masrel fit`` or ``masrel between`` wrote.

    Returns
    -------
    ElbowParameters
        The joint in SI units, with the default constants of ``[elbow]`` for all that
        the file does not say.

    Raises
    ------
    ProtocolError
        If there is no such file, it is no model file, or any key is wrong.
    """
    read = _read_tables(path)
    if isinstance(read, str):
        raise ProtocolError(read)
    raw = {**read.get("model", {}), "constants": read.get("constants", {})}
    decoded = decode_table({"id": "model", **raw}, Model)
    elbow = ElbowConstants()
    numbers = {key: value for key, value in decoded.values.items() if key != "id"}
    values = {"elbow": msgspec.to_builtins(elbow), "models": [numbers]}
    rules = (*kind_rules(values), *joint_rules(values))
    problems = [*decoded.problems, *(rule.removeprefix("models[0].") for rule in rules)]
    if problems:
        raise ProtocolError(*(f"{path}: {problem}" for problem in problems))
    return _joint_of(msgspec.convert({"id": "model", **raw}, Model), elbow)


def _read_tables(path: Path) -> dict[str, Any] | str:
    # the tables of a model file, or what is wrong with it
    try:
        content = parse_toml(read_regular(path, most=MAX_SMALL))
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
    inline = entry.get("constants", {})
    for key in model:
        if key in entry:
            problems.append(
                f"{where}.{key}: needed in {entry['file']} or here, got it in both"
            )
    if isinstance(inline, Mapping):
        for key in inline:
            if key in constants:
                problems.append(
                    f"{where}.constants.{key}: needed in {entry['file']} or here, got "
                    "it in both"
                )
        inline = {**constants, **inline}
    return {**model, **entry, "constants": inline}

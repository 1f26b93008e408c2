"""Read a protocol file, or a model file, and say everything wrong with it at once."""

from collections.abc import Collection, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from masrel._files import write_files
from masrel._input import not_utf8
from masrel.errors import ProtocolError
from masrel.lab._study_files import (
    MAX_SMALL,
    check_format,
    parse_toml,
    read_regular,
)
from masrel.lab.elbow._model_file import (
    CONSTANT_KEYS,
    FORMAT,
    MODEL_KEYS,
    READING_KEYS,
    VARIANT_KEYS,
)
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.protocol._decode import closest, got, type_problems
from masrel.lab.protocol._rules import broken_rules, model_rules
from masrel.lab.protocol.content import _joint_of
from masrel.lab.protocol.definition import (
    DeviceSettings,
    ElbowConstants,
    Model,
    Protocol,
)
from masrel.scales import PUBLISHED_SCALES, PublishedScale

_MAX_PROBLEMS = 200


def read_protocol(path: Path) -> Protocol:
    """Read a protocol file.

    Parameters
    ----------
    path : Path
        A TOML file; ``docs/reference/protocol.md`` has its keys.

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

    Rules across keys are applied once every key alone is right.
    """
    return _checked(_read_toml(path), path)


def _checked(content: dict[str, object], path: Path) -> Protocol:
    check_format(path, content.pop("format", 1), newest=1, error=ProtocolError)
    problems = [
        *_resolve_model_files(content, path.parent),
        *_spell_out_scale(content),
    ]
    _gather_backends(content)
    problems += islice(type_problems(content, Protocol), _MAX_PROBLEMS + 1)
    if not problems:
        protocol = msgspec.convert(content, Protocol)
        problems += islice(broken_rules(protocol), _MAX_PROBLEMS + 1)
    if len(problems) > _MAX_PROBLEMS:
        problems[_MAX_PROBLEMS:] = ["there are more problems"]
    if problems:
        raise ProtocolError(*(f"{path}: {problem}" for problem in problems))
    return protocol


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


def _resolve_model_files(raw: dict[str, object], folder: Path) -> Iterator[str]:
    """Put in the numbers of model files; yield what is wrong."""
    models = raw.get("models")
    if not isinstance(models, list):
        return
    raw["models"] = models = list(models)
    for index, entry in enumerate(models):
        if not isinstance(entry, Mapping) or not isinstance(entry.get("file"), str):
            continue
        where, read = f"models[{index}]", _read_tables(folder / entry["file"])
        if isinstance(read, str):
            yield f"{where}.file: {read}"
            continue
        filed, constants = read.get("model", {}), read.get("constants", {})
        if "simulated" in read:
            filed = {**filed, "simulated": read["simulated"]}
        inline = entry.get("constants", {})
        both = [key for key in filed if key in entry]
        if isinstance(inline, Mapping):
            both += [f"constants.{key}" for key in inline if key in constants]
            inline = {**constants, **inline}
        for key in both:
            yield f"{where}.{key}: needed in {entry['file']} or here, got it in both"
        models[index] = {**filed, **entry, "constants": inline}


def _gather_backends(raw: dict[str, object]) -> None:
    """Put the tables ``[device.NAME]`` together: their keys are the backends' own."""
    device, known = raw.get("device"), DeviceSettings.__struct_fields__
    if isinstance(device, Mapping):
        tables = {
            key: value
            for key, value in device.items()
            if isinstance(value, Mapping) and key not in known
        }
        rest = {key: value for key, value in device.items() if key not in tables}
        raw["device"] = {**rest, "backends": tables} if tables else rest


def _write_rater(
    path: Path, entry: Mapping[str, object], sessions: Collection[str]
) -> None:
    """Write a rater, and in which sessions, into a protocol; comments and layout stay.

    Nothing is written where the protocol would be wrong with this rater, or has what is
    to be written.
    """
    import tomlkit  # nothing else needs it

    document = tomlkit.parse(read_regular(path, most=MAX_SMALL))
    there = document.unwrap()
    its = {s["id"] for s in there["sessions"] if entry["id"] in s["raters"]}
    if entry in there["raters"] and its == {*sessions}:
        return  # by a process that died then
    document["raters"].append(dict(entry))
    for session in document["sessions"]:
        if session["id"] in sessions:
            session["raters"].append(entry["id"])
    text = tomlkit.dumps(document)
    _checked(parse_toml(text.encode()), path)
    write_files({path: text})


def read_model_file(path: Path) -> ElbowParameters:
    """Read the joint of a model file.

    Parameters
    ----------
    path : Path
        A TOML file that ``masrel joint fit`` or ``masrel joint between`` wrote.

    Returns
    -------
    ElbowParameters
        The joint in SI units, with the default constants of ``[elbow]`` for all that
        the file does not say.

    Raises
    ------
    ProtocolError
        If there is no such file, it is not a model file, or any key is wrong.
    """
    read = _read_tables(path)
    if isinstance(read, str):
        raise ProtocolError(read)
    raw = {**read.get("model", {}), "constants": read.get("constants", {})}
    raw["id"] = "model"
    problems = list(type_problems(raw, Model))
    if not problems:
        model, elbow = msgspec.convert(raw, Model), ElbowConstants()
        problems = list(model_rules(model, elbow))
    if problems:
        raise ProtocolError(*(f"{path}: {problem}" for problem in problems))
    return _joint_of(model, elbow)


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


def _spell_out_scale(raw: dict[str, object]) -> Iterator[str]:
    """Replace the name of a scale by its table; yield what is wrong.

    The angles that belong to a scale are asked for in a questionnaire of its name.
    """
    # TOML takes a key below the head of a table for one of that table
    for key, table in raw.items():
        if "scale" not in raw and isinstance(table, dict) and "scale" in table:
            raw["scale"] = table.pop("scale")
            yield (
                f"{key}.scale: needed above the first table of the file, got it in "
                f"[{key}]"
            )
            break
    name = raw.get("scale")
    if not isinstance(name, str):
        return
    if name not in PUBLISHED_SCALES:
        names = ", ".join(map(got, PUBLISHED_SCALES))
        yield (
            f"scale: needed a table [scale] or one of {names}, got {got(name)}"
            f"{closest(name, PUBLISHED_SCALES)}"
        )
    # What else is wrong does not hang on its grades.
    published = PUBLISHED_SCALES.get(name, next(iter(PUBLISHED_SCALES.values())))
    raw["scale"] = {"name": published.scale.name, "grades": published.scale.grades}
    others = raw.get("questionnaires", [])
    if (
        published.angles
        and isinstance(others, list)
        and not any(isinstance(q, Mapping) and q.get("id") == name for q in others)
    ):
        raw["questionnaires"] = [_angles(published), *others]


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

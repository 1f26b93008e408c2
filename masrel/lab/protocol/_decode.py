"""Decode a TOML table into a struct key by key, collecting every problem."""

import datetime
import json
import math
import sys
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches

import msgspec
from msgspec import inspect
from msgspec.structs import FieldInfo

_MAX_HINTS = 20

Table = dict[str, typing.Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Decoded:
    """What could be decoded of a table, and what could not."""

    # the keys whose values are usable, defaults filled in; tables as dicts, arrays as
    # lists in which an unusable entry is None
    values: Table = field(default_factory=dict)
    # everything else, each ``key.path: needed ..., got ...``
    problems: list[str] = field(default_factory=list)


def decode_table(
    raw: Mapping[str, object], struct: type[msgspec.Struct], at: str = ""
) -> Decoded:
    """Decode a table into the fields of a struct, going on after each problem."""
    try:
        whole = msgspec.convert(raw, struct)
    except msgspec.ValidationError:  # of the first problem alone: look key by key
        decoded = Decoded()
    else:
        return Decoded(values=msgspec.to_builtins(whole))
    fields = {info.encode_name: info for info in msgspec.structs.fields(struct)}
    prefix = f"{at}." if at else ""
    unknown = [key for key in raw if key not in fields]
    for place, key in enumerate(unknown):
        # what was meant takes long to find, and helps with the first few
        known = fields if place < _MAX_HINTS else {}
        decoded.problems.append(_unknown(f"{prefix}{key}", key, known))
    for key, info in fields.items():
        where = f"{prefix}{key}"
        if key in raw:
            _decode_value(raw[key], info.type, where, key, decoded)
        elif info.required:
            decoded.problems.append(f"{where}: needed {_form(info, where)}, got none")
        else:
            decoded.values[key] = _default(info)
    return decoded


def _default(info: FieldInfo) -> object:
    if info.default_factory is not msgspec.NODEFAULT:
        return info.default_factory()
    return msgspec.to_builtins(info.default)


def _decode_value(
    value: object, annotation: object, where: str, key: str, into: Decoded
) -> None:
    if isinstance(value, list):
        annotation = _array_of(annotation)
    if _is_struct(annotation):
        if isinstance(value, Mapping):
            part = decode_table(value, annotation, where)
            into.values[key] = part.values
            into.problems.extend(part.problems)
        else:
            into.problems.append(f"{where}: needed a table, got {got(value)}")
    elif (entry := _entry_type(annotation)) is not None:
        _decode_array(value, annotation, entry, where, key, into)
    elif typing.get_origin(annotation) is dict and isinstance(value, Mapping):
        entries = Decoded()
        for name, item in value.items():
            of_value = typing.get_args(annotation)[1]
            _decode_value(item, of_value, f"{where}.{name}", name, entries)
        into.values[key] = entries.values
        into.problems.extend(entries.problems)
    elif (problem := _leaf_problem(value, annotation, where)) is None:
        into.values[key] = value
    else:
        into.problems.append(problem)


def _decode_array(
    value: object,
    annotation: object,
    entry: object,
    where: str,
    key: str,
    into: Decoded,
) -> None:
    if not isinstance(value, list):
        tables = f"an array of tables [[{where}]]"
        form = tables if _is_struct(entry) else needed(annotation)
        into.problems.append(f"{where}: needed {form}, got {got(value)}")
        return
    entries = Decoded()
    for index, item in enumerate(value):
        n_before = len(entries.problems)
        _decode_value(item, entry, f"{where}[{index}]", str(index), entries)
        name = item.get("id") if isinstance(item, Mapping) else None
        if isinstance(name, str):
            # Entries are counted from 0; their id helps to find them in the file.
            of_item = entries.problems[n_before:]
            named = [f"{problem} (id {got(name)})" for problem in of_item]
            entries.problems[n_before:] = named
    into.problems.extend(entries.problems)
    into.values[key] = [entries.values.get(str(i)) for i in range(len(value))]
    # limits on the length of the array, which no entry shows
    info = inspect.type_info(annotation)
    if isinstance(info, inspect.VarTupleType) and not (
        (info.min_length or 0) <= len(value) <= (info.max_length or math.inf)
    ):
        into.problems.append(f"{where}: needed {needed(annotation)}, got {got(value)}")


def _leaf_problem(value: object, annotation: object, where: str) -> str | None:
    try:
        msgspec.convert(value, annotation)
    except msgspec.ValidationError:
        pass
    else:
        return None
    info = inspect.type_info(annotation)
    options = info.values if isinstance(info, inspect.LiteralType) else ()
    hint = _closest(value, [str(option) for option in options])
    return f"{where}: needed {needed(annotation)}, got {got(value)}{hint}"


def _unknown(where: str, key: str, fields: Mapping[str, FieldInfo]) -> str:
    hint = _closest(key, list(fields))
    known = "" if hint or not fields else f" ({', '.join(fields)})"
    return f"{where}: needed a known key{known}, got {got(key)}{hint}"


def _closest(value: object, options: list[str]) -> str:
    near = get_close_matches(str(value), options, n=1)
    return f"; did you mean {near[0]}?" if near else ""


def _form(info: FieldInfo, where: str) -> str:
    if _is_struct(info.type):
        return f"a table [{where}]"
    entry = _entry_type(info.type)
    if entry is not None and _is_struct(entry):
        return f"an array of tables [[{where}]]"
    return needed(info.type)


def _is_struct(annotation: object) -> typing.TypeGuard[type[msgspec.Struct]]:
    return isinstance(annotation, type) and issubclass(annotation, msgspec.Struct)


def _entry_type(annotation: object) -> object | None:
    # X of tuple[X, ...], annotated or not; None for anything else.
    if typing.get_origin(annotation) is typing.Annotated:
        annotation = typing.get_args(annotation)[0]
    if typing.get_origin(annotation) is tuple:
        entry: object = typing.get_args(annotation)[0]
        return entry
    return None


def _array_of(annotation: object) -> object:
    # the member of a union that is an array, or the annotation itself
    is_union = typing.get_origin(annotation) in (typing.Union, types.UnionType)
    for member in typing.get_args(annotation) if is_union else ():
        if _entry_type(member) is not None:
            return member
    return annotation


_IDENTIFIER = (
    "a name of 1 to 32 letters, digits, '.', '_' or '-', "
    "the first a letter or digit (in quotes)"
)


def needed(annotation: object) -> str:
    """Say what a value of a field's type is."""
    return _phrase(inspect.type_info(annotation))


def _phrase(info: inspect.Type) -> str:
    if isinstance(info, inspect.UnionType):
        kinds = [t for t in info.types if not isinstance(t, inspect.NoneType)]
        return " or ".join(_phrase(kind) for kind in kinds)
    if isinstance(info, inspect.BoolType):
        return "true or false"
    if isinstance(info, inspect.DictType):
        return f"a table in which each value is {_phrase(info.value_type)}"
    if isinstance(info, inspect.FloatType):
        return "a number" + _range(info)
    if isinstance(info, inspect.IntType):
        return "a whole number" + _range(info)
    if isinstance(info, inspect.LiteralType):
        of = "one of " if len(info.values) > 1 else ""
        return of + ", ".join(got(value) for value in info.values)
    if isinstance(info, inspect.VarTupleType):
        return "an array" + _entries(info)
    if isinstance(info, inspect.StrType) and info.pattern is not None:
        return _IDENTIFIER
    if isinstance(info, inspect.StrType) and info.min_length:
        return "text that is not empty (in quotes)"
    return "text (in quotes)"


def _range(info: inspect.FloatType | inspect.IntType) -> str:
    limits = (
        ("above", info.gt),
        ("at least", info.ge),
        ("below", info.lt),
        ("at most", info.le),
    )
    form = "d" if isinstance(info, inspect.IntType) else "g"  # exact: up to 2**63
    phrases = [
        f"{word} {limit:{form}}"
        for word, limit in limits
        if limit is not None and abs(limit) < sys.float_info.max  # else every number
    ]
    return " " + " and ".join(phrases) if phrases else ""


def _entries(info: inspect.VarTupleType) -> str:
    phrase = ""
    if info.min_length and info.max_length:
        phrase = f" of {info.min_length} to {info.max_length} entries"
    elif info.min_length:
        few = "entry" if info.min_length == 1 else "entries"
        phrase = f" of at least {info.min_length} {few}"
    if isinstance(info.item_type, inspect.LiteralType) and info.max_length:
        phrase += f", each {_phrase(info.item_type)}"
    return phrase


def got(value: object) -> str:
    """Show a decoded TOML value as its file would."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        return f"an array of {len(value)}"
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()
    return str(value)


def with_id(entry: Mapping[str, object]) -> str:
    """Name an entry of an array of tables at the end of a message."""
    return f" (id {got(entry['id'])})" if "id" in entry else ""

"""What is wrong with the types of a TOML table, key by key."""

import dataclasses
import datetime
import json
import math
import sys
import types
import typing
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches

import msgspec
from msgspec import inspect

_MAX_HINTS = 20


def type_problems(
    raw: Mapping[str, object], struct: type, at: str = ""
) -> Iterator[str]:
    """Yield each key of a table that a struct cannot take, as ``key: needed ...``.

    A dataclass may raise more when it is made, which is reported for the whole table.
    """
    fields, reason = _fields(struct), None
    try:
        msgspec.convert(raw, struct)
    except msgspec.ValidationError as error:  # of the first problem: look key by key
        reason = error.__cause__
    else:
        if raw.keys() <= fields.keys():
            return
    problems = list(_key_problems(raw, fields, f"{at}." if at else ""))
    yield from problems or [f"{at}: {reason}"]


def _key_problems(
    raw: Mapping[str, object], fields: dict[str, tuple[object, bool]], prefix: str
) -> Iterator[str]:
    for place, key in enumerate(key for key in raw if key not in fields):
        # what was meant takes long to find, and helps with the first few
        options = list(fields) if place < _MAX_HINTS else []
        hint = closest(key, options)
        known = "" if hint or not options else f" ({', '.join(options)})"
        yield f"{prefix}{key}: needed a known key{known}, got {got(key)}{hint}"
    for key, (annotation, is_required) in fields.items():
        where = f"{prefix}{key}"
        if key in raw:
            yield from _value_problems(raw[key], annotation, where)
        elif is_required:
            yield f"{where}: needed {_form(annotation, where)}, got none"


def _fields(struct: type) -> dict[str, tuple[object, bool]]:
    # the type of each key, and whether it must be there
    if not dataclasses.is_dataclass(struct):
        infos = msgspec.structs.fields(struct)
        return {info.encode_name: (info.type, info.required) for info in infos}
    types = typing.get_type_hints(struct, include_extras=True)
    return {
        field.name: (
            types[field.name],
            field.default is field.default_factory is dataclasses.MISSING,
        )
        for field in dataclasses.fields(struct)
        if field.metadata.get("in_protocol", True)
    }


def _value_problems(value: object, annotation: object, where: str) -> Iterator[str]:
    array, table = _array_of(annotation), _table_of(annotation)
    match value:
        case Mapping() if table is not None:
            yield from type_problems(value, table, where)
        case Mapping() if typing.get_origin(annotation) is dict:
            of_value = typing.get_args(annotation)[1]
            for name, item in value.items():
                yield from _value_problems(item, of_value, f"{where}.{name}")
        case list() if array is not None:
            yield from _array_problems(value, *array, where)
        case _:
            yield from _leaf_problems(value, annotation, where)


def _array_problems(
    value: list[object], annotation: object, entry: object, where: str
) -> Iterator[str]:
    for index, item in enumerate(value):
        # Entries are counted from 0; their id helps to find them in the file.
        name = item.get("id") if isinstance(item, Mapping) else None
        at_end = f" (id {got(name)})" if isinstance(name, str) else ""
        for problem in _value_problems(item, entry, f"{where}[{index}]"):
            yield problem + at_end
    # limits on the length of the array, which no entry shows
    info = inspect.type_info(annotation)
    if isinstance(info, inspect.VarTupleType) and not (
        (info.min_length or 0) <= len(value) <= (info.max_length or math.inf)
    ):
        yield f"{where}: needed {needed(annotation)}, got {got(value)}"


def _leaf_problems(value: object, annotation: object, where: str) -> Iterator[str]:
    try:
        msgspec.convert(value, annotation)
    except msgspec.ValidationError:
        info = inspect.type_info(annotation)
        options = info.values if isinstance(info, inspect.LiteralType) else ()
        hint = closest(value, map(str, options))
        needs = "a table" if _table_of(annotation) else _form(annotation, where)
        yield f"{where}: needed {needs}, got {got(value)}{hint}"


def closest(value: object, options: Iterable[str]) -> str:
    """Ask at the end of a message for the option that may be meant, if one is near."""
    near = get_close_matches(str(value), list(options), n=1)
    return f"; did you mean {near[0]}?" if near else ""


def _form(annotation: object, where: str) -> str:
    array = _array_of(annotation)
    if _table_of(annotation):
        return f"a table [{where}]"
    if array is not None and _table_of(array[1]):
        return f"an array of tables [[{where}]]"
    return needed(annotation)


def _table_of(annotation: object) -> type | None:
    # the struct or dataclass that it is, or a union has
    for member in _members(annotation):
        if isinstance(member, type) and (
            issubclass(member, msgspec.Struct) or dataclasses.is_dataclass(member)
        ):
            return member
    return None


def _members(annotation: object) -> tuple[object, ...]:
    is_union = typing.get_origin(annotation) in (typing.Union, types.UnionType)
    return typing.get_args(annotation) if is_union else (annotation,)


def _array_of(annotation: object) -> tuple[object, object] | None:
    # the array, annotated or not, that it is or a union has, and what its entries are
    for member in _members(annotation):
        is_annotated = typing.get_origin(member) is typing.Annotated
        bare = typing.get_args(member)[0] if is_annotated else member
        if typing.get_origin(bare) is tuple:
            return member, typing.get_args(bare)[0]
    return None


_IDENTIFIER = (
    "a name of 1 to 32 letters, digits, '.', '_' or '-', "
    "the first a letter or digit (in quotes)"
)


def needed(annotation: object) -> str:
    """Say what a value of a field's type is."""
    return _phrase(inspect.type_info(annotation))


def _phrase(info: inspect.Type) -> str:
    match info:
        case inspect.UnionType():
            kinds = [t for t in info.types if not isinstance(t, inspect.NoneType)]
            return " or ".join(_phrase(kind) for kind in kinds)
        case inspect.BoolType():
            return "true or false"
        case inspect.DictType():
            return f"a table in which each value is {_phrase(info.value_type)}"
        case inspect.FloatType():
            return "a number" + _range(info)
        case inspect.IntType():
            return "a whole number" + _range(info)
        case inspect.LiteralType():
            of = "one of " if len(info.values) > 1 else ""
            return of + ", ".join(got(value) for value in info.values)
        case inspect.VarTupleType():
            return "an array" + _entries(info)
        case inspect.StrType(pattern=str()):
            return _IDENTIFIER
        case inspect.StrType(min_length=int()):
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
    low, high = info.min_length, info.max_length
    phrase = ""
    if low and high:
        phrase = f" of {low} to {high} entries"
    elif low:
        phrase = f" of at least {low} {'entry' if low == 1 else 'entries'}"
    if isinstance(info.item_type, inspect.LiteralType) and high:
        phrase += f", each {_phrase(info.item_type)}"
    return phrase


def got(value: object) -> str:
    """Show a decoded TOML value as its file would."""
    match value:
        case str():
            return json.dumps(value, ensure_ascii=False)
        case bool():
            return "true" if value else "false"
        case Mapping():
            return "a table"
        case list() | tuple():
            return f"an array of {len(value)}"
        case datetime.date() | datetime.time():
            return value.isoformat()
    return str(value)

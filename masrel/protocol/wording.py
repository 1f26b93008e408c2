"""What a key needs and what came instead, in the words of a TOML file."""

import datetime
import json
from collections.abc import Mapping

from msgspec import inspect

__all__ = ["got", "needed", "with_id"]

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
        return "one of " + ", ".join(got(value) for value in info.values)
    if isinstance(info, inspect.VarTupleType):
        return "an array" + _length(info)
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
    said = [f"{word} {limit:g}" for word, limit in limits if limit is not None]
    if isinstance(info, inspect.IntType):  # exact: a limit may be 2**63
        said = [f"{word} {limit}" for word, limit in limits if limit is not None]
    return " " + " and ".join(said) if said else ""


def _length(info: inspect.VarTupleType) -> str:
    if info.min_length and info.max_length:
        return f" of {info.min_length} to {info.max_length} entries"
    if info.min_length:
        few = "entry" if info.min_length == 1 else "entries"
        return f" of at least {info.min_length} {few}"
    return ""


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

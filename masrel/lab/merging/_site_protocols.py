"""One protocol from those of several sites: they differ in their raters alone."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import date, time
from typing import Any

import msgspec

from masrel.errors import ProtocolError
from masrel.lab._bounded_files import MAX_SMALL, parse_toml, read_regular
from masrel.lab.protocol import Protocol, StudyPaths, presented_hash

_ABSENT = object()

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def check_protocols(
    studies: Sequence[StudyPaths], protocols: Sequence[Protocol]
) -> None:
    """Refuse protocols that differ in more than which raters take part."""
    for study, protocol in zip(studies[1:], protocols[1:], strict=True):
        raters = {r.id for r in protocols[0].raters} & {r.id for r in protocol.raters}
        first, other = (
            dict(_leaves(_comparable(each, raters)))
            for each in (protocols[0], protocol)
        )
        for key in sorted({**first, **other}):
            values = first.get(key, _ABSENT), other.get(key, _ABSENT)
            if values[0] != values[1]:
                raise ProtocolError(
                    f"{key}: needed the same in all protocols, got "
                    f"{_shown(values[0])} in {studies[0].protocol} and "
                    f"{_shown(values[1])} in {study.protocol}"
                )
        if presented_hash(protocol) != presented_hash(protocols[0]):
            raise ProtocolError(
                f"{study.protocol}: needed what {studies[0].protocol} presents, got "
                "another presented hash"
            )


def _comparable(protocol: Protocol, raters: set[str]) -> dict[str, Any]:
    # content by the ids of its entries, with these raters, without who takes part when
    content: dict[str, Any] = msgspec.to_builtins(protocol)
    for session in content["sessions"]:
        del session["raters"]
    content["raters"] = [r for r in content["raters"] if r["id"] in raters]
    for array in ("models", "sessions"):
        content[f"{array} in order"] = [entry["id"] for entry in content[array]]
    for array in ("models", "raters", "sessions"):
        content[array] = {entry["id"]: entry for entry in content[array]}
    return content


def _leaves(content: object, place: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(content, Mapping) and content:
        for key, value in content.items():
            yield from _leaves(value, f"{place}.{key}".lstrip("."))
    else:
        yield place, content


def _shown(value: object) -> str:
    return "none" if value is _ABSENT else json.dumps(value, ensure_ascii=False)


def merged_protocol(studies: Sequence[StudyPaths]) -> bytes:
    """Return the file of a protocol with the raters of all sites."""
    contents = [read_regular(study.protocol, most=MAX_SMALL) for study in studies]
    first, *others = (parse_toml(content) for content in contents)
    is_new = False
    for other in others:
        is_new |= _add(first["raters"], other["raters"], "id")
        for session, more in zip(first["sessions"], other["sessions"], strict=True):
            is_new |= _add(session["raters"], more["raters"])
    if not is_new:
        return contents[0]
    names = ", ".join(study.root.resolve().name for study in studies)
    head = f"# Merged from the protocols of {names}; their comments are in them."
    return "\n".join([head, *_toml_lines(first)]).encode() + b"\n"


def _add(entries: list[Any], others: list[Any], key: str | None = None) -> bool:
    # adds the entries that are not there yet, and says whether there are any
    there = [entry[key] if key else entry for entry in entries]
    more = [o for o in others if (o[key] if key else o) not in there]
    entries += more
    return bool(more)


def _toml_lines(table: Mapping[str, Any], place: str = "") -> Iterator[str]:
    # what is no table comes first, so that it does not belong to one
    parts = {name: value for name, value in table.items() if _is_table(value)}
    for name, value in table.items():
        if name not in parts:
            yield f"{_toml_key(name)} = {_toml_value(value)}"
    for name, value in parts.items():
        where = f"{place}.{_toml_key(name)}".lstrip(".")
        if isinstance(value, Mapping):
            yield from ("", f"[{where}]", *_toml_lines(value, where))
        else:
            for entry in value:
                yield from ("", f"[[{where}]]", *_toml_lines(entry, where))


def _is_table(value: object) -> bool:
    if isinstance(value, list):
        return bool(value) and all(isinstance(entry, Mapping) for entry in value)
    return isinstance(value, Mapping)


def _toml_key(name: str) -> str:
    return name if _BARE_KEY.fullmatch(name) else _toml_value(name)


def _toml_value(value: object) -> str:
    if isinstance(value, Mapping):
        pairs = (f"{_toml_key(k)} = {_toml_value(v)}" for k, v in value.items())
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml_value, value))}]"
    if isinstance(value, date | time):  # a datetime too
        return value.isoformat()
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")

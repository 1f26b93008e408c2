"""What is known of each rater: fields that a protocol declares, and their values."""

from collections.abc import Iterator, Mapping
from datetime import date, datetime
from typing import Any

import msgspec

from masrel._input import listed
from masrel.lab.protocol._decode import got, with_id
from masrel.lab.protocol.definition import _FIELD_NAME, RaterField

FieldValue = str | int | float
"""What a field holds; a date is text, ``YYYY-MM-DD``."""

RESERVED = ("rater", "site", "status", "late")
"""Columns of ``raters.csv`` that are no fields."""

_LARGEST = 2**63  # whole numbers that the hash of a protocol can hold

_FORMS = {
    "text": "text that is not empty (in quotes)",
    "whole": "a whole number",
    "number": "a number",
    "date": "a date, YYYY-MM-DD",
}


def needed_of(field: RaterField) -> str:
    """Say what a value of a field is."""
    if field.type == "choice":
        return f"one of {listed(got(choice) for choice in field.choices)}"
    return _FORMS[field.type]


def field_value(field: RaterField, value: object) -> FieldValue | None:
    """Return a value as its field holds it, or None if it is of another type."""
    if isinstance(value, bool | datetime):
        return None
    if field.type == "date":
        return _day(value)
    if field.type == "whole":
        return value if isinstance(value, int) and abs(value) < _LARGEST else None
    if field.type == "number":  # not of nan
        if isinstance(value, int | float) and abs(value) < _LARGEST:
            return value
        return None
    if not isinstance(value, str) or not value.strip():
        return None
    return value if field.type == "text" or value in field.choices else None


def parsed_value(field: RaterField, text: str) -> FieldValue | None:
    """Return the value that a text stands for, or None if it stands for none."""
    kind = {"whole": int, "number": float}.get(field.type, str)
    try:
        return field_value(field, kind(text.strip()))
    except ValueError:
        return None


def _day(value: object) -> str | None:
    if isinstance(value, date):
        return value.isoformat()
    try:
        day = date.fromisoformat(str(value))
    except ValueError:
        return None
    return value if value == day.isoformat() else None


def rater_field_rules(values: Mapping[str, Any]) -> Iterator[str]:
    """Check fields of raters, and what raters have in them."""
    fields = values.get("rater_fields") or {}
    for name, field in fields.items():
        yield from _declaration(name, field or {})
    for index, rater in enumerate(values.get("raters") or []):
        where = f"raters[{index}].fields"
        for name, value in ((rater or {}).get("fields") or {}).items():
            problem = _value_problem(name, value, fields)
            if problem is not None:
                yield f"{where}.{name}: {problem}{with_id(rater)}"


def field_heading(name: str, field: RaterField) -> str:
    """Return what a field is called in a table, unit included."""
    return (field.title or name) + (f" ({field.unit})" if field.unit else "")


def _declaration(name: str, field: Mapping[str, Any]) -> Iterator[str]:
    where = f"rater_fields.{name}"
    if not _FIELD_NAME.fullmatch(name) or name in RESERVED:
        yield (
            f"{where}: needed a name of 1 to 32 small letters, digits and '_', the "
            f"first a letter, other than {', '.join(RESERVED)}, got {got(name)}"
        )
    kind, choices = field.get("type"), field.get("choices")
    if kind == "choice" and choices is not None and len(set(choices)) < 2:
        yield f"{where}.choices: needed at least 2 that differ, got {got(choices)}"
    if kind not in (None, "choice") and choices:
        yield f'{where}.choices: needed for type "choice" only, got it for {got(kind)}'
    if kind in ("text", "choice", "date") and field.get("unit"):
        yield f"{where}.unit: needed for numbers only, got it for {got(kind)}"


def _value_problem(name: str, value: object, fields: Mapping[str, Any]) -> str | None:
    # what is wrong with a rater's value, or None
    if name not in fields:
        known = listed(fields) if fields else "there is none"
        return f"needed a field of [rater_fields] ({known}), got {got(name)}"
    try:
        field = msgspec.convert(fields[name], RaterField)
    except msgspec.ValidationError:
        return None  # the field itself is refused
    if field_value(field, value) is None:
        return f"needed {needed_of(field)}, got {got(value)}"
    return None

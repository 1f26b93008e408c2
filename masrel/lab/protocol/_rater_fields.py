"""What is known of each rater: fields that a protocol declares, and their values."""

from datetime import date, datetime

from masrel._input import listed
from masrel.lab.protocol._decode import got
from masrel.lab.protocol.definition import RaterField

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


def field_heading(name: str, field: RaterField) -> str:
    """Return what a field is called in a table, unit included."""
    return (field.title or name) + (f" ({field.unit})" if field.unit else "")

"""The property numbers of a firmware, from a file of the user's own."""

import tomllib
from pathlib import Path

from masrel.errors import ParameterError
from masrel.hess.puck.properties import PropertyTable

__all__ = ["read_property_table"]


def read_property_table(path: Path) -> PropertyTable:
    """Read the property numbers of a firmware that the driver does not know."""
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ParameterError(f"{path}: not TOML ({error})") from error
    if set(document) != {"properties"} or not isinstance(document["properties"], dict):
        raise ParameterError(f"{path}: needs one table, [properties]")
    numbers = document["properties"]
    for name, number in numbers.items():
        if type(number) is not int:
            raise ParameterError(
                f"{path}: properties.{name}: needs a whole number, got {number!r}"
            )
    try:
        return PropertyTable(numbers=numbers)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from error

"""The property numbers of a firmware, from a file of the user's own."""

import tomllib
from pathlib import Path

from masrel.errors import ParameterError
from masrel.hess.puck.properties import PropertyTable

__all__ = ["read_property_table"]


def read_property_table(path: Path) -> PropertyTable:
    """Read the property numbers of a firmware that the driver does not know.

    Parameters
    ----------
    path : Path
        A TOML file with one table, ``[properties]``: a number for every name.

    Returns
    -------
    PropertyTable
        Names and numbers.

    Raises
    ------
    ParameterError
        If the file is not such a table.
    OSError
        If it cannot be read.
    """
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

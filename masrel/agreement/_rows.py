"""Rows of named fields as columns: tuples, or a long DataFrame."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel._input import USUAL_NAMES, listed, shown
from masrel.agreement._labels import is_missing, is_row
from masrel.errors import RatingsError

Integers = NDArray[np.int64]


def columns_of(rows: Any, fields: Sequence[str]) -> list[list[Any]]:
    """Return a column for each field, from rows in this order or by name."""
    if hasattr(rows, "items"):  # a DataFrame, met without importing pandas, or a dict
        columns = {str(name).casefold(): list(of) for name, of in rows.items()}
        names = [
            next((n for n in USUAL_NAMES.get(field, ()) if n in columns), field)
            for field in fields
        ]
        if not columns.keys() >= set(names):
            raise RatingsError(
                f"ratings: needs columns {', '.join(fields)}, got {listed(columns)}"
            )
        return [columns[name] for name in names]
    table = list(rows) if is_row(rows) else [rows]
    for place, row in enumerate(table):
        if not is_row(row) or len(row) != len(fields):  # type: ignore[arg-type]
            raise RatingsError(
                f"ratings: row {place}: needs {', '.join(fields)}, got {shown(row)}"
            )
    return [list(of) for of in zip(*table, strict=True)] or [[] for _ in fields]


def coded(column: Sequence[Any], field: str) -> tuple[Integers, list[Any]]:
    """Return labels as numbers, in the order in which they are met."""
    places: dict[Any, int] = {}
    try:
        codes = [places.setdefault(label, len(places)) for label in column]
    except TypeError as error:
        raise RatingsError(f"ratings: column {field}: {error}") from None
    labels = [of.item() if isinstance(of, np.generic) else of for of in places]
    if any(map(is_missing, labels)):
        row = next(row for row, label in enumerate(column) if is_missing(label))
        raise RatingsError(f"ratings: row {row}: needs the {field}, got none")
    return np.array(codes, dtype=np.int64), labels

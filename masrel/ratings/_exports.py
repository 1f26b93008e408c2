"""Exports of annotation tools as long tables, one row a rating."""

from typing import Any

import pandas as pd

from masrel.errors import ParameterError


def read_export(name: str, source: str, values: list[Any]) -> pd.DataFrame:
    """Return the ratings of an export, in columns item, rater and grade."""
    raise ParameterError(f"{name}: --from: needed the name of a tool, got {source!r}")

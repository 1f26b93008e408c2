"""The file of an analysis: JSON, every digit kept, inputs named beside each number."""

import dataclasses
import json
import math
from collections.abc import Mapping
from pathlib import Path

import msgspec

from masrel.analysis._results import Analysis
from masrel.estimates import Interval, as_document


def as_analysis_document(analysis: Analysis) -> dict[str, object]:
    """Turn an analysis into plain values for JSON, ``nan`` as None.

    Parameters
    ----------
    analysis : Analysis
        The analysis.

    Returns
    -------
    dict
        Its fields in order; every part carries the hashes of its inputs.
    """
    document: dict[str, object] = {}
    for field in dataclasses.fields(analysis):
        value = getattr(analysis, field.name)
        if field.name == "estimates":
            document[field.name] = [_with_inputs(line, analysis) for line in value]
        elif dataclasses.is_dataclass(value):
            document[field.name] = _with_inputs(value, analysis)
        else:
            document[field.name] = _plain(value)
    return document


def write_analysis(analysis: Analysis, path: Path) -> None:
    """Write an analysis as JSON; the same analysis gives the same bytes.

    Parameters
    ----------
    analysis : Analysis
        The analysis.
    path : Path
        The file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    text = json.dumps(
        as_analysis_document(analysis), indent=1, ensure_ascii=False, allow_nan=False
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text + "\n", encoding="utf-8", newline="\n")


def _with_inputs(part: object, analysis: Analysis) -> dict[str, object]:
    # A line of the plan reads best beside its numbers.
    named = {**plain_fields(getattr(part, "line", None)), **plain_fields(part)}
    named.pop("line", None)
    return {**named, "inputs": dict(analysis.inputs)}


def plain_fields(part: object) -> dict[str, object]:
    """Return the fields of a result as plain values for JSON, ``nan`` as None."""
    if isinstance(part, msgspec.Struct):
        part = msgspec.structs.asdict(part)
    elif dataclasses.is_dataclass(part):
        names = (field.name for field in dataclasses.fields(part))
        part = {name: getattr(part, name) for name in names}
    if not isinstance(part, Mapping):
        return {}
    return {str(name): _plain(value) for name, value in part.items()}


def _plain(value: object) -> object:
    if isinstance(value, Interval):
        return as_document(value)
    if dataclasses.is_dataclass(value) or isinstance(value, msgspec.Struct | Mapping):
        return plain_fields(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, tuple | list):
        return [_plain(part) for part in value]
    return value

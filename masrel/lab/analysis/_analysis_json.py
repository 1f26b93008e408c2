"""Results in other forms: an analysis as JSON, every digit kept; several as a frame."""

import dataclasses
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from masrel._files import write_file
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Interval, as_document
from masrel.lab.analysis._results import Analysis

if TYPE_CHECKING:
    from pandas import DataFrame


ANALYSIS_FORMAT = 1
"""Version of the file of an analysis; one that names none is of version 1."""


_LATER = ("excluded", "questionnaires")
"""Fields that analyses once had not, and have not in a file where they are empty."""


def as_analysis_document(analysis: Analysis) -> dict[str, object]:
    """Turn an analysis into plain values for JSON, ``nan`` as None.

    Parameters
    ----------
    analysis : Analysis
        The analysis.

    Returns
    -------
    dict
        The version of its format, and its fields in order, `excluded` and
        `questionnaires` only where there are some; every part carries the hashes of its
        inputs.
    """
    document: dict[str, object] = {"format": ANALYSIS_FORMAT}
    for field in dataclasses.fields(analysis):
        value = getattr(analysis, field.name)
        if field.name == "estimates":
            document[field.name] = [_with_inputs(line, analysis) for line in value]
        elif dataclasses.is_dataclass(value):
            document[field.name] = _with_inputs(value, analysis)
        elif value or field.name not in _LATER:
            document[field.name] = _plain(value)
    return document


def write_analysis(
    analysis: Analysis, path: Path, *, within: Path | None = None
) -> None:
    """Write an analysis as JSON; the same analysis gives the same bytes.

    Parameters
    ----------
    analysis : Analysis
        The analysis.
    path : Path
        The file.
    within : Path, optional
        A folder that the file may not leave by a link, such as the study's.

    Raises
    ------
    ParameterError
        If `path` is the place of a study's primary record, or not within `within`.
    OSError
        If the file cannot be written; what was there is then there still.
    """
    write_file(path, analysis_text(analysis), within=within)


def analysis_text(analysis: Analysis) -> str:
    """Return an analysis as its file has it."""
    document = as_analysis_document(analysis)
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    return text + "\n"


def to_frame(results: "Iterable[Estimate] | Mapping[str, Estimate]") -> "DataFrame":
    """Put several estimates into a DataFrame, one row each.

    Parameters
    ----------
    results : iterable of Estimate, or mapping of str to Estimate
        The estimates, with or without intervals; names of a mapping become the index.

    Returns
    -------
    DataFrame, shape (n_results, n_fields)
        A column for each field of `Estimate`, by its name, with the fields of
        `Interval` in place of its interval; why an interval is undefined is
        ``interval_reason``. Columns are the same for any results, and empty where a
        result has no such thing. Every digit is kept.

    Raises
    ------
    ParameterError
        If a result is not an `Estimate`.
    ImportError
        If pandas is not installed.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa, gwet_ac
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]
    >>> frame = to_frame({"kappa": fleiss_kappa(ratings), "AC1": gwet_ac(ratings)})
    >>> frame[["coefficient", "value", "n_items"]].round(3)
            coefficient  value  n_items
    kappa  fleiss_kappa  0.467        4
    AC1         gwet_ac  0.529        4
    """
    from pandas import DataFrame  # loaded only when asked for

    index = None
    if isinstance(results, Mapping):
        index, results = list(results), results.values()
    rows = [_row(result, place) for place, result in enumerate(results)]
    return DataFrame(rows, index=index, columns=list(_columns()))


def _columns() -> dict[str, tuple[str, str]]:
    # column to what it is a field of and its name there
    columns: dict[str, tuple[str, str]] = {}
    of_interval = [field.name for field in dataclasses.fields(Interval) if field.repr]
    for field in dataclasses.fields(Estimate):
        if field.name != "interval":
            columns[field.name] = ("estimate", field.name)
            continue
        for name in of_interval:
            column = "interval_reason" if name == "reason" else name
            columns[column] = ("interval", name)
    return columns


def _row(result: object, place: int) -> dict[str, object]:
    # of one estimate; nan where a number is missing
    if not isinstance(result, Estimate):
        raise ParameterError(
            f"results: place {place}: needs an Estimate, got {type(result).__name__}"
        )
    parts = {"estimate": result, "interval": result.interval}
    row = {
        column: getattr(parts[part], name, None)
        for column, (part, name) in _columns().items()
    }
    if result.interval is None:
        row |= {"low": math.nan, "high": math.nan, "level": math.nan}
    return row


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

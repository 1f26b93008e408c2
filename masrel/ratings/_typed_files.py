"""Files whose cells have types (workbooks, Parquet, JSON, SPSS …) as cells of text."""

import io
import json
import math
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from masrel.errors import ParameterError, RatingsError
from masrel.ratings._sheets import SheetOptions

_WORKBOOKS = (".xlsx", ".xlsm", ".xls", ".ods")
_PYREADSTAT = {
    ".sav": "read_sav",
    ".zsav": "read_sav",
    ".por": "read_por",
    ".dta": "read_dta",
    ".sas7bdat": "read_sas7bdat",
    ".xpt": "read_xport",
}


def read_typed(
    name: str, ending: str, data: bytes, options: SheetOptions
) -> tuple[pd.DataFrame, dict[str, str | None]]:
    """Return the records of a file, names first, and what its format is."""
    facts: dict[str, str | None] = {"format": ending.removeprefix(".")}
    if options.source is not None:
        from masrel.ratings._exports import read_export

        frame = read_export(name, options.source, _json_values(name, ending, data))
        facts = {"format": f"{options.source} export"}
    elif ending in _WORKBOOKS:
        frame, facts["sheet"] = _workbook(name, data, options)
    elif ending in (".json", ".jsonl"):
        frame = _objects(name, _json_values(name, ending, data))
    elif ending in (".parquet", ".feather"):
        _require(name, "pyarrow")
        read = pd.read_parquet if ending == ".parquet" else pd.read_feather
        frame = _read(name, ending, lambda: read(io.BytesIO(data)))
        if frame.index.name is not None:
            frame = frame.reset_index()
    else:
        frame = _statistical(name, ending, data)
    return _records(frame, is_sheet=ending in _WORKBOOKS), facts


def _require(name: str, module: str) -> None:
    if find_spec(module) is None:
        raise RatingsError(
            f"{name}: reading it needs {module}: pip install 'masrel[files]'"
        )


def _read(name: str, ending: str, read: Callable[[], Any]) -> Any:
    # Readers of these formats raise what they like for bytes that are not theirs.
    try:
        return read()
    except (ValueError, OSError, KeyError, RuntimeError, TypeError) as error:
        first = (str(error).strip().splitlines() or ["no reason"])[0]
        raise RatingsError(f"{name}: is no {ending} file ({first})") from error


def _workbook(
    name: str, data: bytes, options: SheetOptions
) -> tuple[pd.DataFrame, str]:
    _require(name, "python_calamine")
    book = _read(
        name, "workbook", lambda: pd.ExcelFile(io.BytesIO(data), engine="calamine")
    )
    sheets = [str(sheet) for sheet in book.sheet_names]
    sheet = options.sheet or (sheets[0] if len(sheets) == 1 else None)
    if sheet is None or sheet not in sheets:
        got = "" if sheet is None else f", got {sheet!r}"
        raise RatingsError(
            f"{name}: needs --sheet with one of its sheets, {', '.join(sheets)}{got}"
        )
    frame: pd.DataFrame = book.parse(
        sheet, header=None, dtype=object, keep_default_na=False, na_values=[]
    )
    if frame.empty:
        raise RatingsError(f"{name}: sheet {sheet}: needed a header and rows, got none")
    return frame, sheet


def _json_values(name: str, ending: str, data: bytes) -> list[Any]:
    try:
        text = data.decode("utf-8-sig")
        if ending == ".jsonl":
            return [json.loads(line) for line in text.splitlines() if line.strip()]
        values = json.loads(text)
    except UnicodeDecodeError as error:
        raise RatingsError(f"{name}: needed JSON in UTF-8 ({error})") from error
    except json.JSONDecodeError as error:
        raise RatingsError(
            f"{name}: is no JSON: line {error.lineno}: {error.msg}"
        ) from error
    return values if isinstance(values, list) else [values]


def _objects(name: str, values: list[Any]) -> pd.DataFrame:
    # a list of objects, one a row
    if not values or not all(isinstance(value, dict) for value in values):
        raise RatingsError(
            f"{name}: needed a JSON list of objects, one a row; --from reads exports "
            "of annotation tools"
        )
    for number, value in enumerate(values, start=1):
        nested = [k for k, v in value.items() if isinstance(v, dict | list)]
        if nested:
            raise RatingsError(
                f"{name}: object {number}: needed text or a number for {nested[0]!r}, "
                "got what is nested; --from reads exports of annotation tools"
            )
    return pd.DataFrame(values, dtype=object)


def _statistical(name: str, ending: str, data: bytes) -> pd.DataFrame:
    if ending not in _PYREADSTAT:
        raise ParameterError(f"--from: does not read {ending} files")
    _require(name, "pyreadstat")
    import pyreadstat

    read = getattr(pyreadstat, _PYREADSTAT[ending])
    with tempfile.TemporaryDirectory() as folder:  # it reads no bytes, but files
        file = Path(folder) / f"data{ending}"
        file.write_bytes(data)
        try:
            frame, _ = read(str(file))
        except (pyreadstat.ReadstatError, pyreadstat.PyreadstatError) as error:
            raise RatingsError(f"{name}: is no {ending} file ({error})") from error
    table: pd.DataFrame = frame
    return table


def _records(frame: pd.DataFrame, *, is_sheet: bool) -> pd.DataFrame:
    # cells as text, the names of the columns as the first row
    columns = [_texts(frame.iloc[:, k]) for k in range(frame.shape[1])]
    rows = np.empty((len(frame), frame.shape[1]), dtype=object)
    for position, column in enumerate(columns):
        rows[:, position] = column
    if not is_sheet:  # a workbook has its names in its first row
        rows = np.vstack(
            [np.array([list(map(str, frame.columns))], dtype=object), rows]
        )
    return pd.DataFrame(rows, dtype=object)


def _texts(column: "pd.Series[Any]") -> Any:
    # every value that occurs is written once
    codes, values = pd.factorize(column.astype(object), use_na_sentinel=True)
    texts = np.array([*map(_text, values), ""], dtype=object)
    return texts[codes]  # a missing value is -1, the empty text


def _text(value: object) -> str:
    # 1.0 of a column of numbers is the grade 1
    if isinstance(value, bool | np.bool_):
        return str(value).lower()
    if isinstance(value, float | np.floating):
        number = float(value)
        if math.isfinite(number) and number.is_integer() and abs(number) < 2**53:
            return str(int(number))
        return repr(number)
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value)

"""Files whose cells have types (workbooks, Parquet, JSON, SPSS …) as cells of text."""

import csv
import io
import json
import re
import tempfile
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from masrel.errors import ParameterError, RatingsError
from masrel.ratings._file_bytes import MAX_UNPACKED, MAX_WORKBOOK, unpacked_size
from masrel.ratings._text_cells import SheetOptions, library, value_text

_WORKBOOKS = (".xlsx", ".xlsm", ".xls", ".ods")
_OLD_WORKBOOK = b"\xd0\xcf\x11\xe0"  # how an .xls begins, in which archives may lie
_ARROW = {".parquet": "pyarrow.parquet", ".feather": "pyarrow.feather"}
_PYREADSTAT = {
    ".sav": "read_sav",
    ".zsav": "read_sav",
    ".por": "read_por",
    ".dta": "read_dta",
    ".sas7bdat": "read_sas7bdat",
    ".xpt": "read_xport",
}
# a cell of type error: its formula, if any, and its value
_ERROR_CELL = re.compile(
    rb'<c\s[^>]*?\bt="e"[^>]*>(?:<f[^>]*?(?:/>|>[^<]*</f>))?<v>([^<]*)</v>'
)
_OF_ZIP = (zipfile.BadZipFile, zlib.error, EOFError)  # what reading it may raise
_EXPORTED = (".json", ".jsonl", ".csv")
_ENCODED = (".sav", ".zsav", ".dta", ".sas7bdat", ".xpt")  # pyreadstat takes theirs


def read_typed(
    name: str, suffix: str, data: bytes, options: SheetOptions
) -> tuple[pd.DataFrame, dict[str, Any], dict[str, int]]:
    """Return the records of a file, names first, its facts, and what it leaves out."""
    # the index of the records is where they stand in the file, from 0
    facts: dict[str, Any] = {"format": suffix.removeprefix(".")}
    if options.encoding is not None and suffix not in _ENCODED:
        raise ParameterError(
            f"--encoding: needed a file of text, got {facts['format']}, whose is known"
        )
    if options.sheet is not None and suffix not in _WORKBOOKS:
        raise ParameterError(f"--sheet: needed a workbook, got {facts['format']}")
    if options.source is not None:
        from masrel.ratings._exports import read_export

        files = _json_files(name, suffix, data)
        export = read_export(name, options.source, files, options.grade)
        return _records(name, export.frame), export.facts, export.dropped
    if suffix in _WORKBOOKS:
        records, facts["sheet"] = _workbook(name, suffix, data, options)
        if errors := _read(name, suffix, lambda: _error_cells(suffix, data), *_OF_ZIP):
            facts["errors"] = errors
        return records, facts, {}
    if suffix in (".json", ".jsonl"):
        frame = _objects(name, _json_values(name, suffix, data))
    elif suffix in _ARROW:
        frame = _arrow(name, suffix, data)
    else:
        frame, labels = _statistical(name, suffix, data, options.encoding)
        if labels:
            facts["labels"] = labels
    return _records(name, frame), facts, {}


def _read(
    name: str, suffix: str, read: Callable[[], Any], *errors: type[Exception]
) -> Any:
    # Readers of these formats raise what they like for bytes that are not theirs.
    kinds: tuple[type[Exception], ...] = (ValueError, TypeError, KeyError, *errors)
    kinds += (OSError, RuntimeError)
    try:
        return read()
    except kinds as error:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        raise RatingsError(
            f"{name}: is damaged, or no {suffix} file ({lines[0][:200].rstrip('. ')})"
        ) from error


def _check_unpacked(name: str, suffix: str, data: bytes, most: int, do: str) -> None:
    size = _read(name, suffix, lambda: unpacked_size(data, most), *_OF_ZIP)
    if size > most:
        raise RatingsError(f"{name}: is more than {most} bytes when unpacked: {do}")


def _workbook(
    name: str, suffix: str, data: bytes, options: SheetOptions
) -> tuple[pd.DataFrame, str]:
    calamine = library(name, "python_calamine")
    if zipfile.is_zipfile(io.BytesIO(data)) and not data.startswith(_OLD_WORKBOOK):
        do = "save its sheet as CSV, since a large table of text is read piece by piece"
        _check_unpacked(name, suffix, data, MAX_WORKBOOK, do)
    book = _read(
        name,
        suffix,
        lambda: calamine.CalamineWorkbook.from_filelike(io.BytesIO(data)),
        calamine.CalamineError,
    )
    sheet, cells = _sheet_of(name, suffix, book, options.sheet, calamine.CalamineError)
    if cells is None:
        raise RatingsError(f"{name}: sheet {sheet}: needed a header and rows, got none")
    rows = cells.to_python(skip_empty_area=True)
    texts = _cell_texts(f"{name}: sheet {sheet}", pd.DataFrame(rows, dtype=object))
    first = cells.start[0]  # rows above the table are blank
    records = pd.DataFrame(
        texts, dtype=object, index=pd.RangeIndex(first, first + len(rows))
    )
    # a column without name and cells is a space between others
    records = records.loc[:, (records != "").any(axis=0)]
    return records.set_axis(range(records.shape[1]), axis=1), sheet


def _error_cells(suffix: str, data: bytes) -> dict[str, int]:
    # errors of formulas in any sheet, such as #N/A, which calamine gives as empty
    if suffix not in (".xlsx", ".xlsm"):
        return {}
    errors: Counter[str] = Counter()
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        for member in packed.namelist():
            if member.startswith("xl/worksheets/") and member.endswith(".xml"):
                texts = _ERROR_CELL.findall(packed.read(member))
                errors.update(text.decode("utf-8", "replace") for text in texts)
    return dict(errors)


def _sheet_of(
    name: str, suffix: str, book: Any, chosen: str | None, error: type[Exception]
) -> tuple[str, Any]:
    # -> the sheet that is meant, and its cells or None where it has none
    names = list(map(str, book.sheet_names))

    def cells_of(sheet: str) -> Any:
        cells = _read(name, suffix, lambda: book.get_sheet_by_name(sheet), error)
        return cells if cells.start is not None else None

    if chosen is not None:
        if chosen not in names:
            raise RatingsError(
                f"{name}: --sheet: there is no sheet {chosen!r}, but {', '.join(names)}"
            )
        return chosen, cells_of(chosen)
    filled = {sheet: cells for sheet in names if (cells := cells_of(sheet)) is not None}
    if len(filled) > 1:
        raise RatingsError(
            f"{name}: needs --sheet with one of its sheets, {', '.join(filled)}"
        )
    return next(iter(filled.items()), (", ".join(names), None))


def _json_files(name: str, suffix: str, data: bytes) -> list[tuple[str, list[Any]]]:
    # an export's files, each by its name without the ending, "" where it is one alone
    if not data.startswith(b"PK\3\4"):  # a pipe has no name that says .zip
        return [("", _json_values(name, suffix, data))]
    _check_unpacked(name, suffix, data, MAX_UNPACKED, "unpack it and leave files out")
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        members = [
            path
            for member in packed.namelist()
            if (path := Path(member)).suffix.lower() in _EXPORTED
            and path.parts[0] != "__MACOSX"  # what a Mac adds to every archive
        ]
        if not members:
            raise RatingsError(f"{name}: needed {', '.join(_EXPORTED)} in it, got none")
        files = []
        for path in members:
            member = path.as_posix()
            values = _json_values(
                f"{name}: {member}", path.suffix.lower(), packed.read(member)
            )
            files.append((path.stem, values))
        return files


def _csv_values(name: str, text: str) -> list[Any]:
    try:
        return list(csv.DictReader(io.StringIO(text, newline="")))
    except csv.Error as error:
        raise RatingsError(f"{name}: needed cells of a table ({error})") from error


def _json_values(name: str, suffix: str, data: bytes) -> list[Any]:
    # values of JSON, of JSON lines whatever the name ends with, or rows of a CSV file
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RatingsError(f"{name}: needed text in UTF-8 ({error})") from error
    if suffix == ".csv":
        return _csv_values(name, text)
    if suffix != ".jsonl":
        try:
            values = _parsed(name, text)
        except json.JSONDecodeError as error:
            if not error.msg.startswith("Extra data"):
                raise RatingsError(
                    f"{name}: line {error.lineno}: is no JSON: {error.msg}"
                ) from error
        else:
            return values if isinstance(values, list) else [values]
    values = []
    for number, line in enumerate(text.split("\n"), start=1):
        try:
            if line.strip():
                values.append(_parsed(f"{name}: line {number}", line))
        except json.JSONDecodeError as error:
            raise RatingsError(
                f"{name}: line {number}: is no JSON: {error.msg}"
            ) from error
    return values


def _parsed(name: str, text: str) -> Any:
    def pairs(items: list[tuple[str, Any]]) -> dict[str, Any]:
        value = dict(items)
        if len(value) < len(items):  # the json module would keep the last in silence
            keys = [key for key, _ in items]
            double = next(key for key in keys if keys.count(key) > 1)
            raise RatingsError(
                f"{name}: needed different keys in an object, {double!r} is there twice"
            )
        return value

    return json.loads(text, object_pairs_hook=pairs)


def _objects(name: str, values: list[Any]) -> pd.DataFrame:
    # a list of objects, one a row; or one object of columns, as pandas and R write
    if len(values) == 1 and isinstance(values[0], dict):
        columns = list(values[0].values())
        if all(isinstance(c, dict) and c.keys() == columns[0].keys() for c in columns):
            return pd.DataFrame(values[0], dtype=object).reset_index(drop=True)
        if all(isinstance(c, list) and len(c) == len(columns[0]) for c in columns):
            return pd.DataFrame(values[0], dtype=object)
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


def _arrow(name: str, suffix: str, data: bytes) -> pd.DataFrame:
    module = library(name, _ARROW[suffix])

    def read() -> pd.DataFrame:
        table = module.read_table(io.BytesIO(data))
        # whole numbers beside missing ones stay whole, however many digits they have
        frame: pd.DataFrame = table.to_pandas(integer_object_nulls=True)
        return frame

    frame: pd.DataFrame = _read(name, suffix, read)
    if isinstance(frame.index, pd.RangeIndex) and frame.index.name is None:
        return frame
    names = [str(name or "") for name in frame.index.names]  # of rows, as items have
    return frame.reset_index(names=names, allow_duplicates=True)


def _statistical(
    name: str, suffix: str, data: bytes, encoding: str | None
) -> tuple[pd.DataFrame, dict[str, dict[str, str]]]:
    # -> the table, and what its codes are called, column by column
    pyreadstat = library(name, "pyreadstat")
    read = getattr(pyreadstat, _PYREADSTAT[suffix])
    text = {} if encoding is None else {"encoding": encoding}
    if suffix == ".xpt" and len(data) % 80:
        raise RatingsError(
            f"{name}: is damaged, or no .xpt file (needed lines of 80 bytes)"
        )
    with tempfile.TemporaryDirectory() as folder:  # it reads no bytes, but files
        file = Path(folder) / f"data{suffix}"
        file.write_bytes(data)
        frame, about = _read(
            name,
            suffix,
            lambda: read(str(file), **text),
            pyreadstat.ReadstatError,
            pyreadstat.PyreadstatError,
        )
    labels = {
        str(column): {value_text(code): str(label) for code, label in codes.items()}
        for column, codes in about.variable_value_labels.items()
    }
    return frame, labels


def _records(name: str, frame: pd.DataFrame) -> pd.DataFrame:
    # cells as text, the names of the columns as the first row
    header = np.array([list(map(str, frame.columns))], dtype=object)
    return pd.DataFrame(np.vstack([header, _cell_texts(name, frame)]), dtype=object)


def _cell_texts(name: str, frame: pd.DataFrame) -> NDArray[np.object_]:
    # -> (n_rows, n_columns)
    texts = np.empty(frame.shape, dtype=object)
    for place in range(frame.shape[1]):
        column = frame.iloc[:, place]
        where = f"{name}: column {str(frame.columns[place])!r}"
        texts[:, place] = _texts(where, column)
    return texts


def _texts(where: str, column: "pd.Series[Any]") -> NDArray[np.object_]:
    # (n_rows,) of anything -> (n_rows,) of text, empty where a value is missing
    if column.dtype == object:
        kinds = set(map(type, column))
        nested = {list, dict, set, np.ndarray} & kinds
        if nested:
            raise RatingsError(
                f"{where}: needed text or numbers, got a {nested.pop().__name__}"
            )
        if {bool, np.bool_} & kinds and len(kinds) > 1:
            # True equals 1 in Python, and is another grade
            is_missing = column.isna().to_numpy()
            cells = [
                "" if m else value_text(v)
                for m, v in zip(is_missing, column, strict=True)
            ]
            return np.array(cells, dtype=object)
    # every value that occurs is written once
    codes, values = pd.factorize(column, use_na_sentinel=True)
    # numpy's floats know their precision
    each: Any = values.to_numpy() if values.dtype.kind == "f" else values
    texts = np.array([*map(value_text, each), ""], dtype=object)
    column_texts: NDArray[np.object_] = texts[codes]  # -1, a missing value, is the last
    return column_texts

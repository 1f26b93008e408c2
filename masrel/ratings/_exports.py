"""Files of other programs as sheets: workbooks, Parquet, JSON, SPSS, annotation tools.

An annotation tool has a function from its records to `_Ratings`: who gave which item
which category. Only categories of whole documents are read; several of them at once,
spans and relations are refused.
"""

import csv
import io
import json
import re
import tempfile
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from masrel.errors import ParameterError, RatingsError
from masrel.ratings._findings import ReadingOptions, library, refusal
from masrel.ratings._sheet import MAX_UNPACKED, Column, Sheet, value_text

_WORKBOOKS = (".xlsx", ".xlsm", ".xls", ".ods")
_ARROW = {".parquet": "pyarrow.parquet", ".feather": "pyarrow.feather"}
_PYREADSTAT = {
    ".sav": "read_sav",
    ".zsav": "read_sav",
    ".por": "read_por",
    ".dta": "read_dta",
    ".sas7bdat": "read_sas7bdat",
    ".xpt": "read_xport",
}

_MAX_WORKBOOK = MAX_UNPACKED // 4  # bytes of XML: its cells take several times the room
_OLD_WORKBOOK = b"\xd0\xcf\x11\xe0"  # how an .xls begins, in which archives may lie
# a cell of type error: its formula, if any, and its value
_ERROR_CELL = re.compile(
    rb'<c\s[^>]*?\bt="e"[^>]*>(?:<f[^>]*?(?:/>|>[^<]*</f>))?<v>([^<]*)</v>'
)
# what readers of other formats raise for bytes that are not theirs
_ANY: tuple[type[Exception], ...] = (
    *(ValueError, TypeError, KeyError, OSError, RuntimeError, EOFError),
    *(zipfile.BadZipFile, zlib.error),
)
_EXPORTED = (".json", ".jsonl", ".csv")
_SOLID = re.compile(r"[^ \t\n\r]")
_ENCODED = (".sav", ".zsav", ".dta", ".sas7bdat", ".xpt")  # pyreadstat takes theirs


# ---- files whose cells have types ----


def read_typed(
    name: str,
    sha256: Callable[[], str],
    suffix: str,
    data: bytes,
    options: ReadingOptions,
) -> Sheet:
    """Read a file whose cells have types, or the export of an annotation tool."""
    facts: dict[str, Any] = {"format": suffix.removeprefix(".")}
    if options.encoding is not None and suffix not in _ENCODED:
        raise ParameterError(
            f"--encoding: needed a file of text, got {facts['format']}, whose is known"
        )
    if options.sheet is not None and suffix not in _WORKBOOKS:
        raise ParameterError(f"--sheet: needed a workbook, got {facts['format']}")
    n_above, dropped = 0, dict[str, int]()
    if options.source is not None:
        records = _records(name, suffix, data)
        frame, facts, dropped = _export(name, options.source, records, options.grade)
    elif suffix in _WORKBOOKS:
        frame, n_above = _workbook(name, suffix, data, options.sheet, facts)
    elif suffix in _ARROW:
        arrow = library(name, _ARROW[suffix])
        read = partial(arrow.read_table, io.BytesIO(data))
        frame = read_foreign(name, suffix, lambda: table_frame(read()))
    elif suffix in _PYREADSTAT:
        frame = _statistical(name, suffix, data, options.encoding, facts)
    else:
        frame = _objects(name, _json_values(name, suffix, data))
    return replace(sheet_of(name, sha256, frame, facts, n_above), dropped=dropped)


def sheet_of(
    name: str,
    sha256: Callable[[], str],
    frame: pd.DataFrame,
    facts: dict[str, Any],
    n_above: int = 0,
) -> Sheet:
    """Return the cells of a frame as texts; n_above: rows above the names."""
    names = [str(column) for column in frame.columns]
    return Sheet(
        name=name,
        sha256=sha256,
        header=tuple(names),
        columns=tuple(
            column_of(name, title, frame.iloc[:, place])
            for place, title in enumerate(names)
        ),
        facts=facts,
        unit="row",
        line_of=lambda number: n_above + number + 1,
    )


def column_of(name: str, title: str, values: "pd.Series[Any]") -> Column:
    """Return the cells of a column as texts, empty where a value is missing."""
    kinds = set(map(type, values)) if values.dtype == object else set()
    if nested := {list, dict, set, np.ndarray} & kinds:
        where, kind = f"column {title!r}: ", nested.pop().__name__
        raise refusal(name, "nested cell", where=where, kind=kind)
    if {bool, np.bool_} & kinds:  # True equals 1 in Python, and is another grade
        values = values.map(value_text, na_action="ignore")
    codes, known = pd.factorize(values, use_na_sentinel=True)
    # numpy's floats know their precision
    each: Any = known.to_numpy() if known.dtype.kind == "f" else known
    texts = [*map(value_text, each), ""]  # missing values are the last
    return Column.of(np.where(codes < 0, len(each), codes), texts).rows(slice(None))


def read_foreign(
    name: str, suffix: str, read: Callable[[], Any], *errors: type[Exception]
) -> Any:
    """Read by a library that raises what it likes for bytes of other formats."""
    try:
        return read()
    except _ANY + errors as error:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        line = lines[0][:200].rstrip(". ")
        raise refusal(name, "damaged", suffix=suffix, error=line) from error


def _unzipped(
    name: str,
    suffix: str,
    data: bytes,
    most: int,
    do: str,
    chosen: re.Pattern[str],
) -> dict[str, bytes]:
    # the files of an archive that are chosen, if all is not more than fits the memory
    def read() -> dict[str, bytes] | None:
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            if sum(member.file_size for member in packed.infolist()) > most:
                return None
            return {
                file: packed.read(file)
                for file in packed.namelist()
                if chosen.fullmatch(file)
            }

    files = read_foreign(name, suffix, read)
    if files is None:
        raise refusal(name, "unpacked", most=most, it="", do=do)
    return dict(files)


def _workbook(
    name: str, suffix: str, data: bytes, chosen: str | None, facts: dict[str, Any]
) -> tuple[pd.DataFrame, int]:
    # -> the cells below their names, and how many blank rows are above
    calamine = library(name, "python_calamine")
    if zipfile.is_zipfile(io.BytesIO(data)) and not data.startswith(_OLD_WORKBOOK):
        do = "save its sheet as CSV, since a large table of text is read piece by piece"
        sheets = re.compile(r"xl/worksheets/.*\.xml")  # not of .ods
        files = _unzipped(name, suffix, data, _MAX_WORKBOOK, do, sheets)
        # errors of formulas, such as #N/A, which calamine gives as empty cells
        errors = Counter(e for xml in files.values() for e in _ERROR_CELL.findall(xml))
        if errors:
            facts["errors"] = {
                e.decode("utf-8", "replace"): n for e, n in errors.items()
            }

    def stored() -> dict[str, Any]:
        book = calamine.CalamineWorkbook.from_filelike(io.BytesIO(data))
        names = list(map(str, book.sheet_names))
        meant = [n for n in names if chosen in (None, n)]
        return dict.fromkeys(names) | {n: book.get_sheet_by_name(n) for n in meant}

    sheets_of = read_foreign(name, suffix, stored, calamine.CalamineError)
    if chosen is not None and chosen not in sheets_of:
        raise refusal(name, "no sheet", sheet=chosen, sheets=", ".join(sheets_of))
    meant = {n: cells for n, cells in sheets_of.items() if cells is not None}
    filled = {n: cells for n, cells in meant.items() if cells.start is not None}
    if len(filled) > 1:
        raise refusal(name, "sheets", sheets=", ".join(filled))
    if not filled:
        raise refusal(name, "no cells", sheet=", ".join(meant))
    ((facts["sheet"], cells),) = filled.items()
    frame = pd.DataFrame(cells.to_python(skip_empty_area=True), dtype=object)
    # a column without name and cells is a space between others
    frame = frame.loc[:, (frame != "").any(axis=0)]
    return frame[1:].set_axis([*map(value_text, frame.iloc[0])], axis=1), cells.start[0]


def table_frame(table: Any) -> pd.DataFrame:
    """Return a table of Arrow as a frame, the names of rows that pandas keeps first."""
    # whole numbers beside missing ones stay whole, however many digits they have
    frame: pd.DataFrame = table.to_pandas(integer_object_nulls=True)
    if isinstance(frame.index, pd.RangeIndex) and frame.index.name is None:
        return frame
    names = [str(name or "") for name in frame.index.names]
    return frame.reset_index(names=names, allow_duplicates=True)


def _statistical(
    name: str, suffix: str, data: bytes, encoding: str | None, facts: dict[str, Any]
) -> pd.DataFrame:
    # with what its codes are called, column by column, as a fact
    pyreadstat = library(name, "pyreadstat")
    text = {} if encoding is None else {"encoding": encoding}
    if suffix == ".xpt" and len(data) % 80:
        raise refusal(name, "xpt")
    with tempfile.TemporaryDirectory() as folder:  # it reads no bytes, but files
        file = Path(folder) / f"data{suffix}"
        file.write_bytes(data)
        frame, about = read_foreign(
            name,
            suffix,
            lambda: getattr(pyreadstat, _PYREADSTAT[suffix])(str(file), **text),
            pyreadstat.ReadstatError,
            pyreadstat.PyreadstatError,
        )
    labels = {
        str(column): {value_text(code): str(label) for code, label in codes.items()}
        for column, codes in about.variable_value_labels.items()
    }
    if labels:
        facts["labels"] = labels
    return pd.DataFrame(frame)


# ---- JSON ----


def _json_values(name: str, suffix: str, data: bytes) -> list[Any]:
    # values of JSON, of JSON lines whatever the name ends with, or rows of a CSV file
    try:
        text = data.decode("utf-8-sig").rstrip()
        if suffix == ".csv":
            return list(csv.DictReader(io.StringIO(text, newline="")))
    except UnicodeDecodeError as error:
        raise refusal(name, "no utf-8", error=error) from error
    except csv.Error as error:
        raise refusal(name, "no table", error=error) from error
    values, place = [], 0
    parse = json.JSONDecoder(object_pairs_hook=partial(_object, name)).raw_decode
    try:
        while begun := _SOLID.search(text, place):
            value, place = parse(text, begun.start())
            values.append(value)
    except json.JSONDecodeError as error:
        raise refusal(name, "no JSON", line=error.lineno, error=error.msg) from error
    return values[0] if len(values) == 1 and isinstance(values[0], list) else values


def _object(name: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) < len(pairs):  # the json module would keep the last in silence
        keys = Counter(key for key, _ in pairs)
        raise refusal(name, "same key", key=keys.most_common(1)[0][0])
    return value


def _objects(name: str, values: list[Any]) -> pd.DataFrame:
    # a list of objects, one a row; or one object of columns, as pandas and R write
    if len(values) == 1 and isinstance(values[0], dict):
        columns = list(values[0].values())
        if all(isinstance(c, dict) and c.keys() == columns[0].keys() for c in columns):
            return pd.DataFrame(values[0], dtype=object).reset_index(drop=True)
        if all(isinstance(c, list) and len(c) == len(columns[0]) for c in columns):
            return pd.DataFrame(values[0], dtype=object)
    if not values or not all(isinstance(value, dict) for value in values):
        raise refusal(name, "no objects")
    for number, value in enumerate(values, start=1):
        for key, cell in value.items():
            if isinstance(cell, dict | list):
                raise refusal(name, "nested", number=number, key=key)
    return pd.DataFrame(values, dtype=object)


# ---- annotation tools ----

_Records = list[tuple[str, dict[str, Any]]]  # name of the file, or "", and a record


def _records(name: str, suffix: str, data: bytes) -> list[tuple[str, Any]]:
    # the values of an export, each with the name of its file in an archive
    if not data.startswith(b"PK\3\4"):  # a pipe has no name that says .zip
        return [("", value) for value in _json_values(name, suffix, data)]
    do = "unpack it and leave files out"
    # a Mac adds a folder to every archive
    chosen = re.compile(r"(?!__MACOSX/).*\.(jsonl?|csv)", re.IGNORECASE)
    files = _unzipped(name, ".zip", data, MAX_UNPACKED, do, chosen)
    if not files:
        raise refusal(name, "no export", suffixes=", ".join(_EXPORTED))
    return [
        (Path(file).stem, value)
        for file, content in files.items()
        for value in _json_values(f"{name}: {file}", Path(file).suffix.lower(), content)
    ]


@dataclass(slots=True)
class _Ratings:
    """What is collected from the records of an export."""

    name: str  # of the file, for messages
    chosen: str | None  # the field that the caller takes for the grade
    rows: list[tuple[Any, Any, Any, Any]] = field(default_factory=list)
    dropped: Counter[str] = field(default_factory=Counter)

    def error(self, message: str) -> RatingsError:
        return RatingsError(f"{self.name}: {message}")

    def add(self, item: Any, rater: Any, grade: Any, text: Any) -> None:
        where = f"annotation {len(self.rows) + 1}" if item is None else f"item {item}"
        for role, value in (("item", item), ("annotator", rater)):
            if value is None or value == "":
                raise self.error(f"{where}: needed its {role}, got none")
        labels = grade if isinstance(grade, list) else [grade]
        if any(isinstance(label, dict | list) for label in labels):
            raise self.error(
                f"{where}: needed a category of the whole, got {str(grade)[:60]}; "
                "spans, regions and relations are not read"
            )
        if len(labels) > 1:
            raise self.error(
                f"{where}: needed one category of each annotator, {rater} gave "
                f"{len(labels)}: {', '.join(map(str, labels))[:60]}; annotations with "
                "several labels are not read"
            )
        grade = labels[0] if labels else None
        self.rows.append((item, rater, grade, text))

    def choose(self, fields: Iterable[str], what: str) -> str:
        """Return the field that is the grade: the one there is, or that is named."""
        names = list(dict.fromkeys(fields))
        listed = ", ".join(names) or "none"
        if self.chosen is None and len(names) == 1:
            return names[0]
        if self.chosen is None and not names:
            raise self.error(
                f"needed {what}, got none; spans, regions and relations are not read"
            )
        if self.chosen is None:
            raise self.error(f"needs --grade with one of its {what}, {listed}")
        if self.chosen not in names:
            raise self.error(
                f"--grade: needed one of its {what}, {listed}, got {self.chosen!r}"
            )
        return self.chosen


def _export(
    name: str, source: str, records: list[tuple[str, Any]], grade: str | None
) -> tuple[pd.DataFrame, dict[str, Any], dict[str, int]]:
    # columns item, rater, the grade, and text where it has any; its facts, and why
    # annotations are left out
    if source not in _TOOLS:
        raise ParameterError(f"--from: needed {', '.join(_TOOLS)}, got {source!r}")
    ratings = _Ratings(name, grade)
    if not records or not all(isinstance(value, dict) for _, value in records):
        raise ratings.error(f"needed the records of {source}, got no list of objects")
    try:
        of = _TOOLS[source](ratings, records)
    except (TypeError, AttributeError, KeyError, StopIteration) as error:
        raise ratings.error(
            f"is no export of {source}, or damaged: a record after "
            f"{len(ratings.rows)} annotations has another shape ({error})"
        ) from error
    if not ratings.rows:
        raise ratings.error(f"needed ratings of {of}, got none")
    if grade in ("item", "rater"):
        raise ratings.error(f"--grade: a field cannot be called {grade!r} here")
    names = ["item", "rater", grade or "grade", "text"]
    frame = pd.DataFrame(ratings.rows, columns=names, dtype=object)
    if frame.iloc[:, 3].isna().all() or grade == "text":
        frame = frame.iloc[:, :3]
    return frame, {"format": f"{source} export", "field": of}, dict(ratings.dropped)


# Label Studio's results that are categories of a whole task, and the key of the value.
_CATEGORIES = {
    "choices": "choices",
    "rating": "rating",
    "number": "number",
    "taxonomy": "taxonomy",
    "pairwise": "selected",
}
# What its JSON-MIN has beside the task's data and the results.
_ABOUT = ("id", "annotator", "annotation_id", "created_at", "updated_at", "lead_time")


def _label_studio(ratings: _Ratings, records: _Records) -> str:
    if all("annotator" in task and "annotations" not in task for _, task in records):
        return _label_studio_min(ratings, records)
    annotations = [  # task, annotation
        (task, annotation)
        for _, task in records
        for annotation in task.get("annotations") or task.get("completions") or ()
        if isinstance(annotation, dict)
    ]
    if not annotations:
        raise ratings.error("needed tasks with annotations: the JSON export, got none")
    of = ratings.choose(
        (field for _, annotation in annotations for field in _categories(annotation)),
        "fields of categories",
    )
    for task, annotation in annotations:
        if annotation.get("was_cancelled") or annotation.get("skipped"):
            ratings.dropped["skipped"] += 1
            continue
        who = annotation.get("completed_by")
        if isinstance(who, dict):
            who = who.get("email") or who.get("id")
        grades = _categories(annotation).get(of)
        ratings.add(task.get("id"), who, grades, _text_of(task.get("data")))
    return of


def _categories(annotation: dict[str, Any]) -> dict[str, list[Any]]:
    # of the whole task by field; beside those of a region stands its place
    grades: dict[str, list[Any]] = {}
    for result in annotation.get("result") or ():
        value, key = result.get("value"), _CATEGORIES.get(str(result.get("type")))
        if isinstance(value, dict) and key is not None and set(value) == {key}:
            of = grades.setdefault(str(result.get("from_name")), [])
            of += _grades_of(key, value[key])
    return grades


def _grades_of(key: str, value: Any) -> list[Any]:
    if key == "taxonomy":  # paths from the root
        return ["/".join(map(str, p)) if isinstance(p, list) else p for p in value]
    return value if isinstance(value, list) else [value]


def _text_of(data: object) -> Any:
    # what was annotated, where there is no doubt which of the data that is
    if not isinstance(data, dict):
        return None
    text = data.get("text", next(iter(data.values())) if len(data) == 1 else None)
    return None if isinstance(text, dict | list) else text


def _label_studio_min(ratings: _Ratings, records: _Records) -> str:
    # one object an annotation, its data and its results side by side
    fields = (key for _, task in records for key in task if key not in _ABOUT)
    of = ratings.choose(fields, "fields")
    for _, task in records:
        grade = task.get(of)
        if isinstance(grade, list) and len(grade) == 1:
            grade = grade[0]
        for key in _CATEGORIES.values():
            if isinstance(grade, dict) and set(grade) == {key}:
                grade = _grades_of(key, grade[key])
        ratings.add(task.get("id"), task.get("annotator"), grade, task.get("text"))
    return of


def _doccano(ratings: _Ratings, records: _Records) -> str:
    of = ratings.choose(
        (
            key
            for _, example in records
            for key in ("label", "labels", "cats", "annotations")
            if key in example
        ),
        "labels of whole examples",
    )
    for who, example in records:
        grades: dict[Any, list[Any]] = {}
        labels = example.get(of)
        if of == "annotations":  # old exports: labels and users by their numbers
            for label in labels or ():
                grade = label if "start_offset" in label else label.get("label")
                grades.setdefault(label.get("user"), []).append(grade)
        else:
            rater = example.get("username", example.get("user", who or None))
            if rater is None:
                raise ratings.error(
                    "needed to know who gave the labels, got one file without it: "
                    "doccano writes one for each annotator, in a zip, unless a "
                    "project's annotations are shared"
                )
            grades[rater] = labels if isinstance(labels, list) else [labels]
        for rater, labels in grades.items():
            text = example.get("text", example.get("filename"))
            ratings.add(example.get("id"), rater, labels, text)
    return of


def _prodigy(ratings: _Ratings, records: _Records) -> str:
    is_choice = any("accept" in task for _, task in records)
    labels = dict.fromkeys(
        str(task["label"])
        for _, task in records
        if not is_choice and task.get("label") is not None
    )
    # an answer is to a label: several labels are several questions
    fields = ["accept"] if is_choice else labels or ["answer"]
    of = ratings.choose(fields, "labels" if labels else "fields")
    for who, task in records:
        answer = task.get("answer")
        if answer == "ignore" or (is_choice and answer != "accept"):
            ratings.dropped[f"answered {answer or 'nothing'}"] += 1
            continue
        if labels and task.get("label") != of:
            ratings.dropped["of other labels"] += 1
            continue
        regions = task.get("spans") or task.get("relations")
        grade = task.get("accept", []) if is_choice else answer
        if regions and not is_choice and not labels:
            grade = regions[0]
        rater = task.get("_annotator_id") or task.get("_session_id") or who
        ratings.add(task.get("_input_hash"), rater, grade, task.get("text"))
    return of


def _inception(ratings: _Ratings, records: _Records) -> str:
    columns = {key for _, row in records for key in row}
    if not {"doc", "user"} <= columns:
        raise ratings.error(
            "needed doc, user and label: the CSV or JSON export of the agreement page, "
            f"got {', '.join(sorted(map(str, columns)))[:60]}"
        )
    if columns - {"doc", "user", "label"}:
        raise ratings.error(
            "needed labels of documents, got those of a layer of spans, relations or "
            f"chains ({', '.join(sorted(map(str, columns - {'doc', 'user'})))})"
        )
    of = ratings.choose(["label"] if "label" in columns else [], "labels of a feature")
    grades: dict[tuple[Any, Any], list[Any]] = {}
    for _, row in records:
        document, rater = row.get("doc"), row.get("user")
        if rater in ("CURATION_USER", "INITIAL_CAS"):
            ratings.dropped["of the curator or the source"] += 1
        else:
            grades.setdefault((document, rater), []).append(row.get("label"))
    for (document, rater), labels in grades.items():
        ratings.add(document, rater, labels, None)
    return of


_TOOLS: dict[str, Callable[[_Ratings, _Records], str]] = {
    "label-studio": _label_studio,
    "doccano": _doccano,
    "prodigy": _prodigy,
    "inception": _inception,
}

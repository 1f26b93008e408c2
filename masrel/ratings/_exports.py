"""Files of other programs as sheets: workbooks, Parquet, JSON, SPSS, annotation tools.

An annotation tool has a function from a record to its `_Annotation`s: who gave which
item which category. Only categories of whole documents are read; several of them at
once, spans and relations are refused.
"""

import csv
import io
import json
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, compress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from masrel._input import USUAL_NAMES, refuse, shown
from masrel.agreement._labels import is_row
from masrel.errors import ParameterError, RatingsError
from masrel.ratings._findings import (
    Finding,
    Reading,
    few,
    library,
    listed,
    refusal,
)
from masrel.ratings._layout import ITEM_NAME
from masrel.ratings._sheet import (
    MAX_UNPACKED,
    SNIFFED,
    WORKBOOKS,
    Column,
    Row,
    Sheet,
    joined_names,
    names_option,
    notes_below,
    read_foreign,
    unzipped,
    value_text,
)

_TABLE = "the data"  # what a table in memory is called

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
_ZIP = b"PK\3\4"  # how an archive begins
# a cell of type error: its formula, if any, and its value
_ERROR_CELL = re.compile(
    rb'<c\s[^>]*?\bt="e"[^>]*>(?:<f[^>]*?(?:/>|>[^<]*</f>))?<v>([^<]*)</v>'
)
# Keys of an item in JSON: what was given to it, and what it is called.
_GIVEN = ("annotations", "ratings")
_ID = ("id", *USUAL_NAMES["item"])
_USUAL = frozenset(chain(*USUAL_NAMES.values()))
_SOLID = re.compile(r"[^ \t\n\r]")
_ENCODED = (".sav", ".zsav", ".dta", ".sas7bdat", ".xpt")  # pyreadstat takes theirs


# ---- tables in memory ----


def read_table(data: Any, options: Reading) -> tuple[Sheet, Reading]:
    """Return the cells of a table in memory, and how they are read."""
    facts = {"format": type(data).__name__}
    of_text = ("delimiter", "encoding", "skip", "header")
    of_files = (*of_text, "sheet", "source", "stream")
    refuse(
        *(
            (getattr(options, name), f"--{name}: is of files, got a {facts['format']}")
            for name in of_files
        )
    )
    is_array = isinstance(data, list | tuple | np.ndarray)
    frame = _rows(data) if is_array else _named(data)
    if not isinstance(frame.columns, pd.RangeIndex):
        # rows count from 1, and their names are 0
        return sheet_of(_TABLE, str, frame, facts, -1), options
    # columns that nobody named
    cells = [column_of(_TABLE, str(k), frame.iloc[:1, k]) for k in frame.columns]
    first = ["".join(column.texts) for column in cells]
    has_items = bool(options.item or options.rater or options.grade)
    no_item = options.no_item or (is_array and not has_items)
    options = replace(options, no_header=True, no_item=no_item)
    return sheet_of(_TABLE, str, frame[1:].set_axis(first, axis=1), facts), options


def _rows(data: Any) -> pd.DataFrame:
    # of an array, or of sequences
    is_table = getattr(data, "ndim", 2) == 2 and all(map(is_row, data))
    if not is_table or len(set(map(len, data))) != 1:
        raise _no_table(data)
    return pd.DataFrame(data)


def _named(data: Any) -> pd.DataFrame:
    # names of rows that are more than numbers are the first columns
    if isinstance(data, Mapping):
        try:
            frame = pd.DataFrame(data)
        except (ValueError, TypeError) as error:
            raise _no_table(data, error) from error
    elif isinstance(data, pd.DataFrame):
        frame = data
    else:
        return table_frame(_arrow(data))
    if frame.index.names == [None] and frame.index.dtype.kind in "iu":
        return frame.reset_index(drop=True)
    names = ["" if name is None else str(name) for name in frame.index.names]
    return frame.reset_index(names=names, allow_duplicates=True)


def _arrow(data: Any) -> Any:
    # a frame of another library as a table of Arrow
    import narwhals

    try:
        frame = narwhals.from_native(data)
    except (TypeError, ValueError) as error:
        raise _no_table(data, error) from error
    arrow = library(_TABLE, "pyarrow")
    try:
        kinds = frame.collect_schema()
        if isinstance(frame, narwhals.LazyFrame):
            frame = frame.collect()
    except ValueError as error:  # names that are there twice
        raise _no_table(data, error) from error
    for name, kind in kinds.items():
        if isinstance(kind, narwhals.Object):  # of which Arrow has the address alone
            raise refusal(_TABLE, "nested cell", column=name, number=1, kind="object")
    table = frame.to_arrow()
    # codes without a sign, which older versions of pyarrow give to no frame
    coded = {
        field.name: arrow.dictionary(
            arrow.int32(),
            field.type.value_type,
            field.type.ordered or isinstance(kinds[field.name], narwhals.Enum),
        )
        for field in table.schema
        if arrow.types.is_dictionary(field.type)
    }
    fields = [
        field.with_type(coded.get(field.name, field.type)) for field in table.schema
    ]
    return table.cast(arrow.schema(fields))


def _no_table(data: Any, error: Exception | None = None) -> RatingsError:
    why = " ".join(str(error).split()) if isinstance(error, ValueError) else shown(data)
    return refusal(_TABLE, "no table", got=f"{type(data).__name__}: {why}")


# ---- files whose cells have types ----


def read_typed(
    name: str,
    sha256: Callable[[], str],
    suffix: str,
    data: bytes,
    options: Reading,
) -> Sheet:
    """Read a file whose cells have types, or the export of an annotation tool."""
    facts: dict[str, Any] = {"format": suffix.removeprefix(".")}
    if options.encoding is not None and suffix not in _ENCODED:
        raise ParameterError(
            f"--encoding: needed a file of text, got {facts['format']}, whose is known"
        )
    dropped = dict[str, int]()
    if options.source is not None:
        records = _records(name, suffix, data)
        frame, facts, dropped = _export(name, options.source, records, options.grade)
    elif suffix in WORKBOOKS:
        rows, n_above = _workbook(name, suffix, data, options.sheet, facts)
        return _sheet_of_rows(name, sha256, rows, n_above, facts, options)
    elif suffix in _ARROW:
        arrow = library(name, _ARROW[suffix])
        read = partial(arrow.read_table, io.BytesIO(data))
        frame = read_foreign(name, suffix, lambda: table_frame(read()))
    elif suffix in _PYREADSTAT:
        frame = _statistical(name, suffix, data, options.encoding, facts)
    else:
        frame = _objects(name, _json_values(name, suffix, data), options)
    return replace(sheet_of(name, sha256, frame, facts), dropped=dropped)


def sheet_of(
    name: str,
    sha256: Callable[[], str],
    frame: pd.DataFrame,
    facts: dict[str, Any],
    n_above: int = 0,
) -> Sheet:
    """Return the cells of a frame as texts; n_above: rows above the names."""
    names = [
        " ".join(map(str, name)).strip() if isinstance(name, tuple) else str(name)
        for name in frame.columns
    ]
    orders = {
        name: [*map(value_text, dtype.categories)]
        for name, dtype in zip(names, frame.dtypes, strict=True)
        if getattr(dtype, "ordered", False)
    }
    return Sheet(
        name=name,
        sha256=sha256,
        header=tuple(names),
        columns=tuple(
            column_of(name, title, frame.iloc[:, place])
            for place, title in enumerate(names)
        ),
        facts={**facts, "orders": orders} if orders else facts,
        unit="row",
        line_of=lambda number: n_above + number + 1,
    )


def column_of(name: str, title: str, values: "pd.Series[Any]") -> Column:
    """Return the cells of a column as texts, empty where a value is missing."""
    kinds = list(map(type, values)) if values.dtype == object else []
    for number, kind in enumerate(kinds, start=1):
        if kind in (list, dict, set, np.ndarray):
            facts = {"column": title, "number": number, "kind": kind.__name__}
            raise refusal(name, "nested cell", **facts)
    if {bool, np.bool_} & set(kinds):  # True equals 1 in Python, and is another grade
        values = values.map(value_text, na_action="ignore")
    codes, known = pd.factorize(values, use_na_sentinel=True)
    # numpy's floats know their precision
    each: Any = known.to_numpy() if known.dtype.kind == "f" else known
    texts = [*map(value_text, each), ""]  # missing values are the last
    return Column.of(np.where(codes < 0, len(each), codes), texts).rows(slice(None))


def _workbook(
    name: str, suffix: str, data: bytes, chosen: str | None, facts: dict[str, Any]
) -> tuple[list[list[Any]], int]:
    # -> the rows of a sheet, and how many blank ones are above
    calamine = library(name, "python_calamine")
    if data.startswith(_ZIP):  # not an .xls
        do = "save its sheet as CSV, since a large table of text is read piece by piece"
        sheets = r"xl/worksheets/.*\.xml"  # not of .ods
        files = unzipped(name, suffix, data, _MAX_WORKBOOK, do, sheets)
        # errors of formulas, such as #N/A, which calamine gives as empty cells
        errors = Counter(e for xml in files.values() for e in _ERROR_CELL.findall(xml))
        if errors:
            facts["errors"] = {
                e.decode("utf-8", "replace"): n for e, n in errors.items()
            }

    open_book = partial(calamine.CalamineWorkbook.from_filelike, io.BytesIO(data))
    book = read_foreign(name, suffix, open_book, calamine.CalamineError)
    if chosen is not None and chosen not in book.sheet_names:
        known = ", ".join(book.sheet_names)
        raise refusal(name, "no sheet", sheet=chosen, sheets=known)
    filled = {}
    for title in book.sheet_names if chosen is None else [chosen]:
        read = partial(book.get_sheet_by_name, title)
        cells = read_foreign(name, suffix, read, calamine.CalamineError)
        if cells.start is not None:
            filled[title] = cells
    if len(filled) > 1:
        raise refusal(name, "sheets", sheets=", ".join(filled))
    if not filled:
        raise refusal(name, "no cells", sheet=chosen or ", ".join(book.sheet_names))
    ((facts["sheet"], cells),) = filled.items()
    return cells.to_python(skip_empty_area=True), cells.start[0]


def _sheet_of_rows(
    name: str,
    sha256: Callable[[], str],
    rows: list[list[Any]],
    n_above: int,
    facts: dict[str, Any],
    options: Reading,
) -> Sheet:
    # the table in rows of a workbook, which are below n_above that are empty
    *upper, last = (line - 1 - n_above for line in options.names_at or [n_above + 1])
    n_back, note = notes_below([_texts(row) for row in rows[-SNIFFED:]])
    rows = rows[: len(rows) - n_back]
    below = (k for k in range(max(last, 0), len(rows)) if any(_texts(rows[k])))
    if (first := next(below, None)) is None:
        raise refusal(name, "no line", unit="row", n=options.names_at[-1])
    # a column without name and cells is a space between others
    frame = pd.DataFrame(rows[first:], dtype=object)
    is_used = (frame != "").any(axis=0).to_numpy()
    lines = [_texts(rows[k]) if k >= 0 else [] for k in (*upper, first)]
    names = [*compress(joined_names(lines), is_used)]
    head = [
        Row(k, k, [*compress(_texts(row), is_used)])
        for k, row in enumerate(rows[first : first + SNIFFED], n_above + first + 1)
    ]
    findings = []
    if note:
        where = f"row {n_above + len(rows) + 1}"
        findings.append(Finding("note below", where=where, got=note[:60]))
    if errors := facts.get("errors"):
        shown = ", ".join(f"{text} ×{n}" for text, n in errors.items())
        findings.append(Finding("errors", errors=shown))
    frame = frame.loc[:, is_used][1:].set_axis(names, axis=1)
    return replace(
        sheet_of(name, sha256, frame, facts, n_above + first),
        advice=names_option(name, "row", head, 0, options),
        findings=tuple(findings),
    )


def _texts(row: Sequence[Any]) -> list[str]:
    return [value_text(cell).strip() for cell in row]


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
    def read() -> list[Any]:
        text, place = data.decode("utf-8-sig").rstrip(), 0
        if suffix == ".csv":
            return list(csv.DictReader(io.StringIO(text, newline="")))
        values = []
        while begun := _SOLID.search(text, place):
            value, place = parse(text, begun.start())
            values.append(value)
        return values

    parse = json.JSONDecoder(object_pairs_hook=_object).raw_decode
    values: list[Any] = read_foreign(name, suffix, read, csv.Error)
    return values[0] if len(values) == 1 and isinstance(values[0], list) else values


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) < len(pairs):  # the json module would keep the last in silence
        key = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"an object has the key {key!r} twice")
    return value


def _objects(name: str, values: list[Any], options: Reading) -> pd.DataFrame:
    # a list of objects, one a row; one object of columns, as pandas and R write; or
    # names of raters and items in each other
    if not values or not all(isinstance(value, dict) for value in values):
        raise refusal(name, "no objects")
    only, kinds = values[0], set(map(type, values[0].values()))
    if len(values) == 1 and kinds in ({dict}, {list}):
        if _are_columns(only):
            return pd.DataFrame(only, dtype=object).reset_index(drop=True)
        if kinds == {dict} and any(key in of for of in only.values() for key in _GIVEN):
            values = [{**record, "id": key} for key, record in only.items()]
        elif kinds == {dict} and _USUAL & {*map(str.casefold, chain(*only.values()))}:
            values = [*only.values()]  # rows by their number, as pandas writes, too
        elif kinds == {dict}:
            return _two_levels(name, [*only.items()], options, are_items=False)
    nested = _annotated(name, values, options)
    return pd.DataFrame(values, dtype=object) if nested is None else nested


def _are_columns(columns: dict[str, Any]) -> bool:
    # as long as each other; those of numbered rows have one for their items, too
    (n_rows, *others), rows = map(len, columns.values()), next(iter(columns.values()))
    is_numbered = [*rows] == [*map(str, range(n_rows))]
    return set(others) <= {n_rows} and (
        isinstance(rows, list)
        or any(column.casefold() in _USUAL for column in columns)
        or (is_numbered and any(map(ITEM_NAME.fullmatch, columns)))
    )


def _annotated(
    name: str, values: list[dict[str, Any]], options: Reading
) -> pd.DataFrame | None:
    # objects of items, each with its annotations: by rater, in two lists, or objects
    levels: list[tuple[Any, dict[str, Any]]] = []
    rows: list[dict[str, Any]] = []
    for number, record in enumerate(values, start=1):
        item = next((record[key] for key in _ID if key in record), number)
        of = next((record[key] for key in _GIVEN if key in record), ())
        raters = record.get("annotators", record.get("raters"))
        if isinstance(of, dict):
            levels.append((item, of))
        elif isinstance(of, str | list) and isinstance(raters, str | list):
            both = [x.split(",") if isinstance(x, str) else x for x in (raters, of)]
            if len(both[0]) != len(both[1]):
                raise refusal(name, "lists", item=item, raters=both[0], grades=both[1])
            for who, grade in zip(*both, strict=True):
                rows.append({"item": item, "rater": who, "grade": grade})
        elif isinstance(of, list) and all(isinstance(each, dict) for each in of):
            rows += [{**each, "item": item} for each in of]
    if levels and not rows:
        return _two_levels(name, levels, options, are_items=True)
    frame = pd.DataFrame(rows, dtype=object)
    if (
        levels
        or not rows
        or not (options.rater or {*USUAL_NAMES["rater"]} & {*frame.columns})
    ):
        return None
    is_nested = frame.map(lambda cell: isinstance(cell, dict | list)).any()
    nested = [key for key in frame.columns[is_nested] if key not in _USUAL]
    return frame.drop(columns=nested)


def _two_levels(
    name: str,
    levels: list[tuple[Any, dict[str, Any]]],
    options: Reading,
    *,
    are_items: bool,
) -> pd.DataFrame:
    # a column of items and those of raters, who are the fewer names of two levels
    outer = [key for key, _ in levels]
    inner = [*dict.fromkeys(chain(*(of for _, of in levels)))]
    table: Any = [[of.get(key) for key in inner] for _, of in levels]
    raters, items = inner, outer
    if not are_items and len(outer) <= len(inner):
        raters, items, table = outer, inner, zip(*table, strict=True)
    if len(raters) >= len(items) and not (options.raters or options.transpose):
        names, others = few([*map(str, raters)]), listed([*map(str, items)], 5)
        raise refusal(name, "levels", raters=names, others=others)
    rows = [[item, *row] for item, row in zip(items, table, strict=True)]
    return pd.DataFrame(rows, columns=["item", *raters], dtype=object)


# ---- annotation tools ----


class _Annotation(NamedTuple):
    """What an annotator gave an item."""

    item: Any
    rater: Any
    grades: dict[str, Any]  # by field; several in a list
    text: Any = None  # what was annotated
    why: str = ""  # it is left out


def _records(name: str, suffix: str, data: bytes) -> list[tuple[str, Any]]:
    # the values of an export, each with the name of its file in an archive
    if not data.startswith(_ZIP):  # a pipe has no name that says .zip
        return [("", value) for value in _json_values(name, suffix, data)]
    do = "unpack it and leave files out"
    files = unzipped(name, ".zip", data, MAX_UNPACKED, do, r".*\.(jsonl?|csv)")
    if not files:
        raise refusal(name, "no export")
    return [
        (Path(file).stem, value)
        for file, content in files.items()
        for value in _json_values(f"{name}: {file}", Path(file).suffix.lower(), content)
    ]


def _export(
    name: str, source: str, records: list[tuple[str, Any]], chosen: str | None
) -> tuple[pd.DataFrame, dict[str, Any], dict[str, int]]:
    # columns item, rater, the grade, and text where it has any; its facts, and why
    # annotations are left out
    if source not in _TOOLS:
        raise ParameterError(f"--from: needed {', '.join(_TOOLS)}, got {source!r}")
    try:
        annotations = [
            g for who, record in records for g in _TOOLS[source](who, record)
        ]
    except (TypeError, AttributeError, KeyError) as error:
        raise refusal(name, "shape", source=source, error=error) from error
    fields = list(dict.fromkeys(field for g in annotations for field in g.grades))
    if not fields:
        raise refusal(name, "no fields")
    of = fields[0] if chosen is None else chosen
    if of not in fields or (chosen is None and len(fields) > 1):
        got = "none" if chosen is None else repr(chosen)
        raise refusal(name, "fields", fields=", ".join(fields), got=got)
    if chosen in ("item", "rater"):
        raise refusal(name, "field's name", chosen=chosen)
    rows, dropped = [], Counter[str]()
    for who in annotations:
        # an answer of Prodigy is to one label; others ask for all fields at once
        if who.why or (source == "prodigy" and of not in who.grades):
            dropped[who.why or "of other labels"] += 1
        else:
            rows.append(_row(name, who, of))
    if not rows:
        raise refusal(name, "no rating", field=of)
    frame = pd.DataFrame(
        rows, columns=["item", "rater", chosen or "grade", "text"], dtype=object
    )
    if frame.iloc[:, 3].isna().all() or chosen == "text":
        frame = frame.iloc[:, :3]
    return frame, {"format": f"{source} export", "field": of}, dict(dropped)


def _row(name: str, who: _Annotation, field: str) -> tuple[Any, Any, Any, str | None]:
    # item, rater, the one grade, and the text
    grade = who.grades.get(field)
    labels = grade if isinstance(grade, list) else [grade]
    wrong = {
        "no item": who.item in (None, ""),
        "no annotator": who.rater in (None, ""),
        "spans": any(isinstance(label, dict | list) for label in labels),
        "several labels": len(labels) > 1,
    }
    for code, is_so in wrong.items():
        if is_so:
            got = ", ".join(map(str, labels))[:60]
            raise refusal(name, code, item=who.item, rater=who.rater, got=got)
    text = who.text if isinstance(who.text, str) else None
    return who.item, who.rater, labels[0] if labels else None, text


def _label_studio(_: str, task: dict[str, Any]) -> Iterator[_Annotation]:
    if "annotator" in task and "annotations" not in task:
        # its JSON-MIN has one object an annotation, data and results side by side
        grades = {key: _labels(v) for key, v in task.items() if key not in _ABOUT}
        yield _Annotation(task.get("id"), task["annotator"], grades, task.get("text"))
        return
    data = task.get("data") or {}
    only = next(iter(data.values())) if len(data) == 1 else None
    for annotation in task.get("annotations") or task.get("completions") or ():
        who = annotation.get("completed_by")
        if isinstance(who, dict):
            who = who.get("email") or who.get("id")
        grades = {}
        for result in annotation.get("result") or ():
            value = result.get("value")
            if _is_category(value):
                of = grades.setdefault(str(result.get("from_name")), [])
                of += _labels(value)
        is_skipped = annotation.get("was_cancelled") or annotation.get("skipped")
        why = "skipped" if is_skipped else ""
        yield _Annotation(task.get("id"), who, grades, data.get("text", only), why)


# The keys of Label Studio's results that are categories, and what its JSON-MIN has
# beside the task's data and the results.
_CATEGORIES = {"choices", "rating", "number", "taxonomy", "selected"}
_ABOUT = ("id", "annotator", "annotation_id", "created_at", "updated_at", "lead_time")


def _is_category(value: Any) -> bool:
    # of the whole task: beside that of a region stands its place
    return isinstance(value, dict) and len(value) == 1 and value.keys() <= _CATEGORIES


def _labels(value: Any) -> Any:
    # the categories of a result, of a taxonomy by their path from the root
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    if not _is_category(value):
        return value
    ((_, labels),) = value.items()
    several = labels if isinstance(labels, list) else [labels]
    return ["/".join(map(str, x)) if isinstance(x, list) else x for x in several]


def _doccano(who: str, example: dict[str, Any]) -> Iterator[_Annotation]:
    rater = example.get("username", example.get("user", who))
    text = example.get("text", example.get("filename"))
    keys = {"label", "labels", "cats"} & example.keys()
    if keys:
        grades = {key: example[key] for key in sorted(keys)}
        yield _Annotation(example.get("id"), rater, grades, text)
    for label in example.get("annotations") or ():  # old: labels, users by number
        grade = label if "start_offset" in label else label.get("label")
        yield _Annotation(
            example.get("id"), label.get("user"), {"annotations": grade}, text
        )


def _prodigy(who: str, task: dict[str, Any]) -> Iterator[_Annotation]:
    answer, why = task.get("answer"), ""
    is_choice = "accept" in task or "options" in task
    if answer == "ignore" or (is_choice and answer != "accept"):
        why = f"answered {answer or 'nothing'}"
    regions = task.get("spans") or task.get("relations")
    if is_choice:
        grades = {"accept": task.get("accept", [])}
    elif task.get("label") is not None:
        grades = {str(task["label"]): answer}
    else:
        grades = {"answer": regions or answer}
    rater = task.get("_annotator_id") or task.get("_session_id") or who
    yield _Annotation(task.get("_input_hash"), rater, grades, task.get("text"), why)


def _inception(_: str, row: dict[str, Any]) -> Iterator[_Annotation]:
    if other := row.keys() - {"doc", "user", "label"}:
        raise KeyError(f"columns of spans or chains, {', '.join(map(str, other))}")
    is_other = row["user"] in ("CURATION_USER", "INITIAL_CAS")
    why = "of the curator or the source" if is_other else ""
    yield _Annotation(row["doc"], row["user"], {"label": row["label"]}, why=why)


_TOOLS: dict[str, Callable[[str, Any], Iterator[_Annotation]]] = {
    "label-studio": _label_studio,
    "doccano": _doccano,
    "prodigy": _prodigy,
    "inception": _inception,
}

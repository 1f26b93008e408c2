"""Files of other programs as sheets: workbooks, Parquet, JSON, SPSS, exports of tools.

What the records of an export say is in `_tools`.
"""

import binascii
import csv
import io
import json
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial, reduce
from itertools import chain, compress
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import pandas as pd

from masrel._input import USUAL_NAMES, refuse, shown
from masrel.agreement._labels import is_row
from masrel.errors import RatingsError
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
from masrel.ratings._tools import TOOLS, Annotation

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

_MORE = 16  # times as much may be in an archive that is read file by file
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
    of_files = (
        *("delimiter", "encoding", "skip", "header"),
        *("sheet", "source", "stream"),
    )
    refuse(
        *(
            (
                getattr(options, name),
                f"--{name}: needed a file, got a {facts['format']}",
            )
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
    are_named = options.item or options.rater or options.grade
    options = replace(
        options,
        no_header=True,
        no_item=options.no_item or (is_array and not are_named),
    )
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
    return frame.reset_index(
        names=["" if name is None else str(name) for name in frame.index.names],
        allow_duplicates=True,
    )


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
            raise refusal(
                _TABLE, "nested cell", column=name, number=1, kind="Python object"
            )
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
    source, extras = options.source, dict[str, Any]()
    refuse(
        (
            options.encoding is not None and suffix not in _ENCODED,
            f"--encoding: needed text, got {facts['format']}, whose encoding is known",
        ),
        (
            source not in (None, *TOOLS),
            f"--from: needed one of {', '.join(TOOLS)}, got {source!r}",
        ),
    )
    is_json = source is None and suffix in (".json", ".jsonl")
    values = _json_values(name, suffix, data) if is_json else []
    records = [*_within(values)]
    if source is None:
        is_log = suffix == ".eval"
        source = "inspect-ai" if is_log else _recognized(name, records, options)
    if source is not None:
        export = (
            [("", record) for record in records]
            if is_json
            else _records(name, suffix, data, source)
        )
        frame, facts, extras = _export(name, source, export, options.grade)
    elif suffix in WORKBOOKS:
        rows, n_above = _workbook(name, suffix, data, options.sheet, facts)
        return _sheet_of_rows(name, sha256, rows, n_above, facts, options)
    elif suffix in _ARROW:
        read = partial(library(name, _ARROW[suffix]).read_table, io.BytesIO(data))
        frame = read_foreign(name, suffix, lambda: table_frame(read()))
    elif suffix in _PYREADSTAT:
        frame = _statistical(name, suffix, data, options.encoding, facts)
    else:
        frame = _objects(name, values, options)
    return replace(sheet_of(name, sha256, frame, facts), **extras)


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
            raise refusal(
                name, "nested cell", column=title, number=number, kind=kind.__name__
            )
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
        files = unzipped(
            *(name, suffix, data, _MAX_WORKBOOK),
            "save its sheet as CSV, so that it can be read in batches",
            r"xl/worksheets/.*\.xml",  # not of .ods
        )
        # errors of formulas, such as #N/A, which calamine gives as empty cells
        errors = Counter(
            e for xml in files.values() for e in _ERROR_CELL.findall(xml())
        )
        if errors:
            facts["errors"] = {
                e.decode("utf-8", "replace"): n for e, n in errors.items()
            }

    open_book = partial(calamine.CalamineWorkbook.from_filelike, io.BytesIO(data))
    book = read_foreign(name, suffix, open_book, calamine.CalamineError)
    if chosen is not None and chosen not in book.sheet_names:
        raise refusal(
            name, "no sheet", sheet=chosen, sheets=", ".join(book.sheet_names)
        )
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
    where = f"row {n_above + len(rows) + 1}"
    findings = [Finding("note below", where=where, got=note[:60])] if note else []
    if errors := ", ".join(f"{e} ×{n}" for e, n in facts.get("errors", {}).items()):
        findings.append(Finding("errors", errors=errors))
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
    return frame.reset_index(
        names=[str(name or "") for name in frame.index.names], allow_duplicates=True
    )


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
    values = _joined(values)
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


def _joined(values: list[dict[str, Any]]) -> list[dict[str, Any]]:
    # objects of objects are one, if none has a name of another: files in a row
    names = [*chain(*values)]
    is_nested = all(isinstance(of, dict) for value in values for of in value.values())
    if not is_nested or len(set(names)) < len(names):
        return values
    return [dict(chain(*(value.items() for value in values)))]


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
        pairs = _pairs(name, item, record.get("annotators", record.get("raters")), of)
        if pairs is not None:
            rows += [{"item": item, "rater": who, "grade": got} for who, got in pairs]
        elif isinstance(of, dict):
            levels.append((item, of))
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


def _pairs(name: str, item: Any, raters: Any, of: Any) -> Sequence[Any] | None:
    # who gave an item which grade, where its raters are listed beside its grades
    if not isinstance(raters, str | list) or not isinstance(of, str | list | dict):
        return None
    if isinstance(of, dict):
        return [*of.items()]
    both = [x.split(",") if isinstance(x, str) else x for x in (raters, of)]
    if len(both[0]) != len(both[1]):
        raise refusal(name, "lists", item=item, raters=both[0], grades=both[1])
    return [*zip(*both, strict=True)]


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
        raise refusal(
            name,
            "levels",
            raters=few([*map(str, raters)]),
            others=listed([*map(str, items)], 5),
        )
    rows = [[item, *row] for item, row in zip(items, table, strict=True)]
    return pd.DataFrame(rows, columns=["item", *raters], dtype=object)


# ---- exports of tools ----

# Where the records are in an object of a whole file.
_WITHIN = (("samples",), ("results", "results"), ("traces",), ("data",))


def _within(values: list[Any]) -> Iterator[Any]:
    for value in values:
        inner = (reduce(_inner, path, value) for path in _WITHIN)
        yield from next((of for of in inner if isinstance(of, list)), [value])


def _inner(value: Any, key: str) -> Any:
    return value.get(key) if isinstance(value, dict) else None


def _recognized(name: str, records: list[Any], options: Reading) -> str | None:
    # the tool whose keys all records have, unless columns are named
    is_named = options.item or options.rater or options.raters
    if is_named or not all(isinstance(record, dict) for record in records):
        return None
    keys = set.intersection(*(set(record) for record in records or [{}]))
    sources = [
        source
        for source, tool in TOOLS.items()
        if any(keys.issuperset(of.split()) for of in tool.keys)
    ]
    if len(sources) > 1:
        raise refusal(
            name,
            "sources",
            options=" or ".join(f"--from {source}" for source in sources),
        )
    return sources[0] if sources else None


def _records(
    name: str, suffix: str, data: bytes, source: str
) -> Iterator[tuple[str, Any]]:
    # the records of an export, each with the name of its file in an archive
    if suffix in _ARROW:
        read = partial(library(name, _ARROW[suffix]).read_table, io.BytesIO(data))
        yield from (("", row) for row in read_foreign(name, suffix, read).to_pylist())
    elif not data.startswith(_ZIP):  # a pipe has no name that says .zip
        yield from (
            ("", record) for record in _within(_json_values(name, suffix, data))
        )
    else:
        # a log of inspect_ai has summaries beside its samples, which are large
        is_log, do = source == "inspect-ai", "unpack it and leave out some files"
        most = MAX_UNPACKED * (_MORE if is_log else 1)
        chosen = "samples/.*[.]json" if is_log else r".*\.(jsonl?|csv)"
        files = unzipped(name, suffix or ".zip", data, most, do, chosen)
        if not files:
            raise refusal(name, "no export")
        for file, content in files.items():
            path = PurePosixPath(file)
            values = _json_values(f"{name}: {file}", path.suffix.lower(), content())
            yield from ((str(path.with_suffix("")), each) for each in _within(values))


def _export(
    name: str, source: str, records: Iterable[tuple[str, Any]], chosen: str | None
) -> tuple[pd.DataFrame, dict[str, Any], dict[str, Any]]:
    # columns item, rater, the grade, and text and cluster where there are any; facts;
    # why annotations are left out, and findings
    tool = TOOLS[source]
    try:
        annotations = [g for who, record in records for g in tool.read(who, record)]
    except (TypeError, AttributeError, LookupError, binascii.Error) as error:
        raise refusal(name, "shape", source=source, error=error) from error
    fields = list(
        dict.fromkeys(field for g in annotations if not g.why for field in g.grades)
    )
    if not fields:
        raise refusal(name, "no fields")
    of = fields[0] if chosen is None else chosen
    if of not in fields or (chosen is None and len(fields) > 1):
        got = "none" if chosen is None else repr(chosen)
        raise refusal(name, "fields", fields=", ".join(fields), got=got)
    if chosen in ("item", "rater"):
        raise refusal(name, "field's name", chosen=chosen)
    others = "of other fields" if tool.is_split else ""
    why = [who.why or others * (of not in who.grades) for who in annotations]
    used = [who for who, lost in zip(annotations, why, strict=True) if not lost]
    if not used:
        raise refusal(name, "no rating", field=of)
    used = _by_kind(used)
    names = ["item", "rater", chosen or "grade", "text", "cluster"]
    frame = pd.DataFrame(
        [_row(name, who, of) for who in used], columns=names, dtype=object
    )
    is_there = [
        k < 3 or (is_so and names[k] != chosen)
        for k, is_so in enumerate(frame.notna().any())
    ]
    facts: dict[str, Any] = {"format": f"{source} export", "field": of}
    if kinds := {str(who.rater): who.kind for who in used if who.kind}:
        facts["kinds"] = kinds
    notes = Counter(who.note for who in used if who.note)
    extras = {
        "dropped": dict(Counter(filter(None, why))),
        "findings": tuple(Finding(note, n=n) for note, n in notes.items()),
    }
    return frame.loc[:, is_there], facts, extras


def _by_kind(annotations: list[Annotation]) -> list[Annotation]:
    # raters of one name and several kinds, such as a person and a judge, are several
    kinds: dict[Any, set[str]] = {}
    for who in annotations:
        kinds.setdefault(str(who.rater), set()).add(who.kind)
    return [
        who._replace(rater=f"{who.rater} ({who.kind})")
        if who.kind and len(kinds[str(who.rater)]) > 1
        else who
        for who in annotations
    ]


def _row(name: str, who: Annotation, field: str) -> tuple[Any, ...]:
    # item, rater, the one grade, the text and the cluster
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
    return who.item, who.rater, labels[0] if labels else None, text, who.cluster

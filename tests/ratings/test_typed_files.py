"""Files whose cells have types: what each cell says, and what is refused."""

import datetime
import gzip
import io
import json
import sys
import zipfile
from collections.abc import Callable
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from masrel.errors import ParameterError, RatingsError
from masrel.ratings import Reading, read_ratings
from tests.ratings.by_hand import grades

LONG = {
    "item": ["A", "A", "B", "B"],
    "rater": ["Kim", "Lee", "Kim", "Lee"],
    "grade": [1.0, 2.0, None, 1.0],
}
FRAME = pd.DataFrame(LONG)
EXPECTED = {
    ("A", "Kim"): "1",
    ("A", "Lee"): "2",
    ("B", "Kim"): None,
    ("B", "Lee"): "1",
}
WIDE = [["item", "Kim", "Lee"], ["A", 1, "1+"], ["B", None, 2.0], ["C", "1", 1]]
OF_WIDE = {
    **{("A", "Kim"): "1", ("A", "Lee"): "1+", ("B", "Kim"): None, ("B", "Lee"): "2"},
    **{("C", "Kim"): "1", ("C", "Lee"): "1"},
}


def workbook(path: Path, **sheets: list[list[Any]]) -> None:
    pytest.importorskip("python_calamine")
    book = pytest.importorskip("openpyxl").Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)


def arrow(path: Path, columns: dict[str, Any]) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.table(columns), path)


def text(path: Path, content: str) -> None:
    path.write_text(content, encoding="utf-8")


def statistical(path: Path, frame: pd.DataFrame = FRAME, **more: Any) -> None:
    pyreadstat = pytest.importorskip("pyreadstat")
    kind = path.suffix.removeprefix(".").replace("xpt", "xport").replace("zsav", "sav")
    if path.suffix == ".zsav":
        more["compress"] = True
    getattr(pyreadstat, f"write_{kind}")(frame, str(path), **more)


def open_document(path: Path, rows: list[tuple[Any, ...]]) -> None:
    pytest.importorskip("python_calamine")
    ns = "urn:oasis:names:tc:opendocument:xmlns"

    def cell(value: Any) -> str:
        kind = 'string"' if isinstance(value, str) else f'float" office:value="{value}"'
        return (
            f'<table:table-cell office:value-type="{kind}><text:p>{value}</text:p>'
            "</table:table-cell>"
        )

    xml = "".join(
        f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows
    )
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        packed.writestr(
            "content.xml",
            f'<office:document-content xmlns:office="{ns}:office:1.0" '
            f'xmlns:table="{ns}:table:1.0" xmlns:text="{ns}:text:1.0">'
            '<office:body><office:spreadsheet><table:table table:name="R">'
            f"{xml}</table:table></office:spreadsheet></office:body>"
            "</office:document-content>",
        )
        packed.writestr(
            "META-INF/manifest.xml",
            f'<manifest:manifest xmlns:manifest="{ns}:manifest:1.0"/>',
        )


def formula_with_an_error(path: Path) -> None:
    workbook(path, R=[*WIDE, ["D", "#DIV/0!", 1]])
    with zipfile.ZipFile(path) as packed:
        kept = {name: packed.read(name) for name in packed.namelist()}
    with zipfile.ZipFile(path, "w") as packed:
        for name, data in kept.items():
            formula = data.replace(b"<v>#DIV/0!", b"<f>1/0&lt;2</f><v>#DIV/0!")
            packed.writestr(name, formula)


def feather(path: Path) -> None:
    grade = pd.Categorical([1, 2, None, 1], categories=[2, 1, 7], ordered=True)
    module = pytest.importorskip("pyarrow.feather")
    module.write_feather(FRAME.assign(grade=grade), str(path))


def named_rows(path: Path) -> None:
    pytest.importorskip("pyarrow")
    columns = {"Kim": [1, None], "Lee": [2, 1]}
    pd.DataFrame(columns, index=["A", "B"]).to_parquet(path)


def zipped(path: Path) -> None:
    arrow(path.with_suffix(".parquet"), LONG)
    with zipfile.ZipFile(path, "w") as packed:
        packed.write(path.with_suffix(".parquet"), "r.parquet")


def floats(path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    single = pyarrow.array([0.1, 2.0], pyarrow.float32())
    arrow(path, {"item": ["A", "B"], "Kim": single, "Lee": [0.1, 2.5]})


def sas(path: Path) -> None:
    pytest.importorskip("pyreadstat")
    packed = Path(__file__).parent / "sas" / "hadley.sas7bdat.gz"
    path.write_bytes(gzip.decompress(packed.read_bytes()))


BLANKS = [[], [], *[["", *row[:2], None, row[2]] for row in WIDE]]
BLANKS[5] = [*BLANKS[5][:2], "n/a", *BLANKS[5][3:]]  # row 6 of the sheet
ERRORS = [*WIDE, ["D", "#N/A", "=1/0"], ["E", "1", "#N/A"], ["F", "1", 't="e"']]
ROWS = [
    {"item": "A", "Kim": 1, "Lee": 2},
    {"item": "B", "Kim": None, "Lee": 1.0},
]
BY_ROW = {"Kim": {"0": 1.0, "1": None}, "Lee": {"0": 2.0, "1": 1.0}}
LONG_NUMBERS = {"item": [*"ABC"], "Kim": [2**53 + 1, 2**53, None], "Lee": [2**53] * 3}
TRUTH = {"item": ["A", "B"], "Kim": [True, False], "Lee": [1, 0]}
# U+2028 is a line's end to Python, and none in JSON
LINES = '{"item": "A\u2028", "Kim": 1, "Lee": "1+"}\n\n{"item": "B", "Kim": NaN}\n'
OF_SPSS = {"grade": {1: "none", 2: "some", 9: "refused"}}
NINE = FRAME.assign(grade=[1.0, 2.0, 9.0, 1.0])
STATA = FRAME.assign(grade=pd.Series([1, 2, "a", 1], dtype=object))

Write = Callable[[Path], None]
# name: ending, how it is written, options, grades or how often each is there, facts
READ: dict[str, tuple[str, Write, dict[str, Any], Any, dict[str, Any]]] = {
    "workbook": ("xlsx", partial(workbook, R=WIDE), {}, OF_WIDE, {"sheet": "R"}),
    "workbook with macros": ("xlsm", partial(workbook, R=WIDE), {}, OF_WIDE, {}),
    "open document": (
        "ods",
        partial(open_document, rows=[("item", "Kim", "Lee"), ("A", 1.0, 2.0)]),
        *({}, {("A", "Kim"): "1", ("A", "Lee"): "2"}, {}),
    ),
    "blank rows and columns": (
        *("xlsx", partial(workbook, R=BLANKS, empty=[]), {"missing_codes": ["n/a"]}),
        *({**OF_WIDE, ("C", "Kim"): None}, {}),
    ),
    "one of two sheets": (
        *("xlsx", partial(workbook, one=WIDE, two=[*WIDE[:1], ["A", 3, 3]])),
        *({"sheet": "two"}, {("A", "Kim"): "3", ("A", "Lee"): "3"}, {}),
    ),
    "errors of formulas": (
        *("xlsx", partial(workbook, R=ERRORS), {"missing_codes": ['t="e"']}),
        *({"1": 5, "1+": 1, "2": 1}, {"errors": {"#N/A": 2}}),
    ),
    "an error's formula": (
        *("xlsx", formula_with_an_error, {}),
        *({"1": 4, "1+": 1, "2": 1}, {"errors": {"#DIV/0!": 1}}),
    ),
    "parquet": (
        *("parquet", partial(arrow, columns=LONG), {}, EXPECTED),
        {"format": "parquet", "n_missing": 1},
    ),
    "parquet in a zip": ("zip", zipped, {}, EXPECTED, {"format": "parquet"}),
    "feather with categories": ("feather", feather, {}, EXPECTED, {}),
    "names of rows": ("parquet", named_rows, {}, EXPECTED, {}),
    "true beside 1": (
        *("parquet", partial(arrow, columns=TRUTH), {}),
        *({"0": 2, "1": 2}, {"merged": {"0": ["false", "0"], "1": ["true", "1"]}}),
    ),
    "floats as written": ("parquet", floats, {}, {"0.1": 2, "2": 1, "2.5": 1}, {}),
    "numbers that are no floats": (
        *("parquet", partial(arrow, columns=LONG_NUMBERS), {}),
        *({"9007199254740992": 4, "9007199254740993": 1}, {}),
    ),
    "rows of JSON": (
        *("json", partial(text, content=json.dumps(ROWS)), {}, EXPECTED, {}),
    ),
    "columns of R": (
        "json",
        partial(
            text,
            content=json.dumps({"item": ["A", "B"], "Kim": [1, None], "Lee": [2, 1]}),
        ),
        *({}, EXPECTED, {}),
    ),
    "columns of pandas": (
        "json",
        partial(text, content=json.dumps({"item": {"0": "A", "1": "B"}, **BY_ROW})),
        *({}, EXPECTED, {}),
    ),
    "a key left out": (
        "json",
        partial(text, content=json.dumps([ROWS[0], {"item": "B", "Lee": 1}])),
        *({}, EXPECTED, {}),
    ),
    "lines of JSON": (
        *("jsonl", partial(text, content=LINES), {}),
        *({"1": 1, "1+": 1}, {"n_items": 2}),
    ),
    "lines called JSON": (
        *(
            "json",
            partial(text, content=LINES),
            {},
            {"1": 1, "1+": 1},
            {"n_missing": 2},
        ),
    ),
    "true and 1 of a column": (
        "json",
        partial(
            text,
            content='[{"item": 1, "K": true, "L": 1}, {"item": 2, "K": 1, "L": 1.0}]',
        ),
        *({}, {"1": 4}, {}),
    ),
    **{
        kind: (kind, statistical, {}, EXPECTED, {"format": kind})
        for kind in ("sav", "zsav", "dta", "por", "xpt")
    },
    "labels and missing codes of SPSS": (
        "sav",
        partial(
            statistical,
            frame=NINE,
            variable_value_labels=OF_SPSS,
            missing_ranges={"grade": [9]},
        ),
        *({}, EXPECTED),
        {"labels": {"grade": {"1": "none", "2": "some", "9": "refused"}}},
    ),
    "missing values of Stata": (
        "dta",
        partial(statistical, frame=STATA, missing_user_values={"grade": ["a"]}),
        *({}, EXPECTED, {}),
    ),
    "SAS": (
        *("sas7bdat", sas, {"item": "id", "ignore": ["workshop", "gender"]}),
        *({"1": 6, "2": 4, "3": 4, "4": 8, "5": 9}, {"n_missing": 1}),
    ),
    "an encoding": ("sav", statistical, {"encoding": "UTF-8"}, EXPECTED, {}),
}


@pytest.mark.parametrize("name", READ)
def test_what_is_read(name: str, tmp_path: Path) -> None:
    ending, write, options, expected, facts = READ[name]
    path = tmp_path / f"r.{ending}"
    write(path)
    file = read_ratings(path, Reading(**options))
    is_by_name = isinstance(next(iter(expected)), tuple)
    assert (grades(file) if is_by_name else file.read["grades"]) == expected
    assert {key: file.read[key] for key in facts} == facts
    assert ("errors" in file.read) is any("formulas" in w for w in file.warnings)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        *((3.0, "3"), (-0.0, "0"), (2.5, "2.5"), (1e300, "1e+300"), (True, "true")),
        *((Decimal("2.00"), "2"), (Decimal("0.50"), "0.50")),
        (datetime.date(2024, 3, 1), "2024-03-01"),
        (datetime.datetime(2024, 3, 1), "2024-03-01"),
        (datetime.datetime(2024, 3, 1, 14, 5), "2024-03-01T14:05:00"),
        (datetime.time(14, 5), "14:05:00"),
        *(("José".encode(), "José"), (b"\xff", "\\xff")),
    ],
)
def test_what_a_cell_says(tmp_path: Path, value: Any, said: str) -> None:
    path = tmp_path / "r.parquet"
    arrow(path, {"item": [value], "Kim": ["x"], "Lee": ["y"]})
    assert read_ratings(path).parts[0].items == (said,)


# ---- JSON of names in each other ----

BY_RATER = {
    "Kim": {"A": "x", "B": "y", "C": None},
    "Lee": {"A": "x", "B": "x", "C": "y"},
}
BY_ITEM = {item: {rater: of[item] for rater, of in BY_RATER.items()} for item in "ABC"}
OF_NESTED = {(i, r): grade for i, of in BY_ITEM.items() for r, grade in of.items()}
TURNED = {(rater, item): grade for (item, rater), grade in OF_NESTED.items()}
OBJECTS = [
    {
        "id": item,
        "text": "of it",
        "annotations": [
            {"annotator": rater, "label": grade, "at": [1, 2]}
            for rater, grade in of.items()
        ],
    }
    for item, of in BY_ITEM.items()
]
LISTS_OF = {
    item: {
        "annotators": ", ".join(of),
        "annotations": ", ".join(grade or "" for grade in of.values()),
        "n": 2,
    }
    for item, of in BY_ITEM.items()
}
FEW = {rater: {item: of[item] for item in "AB"} for rater, of in BY_RATER.items()}
OF_FEW = {key: grade for key, grade in OF_NESTED.items() if key[0] != "C"}
NUMBERED = {k: {"item": i, **of} for k, (i, of) in enumerate(BY_ITEM.items())}


def renamed(**keys: str) -> list[dict[str, Any]]:
    text = json.dumps(OBJECTS)
    for old, new in keys.items():
        text = text.replace(f'"{old}"', f'"{new}"')
    return json.loads(text)  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("value", "options", "expected"),
    [
        *((value, {}, OF_NESTED) for value in (BY_RATER, BY_ITEM, OBJECTS, LISTS_OF)),
        ({i: {"annotations": of, "text": "t"} for i, of in BY_ITEM.items()}, {}, None),
        ({i: {"ratings": of} for i, of in BY_ITEM.items()}, {}, None),
        ([{"id": i, "ratings": of} for i, of in BY_ITEM.items()], {}, None),
        ({of["id"]: {"annotations": of["annotations"]} for of in OBJECTS}, {}, None),
        (
            [
                {"item": i, "raters": [*of], "ratings": [*of.values()]}
                for i, of in BY_ITEM.items()
            ],
            *({}, None),
        ),
        (renamed(annotations="ratings", annotator="coder", label="score"), {}, None),
        (renamed(annotator="by", label="is"), {"rater": "by", "grade": "is"}, None),
        # as pandas writes a frame by its index, and a column of numbered rows
        (NUMBERED, {}, None),
        (
            {
                "patient no": dict(enumerate("ABC")),
                **{
                    rater: dict(enumerate(of.values()))
                    for rater, of in BY_RATER.items()
                },
            },
            {},
            None,
        ),
        # the other way round
        (BY_RATER, {"transpose": True}, TURNED),
        (BY_ITEM, {"transpose": True}, TURNED),
        # as many of both
        (FEW, {"raters": "Kim,Lee"}, OF_FEW),
        (FEW, {"transpose": True}, {(r, i): grade for (i, r), grade in OF_FEW.items()}),
        (
            [{"id": i, "ratings": BY_ITEM[i]} for i in "AB"],
            {"raters": "Kim,Lee"},
            OF_FEW,
        ),
    ],
)
def test_names_in_each_other(
    tmp_path: Path,
    value: Any,
    options: dict[str, Any],
    expected: dict[tuple[str, str], str | None] | None,
) -> None:
    text(tmp_path / "r.json", json.dumps(value))
    file = read_ratings(tmp_path / "r.json", Reading(**options))
    assert grades(file) == (expected or OF_NESTED)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (FEW, "--raters Kim,Lee, or add --transpose if they are 'A', 'B'"),
        ([{"id": i, "ratings": BY_ITEM[i]} for i in "AB"], "--raters Kim,Lee"),
        ([{"id": "A", "annotations": BY_ITEM["A"]}, OBJECTS[1]], "value 1: .* a dict"),
        ({"A": {"annotators": "Kim", "annotations": "x,y"}}, "item 'A': .*annotator"),
        ([OBJECTS[0], OBJECTS[0], OBJECTS[1]], "'Kim' graded 'A' more than once"),
        (renamed(annotator="completed_by"), "'annotations', value 1: .* --from"),
        ({"Kim": {"A": {"x": 1}}, "Lee": {"A": 1}}, "got a dict"),
        ([{"id": "A", "annotations": [{"rater": "K", "label": ["x"]}]}], "got a list"),
    ],
)
def test_names_in_each_other_that_are_refused(
    tmp_path: Path, value: Any, words: str
) -> None:
    text(tmp_path / "r.json", json.dumps(value))
    with pytest.raises(RatingsError, match=words):
        read_ratings(tmp_path / "r.json")


NO_ROWS: dict[str, list[Any]] = {"item": [], "Kim": [], "Lee": []}
LISTS = {"item": ["A", "B"], "Kim": [[1], [2, 3]], "Lee": [1, 2]}
REFUSED: list[tuple[str, Write, dict[str, Any], str]] = [
    ("xlsx", partial(workbook, R=BLANKS, empty=[]), {}, "row 6.*n/a"),
    (
        "xlsx",
        partial(workbook, one=WIDE, two=WIDE),
        {},
        "sheets, one, two: .*--sheet",
    ),
    (
        "xlsx",
        partial(workbook, one=WIDE),
        {"sheet": "six"},
        "--sheet: .* no sheet 'six'",
    ),
    ("xlsx", partial(workbook, R=[]), {}, "needed a header and rows, got none"),
    ("parquet", partial(arrow, columns=NO_ROWS), {}, "needed rows of ratings"),
    (
        "parquet",
        partial(arrow, columns=LONG),
        {"sheet": "R"},
        "--sheet R: needed a workbook",
    ),
    ("parquet", partial(arrow, columns=LONG), {"encoding": "latin-1"}, "--encoding: "),
    (
        "parquet",
        partial(arrow, columns=LISTS),
        {},
        "column 'Kim', value 1: needed text or",
    ),
    ("sav", statistical, {"encoding": "no such encoding"}, r"r\.sav"),
    *(
        ("json", partial(text, content=content), {}, words)
        for content, words in (
            ('[{"item": "A", "Kim": 1, "Kim": 2}]', "key 'Kim' twice"),
            (
                '[{"item": "A", "Kim": [1]}]',
                "column 'Kim', value 1: .* a list; .*--from",
            ),
            ('[{"item": "A"\n,]', r"is damaged or not a .json file .*line 2"),
            ("[]", "needed a JSON list of objects"),
            ("{}", "needed rows of ratings below the header"),
            ("null", "needed a JSON list of objects"),
            (
                '{"data": [{"a": 1}]}',
                "'data', value 1: needed text or a number, got a dict",
            ),
            ("[1, 2]", "needed a JSON list of objects"),
            ('{"item": ["A"], "Kim": []}', "value 1: .* a list"),
            ("nonsense", r"is damaged or not a .json file .*line 1"),
            ('{"a": 1}\n{"a": \n', r"is damaged or not a .json file .*line 2"),
        )
    ),
]


@pytest.mark.parametrize(("ending", "write", "options", "words"), REFUSED)
def test_what_is_refused(
    ending: str, write: Write, options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    path = tmp_path / f"r.{ending}"
    write(path)
    with pytest.raises((RatingsError, ParameterError), match=words) as refusal:
        read_ratings(path, Reading(**options))
    assert "\n" not in str(refusal.value)


LIBRARIES = {
    **dict.fromkeys(("xlsx", "xls", "ods"), "python_calamine"),
    **dict.fromkeys(("parquet", "feather"), "pyarrow"),
    **dict.fromkeys(("sav", "zsav", "por", "dta", "sas7bdat", "xpt"), "pyreadstat"),
}


@pytest.mark.parametrize("ending", LIBRARIES)
@pytest.mark.parametrize("data", [b"item,Kim,Lee\nA,1,2\n", b"\0" * 600, b"PK\3\4x"])
def test_another_format_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, data: bytes
) -> None:
    path, library = tmp_path / f"r.{ending}", LIBRARIES[ending]
    path.write_bytes(data)
    with monkeypatch.context() as without:
        without.setitem(sys.modules, library, None)
        with pytest.raises(
            RatingsError, match=rf"needs {library}: pip install 'masrel"
        ):
            read_ratings(path)
    pytest.importorskip(library)
    with pytest.raises(RatingsError, match=rf"or not an? \.{ending} file") as refusal:
        read_ratings(path)
    assert "\n" not in str(refusal.value)


GRADES = np.random.default_rng(3).integers(1, 9, (4000, 2)).astype(float)
MANY = pd.DataFrame(
    {"item": [f"i{k}" for k in range(4000)], **dict(zip("KL", GRADES.T, strict=True))}
)
CUT: dict[str, Write] = {
    "xlsx": partial(workbook, R=[list(MANY), *MANY.to_numpy().tolist()]),
    "parquet": MANY.to_parquet,
    "feather": MANY.to_feather,
    **dict.fromkeys(("sav", "dta", "xpt"), partial(statistical, frame=MANY)),
}


@pytest.mark.parametrize("ending", CUT)
def test_a_file_cut_short_is_refused_not_read_in_part(
    tmp_path: Path, ending: str
) -> None:
    pytest.importorskip("pyarrow")
    path = tmp_path / f"r.{ending}"
    CUT[ending](path)
    assert read_ratings(path).read["n_items"] == 4000
    data = path.read_bytes()
    for part in (0.2, 0.5, 0.9):
        # an odd number of bytes: an .xpt file has lines of 80, and no end but the last
        path.write_bytes(data[: int(part * len(data)) | 1])
        with pytest.raises(RatingsError, match="is damaged or not a"):
            read_ratings(path)


@pytest.mark.parametrize("ending", ["xlsx", "xls", "ods"])
def test_a_workbook_of_more_than_fits_the_memory_is_refused(
    tmp_path: Path, ending: str
) -> None:
    pytest.importorskip("python_calamine")
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for sheet in range(9):
            archive.writestr(f"xl/worksheets/sheet{sheet}.xml", b" " * 8_000_000)
    path = tmp_path / f"r.{ending}"
    path.write_bytes(packed.getvalue())
    assert path.stat().st_size < 250_000
    with pytest.raises(RatingsError, match="when unpacked: save its sheet as CSV"):
        read_ratings(path)

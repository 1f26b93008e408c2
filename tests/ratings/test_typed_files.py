"""Files whose cells have types: what each cell says, and what is refused."""

import datetime
import gzip
import io
import json
import sys
import zipfile
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, read_ratings

LONG = {
    "item": ["A", "A", "B", "B"],
    "rater": ["Kim", "Lee", "Kim", "Lee"],
    "grade": [1.0, 2.0, None, 1.0],
}
EXPECTED = {
    ("A", "Kim"): "1",
    ("A", "Lee"): "2",
    ("B", "Kim"): None,
    ("B", "Lee"): "1",
}


def grades(file: RatingsFile) -> dict[tuple[str, str], str | None]:
    """Return the grade of each item and rater."""
    (part,) = file.parts
    codes = part.ratings.codes
    return {
        (item, rater): None if (code := codes[i, j]) < 0 else file.scale.grades[code]
        for i, item in enumerate(part.items)
        for j, rater in enumerate(part.raters)
    }


def workbook(path: Path, **sheets: list[list[Any]]) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


def parquet(path: Path, columns: dict[str, Any]) -> Path:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.table(columns), path)
    return path


WIDE = [["item", "Kim", "Lee"], ["A", 1, "1+"], ["B", None, 2.0], ["C", "1", 1]]


class TestWorkbook:
    @pytest.mark.parametrize("ending", ["xlsx", "xlsm"])
    def test_numbers_and_text_of_one_column_are_grades(
        self, tmp_path: Path, ending: str
    ) -> None:
        pytest.importorskip("python_calamine")
        file = read_ratings(workbook(tmp_path / f"r.{ending}", R=WIDE))
        assert grades(file) == {
            ("A", "Kim"): "1",
            ("A", "Lee"): "1+",
            ("B", "Kim"): None,
            ("B", "Lee"): "2",
            ("C", "Kim"): "1",
            ("C", "Lee"): "1",
        }
        assert file.read["sheet"] == "R"
        assert file.read["format"] == ending

    def test_an_open_document_sheet(self, tmp_path: Path) -> None:
        pytest.importorskip("python_calamine")
        ns = "urn:oasis:names:tc:opendocument:xmlns"
        cell = (
            '<table:table-cell office:value-type="{}"{}><text:p>{}</text:p>'
            "</table:table-cell>"
        )

        def cells(*values: str | float) -> str:
            return "".join(
                cell.format("string", "", value)
                if isinstance(value, str)
                else cell.format("float", f' office:value="{value}"', value)
                for value in values
            )

        rows = [("item", "Kim", "Lee"), ("A", 1.0, 2.0), ("B", 2.0, "1+")]
        xml = "".join(f"<table:table-row>{cells(*r)}</table:table-row>" for r in rows)
        content = (
            f'<office:document-content xmlns:office="{ns}:office:1.0" '
            f'xmlns:table="{ns}:table:1.0" xmlns:text="{ns}:text:1.0">'
            '<office:body><office:spreadsheet><table:table table:name="R">'
            f"{xml}</table:table></office:spreadsheet></office:body>"
            "</office:document-content>"
        )
        manifest = f'<manifest:manifest xmlns:manifest="{ns}:manifest:1.0"/>'
        path = tmp_path / "r.ods"
        with zipfile.ZipFile(path, "w") as packed:
            packed.writestr(
                "mimetype", "application/vnd.oasis.opendocument.spreadsheet"
            )
            packed.writestr("content.xml", content)
            packed.writestr("META-INF/manifest.xml", manifest)
        assert grades(read_ratings(path)) == {
            ("A", "Kim"): "1",
            ("A", "Lee"): "2",
            ("B", "Kim"): "2",
            ("B", "Lee"): "1+",
        }

    def test_blank_rows_and_columns_around_the_table_are_no_cells(
        self, tmp_path: Path
    ) -> None:
        pytest.importorskip("python_calamine")
        rows = [[], [], *[["", *row[:2], None, row[2]] for row in WIDE]]
        rows[5][2] = "n/a"  # row 6 of the sheet
        path = workbook(tmp_path / "r.xlsx", R=rows, empty=[])
        with pytest.raises(RatingsError, match=r"row 6.*n/a"):
            read_ratings(path)
        file = read_ratings(path, missing_codes=["n/a"])
        assert grades(file)["C", "Kim"] is None
        assert grades(file)["A", "Lee"] == "1+"

    def test_of_several_sheets_one_is_chosen(self, tmp_path: Path) -> None:
        pytest.importorskip("python_calamine")
        other = [["item", "Kim", "Lee"], ["A", 3, 3], ["B", 2, 2]]
        path = workbook(tmp_path / "r.xlsx", one=WIDE, two=other)
        with pytest.raises(RatingsError, match=r"needs --sheet .*, one, two"):
            read_ratings(path)
        with pytest.raises(RatingsError, match="--sheet: there is no sheet 'six'"):
            read_ratings(path, sheet="six")
        assert grades(read_ratings(path, sheet="two"))["A", "Lee"] == "3"

    def test_errors_of_formulas_are_empty_and_warned_of(self, tmp_path: Path) -> None:
        pytest.importorskip("python_calamine")
        rows = [*WIDE, ["D", "#N/A", "=1/0"], ["E", "1", "#N/A"], ["F", "1", 't="e"']]
        path = workbook(tmp_path / "r.xlsx", R=rows)
        file = read_ratings(path, missing_codes=['t="e"'])
        (warning,) = [w for w in file.warnings if "formulas" in w]
        assert warning.endswith("are read as empty cells: #N/A ×2")
        assert file.read["errors"] == {"#N/A": 2}
        assert grades(file)["D", "Kim"] is None
        none = read_ratings(workbook(tmp_path / "r.xlsx", R=WIDE))
        assert "errors" not in none.read

    def test_an_error_s_formula_is_no_part_of_it(self, tmp_path: Path) -> None:
        pytest.importorskip("python_calamine")
        path = workbook(tmp_path / "r.xlsx", R=[*WIDE, ["D", "#DIV/0!", 1]])
        kept = {}
        with zipfile.ZipFile(path) as packed:
            kept = {name: packed.read(name) for name in packed.namelist()}
        name = "xl/worksheets/sheet1.xml"
        kept[name] = kept[name].replace(b"<v>#DIV/0!", b"<f>1/0&lt;2</f><v>#DIV/0!")
        with zipfile.ZipFile(path, "w") as packed:
            for name, data in kept.items():
                packed.writestr(name, data)
        assert read_ratings(path).read["errors"] == {"#DIV/0!": 1}

    def test_a_sheet_without_cells_is_refused(self, tmp_path: Path) -> None:
        pytest.importorskip("python_calamine")
        with pytest.raises(RatingsError, match="needed a header and rows, got none"):
            read_ratings(workbook(tmp_path / "r.xlsx", R=[]))


class TestArrow:
    def test_missing_values_are_missing_and_whole_numbers_whole(
        self, tmp_path: Path
    ) -> None:
        path = parquet(tmp_path / "r.parquet", LONG)
        assert grades(read_ratings(path)) == EXPECTED
        file = read_ratings(path)
        assert file.read["format"] == "parquet"
        assert file.read["n_missing"] == 1

    def test_feather_and_columns_of_categories(self, tmp_path: Path) -> None:
        feather = pytest.importorskip("pyarrow.feather")
        frame = pd.DataFrame(LONG)
        frame["grade"] = pd.Categorical(
            [1, 2, None, 1], categories=[2, 1, 7], ordered=True
        )
        feather.write_feather(frame, str(tmp_path / "r.feather"))
        assert grades(read_ratings(tmp_path / "r.feather")) == EXPECTED

    def test_true_is_not_the_grade_1(self, tmp_path: Path) -> None:
        values = [[True, False], [1, 0]]
        columns = {"item": ["A", "B"], "Kim": values[0], "Lee": values[1]}
        file = read_ratings(parquet(tmp_path / "r.parquet", columns))
        assert file.read["grades"] == {"0": 1, "1": 1, "false": 1, "true": 1}

    def test_floats_have_the_digits_they_were_written_with(
        self, tmp_path: Path
    ) -> None:
        pyarrow = pytest.importorskip("pyarrow")
        columns = {
            "item": ["A", "B"],
            "Kim": pyarrow.array([0.1, 2.0], pyarrow.float32()),
            "Lee": pyarrow.array([0.1, 2.5], pyarrow.float64()),
        }
        file = read_ratings(parquet(tmp_path / "r.parquet", columns))
        assert file.read["grades"] == {"0.1": 2, "2": 1, "2.5": 1}

    def test_long_numbers_beside_missing_ones_stay_apart(self, tmp_path: Path) -> None:
        # 2**53 + 1 is no float: as floats both would be one grade
        columns = {
            "item": ["A", "B", "C"],
            "Kim": [2**53 + 1, 2**53, None],
            "Lee": [2**53, 2**53, 1],
        }
        file = read_ratings(parquet(tmp_path / "r.parquet", columns))
        assert grades(file)["A", "Kim"] == "9007199254740993"
        assert grades(file)["A", "Lee"] == "9007199254740992"

    def test_names_of_rows_are_a_column(self, tmp_path: Path) -> None:
        pytest.importorskip("pyarrow")
        frame = pd.DataFrame({"Kim": [1, 2], "Lee": [2, 2]}, index=["A", "B"])
        frame.to_parquet(tmp_path / "r.parquet")
        assert grades(read_ratings(tmp_path / "r.parquet"))["A", "Lee"] == "2"

    def test_a_table_without_rows_is_refused(self, tmp_path: Path) -> None:
        path = parquet(tmp_path / "r.parquet", {"item": [], "Kim": [], "Lee": []})
        with pytest.raises(RatingsError, match="needed rows of ratings"):
            read_ratings(path)

    def test_options_of_other_formats_are_refused(self, tmp_path: Path) -> None:
        path = parquet(tmp_path / "r.parquet", LONG)
        with pytest.raises(ParameterError, match="--sheet: needed a workbook"):
            read_ratings(path, sheet="R")
        with pytest.raises(ParameterError, match="--encoding: needed a file of text"):
            read_ratings(path, encoding="latin-1")

    def test_lists_in_cells_are_refused(self, tmp_path: Path) -> None:
        columns = {"item": ["A", "B"], "Kim": [[1], [2, 3]], "Lee": [1, 2]}
        with pytest.raises(RatingsError, match="column 'Kim': needed text or numbers"):
            read_ratings(parquet(tmp_path / "r.parquet", columns))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (3.0, "3"),
        (-0.0, "0"),
        (2.5, "2.5"),
        (1e300, "1e+300"),
        (Decimal("2.00"), "2"),
        (Decimal("0.50"), "0.50"),
        (True, "true"),
        (datetime.date(2024, 3, 1), "2024-03-01"),
        (datetime.datetime(2024, 3, 1), "2024-03-01"),
        (datetime.datetime(2024, 3, 1, 14, 5), "2024-03-01T14:05:00"),
        (datetime.time(14, 5), "14:05:00"),
        ("José".encode(), "José"),
        (b"\xff", "\\xff"),
    ],
)
def test_what_a_cell_says(tmp_path: Path, value: Any, text: str) -> None:
    columns = {"item": [value], "Kim": ["x"], "Lee": ["y"]}
    path = parquet(tmp_path / "r.parquet", columns)
    (part,) = read_ratings(path).parts
    assert part.items == (text,)


class TestJson:
    @pytest.mark.parametrize(
        "content",
        [
            [
                {"item": "A", "Kim": 1, "Lee": 2},
                {"item": "B", "Kim": None, "Lee": 1.0},
            ],
            {"item": ["A", "B"], "Kim": [1, None], "Lee": [2, 1]},
            {
                "item": {"0": "A", "1": "B"},
                "Kim": {"0": 1.0, "1": None},
                "Lee": {"0": 2.0, "1": 1.0},
            },
            [{"item": "A", "Kim": 1, "Lee": 2}, {"item": "B", "Lee": 1}],
        ],
        ids=["rows", "columns of R", "columns of pandas", "a key left out"],
    )
    def test_rows_and_columns(self, tmp_path: Path, content: object) -> None:
        path = tmp_path / "r.json"
        path.write_text(json.dumps(content))
        assert grades(read_ratings(path)) == EXPECTED

    @pytest.mark.parametrize("ending", ["jsonl", "json"])
    def test_lines_of_objects(self, tmp_path: Path, ending: str) -> None:
        # U+2028 is a line's end to Python, and none in JSON
        path = tmp_path / f"r.{ending}"
        path.write_text(
            '{"item": "A\u2028", "Kim": 1, "Lee": "1+"}\n\n'
            '{"item": "B", "Kim": NaN, "Lee": 2}\n',
            encoding="utf-8",
        )
        file = read_ratings(path)
        assert file.read["grades"] == {"1": 1, "1+": 1, "2": 1}
        assert file.read["n_missing"] == 1
        assert file.parts[0].items == ("A", "B")

    def test_true_and_1_of_one_column_are_two_grades(self, tmp_path: Path) -> None:
        path = tmp_path / "r.json"
        path.write_text(
            '[{"item": 1, "Kim": true, "Lee": 1}, {"item": 2, "Kim": 1, "Lee": 1.0}]'
        )
        assert read_ratings(path).read["grades"] == {"1": 3, "true": 1}

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ('[{"item": "A", "Kim": 1, "Kim": 2}]', "'Kim' is there twice"),
            ('[{"item": "A", "Kim": [1]}]', "object 1: .*'Kim', got what is nested"),
            ('[{"item": "A"\n,]', "line 2: is no JSON"),
            ("[]", "needed a JSON list of objects"),
            ("{}", "needed rows of ratings below the names"),
            ("null", "needed a JSON list of objects"),
            ('{"data": [{"a": 1}]}', "'data': needed text or numbers, got a dict"),
            ("[1, 2]", "needed a JSON list of objects"),
            ('{"item": ["A"], "Kim": []}', "object 1: .* nested"),
            ("", "the file is empty"),
            ("nonsense", "line 1: is no JSON"),
            ('{"a": 1}\n{"a": \n', "line 2: is no JSON"),
        ],
    )
    def test_what_is_refused(self, tmp_path: Path, text: str, words: str) -> None:
        path = tmp_path / "r.json"
        path.write_text(text)
        with pytest.raises(RatingsError, match=words) as refusal:
            read_ratings(path)
        assert "\n" not in str(refusal.value)


class TestStatistical:
    @pytest.mark.parametrize("ending", ["sav", "zsav", "dta", "por", "xpt"])
    def test_codes_are_the_grades(self, tmp_path: Path, ending: str) -> None:
        pyreadstat = pytest.importorskip("pyreadstat")
        path = tmp_path / f"r.{ending}"
        write = {
            "sav": pyreadstat.write_sav,
            "dta": pyreadstat.write_dta,
            "por": pyreadstat.write_por,
            "xpt": pyreadstat.write_xport,
        }
        if ending == "zsav":
            pyreadstat.write_sav(pd.DataFrame(LONG), str(path), compress=True)
        else:
            write[ending](pd.DataFrame(LONG), str(path))
        file = read_ratings(path)
        assert grades(file) == EXPECTED
        assert file.read["format"] == ending

    def test_a_table_of_sas(self, tmp_path: Path) -> None:
        pytest.importorskip("pyreadstat")
        packed = Path(__file__).parent / "sas" / "hadley.sas7bdat.gz"
        path = tmp_path / "r.sas7bdat"
        path.write_bytes(gzip.decompress(packed.read_bytes()))
        rows = ("1151", "2141", "2243", "31 3", "4524", "5455", "5344", "4555")
        answers = {
            (f"{item}", f"q{k}"): None if cell == " " else cell
            for item, row in enumerate(rows, start=1)
            for k, cell in enumerate(row, start=1)
        }
        for form in (packed, path):
            file = read_ratings(form, item="id", ignore=["workshop", "gender"])
            assert grades(file) == answers
            assert file.read["format"] == "sas7bdat"
        for end in (300, 70_000, 131_000):
            path.write_bytes(gzip.decompress(packed.read_bytes())[:end])
            with pytest.raises(RatingsError, match=r"r\.sas7bdat: is damaged"):
                read_ratings(path, item="id", ignore=["workshop", "gender"])

    def test_labels_of_spss_are_noted_and_its_missing_codes_missing(
        self, tmp_path: Path
    ) -> None:
        pyreadstat = pytest.importorskip("pyreadstat")
        frame = pd.DataFrame(LONG)
        frame["grade"] = [1.0, 2.0, 9.0, 1.0]
        labels = {"grade": {1: "none", 2: "some", 9: "refused"}}
        path = tmp_path / "r.sav"
        pyreadstat.write_sav(
            frame,
            str(path),
            variable_value_labels=labels,
            missing_ranges={"grade": [9]},
        )
        file = read_ratings(path)
        assert grades(file) == EXPECTED
        words = {"grade": {"1": "none", "2": "some", "9": "refused"}}
        assert file.read["labels"] == words

    def test_extended_missing_values_of_stata_are_missing(self, tmp_path: Path) -> None:
        pyreadstat = pytest.importorskip("pyreadstat")
        frame = pd.DataFrame(LONG)
        frame["grade"] = pd.Series([1, 2, "a", 1], dtype=object)
        path = tmp_path / "r.dta"
        pyreadstat.write_dta(frame, str(path), missing_user_values={"grade": ["a"]})
        assert grades(read_ratings(path)) == EXPECTED

    def test_an_encoding_may_be_named(self, tmp_path: Path) -> None:
        pyreadstat = pytest.importorskip("pyreadstat")
        path = tmp_path / "r.sav"
        frame = pd.DataFrame({**LONG, "rater": ["José", "Lee", "José", "Lee"]})
        pyreadstat.write_sav(frame, str(path))
        file = read_ratings(path, encoding="UTF-8")
        assert file.read["raters"] == ["José", "Lee"]
        with pytest.raises(RatingsError, match=r"r\.sav"):
            read_ratings(path, encoding="no such encoding")


@pytest.mark.parametrize(
    ("ending", "library"),
    [
        *(("xlsx", "python_calamine"), ("xls", "python_calamine")),
        *(("ods", "python_calamine"), ("parquet", "pyarrow"), ("feather", "pyarrow")),
        *((e, "pyreadstat") for e in ("sav", "zsav", "por", "dta", "sas7bdat", "xpt")),
    ],
)
@pytest.mark.parametrize("data", [b"item,Kim,Lee\nA,1,2\n", b"\0" * 600, b"PK\3\4x"])
def test_another_format_is_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    ending: str,
    library: str,
    data: bytes,
) -> None:
    path = tmp_path / f"r.{ending}"
    path.write_bytes(data)
    with monkeypatch.context() as without:
        without.setitem(sys.modules, library, None)
        with pytest.raises(
            RatingsError, match=rf"needs {library}: pip install 'masrel\[files\]'"
        ):
            read_ratings(path)
    pytest.importorskip(library)
    with pytest.raises(RatingsError, match=rf"or no \.{ending} file") as refusal:
        read_ratings(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("ending", ["xlsx", "parquet", "feather", "sav", "dta", "xpt"])
@pytest.mark.parametrize("part", [0.2, 0.5, 0.9])
def test_a_file_cut_short_is_refused_not_read_in_part(
    tmp_path: Path, ending: str, part: float
) -> None:
    rng = np.random.default_rng(3)
    n = 4000
    frame = pd.DataFrame(
        {
            "item": [f"item{k}" for k in range(n)],
            "Kim": rng.integers(1, 9, n).astype(float),
            "Lee": rng.integers(1, 9, n).astype(float),
        }
    )
    path = tmp_path / f"r.{ending}"
    if ending == "xlsx":
        pytest.importorskip("python_calamine")
        workbook(path, R=[list(frame), *frame.to_numpy().tolist()])
    elif ending in ("parquet", "feather"):
        pytest.importorskip("pyarrow")
        (frame.to_parquet if ending == "parquet" else frame.to_feather)(path)
    else:
        pyreadstat = pytest.importorskip("pyreadstat")
        write = {"sav": "write_sav", "dta": "write_dta", "xpt": "write_xport"}[ending]
        getattr(pyreadstat, write)(frame, str(path))
    data = path.read_bytes()
    assert read_ratings(path).read["n_items"] == n
    # an odd number of bytes: an .xpt file has lines of 80, and no end but the last
    path.write_bytes(data[: int(part * len(data)) | 1])
    with pytest.raises(RatingsError, match="is damaged, or no"):
        read_ratings(path)


def test_a_packed_file_is_read_as_what_is_in_it(tmp_path: Path) -> None:
    inner = parquet(tmp_path / "r.parquet", LONG)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.write(inner, "r.parquet")
    (tmp_path / "r.zip").write_bytes(packed.getvalue())
    assert grades(read_ratings(tmp_path / "r.zip")) == EXPECTED


def bomb(path: Path, n_sheets: int, declared: int | None = None) -> Path:
    """Write a workbook of some 70 kB, the sheets of which are 65 MB of XML."""
    workbook(path, R=WIDE)
    rows = b"<row>" + b"<c><v>1</v></c>" * 1000 + b"</row>"
    name = "xl/worksheets/sheet{}.xml"
    with zipfile.ZipFile(path) as small:
        files = {n: small.read(n) for n in small.namelist() if "/sheet1." not in n}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for file, data in files.items():
            packed.writestr(file, data)
        for sheet in range(1, n_sheets + 1):
            with packed.open(name.format(sheet), "w") as member:
                member.write(SHEET)
                for _ in range(433 // n_sheets):
                    member.write(10 * rows)
                member.write(b"</sheetData></worksheet>")
    if (
        declared is not None
    ):  # in the headers of the sheet: of the file, and in its list
        data, title = path.read_bytes(), name.format(1).encode()
        at, listed = data.index(title) - 30, data.rindex(title) - 46
        for place in (at + 22, listed + 24):
            data = data[:place] + declared.to_bytes(4, "little") + data[place + 4 :]
        path.write_bytes(data)
    return path


SHEET = (
    b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
    b"<sheetData>"
)


@pytest.mark.parametrize(
    ("ending", "n_sheets", "declared"),
    [("xlsx", 1, None), ("xls", 9, None), ("ods", 1, None)],
)
def test_a_workbook_of_more_than_fits_the_memory_is_refused(
    tmp_path: Path, ending: str, n_sheets: int, declared: int | None
) -> None:
    pytest.importorskip("python_calamine")
    path = bomb(tmp_path / "r.xlsx", n_sheets, declared)
    assert path.stat().st_size < 250_000
    path = path.rename(tmp_path / f"r.{ending}")
    with pytest.raises(RatingsError, match="when unpacked: save its sheet as CSV"):
        read_ratings(path)

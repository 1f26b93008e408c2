"""Lines above a table, names in several lines, and notes below."""

import re
from pathlib import Path
from typing import Any

import pytest

from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, Reading, read_ratings
from tests.cli.process import Caller
from tests.ratings.by_hand import grades

TABLE = "patient,Ines,Omar,Yun\nP1,1,2,3\nP2,0,3,0\nP3,1,,1\n"
GRADES = {
    **{("P1", "Ines"): "1", ("P1", "Omar"): "2", ("P1", "Yun"): "3"},
    **{("P2", "Ines"): "0", ("P2", "Omar"): "3", ("P2", "Yun"): "0"},
    **{("P3", "Ines"): "1", ("P3", "Omar"): None, ("P3", "Yun"): "1"},
}
TITLE = "Tone at the elbow, second visit\n\n"
ROWS = TABLE.partition("\n")[2]
TWO_LINES = f"patient,Rater,,\n,Ines,Omar,Yun\n{ROWS}"
OF_TWO = {(item, f"Rater {rater}"): grade for (item, rater), grade in GRADES.items()}


def file_of(folder: Path, content: str | bytes, ending: str = ".csv") -> Path:
    """A file; a workbook has the cells of the text."""
    path = folder / f"r{ending}"
    if ending == ".xlsx":
        assert isinstance(content, str)
        book = pytest.importorskip("openpyxl").Workbook()
        pytest.importorskip("python_calamine")
        for number, line in enumerate(content.split("\n"), start=1):
            for place, cell in enumerate(line.split(","), start=1):
                value = int(cell) if cell.isdecimal() else cell or None
                book.active.cell(number, place, value)
        book.save(path)
    else:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def read(
    folder: Path, content: str | bytes, ending: str, **options: Any
) -> RatingsFile:
    return read_ratings(file_of(folder, content, ending), Reading(**options))


@pytest.mark.parametrize("ending", [".csv", ".xlsx"])
@pytest.mark.parametrize(
    ("text", "options", "expected"),
    [
        (TITLE.replace(",", "") + TABLE, {"skip": 2}, GRADES),
        (TITLE.replace(",", "") + TABLE, {"header": (3,)}, GRADES),
        (f"\n\nTitle\n\n\n{TABLE}", {"skip": 4}, GRADES),  # line 5 is empty, too
        (TABLE, {"header": (1,)}, GRADES),
        (TWO_LINES, {"header": (1, 2)}, OF_TWO),
        (f"\nTitle\n{TWO_LINES}", {"header": (3, 4)}, OF_TWO),
        # an empty cell of the first column has nothing on its left
        (TWO_LINES.replace("patient", ""), {"header": (1, 2)}, OF_TWO),
        # lines between are no names
        (TWO_LINES.replace("\n,", "\n1,2,3,4\n,"), {"header": (1, 3)}, OF_TWO),
        (f",,a,b\n{TWO_LINES}", {"header": (2, 3)}, OF_TWO),
        (
            f",,,b\n{TWO_LINES}",
            {"header": (1, 2, 3), "raters": ("Rater Ines", "Rater Omar")},
            {key: of for key, of in OF_TWO.items() if key[1] != "Rater Yun"},
        ),
        # as pandas writes columns of two levels
        (
            f",Rater,Rater,Rater\n,Ines,Omar,Yun\npatient,,,\n{ROWS}",
            {"header": (1, 2, 3)},
            OF_TWO,
        ),
        (f"Title\n{ROWS}", {"skip": 1, "no_header": True}, None),
        (
            "Title\nrater,P1,P2,P3\nInes,1,0,1\nOmar,2,3,\nYun,3,0,1\n",
            {"skip": 1, "transpose": True},
            GRADES,
        ),
        (f"{TABLE}\nSource: ward 4\n", {}, GRADES),
        (f"{TABLE},,,\nn = 3\nSource: ward 4,,,\n\n", {}, GRADES),
        (f"{TITLE.replace(',', '')}{TABLE}\nSource: ward 4", {"skip": 2}, GRADES),
    ],
)
def test_where_the_names_are(
    tmp_path: Path,
    ending: str,
    text: str,
    options: dict[str, Any],
    expected: dict[tuple[str, str], str | None] | None,
) -> None:
    file = read(tmp_path, text, ending, **options)
    if expected is None:
        names = dict(zip("234", ("Ines", "Omar", "Yun"), strict=True))
        assert {(i, names[r]): g for (i, r), g in grades(file).items()} == GRADES
    else:
        assert grades(file) == expected
    codes = [warning.code for warning in file.warnings]
    assert ("note below" in codes) == ("Source" in text)


REFUSED: list[tuple[str, str]] = [
    (TITLE + TABLE, "--skip 2"),
    (TITLE + TABLE.replace(",", ";"), "--skip 2"),
    (TITLE + TABLE.replace(",", "\t"), "--skip 2"),
    (f"# a comment\n{TITLE}{TABLE}", "--skip 3"),
    (f"sep=,\n{TITLE}{TABLE}", "--skip 3"),
    (f"Table 3. Tone, elbow\n{TABLE}", "--skip 1"),
    (f"Table 3, of tone, arms\n\n{TABLE}", "--skip 2"),
    (f"Table 3, of, tone, arms\n\n{TABLE}P4,1,1,1\n", "--skip 2"),
    (f"Table 3,,,\n,,,\n{TABLE}", "--skip 2"),
    (f"Table 3,,,\nby ward,,,\n{TABLE.replace('Yun', '101')}", "--skip 2"),
    (f"Study,Tone\nDate,2024\n\n{TABLE}", "--skip 3"),
    (f"Study,Tone,,\nDate,2024,,\n,,,\n{TABLE}", "--skip 3"),
    (TITLE + TWO_LINES, "--header 3,4"),
    (f"Table 3,,,\n,,,\n{TWO_LINES}", "--header 3,4"),
    (TWO_LINES, "--header 1,2"),
    (TWO_LINES.replace("\n,Ines", "\nid,Ines"), "--header 1,2"),
    (TWO_LINES.replace("Rater,,", "Rater,Rater,Rater"), "--header 1,2"),
    (TWO_LINES.replace("Rater,,", "Kim,Lee,Oh"), "--header 1,2"),
    (f"patient,Kim,Lee,Oh\n-,MAS,tone,level\n{ROWS}P4,1,1,1\n", "--header 1,2"),
    (f",Rater,Rater,Rater\n,Ines,Omar,Yun\npatient,,,\n{ROWS}", "--header 1,2,3"),
    (
        "item,flu,,acc,\n,Ines,Omar,Ines,Omar\na,1,2,1,1\nb,1,1,2,2\n",
        "--header 1,2 --by-criterion",
    ),
    ("Title\n\nKim Lee Oh\nA 1 1 1\nB 2 1 1\n", "--skip 2"),
]


@pytest.mark.parametrize(("text", "option"), REFUSED)
def test_a_refusal_names_the_option_that_reads_the_table(
    tmp_path: Path, masrel: Caller, text: str, option: str
) -> None:
    path = file_of(tmp_path, text)
    refused = masrel("agree", path)
    assert refused.code == 2
    assert len(refused.err.splitlines()) == 1
    first = re.findall(r"--(?:skip|header) [\d,]+", refused.err)[0]
    assert first == " ".join(option.split()[:2])
    done = masrel("agree", path, *option.split(), "--json", "-")
    assert done.code == 0, done.err


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        (TABLE, {"skip": 9}, "--skip.* line 10"),
        (TABLE, {"header": (4, 9)}, "--header.* line 9"),
        (
            TABLE,
            {"header": (1, 2), "item": "patient"},
            "'patient'; found 'patient P1'",
        ),
        # what is named by the caller is no title, and no note has no letter
        (f"{TABLE}\nSource: ward 4, 2024\n", {}, "line 6: needed 4 cells"),
        (f"{TABLE}\n7\n", {}, "line 6: needed 4 cells"),
        (f"{TABLE}a\nb\n", {}, "line 5: needed 4 cells"),
        (f'{TABLE}"P4\n\nb",1,1\n', {}, "line 5: needed 4 cells"),
        (TITLE + TABLE, {"item": "patient"}, "line 1: .*--skip 2"),
        (f"Date,2024,,\n,,,\n{TABLE}", {"item": "patient"}, "'patient'.*--skip 2"),
        ("item,Kim,Kim\na,1,2\nb,2,2\n", {}, "line 1: .*'Kim' occurs twice"),
        ("item,Kim,Kim\na,1,2\n", {"raters": "Kim"}, "line 1: .*'Kim' occurs twice"),
        ("item,,Kim,Lee\na,x,1,2\nb,y,2,2\n", {}, "line 1: .*column 2, got none"),
    ],
)
def test_where_no_names_are(
    tmp_path: Path, text: str, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(RatingsError, match=words):
        read(tmp_path, text, ".csv", **options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"skip": -1}, "--skip.*got 0"),
        ({"header": (2, 1)}, "--header.*got 2, 1"),
        ({"header": (1, 1)}, "--header.*got 1, 1"),
        ({"header": (1,), "skip": 1}, "--skip, --header: needed one"),
        ({"header": (1,), "no_header": True}, "--no-header, --header: needed one"),
    ],
)
def test_options_that_contradict(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        Reading(**options)


@pytest.mark.parametrize("ending", [".json", ".sav"])
def test_names_of_other_formats_are_in_no_line(tmp_path: Path, ending: str) -> None:
    with pytest.raises(
        RatingsError, match="--skip, --header: needed text or a workbook"
    ):
        read(tmp_path, "[]", ending, skip=1)

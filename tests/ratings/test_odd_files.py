"""Odd files: read right, warned of by name, or refused in one sentence."""

import gzip
import io
import lzma
import math
import re
import warnings
import zipfile
from pathlib import Path
from typing import Any

import pytest

from masrel.agreement import fleiss_kappa, percent_agreement
from masrel.errors import MasrelError, UndefinedStatisticWarning
from masrel.ratings import Reading, read_ratings

Values = tuple[float, float]


def values_of(ratings: Any, **options: Any) -> Values:
    """Percent agreement and Fleiss' kappa; what is undefined is -2, to be compared."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        both = (
            round(percent_agreement(ratings, **options).value, 12),
            round(fleiss_kappa(ratings, **options).value, 12),
        )
    return tuple(-2 if math.isnan(value) else value for value in both)  # type: ignore[return-value]


def outcome(
    folder: Path, data: str | bytes, ending: str = ".csv", **options: Any
) -> tuple[str, str, Values | None]:
    """right, warned or refused; what was said; the values."""
    path = folder / f"r{ending}"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    try:
        file = read_ratings(path, Reading(**options))
    except MasrelError as error:
        message = str(error)
        assert "\n" not in message
        assert len(message) < 600
        return "refused", message, None
    assert not any("\n" in warning for warning in file.warnings)
    counted = file.parts[0].counted
    values = values_of(counted, categories=counted.categories)
    return "warned" if file.warnings else "right", " | ".join(file.warnings), values


# ---- spellings of one grade, the first of Kim ----

NUMBERS = [
    ["1", "1", "1"],
    ["2", "2", "2"],
    ["3", "3", "1"],
    ["1", "2", "2"],
    ["2", "3", "3"],
    ["4", "4", "4"],
]
TEXTS = [
    ["mild", "mild", "mild"],
    ["absent", "mild", "absent"],
    ["severe", "severe", "mild"],
    ["absent", "severe", "severe"],
    ["mild", "mild", "mild"],
]
ASHWORTH = [["1+", "1+", "1"], ["0", "0", "0"], ["2", "1+", "2"], ["3", "3", "2"]]


def with_spelling(table: list[list[str]], spelling: str) -> str:
    rows = [[spelling, *table[0][1:]], *table[1:]]
    lines = [f"item {k},{','.join(row)}" for k, row in enumerate(rows)]
    return "\n".join(["item,Kim,Lee,Oh", *lines, ""])


def with_grade(table: list[list[str]], grade: str | None) -> Values:
    return values_of([[grade, *table[0][1:]], *table[1:]])


# The same number, or the same text.
SAME_NUMBER = (
    *("1", "1.0", "01", "1.", "1e0", "10e-1", "1.000", "001.0", " 1", "1 ", "\t1"),
    *("\u00a01", "1\u2003", '"1"', '" 1 "', '"1\n"', "1\x1f", "\x0c1", "1\u3000"),
)
SAME_TEXT = ("mild", " mild", "mild ", '"mild"', "mild\u00a0", '"mild\r\n"')
# No grade.
MISSING = ("", " ", '""', "NA", '"NA"', " NA ", "\u00a0")
# Grades of their own, as they stand.
OWN = (
    "1+",
    "1-",
    "1++",
    "2a",
    "5",
    "5.5",
    "1e1",
    "1e-300",
    "100000",
    "1.5",
    "0",
    "-0.5",
)
OWN_TEXT = ("x", "very mild", "Δ", "😀", "mild or severe", "1+", "0x10", "I", "1/2")
# Counted as they stand, with a warning.
ODD_NUMBER = (
    *("１", "1\u200b", "\u200b1", "1\ufeff", "\u00ad1", "1\u2060", "¹", "①", "١", "१"),
    *("'1", "'1'", '="1"', "1 +", "1_000", "1%", "1/2", "½", "0x1"),
    *("I", "l", "O", "Ⅰ", "one", "x", "X", "*", "/", "_", "ND", "unknown", "n", "z"),
    *("yes", "2020-01-01", "1:30", "😀", ".a", ".z", "inf", "-inf"),
    *("Infinity", "1e999", "-1e999", "1e-99999999999999999999", "0e99999999999999"),
    *("1" * 400, "1\u0301", "1 2", "1;2", "1,,", "1.0000000000000000000000001"),
    *("9", "8", "7", "99", "88", "77", "999", "9999", "-1", "-9", "-99", "-999", "9.0"),
    *("999999", "-7", "-8", "-88"),
)
ODD_TEXT = (
    *(
        "Mild",
        "MILD",
        "mild.",
        "'mild'",
        "mi\u200bld",
        "m\u0456ld",
        "ｍｉｌｄ",
        "mild!",
    ),
    *("99", "-9", "999", "9", "-1", "mil d", "=mild", "`mild", "mild,"),
)
ODD_ASHWORTH = ("9", "99", "-1", "x", "1 +", "１+", "1＋", "1+.", "NT")
# Refused: there may be no grade, or one of two.
DOUBTFUL = (
    *("nan", "NaN", "NAN", "-nan", "<NA>", "#N/A", "#NA", "#NULL!", "#VALUE!", "#REF!"),
    *("#DIV/0!", "#NAME?", "#NUM!", "N/A", "n/a", "N/A.", "n.a.", "na", "Na", "None"),
    *("NULL", "null", "nil", "NaT", ".", "..", "...", "…", "-", "--", "---", "–", "—"),
    *("−", "‐", "‑", "―", "?", "??", "missing", "Missing", "not rated", "Not Rated"),
    *(
        "unrated",
        "not assessed",
        "n.d.",
        "\\N",
        "(null)",
        "<null>",
        "(blank)",
        "１.#QNAN",
    ),
    *("1.#IND", "\u200b", "\u2060", "\ufeff", '"\u200b "', "undefined", "no rating"),
)
OF_TWO = (
    *("true", "TRUE"),
    "1 000",
    "1'000",
    "+1",
    "+2",
    "+1.0",
    '"1,5"',
    '"1,0"',
    '"1,000"',
    '"1\n2"',
    '"1\r2"',
    "1\x00",
)


@pytest.mark.parametrize(
    ("table", "spelling", "grade"),
    [
        *((NUMBERS, spelling, "1") for spelling in SAME_NUMBER),
        *((TEXTS, spelling, "mild") for spelling in SAME_TEXT),
        *(
            (t, spelling, None)
            for t in (NUMBERS, TEXTS, ASHWORTH)
            for spelling in MISSING
        ),
        *((NUMBERS, spelling, "another") for spelling in OWN),
        *((TEXTS, spelling, "another") for spelling in OWN_TEXT),
    ],
)
def test_what_a_spelling_is(
    table: list[list[str]], spelling: str, grade: str | None, tmp_path: Path
) -> None:
    got = outcome(tmp_path, with_spelling(table, spelling))
    assert got == ("right", "", with_grade(table, grade))


@pytest.mark.parametrize(
    ("table", "spelling"),
    [
        *((NUMBERS, s) for s in ODD_NUMBER),
        *((TEXTS, s) for s in ODD_TEXT),
        *((ASHWORTH, s) for s in ODD_ASHWORTH),
    ],
)
def test_what_may_be_another_grade_or_none_is_warned_of(
    table: list[list[str]], spelling: str, tmp_path: Path
) -> None:
    cell = f'"{spelling}"' if "," in spelling else spelling
    kind, message, values = outcome(tmp_path, with_spelling(table, cell))
    assert kind == "warned"
    assert values == with_grade(table, "another")
    named = spelling.removesuffix(".0")[:20]
    assert named in message or repr(named)[1:-1] in message


@pytest.mark.parametrize(
    ("table", "spelling", "words"),
    [
        *((NUMBERS, s, "line 2, column 'Kim'.*--missing") for s in DOUBTFUL),
        *((TEXTS, s, "line 2, column 'Kim'.*--missing") for s in DOUBTFUL),
        *((NUMBERS, s, "line 2") for s in OF_TWO),
    ],
)
def test_what_may_be_no_grade_or_one_of_two_is_refused(
    table: list[list[str]], spelling: str, words: str, tmp_path: Path
) -> None:
    kind, message, _ = outcome(tmp_path, with_spelling(table, spelling))
    assert kind == "refused"
    assert re.search(words, message)


@pytest.mark.parametrize("spelling", ["#N/A", "-99", "x", ".", "9.0", "--"])
def test_a_code_that_is_named_is_missing(spelling: str, tmp_path: Path) -> None:
    data = with_spelling(NUMBERS, spelling)
    got = outcome(tmp_path, data, missing_codes=[spelling.removesuffix(".0")])
    assert got == ("right", "", with_grade(NUMBERS, None))


# ---- files of one table: rows, separators, bytes ----

TABLE = [["1", "1"], ["2", "2"], ["3", "1"], ["2", "2"]]
LINES = ["item,Kim,Lee", "A,1,1", "B,2,2", "C,3,1", "D,2,2"]
BASE = "\n".join([*LINES, ""])


def lines(*, delimiter: str = ",", end: str = "\n", quote: str = "") -> str:
    rows = [[f"{quote}{cell}{quote}" for cell in line.split(",")] for line in LINES]
    return "".join(delimiter.join(row) + end for row in rows)


def zipped(**members: str) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, text in members.items():
            archive.writestr(name, text)
    return data.getvalue()


def encrypted() -> bytes:
    data = bytearray(zipped(a=BASE))
    data[6] |= 1
    data[data.index(b"PK\x01\x02") + 8] |= 1
    return bytes(data)


ACCENTED = BASE.replace("Kim", "Kím")

RIGHT: dict[str, Any] = {
    "commas": BASE,
    "tabs": lines(delimiter="\t"),
    "semicolons": lines(delimiter=";"),
    "bars": lines(delimiter="|"),
    "blanks": lines(delimiter=" "),
    "many blanks": lines(delimiter="   "),
    "commas and blanks": lines(delimiter=", "),
    "tabs and blanks": lines(delimiter="\t "),
    "colons": (lines(delimiter=":"), {"delimiter": ":"}),
    "carets": (lines(delimiter="^"), {"delimiter": "^"}),
    "bar named": (lines(delimiter="|"), {"delimiter": "|"}),
    "crlf": lines(end="\r\n"),
    "cr": lines(end="\r"),
    "crcrlf": lines(end="\r\r\n"),
    "mixed line ends": "item,Kim,Lee\r\nA,1,1\nB,2,2\rC,3,1\r\nD,2,2",
    "no last line end": BASE.rstrip("\n"),
    "quoted": lines(quote='"'),
    "quoted, crlf": lines(quote='"', end="\r\n"),
    "single quotes in items": BASE.replace("A,", "'A',"),
    "apostrophe in an item": BASE.replace("A,", "A's,"),
    "inch mark in an item": BASE.replace("A,", 'A 5",'),
    "doubled quotes": BASE.replace("A,", '"a ""b""",'),
    "comma in an item": BASE.replace("A,", '"a, b",'),
    "line break in an item": BASE.replace("A,", '"a\nb",'),
    "line break in a name": BASE.replace("Kim", '"Kim\n2"'),
    "two kinds of line break in an item": lines(end="\r\n").replace("A,", '"a\r\nb",'),
    "blank lines": "\n\n" + BASE.replace("\nC", "\n\n\nC") + "\n\n",
    "lines of blanks": BASE.replace("\nC", "\n   \nC") + "  \n",
    "lines of separators": BASE.replace("\nC", "\n,,\nC") + ",,\n",
    "lines of blanks and separators": BASE.replace("\nC", "\n , ,\nC"),
    "separators at line ends": "".join(f"{line},\n" for line in LINES),
    "separators at ends of rows": "".join(
        f"{line},\n" if k else f"{line}\n" for k, line in enumerate(LINES)
    ),
    "no name above row names": BASE.replace("item,", ""),
    "empty name above row names": BASE.replace("item", ""),
    "r's quotes": 'Kim Lee\n"A" 1 1\n"B" 2 2\n"C c" 3 1\n"D" 2 2\n',
    "comment": "# made by hand\n" + BASE,
    "comments and a blank line": "# a\n#\n\n# b\n\n" + BASE,
    "header with #": BASE.replace("item", "#item"),
    "comment above a header with #": "# a\n" + BASE.replace("item", "#item"),
    "sep=": "sep=,\n" + BASE,
    "sep= crlf": "sep=;\r\n" + lines(delimiter=";", end="\r\n"),
    "SEP=": "SEP=,\n" + BASE,
    "quoted sep=": '"sep=,"\n' + BASE,
    "sep= tab": "sep=\t\n" + lines(delimiter="\t"),
    "sep= that is rare": "sep=^\n" + lines(delimiter="^"),
    "sep= and a comment": "sep=,\n# by hand\n" + BASE,
    "line separator in an item": BASE.replace("A,", "A\u2028a,"),
    "next line in an item between blanks": lines(delimiter=" ").replace(
        "A ", "A\x85a "
    ),
    "no-break space in an item between blanks": lines(delimiter=" ").replace(
        "A ", "A\xa0a "
    ),
    "mark": BASE.encode("utf-8-sig"),
    "mark before sep=": ("sep=,\n" + BASE).encode("utf-8-sig"),
    "two marks": b"\xef\xbb\xbf" + BASE.encode("utf-8-sig"),
    "utf-16": ACCENTED.encode("utf-16"),
    "utf-16 big": b"\xfe\xff" + ACCENTED.encode("utf-16-be"),
    "utf-32": ACCENTED.encode("utf-32"),
    "utf-16 without mark": (ACCENTED.encode("utf-16-le"), {"encoding": "utf-16"}),
    "utf-16 big without mark": (ACCENTED.encode("utf-16-be"), {"encoding": "UTF16"}),
    "utf-16-be": (ACCENTED.encode("utf-16-be"), {"encoding": "utf-16-be"}),
    "cp1252": (ACCENTED.encode("cp1252"), {"encoding": "cp1252"}),
    "latin-1": (ACCENTED.encode("latin-1"), {"encoding": "latin-1"}),
    "mac": (ACCENTED.encode("mac-roman"), {"encoding": "mac-roman"}),
    "shift-jis": (BASE.replace("Kim", "金").encode("shift-jis"), {"encoding": "sjis"}),
    "names in many alphabets": BASE.replace("Kim", "Кім").replace("Lee", "이 😀"),
    "gz": (gzip.compress(BASE.encode()), {"ending": ".csv.gz"}),
    "gz in parts": (
        gzip.compress(BASE[:20].encode()) + gzip.compress(BASE[20:].encode()),
        {"ending": ".csv.gz"},
    ),
    "GZ": (gzip.compress(BASE.encode()), {"ending": ".CSV.GZ"}),
    "gz by its bytes": gzip.compress(BASE.encode()),
    "xz": (lzma.compress(BASE.encode()), {"ending": ".csv.xz"}),
    "xz by its bytes": (lzma.compress(BASE.encode()), {"ending": ""}),
    "zip": (zipped(a=BASE), {"ending": ".zip"}),
    "zip with a folder": (zipped(**{"f/": "", "f/a.csv": BASE}), {"ending": ".zip"}),
    "no ending": (BASE, {"ending": ""}),
    "other ending": (BASE, {"ending": ".ratings"}),
    "very long item": BASE.replace("A,", "A" * 200_000 + ","),
    "very long quoted item": BASE.replace("A,", f'"{"A," * 100_000}",'),
    "very long name": BASE.replace("item", "item" * 50_000),
    "numbered raters": BASE.replace("Kim,Lee", "101,102"),
    "raters named as grades": BASE.replace("Kim,Lee", "1,2"),
    "blanks around names": BASE.replace("Kim", "  Kim  "),
    "no header": (BASE.split("\n", 1)[1], {"no_header": True}),
    "no item": ("Kim,Lee\n1,1\n2,2\n3,1\n2,2\n", {"no_item": True}),
    "grades only": (
        "1,1\n2,2\n3,1\n2,2\n",
        {"no_item": True, "no_header": True},
    ),
    "raters as rows": (
        "rater,A,B,C,D\nKim,1,2,3,2\nLee,1,2,1,2\n",
        {"transpose": True},
    ),
    "raters as rows without names": (
        ",A,B,C,D\nKim,1,2,3,2\nLee,1,2,1,2\n",
        {"transpose": True},
    ),
    "one row a rating": "item,rater,grade\n"
    "A,K,1\nA,L,1\nB,K,2\nB,L,2\nC,K,3\nC,L,1\nD,K,2\nD,L,2\n",
    "one row a rating, in capitals": "Rater,ITEM,Score\n"
    "K,A,1\nL,A,1\nK,B,2\nL,B,2\nK,C,3\nL,C,1\nK,D,2\nL,D,2\n",
    "counts": (
        "item,1,2,3\nA,2,0,0\nB,0,2,0\nC,1,0,1\nD,0,2,0\n",
        {"counts": True},
    ),
    "counts with empty cells": (
        "item,1,2,3\nA,2,,\nB,,2,\nC,1,,1\nD,,2,\n",
        {"counts": True},
    ),
    "contingency table": (
        ",1,2,3\n1,1,0,0\n2,0,2,0\n3,1,0,0\n",
        {"table": True},
    ),
    "contingency table in another order": (
        ",3,2,1\n1,0,0,1\n2,0,2,0\n3,0,0,1\n",
        {"table": True},
    ),
    "an ignored column": (
        "item,x,Kim,Lee\nA,q,1,1\nB,r,2,2\nC,s,3,1\nD,t,2,2\n",
        {"ignore": ["x"]},
    ),
    "a decimal comma": (
        "item;Kim;Lee\nA;1,0;1\nB;2;2,0\nC;3;1\nD;2;2\n",
        {"decimal": ","},
    ),
    "decimal commas in every cell": (  # as many columns by commas as by semicolons
        "A;1,0;1,0\nB;2,0;2,0\nC;3,0;1,0\nD;2,0;2,0\n",
        {"decimal": ",", "no_header": True},
    ),
    "decimal commas beside bars": (
        "A|1,0|1,0\nB|2,0|2,0\nC|3,0|1,0\nD|2,0|2,0\n",
        {"decimal": ",", "no_header": True},
    ),
}

WARNED: dict[str, Any] = {
    "raters differ by case": (BASE.replace("Lee", "kim"), "'Kim', 'kim'"),
    "items differ by case": (BASE.replace("B,", "a,"), "'A', 'a'"),
    "items differ by zeros": (
        BASE.replace("A,", "01,").replace("B,", "1,"),
        "'01', '1'",
    ),
    "raters as rows": (
        ",i1,i2,i3,i4,i5\nKim,1,2,3,1,2\nLee,1,2,2,2,1\n",
        "--transpose",
    ),
    "rater without grades": ("item,Kim,Lee,Oh\nA,1,1,\nB,2,1,\n", "'Oh'"),
    "eights and nines": (
        "item,Kim,Lee\nA,1,9\nB,2,2\nC,3,3\nD,4,8\nE,5,5\n",
        "--missing 8,9",
    ),
    "too near for floats": (
        "item,Kim,Lee\nA,9007199254740992,9007199254740993\nB,1,1\n",
        "too close",
    ),
    "too small for floats": ("item,Kim,Lee\nA,0,1e-400\nB,1,1\n", "too close"),
    "points beside decimal commas": (
        "item;Kim;Lee\nA;1,5;1.5\nB;2;2\nC;1,5;2\n",
        "'1,5'.*'1.5'",
        {"decimal": ","},
    ),
    "points of thousands": (
        "item;Kim;Lee\nA;1.000,5;1000,5\nB;2;2\nC;1,5;2\n",
        r"1\.000,5",
        {"decimal": ","},
    ),
    "items that number the rows": (
        "item,rater,grade\n1,K,1\n2,L,1\n3,K,2\n4,L,1\n",
        "--item",
    ),
    "groups differ by case": (
        "item,g,Kim,Lee\nA,x,1,1\nB,X,2,2\nC,x,3,1\n",
        "'X', 'x'",
        {"by": "g"},
    ),
    "counts of an item twice": (
        "item,a,b\nA,3,0\nB,1,2\nA,0,3\n",
        "'item'",
        {"counts": True},
    ),
    "counts of categories that differ by case": (
        "item,mild,Mild\nA,3,0\nB,1,2\n",
        "'mild', 'Mild'",
        {"counts": True},
    ),
}

REFUSED: dict[str, Any] = {
    "counts whose first column is a category": (
        "a,b,c\n3,0,0\n1,2,0\n0,0,3\n",
        "--no-item",
        {"counts": True},
    ),
    "total row": (BASE + "Total,8,6\n", "'Total' looks like a summary"),
    "mean row": (BASE + "Mean,2,1.5\n", "'Mean'"),
    "sd row": (BASE + "SD,2,1\n", "'SD'"),
    "row of numbers of ratings": (BASE + "N,4,4\n", "line 6: 'N'"),
    "commented row": (BASE.replace("\nC", "\n#C"), "line 4: '#C'"),
    "second line of names, one row a rating": (
        "item,rater,grade\nwhich,who,what\nA,K,1\nA,L,1\nB,K,2\nB,L,1\n",
        "line 2.*--header 1,2 .*--header 1 ",
    ),
    "first line of grades": ("A,1,2\nB,2,2\nC,3,1\n", "--no-header"),
    "first line of text grades": (
        "A,mild,severe\nB,mild,mild\nC,severe,severe\n",
        "--no-header",
    ),
    "numbers as names": (BASE.replace("item,Kim,Lee", "x,1,2"), "--no-header"),
    "first column may be a rater": ("Kim,Lee,Oh\n1,1,1\n5,2,2\n3,4,4\n", "--no-item"),
    "first column is called David": (
        "David,Lee,Oh\n1,1,1\n2,2,2\n3,4,4\n",
        "--no-item",
    ),
    "counts": ("item,a,b,c\nA,3,0,0\nB,1,2,0\nC,0,0,3\nD,0,3,0\n", "--counts"),
    "counts, some missing": (
        "item,a,b,c\nA,3,0,0\nB,1,1,0\nC,0,0,3\nD,0,3,0\n",
        "--counts",
    ),
    "counts, empty for none": ("item,a,b\nA,3,\nB,1,2\nC,,3\nD,,3\n", "--counts"),
    "column of text": (
        "item,hand,Kim,Lee\nA,left,1,1\nB,right,2,2\nC,left,3,1\n",
        "--ignore hand",
    ),
    "column of other numbers": (
        "item,bpm,Kim,Lee\nA,61,1,1\nB,72,2,2\nC,83,3,1\n",
        "--ignore bpm",
    ),
    "column called weight": (
        "item,weight,Kim,Lee\nA,1,1,1\nB,2,2,2\nC,3,3,1\n",
        "--frequency weight.*--ignore weight",
    ),
    "colons": (lines(delimiter=":"), "--delimiter"),
    "two separators, no decimal comma": (
        "A;1,b;1,b\nB;2,b;2,b\n",
        "line 1.*--delimiter",
        {"no_header": True},
    ),
    "two separators": ("item,a;Kim,b\nA,1;1,2\nB,2;2,3\n", "--delimiter"),
    "other separator below": ("item,Kim,Lee\nA;1;1\nB;2;2\n", "line 2"),
    "wrong delimiter": (BASE, "line 1.*semicolon", {"delimiter": ";"}),
    "wrong sep=": ("sep=;\n" + BASE, "line 2.*semicolon"),
    "line separators for line ends": (lines(end="\u2028"), "line 1"),
    "end of a DOS file": (BASE + "\x1a", "line 6"),
    "form feed": (BASE + "\x0c\n", "line 6"),
    "short row": (BASE.replace("B,2,2", "B,2"), "line 3: needed 3 cells"),
    "short row, late": (BASE + "E,1,1\n" * 0 + "E,1\n", "line 6"),
    "long row": (BASE.replace("B,2,2", "B,2,2,2"), "line 3: needed 3 cells"),
    "long row, late": (
        BASE + "".join(f"i{k},1,1\n" for k in range(30)) + "x,1,1,1\n",
        "line 36",
    ),
    "long row, late and empty": (
        BASE + "".join(f"i{k},1,1\n" for k in range(30)) + "x,1,1,\n",
        "line 36",
    ),
    "short row below many columns": (
        "item" + "".join(f",r{k}" for k in range(1200)) + "\nA,1,2\n",
        "line 2: needed 1201 cells",
    ),
    "separator at the end of the first line": (
        BASE.replace("Lee\n", "Lee,\n"),
        "line 2",
    ),
    "two separators at line ends": ("".join(f"{x},,\n" for x in LINES), "line 1"),
    "comment between rows": (BASE.replace("\nC", "\n# a\nC"), "line 4"),
    "comment below": (BASE + "# end\n", "line 6"),
    "comment that may be the header": ("# a,b,c\n" + BASE, "line 1.*#"),
    "header after #": (BASE.replace("item", "# item"), "line 1.*#"),
    "comments only": ("# a\n# b\n", "header"),
    "names once more": (BASE + BASE, "line 6"),
    "names once more, at the end": (BASE + LINES[0], "line 6"),
    "names once more, crlf": (lines(end="\r\n") * 2, "line 6"),
    "units": (
        BASE.replace("Lee\n", "Lee\n-,MAS,MAS\n", 1),
        "line 2.*--header 1,2 .*--header 1 ",
    ),
    "an unnamed column": (BASE.replace("Kim", ""), "line 1.*column 2"),
    "an unnamed last column": (BASE.replace("Lee", ""), "line 1.*column 3"),
    "two unnamed columns": (BASE.replace("item,Kim", ","), "line 1.*column 2"),
    "a name twice": (BASE.replace("Lee", "Kim"), "line 1.*'Kim'.*twice"),
    "a name twice, blanks aside": (BASE.replace("Lee", " Kim "), "line 1.*twice"),
    "grades without names": ("1,1\n1,1\n2,2\n", "--no-header"),
    "an item missing": (BASE.replace("B,", ","), "line 3.*item"),
    "an item NA": (BASE.replace("B,", "NA,"), "line 3.*item"),
    "an item twice": (BASE.replace("B,", "A,"), "line 2 and line 3.*--repeated"),
    "an item twice, blanks aside": (BASE.replace("B,", "A ,"), "--repeated"),
    "units without item": (BASE.replace("Lee\n", "Lee\n,MAS,MAS\n"), "line 2.*item"),
    "a row in quotes": (lines(quote="").replace("A,1,1", '"A,1,1"'), "line 2"),
    "rows in quotes": ("".join(f'"{line}"\n' for line in LINES), "--delimiter"),
    "a quote that stays open": (BASE.replace("B,", '"B,'), "line 3"),
    "two quotes that swallow a line": (
        'item,Kim,Lee\nA,"1,1\nB,2",2\nC,2,2\n',
        "line 2.*quote",
    ),
    "quotes by a backslash": (BASE.replace("B,", '"B \\"b, c\\"",'), "line 3"),
    "utf-16 without a mark": (BASE.encode("utf-16-le"), "--encoding utf-16-le"),
    "utf-16-be without a mark": (BASE.encode("utf-16-be"), "--encoding utf-16-be"),
    "utf-16-be of accents": (ACCENTED.encode("utf-16-be"), "--encoding utf-16-be"),
    "cp1252": (ACCENTED.encode("cp1252"), "line 1.*--encoding cp1252"),
    **{
        f"{name}: {words}": (
            f"item,Kim,Lee\n1,{words}\n2,{words}\n".encode(name),
            f"line 2: .*{likely}$",
        )
        for name, words, likely in (
            ("cp1252", "große,kühl", "try --encoding cp1252"),
            ("cp1250", "łagodny,średni", "try --encoding cp1250"),
            ("cp1254", "doğru,yanlış", "try --encoding cp1254"),
            ("cp1251", "да,трудно сказать", "try --encoding cp1251"),
            ("koi8-r", "да,трудно сказать", "try --encoding koi8-r"),
            ("cp866", "да,трудно сказать", "try --encoding cp866"),
            ("cp1253", "ναι,όχι", "try --encoding cp1253"),
            ("cp1255", "לא,אולי", "try --encoding cp1255"),
            ("mac-roman", "élevé,modéré", "try --encoding mac-roman"),
            ("cp850", "élevé,modéré", "try --encoding cp850"),
            ("gbk", "不知道,是", "name it with --encoding"),
            ("shift-jis", "いいえ,はい", "name it with --encoding"),
        )
    },
    "ebcdic": (BASE.encode("cp037"), "--encoding"),
    "utf-8 as utf-16": (BASE, "--encoding utf-8", {"encoding": "utf-16"}),
    "utf-8 as ascii": (ACCENTED, "--encoding utf-8", {"encoding": "ascii"}),
    "an unknown encoding": (BASE, "--encoding.*'foo'", {"encoding": "foo"}),
    "an encoding of bytes": (BASE, "--encoding.*'hex'", {"encoding": "hex"}),
    "an encoding of text": (BASE, "--encoding.*'rot13'", {"encoding": "rot13"}),
    "an encoding of nothing": (BASE, "--encoding", {"encoding": "undefined"}),
    "an encoding with a zero": (BASE, "--encoding", {"encoding": "a\0b"}),
    "a zero byte": (BASE.replace("B,", "B\0,"), "line 3.*zero byte"),
    "zero bytes": (bytes(100), "zero byte"),
    "all bytes": (bytes(range(256)), "byte"),
    "nothing": (b"", "empty"),
    "line ends": (b"\n\r\n", "none"),
    "a mark alone": (b"\xef\xbb\xbf", "none"),
    "blanks": (b"   \n\t\n", "none"),
    "sep= alone": ("sep=,\n", "none"),
    "half a gz": (
        gzip.compress(BASE.encode())[:-6],
        r"damaged.*\.gz",
        {"ending": ".gz"},
    ),
    "a damaged gz": (
        gzip.compress(BASE.encode())[:12] + b"xxxx" + gzip.compress(BASE.encode())[16:],
        "damaged",
        {"ending": ".gz"},
    ),
    "a gz that is none": (BASE, "damaged", {"ending": ".csv.gz"}),
    "a gz of nothing": (gzip.compress(b""), "none", {"ending": ".gz"}),
    "half an xz": (lzma.compress(BASE.encode())[:-5], "damaged", {"ending": ".xz"}),
    "a zip of two": (zipped(a=BASE, b=BASE), "one file.*a, b", {"ending": ".zip"}),
    "a zip of none": (zipped(), "one file", {"ending": ".zip"}),
    "half a zip": (zipped(a=BASE)[:-5], "damaged", {"ending": ".zip"}),
    "an encrypted zip": (encrypted(), "encrypted", {"ending": ".zip"}),
    "a workbook called csv": (zipped(a=BASE), r"\.xlsx"),
    "a parquet called csv": (b"PAR1xxxx", r"\.parquet"),
    "a pdf": (b"%PDF-1.4\n%\xe2\xe3\n", r"\.pdf"),
    "a bz2": (b"BZh91AY", r"\.bz2", {"ending": ".bz2"}),
    "html": ("<html><table><tr><td>1</td></tr></table></html>\n", " HTML"),
    "html of a web program": (
        "\ufeff<!DOCTYPE html>\n<html>",
        " HTML",
        {"ending": ".xls"},
    ),
    "html in utf-16": ("\n <table>".encode("utf-16"), " HTML", {"ending": ".xlsx"}),
    "one column": ("grade\n1\n2\n", "line 1"),
    "one column without names": ("1\n2\n", "line 1", {"no_item": True}),
    "names only": ("item,Kim,Lee\n", "rows"),
    "no grade": ("item,Kim,Lee\nA,,\nB,NA,\n", "grade"),
    "a rating twice": (
        "item,rater,grade\nA,K,1\nA,L,1\nA,K,2\n",
        "line 2 and line 4.*--repeated",
    ),
    "a rating and an empty one": (
        "item,rater,grade\nA,K,1\nA,L,1\nA,K,\n",
        "line 2 and line 4",
    ),
    "no rater": ("item,rater,grade\nA,K,1\nA,,1\n", "line 3, column 'rater'"),
    "unusual names": (
        "what,who,value\nA,K,1\nA,L,1\nB,K,2\nB,L,1\n",
        "--rater, --grade",
    ),
    "a usual name alone": (
        "what,who,value,grade\nA,K,1,1\nA,L,1,2\n",
        "--item and --rater",
    ),
    "two usual names": (
        "item,subject,rater,grade\nA,x,K,1\nA,x,L,1\n",
        "item and subject.*--item",
    ),
    "raters as rows": (
        "rater,A,B,C\nKim,1,2,3\nLee,1,2,1\n",
        "--transpose",
    ),
    "contingency table": (",a,b\na,3,1\nb,0,4\n", "--table"),
    "contingency table with sums": (
        ",a,b,Total\na,3,1,4\nb,0,4,4\nTotal,3,5,8\n",
        "'Total' is the sum",
        {"table": True},
    ),
    "contingency table with a row too many": (
        ",a,b\na,3,1\nb,0,4\nc,1,1\n",
        "as many rows",
        {"table": True},
    ),
    "contingency table of other rows": (
        ",a,b\na,3,1\nc,0,4\n",
        "'c'",
        {"table": True},
    ),
    "contingency table of nothing": (",a,b\na,0,0\nb,0,0\n", "none", {"table": True}),
    "counts with a column of sums": (
        "item,a,b,n\nA,3,0,3\nB,1,2,3\n",
        "'n' is the sum",
        {"counts": True},
    ),
    "counts with a row of sums": (
        "item,a,b\nA,3,0\nB,1,2\nall,4,2\n",
        "line 4.*sum",
        {"counts": True},
    ),
    "negative counts": ("item,a,b\nA,-3,0\n", "line 2.*'-3'", {"counts": True}),
    "parts as counts": ("item,a,b\nA,0.5,0.5\n", "line 2.*'0.5'", {"counts": True}),
    "counts that are too many": ("item,a,b\nA,1e16,0\n", "line 2", {"counts": True}),
    "missing counts": ("item,a,b\nA,NA,3\n", "line 2.*'NA'", {"counts": True}),
    "counts and table": (BASE, "--counts, --table", {"counts": True, "table": True}),
    "a rater twice": (BASE, "--raters.*'Kim'.*twice", {"raters": ["Kim,Kim"]}),
    "a rater and item": (BASE, "--raters, --item", {"raters": ["Kim"], "item": "Kim"}),
    "a rater ignored": (BASE, "--ignore", {"raters": ["Kim"], "ignore": ["Kim"]}),
    "an item ignored": (BASE, "--ignore", {"item": "item", "ignore": ["item"]}),
    "all ignored": (BASE, "rater", {"ignore": ["Kim", "Lee"]}),
    "an unknown rater": (BASE, "'Kin'.*'Kim'", {"raters": ["Kin"]}),
    "wide and long": (BASE, "--raters", {"raters": ["Kim"], "grade": "Lee"}),
    "no item and an item": (BASE, "--no-item", {"no_item": True, "item": "item"}),
    "a grade twice in the scale": (
        BASE,
        "--categories.*'1'",
        {"categories": ["1", "1", "2", "3"]},
    ),
    "an empty grade in the scale": (
        BASE,
        "--categories",
        {"categories": ["1", "", "2"]},
    ),
    "a grade beyond the scale": (
        BASE,
        "line 4, column 'Kim'.*'3'",
        {"categories": ["1", "2"]},
    ),
    "a grade that is missing": (
        BASE,
        "--categories, --missing",
        {"categories": ["1", "2", "3"], "missing_codes": ["3.0"]},
    ),
    "all missing": (BASE, "grade", {"missing_codes": ["1", "2", "3"]}),
}


def unpacked(case: Any) -> tuple[Any, dict[str, Any]]:
    return case if isinstance(case, tuple) else (case, {})


@pytest.mark.parametrize("name", RIGHT)
def test_files_that_are_read_right(name: str, tmp_path: Path) -> None:
    data, options = unpacked(RIGHT[name])
    assert outcome(tmp_path, data, **options) == ("right", "", values_of(TABLE))


@pytest.mark.parametrize("name", WARNED)
def test_files_that_are_warned_of(name: str, tmp_path: Path) -> None:
    data, regex, *options = WARNED[name]
    kind, message, _ = outcome(tmp_path, data, **dict(*options))
    assert kind == "warned"
    assert re.search(regex, message)


@pytest.mark.parametrize("name", REFUSED)
def test_files_that_are_refused(name: str, tmp_path: Path) -> None:
    data, regex, *options = REFUSED[name]
    kind, message, _ = outcome(tmp_path, data, **dict(*options))
    assert kind == "refused"
    assert re.search(regex, message)


# ---- sizes ----


def test_a_folder_and_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(MasrelError, match="needed a file, got a folder"):
        read_ratings(tmp_path)
    with pytest.raises(MasrelError, match="no such file"):
        read_ratings(tmp_path / "no.csv")

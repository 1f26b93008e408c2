"""What is read of a file of ratings: shapes, names, grades, options."""

import gzip
import io
import os
import re
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from masrel.agreement import CountedRatings, fleiss_kappa
from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, Reading, read_ratings
from masrel.scales import MODIFIED_ASHWORTH
from tests.cli.process import Caller
from tests.ratings.by_hand import read

WIDE = "patient,Kim,Lee,Ann\nA,1,1,2\nB,2,2,NA\nC,3,,3\n"
LONG = (
    "item,rater,grade\nA,Kim,1\nA,Lee,1\nA,Ann,2\nB,Kim,2\nB,Lee,2\nC,Kim,3\nC,Ann,3\n"
)
TABLE = [["1", "1", "2"], ["2", "2", None], ["3", None, "3"]]


def grades_of(file: RatingsFile) -> list[list[list[str | None]]]:
    """The grades of each part as text, item by rater."""
    grades = (*file.scale.grades, None)
    return [
        [[grades[code] for code in row] for row in part.ratings.codes.tolist()]
        for part in file.parts
    ]


PAIRS = "1,1\n2,2\n3,1\n1,1\n"
OF_PAIRS = [["1", "1"], ["2", "2"], ["3", "1"], ["1", "1"]]
SITES = "site,nr,Kim,Lee\nN,1,1,1\nN,2,2,2\nS,1,3,1\n"
COMMAS = 'patient,"Kim, A","Lee, B",Oh\nA,1,1,1\nB,2,2,1\n'
CODES = "item,Kim,Lee\nA,1,9\nB,x,2\nC,2,2\nD,9.0,not rated\n"
ZEROS = "item,Kim,Lee\nA,1,1.0\nB,01,2\n"
PLUS = "item,Kim,Lee\nA,+1,1\nB,0,2\n"
LETTERS = "item,Kim,Lee\nA,l\u00e9ger,le\u0301ger\nB,x,x\n"
ASHWORTH = ["0", "1", "1+", "2", "3", "4"]
AGES = "patient,age,Kim,Lee,note\nA,61,1,1,x\nB,47,2,2,\nC,61,3,1,y\n"
DECIMALS = "item;Kim;Lee\nA;1,5;1,50\nB;2;2,0\n"
TWICE = "item,rater,grade\nA,K,1\nA,L,1\nA,K,2\nB,K,3\nB,L,\nB,L,3\n"
SESSIONS = (
    "visit,item,rater,grade\n1,A,K,1\n1,A,L,1\n1,B,K,2\n1,B,L,1\n"
    "2,A,K,2\n2,A,L,2\n2,B,K,2\n2,B,L,2\n"
)
VISITS = [[["1", "1"], ["2", "1"]], [["2", "2"], ["2", "2"]]]
BY_SITE = "item,site,Kim,Lee\nA,N,1,1\nB,S,5,5\nC,N,2,1\n"
QUALTRICS = (
    'patient,Kim,Lee\n"Which patient?","How severe?","How severe?"\n'
    '"{""ImportId"":""Q1""}","{""ImportId"":""Q2""}","{""ImportId"":""Q3""}"\n'
    "A,1,1\nB,2,1\nC,2,2\n"
)
NUMBERED = "P1,mild,severe\nP2,no,no\nP3,no,some\nP4,some,some\n"
SEVERITY = "item,Kim,Lee\nA,mild,severe\nB,absent,mild\n"

# text, options, grades of one part, what the record says
READ: list[tuple[str, dict[str, Any], list[list[str | None]], dict[str, Any]]] = [
    (
        WIDE,
        {},
        TABLE,
        {
            "format": "CSV",
            "delimiter": "comma",
            "encoding": "utf-8",
            "layout": "wide",
            "item": ["patient"],
            "raters": ["Kim", "Lee", "Ann"],
            "ignored": [],
            "n_items": 3,
            "n_raters": 3,
            "n_ratings": 7,
            "n_missing": 2,
            "missing": {"": 1, "NA": 1},
            "grades": {"1": 2, "2": 3, "3": 2},
            "merged": {},
            "dropped": {},
            "n_repeated": 0,
            "repeated": None,
            "scale": {"name": "observed", "grades": ["1", "2", "3"], "declared": False},
            "warnings": [],
        },
    ),
    (WIDE.replace("\n", "\r"), {}, TABLE, {"n_items": 3}),  # of an old Mac
    (
        NUMBERED.replace("P1", "patient"),
        {},
        [["no", "no"], ["no", "some"], ["some", "some"]],
        {"warnings": []},
    ),
    # columns by name
    (LONG, {}, TABLE, {"rater": "rater", "grade": "grade", "n_missing": 0}),
    *(
        (LONG.replace("item,rater,grade", header), options, TABLE, {})
        for header, options in (
            ("what,who,value", {"item": "what", "rater": "who", "grade": "value"}),
            ("what,who,grade", {"item": "what", "rater": "who"}),
            ("Subject_ID,Coder,Label", {}),
            ("bild,rater,score", {}),
            ("item,wer,score", {"rater": "wer"}),
            ("item,idreviewer,score", {}),
            ("item,rater,wert", {}),
        )
    ),
    (AGES, {"raters": ["Kim", "Lee"]}, OF_PAIRS[:3], {}),
    (AGES, {"ignore": ["age,note"]}, OF_PAIRS[:3], {"ignored": ["age", "note"]}),
    (SITES, {"item": ["site", "nr"]}, OF_PAIRS[:3], {"item": ["site", "nr"]}),
    (SITES, {"item": ["site,nr"]}, OF_PAIRS[:3], {}),
    (COMMAS, {"raters": ["Kim, A,Lee, B"]}, OF_PAIRS[:2], {}),
    (COMMAS, {"raters": ["Lee, B", "Oh"]}, [["1", "1"], ["2", "1"]], {}),
    ("Kim,Lee\n" + PAIRS, {"no_item": True}, OF_PAIRS, {}),
    (PAIRS, {"no_item": True, "no_header": True}, OF_PAIRS, {}),
    (
        "A,x,1\nA,y,2\n",
        {"no_header": True, "item": "1", "rater": "2", "grade": "3"},
        [["1", "2"]],
        {},
    ),
    ("rater,A,B,C\nKim,1,2,3\nLee,1,2,\nAnn,2,NA,3\n", {"transpose": True}, TABLE, {}),
    (
        QUALTRICS,
        {},
        [["1", "1"], ["2", "1"], ["2", "2"]],
        {"dropped": {"second header": 2}},
    ),
    # which grade a text is
    (
        CODES,
        {"missing_codes": ["9", "x", "not rated"]},
        [["1", None], [None, "2"], ["2", "2"], [None, None]],
        {"missing": {"9": 1, "x": 1, "9.0": 1, "not rated": 1}, "n_missing": 4},
    ),
    (
        "item,Kim,Lee\nA,NA,NA\nB,b,\n",
        {"categories": ["NA", "b"]},
        [["NA", "NA"], ["b", None]],
        {},
    ),
    (
        "item,Kim,Lee\nA,1,1.0\nB,02,2\nC,10,3\n",
        {},
        [["1", "1"], ["2", "2"], ["10", "3"]],
        {"merged": {"1": ["1", "1.0"], "2": ["02", "2"]}},
    ),
    (
        "item,Kim,Lee\nA,TRUE,1\nB,false,0.0\nC,NA,1\n",
        {},
        [["1", "1"], ["0", "0"], [None, "1"]],
        {"merged": {"1": ["TRUE", "1"], "0": ["false", "0.0"]}},
    ),
    ("item,Kim,Lee\nA,True,x\nB,x,True\n", {}, [["True", "x"], ["x", "True"]], {}),
    ("item,Kim,Lee\nA,1,1.0\nB,1+,2\n", {}, [["1", "1.0"], ["1+", "2"]], {}),
    (ZEROS, {"categories": ["1.0", "2", "3"]}, [["1.0", "1.0"], ["1.0", "2"]], {}),
    (ZEROS, {"categories": ["1", "1.0", "01", "2"]}, [["1", "1.0"], ["01", "2"]], {}),
    (PLUS, {"categories": ASHWORTH}, [["1+", "1"], ["0", "2"]], {}),
    (PLUS, {"categories": ["0", "1", "2"]}, [["1", "1"], ["0", "2"]], {}),
    (LETTERS, {}, [["l\u00e9ger", "l\u00e9ger"], ["x", "x"]], {}),
    (
        LETTERS,
        {"categories": ["le\u0301ger", "x"]},
        [["l\u00e9ger", "l\u00e9ger"], ["x", "x"]],
        {},
    ),
    (DECIMALS, {"decimal": ","}, [["1.5", "1.5"], ["2", "2"]], {}),
    (
        DECIMALS,
        {"categories": ["1,5", "1,50", "2", "2,0"]},
        [["1,5", "1,50"], ["2", "2,0"]],
        {},
    ),
    (
        SEVERITY,
        {"categories": ["severe", "mild", "absent", "none"]},
        [["mild", "severe"], ["absent", "mild"]],
        {"grades": {"severe": 1, "mild": 2, "absent": 1}},
    ),
    # repeats: an empty cell displaces no grade
    (TWICE, {"repeated": "first"}, [["1", "1"], ["3", "3"]], {"n_repeated": 2}),
    (TWICE, {"repeated": "last"}, [["1", "2"], ["3", "3"]], {"repeated": "last"}),
    (TWICE, {"repeated": "mean"}, [["1.5", "1"], ["3", "3"]], {}),
]


@pytest.mark.parametrize(("text", "options", "grades", "record"), READ)
def test_what_is_read(
    tmp_path: Path,
    text: str,
    options: dict[str, Any],
    grades: list[list[str | None]],
    record: dict[str, Any],
) -> None:
    file = read(tmp_path, text, **options)
    assert grades_of(file) == [grades]
    assert {key: file.read[key] for key in record} == record


@pytest.mark.parametrize(
    ("text", "options", "parts", "grades"),
    [
        (SESSIONS, {"session": "visit"}, [(None, "1"), (None, "2")], VISITS),
        (SESSIONS.replace("visit", "Session"), {}, [(None, "1"), (None, "2")], VISITS),
        (SESSIONS, {"by": "visit"}, [("1", None), ("2", None)], VISITS),
        (
            SESSIONS,
            {"by": "visit", "session": "visit"},
            [("1", None), ("2", None)],
            VISITS,
        ),
        (
            BY_SITE,
            {"by": "site"},
            [("N", None), ("S", None)],
            [[["1", "1"], ["2", "1"]], [["5", "5"]]],
        ),
    ],
)
def test_groups_and_sessions_are_parts(
    tmp_path: Path, text: str, options: dict[str, str], parts: object, grades: object
) -> None:
    file = read(tmp_path, text, **options)
    assert [(part.group, part.session) for part in file.parts] == parts
    assert grades_of(file) == grades


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        (ZEROS, {"categories": ["1", "1.0", "2"]}, r"line 3, column 'Kim'.*'01'"),
        (PLUS.replace("0", "1"), {}, r"'\+1'.*--categories"),
        (PLUS.replace("2", "1+"), {}, r"'\+1'.*--categories"),
        (DECIMALS, {}, "--decimal ,"),
        (AGES, {}, "--ignore age,note"),
        (TWICE, {}, "line 2 and line 4: 'K' graded 'A'"),
        (
            "day,item,rater,grade\n1,A,K,1\n1,A,L,1\n2,A,K,2\n",
            {},
            "line 2 and line 4: 'K' graded 'A'",
        ),
        (TWICE.replace("1", "a"), {"repeated": "mean"}, "--repeated mean"),
        # raters, or what is left over
        (LONG.replace("rater,grade", "wer,score"), {}, "name columns with --rater"),
        (
            LONG.replace("item,rater", "subject,outcome"),
            {"item": "subject", "grade": "grade"},
            "name columns with --rater",
        ),
        (NUMBERED, {}, "--no-header"),  # though they are no grades of other rows
        (
            TWICE,
            {"repeated": "mean", "categories": ["1", "2", "3"]},
            "without --categories",
        ),
        (BY_SITE.replace("S", ""), {"by": "site"}, "line 3, column 'site'"),
        (
            "rater,A,B,C\nKim,1,2,n/a\nLee,1,2,2\n",
            {"transpose": True},
            r"r\.csv: column 4, column 'Kim'.*n/a",
        ),
        (
            "Kim,Lee,Ann\n1,1,2\n2,2,1\n1,2,2\n2,2,2\n",
            {},
            "'Kim', has .*--no-item if",
        ),
        (
            "item,mild,severe\nA,2,1\n",
            {"counts": True, "categories": ["a"]},
            "mild, sev",
        ),
        *(
            (WIDE, options, words)
            for options, words in (
                ({"item": "nobody"}, "--item: there is no column 'nobody'"),
                ({"by": "patiend"}, "did you mean 'patient'"),
                ({"session": "x"}, "--session"),
                ({"rater": "Kim", "grade": "Kim"}, "--rater, --grade"),
                ({"raters": ["Kim"], "rater": "Lee"}, "--raters"),
                ({"raters": ["Kim", "Lee", "Kim"]}, "'Kim' twice"),
                ({"counts": True, "table": True}, "--counts, --table"),
                ({"no_item": True, "item": "patient"}, "--no-item"),
                ({"counts": True, "session": "patient"}, "--session: counts"),
                ({"counts": True, "missing_codes": ["9"]}, "--missing: .* got 9"),
                ({"categories": ["1", "2", "2", "3"]}, r"repeated: '2'"),
                (
                    {"categories": ["1", "2", "3"], "missing_codes": ["3"]},
                    "'3' is a grade or miss",
                ),
            )
        ),
    ],
)
def test_what_is_refused(
    tmp_path: Path, text: str, options: dict[str, Any], words: str
) -> None:
    with pytest.raises((RatingsError, ParameterError), match=words):
        read(tmp_path, text, **options)


@pytest.mark.parametrize(
    ("text", "options", "grades", "n_raters", "kappas"),
    [
        # observed 1/3 and 1; chance 14/36: (2/3 - 7/18) / (11/18)
        (
            "item,10,2,3\nA,2,0,1\nB,0,3,\n",
            {"counts": True},
            *({"2": 3, "3": 1, "10": 2}, 3, [5 / 11]),
        ),
        (
            "item,mild,severe\nA,2,1\nB,0,3\n",
            {"counts": True, "categories": ["severe", "mild"]},
            # observed 1/3 and 1; chance (2/3)² + (1/3)²
            *({"severe": 4, "mild": 2}, 3, [(2 / 3 - 5 / 9) / (4 / 9)]),
        ),
        (
            "item,site,a,b\nA,N,2,0\nB,S,1,1\nC,N,0,2\n",
            {"counts": True, "by": "site"},
            *({"a": 3, "b": 3}, 2, [1, -1]),
        ),
        # low, low five times; high, high twice; high, low once: observed 7/8
        *(
            (text, options, {"low": 11, "high": 5}, 2, [1 - (1 / 8) / (110 / 256)])
            for text, options in (
                (",low,high\nhigh,1,2\nlow,5,0\n", {"table": True}),
                ("low,high\n5,0\n1,2\n", {"table": True, "no_item": True}),
            )
        ),
        # 6000 items by 6000 raters, two ratings an item: half agree, a quarter is 0
        (
            "item,rater,grade\n"
            + "".join(
                f"i{k},r{k},1\ni{k},r{(k + 1) % 6000},{k % 2}\n" for k in range(6000)
            ),
            *({}, {"0": 3000, "1": 9000}, 6000, [(1 / 2 - 10 / 16) / (6 / 16)]),
        ),
    ],
)
def test_counts(
    tmp_path: Path,
    text: str,
    options: dict[str, Any],
    grades: dict[str, int],
    n_raters: int,
    kappas: list[float],
) -> None:
    file = read(tmp_path, text, **options)
    assert file.read["grades"] == grades
    assert list(file.read["grades"]) == list(file.scale.grades) == list(grades)
    assert file.read["n_raters"] == n_raters
    values = []
    for part in file.parts:
        assert isinstance(part.ratings, CountedRatings)
        values.append(fleiss_kappa(part.counted, categories=file.scale.values).value)
    assert values == pytest.approx(kappas)


@pytest.mark.parametrize(
    ("text", "options", "grades", "is_ordered"),
    [
        (WIDE, {}, ("1", "2", "3"), True),
        ("item,Kim,Lee\nA,1+,1\nB,0,2\n", {}, MODIFIED_ASHWORTH.grades, True),
        ("item,Kim,Lee\nA,1+,1\nB,0,5\n", {}, ("0", "1", "1+", "5"), False),
        (SEVERITY, {}, ("absent", "mild", "severe"), False),
        (SEVERITY, {"categories": ["severe", "mild", "absent"]}, None, True),
    ],
)
def test_scales(
    tmp_path: Path, text: str, options: dict[str, Any], grades: object, is_ordered: bool
) -> None:
    file = read(tmp_path, text, **options)
    assert file.scale.grades == (grades or tuple(options["categories"]))
    assert file.is_ordered is is_ordered
    assert file.read["scale"]["declared"] is bool(options)


def test_a_simulated_file_says_so(tmp_path: Path) -> None:
    assert read(tmp_path, "# SIMULATED\n" + WIDE).simulated
    text = re.sub(r"(\d)\n", r"\1,simulated\n", LONG).replace("grade", "grade,source")
    assert read(tmp_path, text).simulated
    assert not read(tmp_path, text.replace("simulated", "foreign")).simulated


def test_standard_input_and_pipes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for data in (WIDE.encode(), gzip.compress(WIDE.encode())):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
        assert grades_of(read_ratings("-")) == [TABLE]
    with pytest.raises(RatingsError, match="no such file"):
        read_ratings(tmp_path / "-")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        write = (tmp_path / "pipe").write_text
        writer = threading.Thread(target=write, args=(WIDE,))
        writer.start()
        assert grades_of(read_ratings(tmp_path / "pipe")) == [TABLE]
        writer.join()


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (KeyboardInterrupt(), "stopped by Ctrl-C"),
        (MemoryError("2 GiB"), "there is not enough memory. 2 GiB"),
    ],
)
@pytest.mark.parametrize(
    ("place", "options"),
    [
        ("masrel.ratings.read_ratings", ()),
        ("masrel.ratings._large.groups_of", ("--stream",)),
    ],
)
def test_an_end_from_outside_is_one_sentence(
    error: BaseException,
    words: str,
    place: str,
    options: tuple[str, ...],
    tmp_path: Path,
    masrel: Caller,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise error

    if options:
        pytest.importorskip("duckdb")
    monkeypatch.setattr(place, interrupted)
    path = tmp_path / "r.csv"
    path.write_text(WIDE)
    done = masrel("agree", path, *options)
    assert done.code == 1
    assert done.err.strip() == f"masrel: {words}"  # below the ^C of a terminal


def test_an_encoding_that_is_given_outdoes_a_mark(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_bytes("ÿþ,Kim,Lee\nA,1,1\nB,2,1\n".encode("latin-1"))  # UTF-16's mark
    assert read_ratings(path, Reading(encoding="latin-1")).read["item"] == ["ÿþ"]

"""What is read of a file of ratings: shapes, names, grades, options."""

import gzip
import hashlib
import io
import json
import math
import os
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from masrel.agreement import CodedRatings, CountedRatings, fleiss_kappa
from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, read_ratings
from masrel.scales import MODIFIED_ASHWORTH
from tests.cli.process import Caller

WIDE = "patient,Kim,Lee,Ann\nA,1,1,2\nB,2,2,NA\nC,3,,3\n"
LONG = (
    "item,rater,grade\nA,Kim,1\nA,Lee,1\nA,Ann,2\nB,Kim,2\nB,Lee,2\nC,Kim,3\nC,Ann,3\n"
)
TABLE = [["1", "1", "2"], ["2", "2", None], ["3", None, "3"]]


def read(folder: Path, text: str, **options: Any) -> RatingsFile:
    path = folder / "r.csv"
    path.write_text(text, encoding="utf-8")
    return read_ratings(path, **options)


def grades_of(file: RatingsFile, part: int = 0) -> list[list[str | None]]:
    """The grades of a part as text, item by rater."""
    ratings = file.parts[part].ratings
    assert isinstance(ratings, CodedRatings)
    grades = (*file.scale.grades, None)
    return [[grades[code] for code in row] for row in ratings.codes.tolist()]


# ---- shapes ----


def test_a_wide_table(tmp_path: Path) -> None:
    file = read(tmp_path, WIDE)
    (part,) = file.parts
    assert (part.group, part.session) == (None, None)
    assert part.items == ("A", "B", "C")
    assert part.raters == ("Kim", "Lee", "Ann")
    assert grades_of(file) == TABLE
    assert file.scale.values == (1, 2, 3)
    assert file.is_ordered
    assert not file.simulated
    assert file.warnings == ()


@pytest.mark.parametrize("stream", [False, True])
def test_the_hash_is_that_of_the_file(tmp_path: Path, stream: bool) -> None:
    path = tmp_path / "r.csv"
    path.write_text(WIDE)
    file = read_ratings(path, stream=stream)
    assert file.sha256() == hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_record_says_what_was_read(tmp_path: Path) -> None:
    read_of_file = read(tmp_path, WIDE).read
    expected = {
        "file": str(tmp_path / "r.csv"),
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
    }
    assert {key: read_of_file[key] for key in expected} == expected


def test_a_long_table_is_the_same(tmp_path: Path) -> None:
    file = read(tmp_path, LONG)
    assert grades_of(file) == TABLE
    assert file.parts[0].raters == ("Kim", "Lee", "Ann")
    assert (file.read["rater"], file.read["grade"]) == ("rater", "grade")
    assert file.read["n_missing"] == 0  # rows without a grade


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("what,who,value", {"item": "what", "rater": "who", "grade": "value"}),
        ("what,who,grade", {"item": "what", "rater": "who"}),
        ("Subject_ID,Coder,Label", {}),
        ("bild,rater,score", {}),
        ("item,wer,score", {}),
        ("item,rater,wert", {}),
    ],
)
def test_columns_by_name(header: str, options: dict[str, str], tmp_path: Path) -> None:
    file = read(tmp_path, LONG.replace("item,rater,grade", header), **options)
    assert grades_of(file) == TABLE


def test_raters_or_what_is_ignored(tmp_path: Path) -> None:
    text = "patient,age,Kim,Lee,note\nA,61,1,1,x\nB,47,2,2,\nC,61,3,1,y\n"
    expected = [["1", "1"], ["2", "2"], ["3", "1"]]
    assert grades_of(read(tmp_path, text, raters=["Kim", "Lee"])) == expected
    file = read(tmp_path, text, ignore=["age,note"])
    assert grades_of(file) == expected
    assert file.read["ignored"] == ["age", "note"]
    with pytest.raises(RatingsError, match="--ignore age,note"):
        read(tmp_path, text)


PAIRS = "1,1\n2,2\n3,1\n1,1\n"
OF_PAIRS = [["1", "1"], ["2", "2"], ["3", "1"], ["1", "1"]]
SITES = "site,nr,Kim,Lee\nN,1,1,1\nN,2,2,2\nS,1,3,1\n"
COMMAS = 'patient,"Kim, A","Lee, B",Oh\nA,1,1,1\nB,2,2,1\n'
CODES = "item,Kim,Lee\nA,1,9\nB,x,2\nC,2,2\nD,9.0,not rated\n"
ZEROS = "item,Kim,Lee\nA,1,1.0\nB,01,2\n"
PLUS = "item,Kim,Lee\nA,+1,1\nB,0,2\n"
LETTERS = "item,Kim,Lee\nA,l\u00e9ger,le\u0301ger\nB,x,x\n"
ASHWORTH = ["0", "1", "1+", "2", "3", "4"]
READ: list[tuple[str, dict[str, Any], list[list[str | None]]]] = [
    (SITES, {"item": ["site", "nr"]}, [["1", "1"], ["2", "2"], ["3", "1"]]),
    (SITES, {"item": ["site,nr"]}, [["1", "1"], ["2", "2"], ["3", "1"]]),
    (COMMAS, {"raters": ["Kim, A,Lee, B"]}, [["1", "1"], ["2", "2"]]),
    (COMMAS, {"raters": ["Lee, B", "Oh"]}, [["1", "1"], ["2", "1"]]),
    ("Kim,Lee\n" + PAIRS, {"no_item": True}, OF_PAIRS),
    (PAIRS, {"no_item": True, "no_header": True}, OF_PAIRS),
    (
        "A,x,1\nA,y,2\n",
        {"no_header": True, "item": "1", "rater": "2", "grade": "3"},
        [["1", "2"]],
    ),
    (
        "rater,A,B,C\nKim,1,2,3\nLee,1,2,\nAnn,2,NA,3\n",
        {"transpose": True},
        [["1", "1", "2"], ["2", "2", None], ["3", None, "3"]],
    ),
    (
        CODES,
        {"missing_codes": ["9", "x", "not rated"]},
        [["1", None], [None, "2"], ["2", "2"], [None, None]],
    ),
    (
        "item,Kim,Lee\nA,NA,NA\nB,b,\n",
        {"categories": ["NA", "b"]},
        [["NA", "NA"], ["b", None]],
    ),
    ("item,Kim,Lee\nA,1,1.0\nB,1+,2\n", {}, [["1", "1.0"], ["1+", "2"]]),
    (ZEROS, {"categories": ["1.0", "2", "3"]}, [["1.0", "1.0"], ["1.0", "2"]]),
    (ZEROS, {"categories": ["1", "1.0", "01", "2"]}, [["1", "1.0"], ["01", "2"]]),
    (PLUS, {"categories": ASHWORTH}, [["1+", "1"], ["0", "2"]]),
    (PLUS, {"categories": ["0", "1", "2"]}, [["1", "1"], ["0", "2"]]),
    (LETTERS, {}, [["l\u00e9ger", "l\u00e9ger"], ["x", "x"]]),
    (
        LETTERS,
        {"categories": ["le\u0301ger", "x"]},
        [["l\u00e9ger", "l\u00e9ger"], ["x", "x"]],
    ),
]


@pytest.mark.parametrize(("text", "options", "grades"), READ)
def test_what_is_read(
    tmp_path: Path,
    text: str,
    options: dict[str, Any],
    grades: list[list[str | None]],
) -> None:
    assert grades_of(read(tmp_path, text, **options)) == grades


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        (ZEROS, {"categories": ["1", "1.0", "2"]}, r"line 3, column 'Kim'.*'01'"),
        (PLUS.replace("0", "1"), {}, r"'\+1'.*--categories"),
        (PLUS.replace("2", "1+"), {}, r"'\+1'.*--categories"),
    ],
)
def test_what_is_refused(
    tmp_path: Path, text: str, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(RatingsError, match=words):
        read(tmp_path, text, **options)


def test_codes_of_missing_grades_are_counted(tmp_path: Path) -> None:
    file = read(tmp_path, CODES, missing_codes=["9", "x", "not rated"])
    assert file.read["missing"] == {"9": 1, "x": 1, "9.0": 1, "not rated": 1}
    assert file.read["n_missing"] == 4


def test_counts(tmp_path: Path) -> None:
    text = "item,10,2,x2\nA,2,0,1\nB,0,3,\n"
    file = read(tmp_path, text.replace("x2", "3"), counts=True)
    assert file.scale.grades == ("2", "3", "10")
    (part,) = file.parts
    assert part.raters == ()
    assert file.read["grades"] == {"2": 3, "3": 1, "10": 2}
    assert file.read["n_raters"] == 3
    # Observed 1/3 and 1; shares 1/2, 1/6, 1/3 make chance 14/36: (2/3 - 7/18) / (11/18)
    assert fleiss_kappa(part.counted, categories=file.scale.values).value == (
        pytest.approx(5 / 11)
    )
    text = "item,mild,severe\nA,2,1\nB,0,3\n"
    file = read(tmp_path, text, counts=True, categories=["severe", "mild"])
    assert file.scale.grades == ("severe", "mild")
    with pytest.raises(RatingsError, match=r"--categories.*mild, severe"):
        read(tmp_path, text, counts=True, categories=["mild", "moderate"])


def test_counts_by_group(tmp_path: Path) -> None:
    text = "item,site,a,b\nA,N,2,0\nB,S,1,1\nC,N,0,2\n"
    file = read(tmp_path, text, counts=True, by="site")
    values = [
        fleiss_kappa(part.counted, categories=(1, 2)).value for part in file.parts
    ]
    assert [part.group for part in file.parts] == ["N", "S"]
    assert values == [1.0, -1.0]


def test_a_contingency_table(tmp_path: Path) -> None:
    text = ",low,high\nhigh,1,2\nlow,5,0\n"
    file = read(tmp_path, text, table=True)
    (part,) = file.parts
    assert isinstance(part.ratings, CountedRatings)
    # low, low five times; high, high twice; high, low once
    assert file.read["n_items"] == 8
    assert file.read["grades"] == {"low": 11, "high": 5}
    # Observed 7/8; chance (11/16)² + (5/16)²
    chance = (121 + 25) / 256
    value = fleiss_kappa(part.counted, categories=file.scale.values).value
    assert value == pytest.approx((7 / 8 - chance) / (1 - chance))
    text = "low,high\n5,0\n1,2\n"
    same = read(tmp_path, text, table=True, no_item=True).parts[0].counted
    assert fleiss_kappa(same, categories=file.scale.values).value == value


# ---- missing grades, numbers, scales ----


def test_equal_numbers_are_one_grade_and_named(tmp_path: Path) -> None:
    file = read(tmp_path, "item,Kim,Lee\nA,1,1.0\nB,02,2\nC,10,3\n")
    assert grades_of(file) == [["1", "1"], ["2", "2"], ["10", "3"]]
    assert file.scale.grades == ("1", "2", "3", "10")
    assert file.read["merged"] == {"1": ["1", "1.0"], "2": ["02", "2"]}


def test_a_decimal_comma(tmp_path: Path) -> None:
    text = "item;Kim;Lee\nA;1,5;1,50\nB;2;2,0\n"
    file = read(tmp_path, text, decimal=",")
    assert file.scale.grades == ("1.5", "2")
    assert grades_of(file) == [["1.5", "1.5"], ["2", "2"]]
    with pytest.raises(RatingsError, match="--decimal ,"):
        read(tmp_path, text)
    as_text = read(tmp_path, text, categories=["1,5", "1,50", "2", "2,0"])
    assert grades_of(as_text) == [["1,5", "1,50"], ["2", "2,0"]]


def test_the_modified_ashworth_scale_is_known_by_its_grade(tmp_path: Path) -> None:
    file = read(tmp_path, "item,Kim,Lee\nA,1+,1\nB,0,2\n")
    assert file.scale is MODIFIED_ASHWORTH
    assert file.is_ordered
    file = read(tmp_path, "item,Kim,Lee\nA,1+,1\nB,0,5\n")
    assert (file.scale.name, file.is_ordered) == ("observed", False)


def test_the_order_of_text(tmp_path: Path) -> None:
    text = "item,Kim,Lee\nA,mild,severe\nB,absent,mild\n"
    file = read(tmp_path, text)
    assert (file.scale.grades, file.is_ordered) == (("absent", "mild", "severe"), False)
    file = read(tmp_path, text, categories=["severe", "mild", "absent", "none"])
    assert file.is_ordered
    assert file.scale.grades == ("severe", "mild", "absent", "none")
    assert file.read["scale"]["declared"]
    assert file.read["grades"] == {"severe": 1, "mild": 2, "absent": 1}


# ---- repeats, sessions, groups ----

TWICE = "item,rater,grade\nA,K,1\nA,L,1\nA,K,2\nB,K,3\nB,L,\nB,L,3\n"


@pytest.mark.parametrize(
    ("repeated", "expected"),
    [
        ("first", [["1", "1"], ["3", "3"]]),
        ("last", [["1", "2"], ["3", "3"]]),  # L's row is then the first
        ("mean", [["1.5", "1"], ["3", "3"]]),
    ],
)
def test_repeats(repeated: Any, expected: list[list[str]], tmp_path: Path) -> None:
    file = read(tmp_path, TWICE, repeated=repeated)
    assert grades_of(file) == expected  # an empty cell displaces no grade
    assert (file.read["n_repeated"], file.read["repeated"]) == (2, repeated)


def test_repeats_are_refused_with_what_tells_them_apart(tmp_path: Path) -> None:
    with pytest.raises(RatingsError, match=r"line 2 and line 4: 'K' graded 'A'"):
        read(tmp_path, TWICE)
    rows = TWICE.split("\n")[1:-1]
    text = "day,item,rater,grade\n" + "".join(
        f"{day},{row}\n" for day, row in zip("112123", rows, strict=True)
    )
    with pytest.raises(RatingsError, match="--by 'day' would"):
        read(tmp_path, text)
    with pytest.raises(RatingsError, match="--repeated mean"):
        read(tmp_path, TWICE.replace("1", "a"), repeated="mean")
    with pytest.raises(RatingsError, match="without a declared scale"):
        read(tmp_path, TWICE, repeated="mean", categories=["1", "2", "3"])


SESSIONS = (
    "visit,item,rater,grade\n1,A,K,1\n1,A,L,1\n1,B,K,2\n1,B,L,1\n"
    "2,A,K,2\n2,A,L,2\n2,B,K,2\n2,B,L,2\n"
)


def test_sessions_and_groups(tmp_path: Path) -> None:
    file = read(tmp_path, SESSIONS, session="visit")
    assert [part.session for part in file.parts] == ["1", "2"]
    assert grades_of(file, 0) == [["1", "1"], ["2", "1"]]
    assert grades_of(file, 1) == [["2", "2"], ["2", "2"]]
    usual = read(tmp_path, SESSIONS.replace("visit", "Session"))
    assert [part.session for part in usual.parts] == ["1", "2"]
    by = read(tmp_path, SESSIONS, by="visit")
    assert [(part.group, part.session) for part in by.parts] == [
        ("1", None),
        ("2", None),
    ]
    both = read(tmp_path, SESSIONS, by="visit", session="visit")
    assert [(part.group, part.session) for part in both.parts] == [
        ("1", None),
        ("2", None),
    ]


def test_groups_of_a_wide_table_share_a_scale(tmp_path: Path) -> None:
    text = "item,site,Kim,Lee\nA,N,1,1\nB,S,5,5\nC,N,2,1\n"
    file = read(tmp_path, text, by="site")
    assert [part.items for part in file.parts] == [("A", "C"), ("B",)]
    assert file.scale.grades == ("1", "2", "5")
    with pytest.raises(RatingsError, match="line 3, column 'site': needed a value"):
        read(tmp_path, text.replace("S", ""), by="site")


# ---- where from ----


def test_a_simulated_file_says_so(tmp_path: Path) -> None:
    assert read(tmp_path, "# SIMULATED\n" + WIDE).simulated
    text = LONG.replace("grade\n", "grade,source\n").replace("1\n", "1,simulated\n")
    text = text.replace("2\n", "2,simulated\n").replace("3\n", "3,foreign\n")
    assert read(tmp_path, text).simulated
    assert not read(tmp_path, text.replace("simulated", "foreign")).simulated


def test_standard_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for data in (WIDE.encode(), gzip.compress(WIDE.encode())):
        stream = io.TextIOWrapper(io.BytesIO(data))
        monkeypatch.setattr(sys, "stdin", stream)
        assert grades_of(read_ratings("-")) == TABLE
    with pytest.raises(RatingsError, match="no such file"):
        read_ratings(tmp_path / "-")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with a name")
def test_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_text, args=(WIDE,))
    writer.start()
    assert grades_of(read_ratings(pipe)) == TABLE
    writer.join()


def test_many_columns_and_rows(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    codes = rng.integers(0, 3, (30, 1200))
    header = ",".join(["item", *(f"r{k}" for k in range(1200))])
    rows = [f"i{k}," + ",".join(map(str, row)) for k, row in enumerate(codes.tolist())]
    file = read(tmp_path, "\n".join([header, *rows]))
    ratings = file.parts[0].ratings
    assert isinstance(ratings, CodedRatings)
    assert (ratings.codes == codes).all()


def test_a_crowd_is_counted(tmp_path: Path) -> None:
    # 6000 items by 6000 raters, two ratings an item
    rows = "".join(
        f"i{k},r{k},1\ni{k},r{(k + 1) % 6000},{k % 2}\n" for k in range(6000)
    )
    file = read(tmp_path, "item,rater,grade\n" + rows)
    counted = file.parts[0].ratings
    assert isinstance(counted, CountedRatings)
    # half of the items agree; a quarter of the ratings is 0
    value = fleiss_kappa(counted, categories=file.scale.values).value
    assert math.isclose(value, (1 / 2 - 10 / 16) / (6 / 16))


# ---- refusals of the call, and the command line ----


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"item": "nobody"}, "--item: there is no column 'nobody'"),
        ({"by": "patiend"}, "did you mean 'patient'"),
        ({"session": "x"}, "--session"),
        ({"rater": "Kim", "grade": "Kim", "item": "patient"}, "--rater, --grade|twice"),
        ({"raters": ["Kim"], "rater": "Lee"}, "--raters"),
        ({"raters": ["Kim", "Lee", "Kim"]}, "'Kim' twice"),
        ({"counts": True, "table": True}, "--counts, --table"),
        ({"no_item": True, "item": "patient"}, "--no-item"),
        ({"counts": True, "session": "patient"}, "--session: counts do not say"),
        ({"counts": True, "missing_codes": ["9"]}, "--missing: .* --counts .*got 9"),
        ({"categories": ["1", "2", "2", "3"]}, r"repeated: \['2'\]"),
        (
            {"categories": ["1", "2", "3"], "missing_codes": ["3"]},
            "'3' is a grade or miss",
        ),
    ],
)
def test_wrong_options(options: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises((RatingsError, ParameterError), match=words):
        read(tmp_path, WIDE, **options)


def test_options_are_repeated_on_the_command_line(
    tmp_path: Path, masrel: Caller
) -> None:
    path = tmp_path / "r.csv"
    path.write_text('id,"Kim, A",Lee,Oh,age\nA,1,1,9,61\nB,2,x,2,61\n')
    done = masrel(
        *("agree", path, "--raters", "Kim, A,Lee", "--raters", "Oh"),
        *("--missing", "9", "--missing", "x,y", "--json", "-"),
    )
    read_of_file = json.loads(done.out)["read"]
    assert read_of_file["raters"] == ["Kim, A", "Lee", "Oh"]
    assert read_of_file["missing"] == {"9": 1, "x": 1}


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (KeyboardInterrupt(), "stopped by Ctrl-C"),
        (MemoryError("2 GiB"), "needs more memory than there is. 2 GiB"),
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


def test_names_numbered_like_the_items_below_may_be_a_row(tmp_path: Path) -> None:
    # names that are no grades of the other rows
    text = "P1,mild,severe\nP2,no,no\nP3,no,some\nP4,some,some\n"
    (warning,) = [w for w in read(tmp_path, text).warnings if "--no-header" in w]
    assert warning.startswith("the names of the columns, 'mild', 'severe', may be")
    named = read(tmp_path, text.replace("P1", "patient"))
    assert not any("--no-header" in w for w in named.warnings)


def test_a_first_column_of_grades_is_refused_as_that(tmp_path: Path) -> None:
    with pytest.raises(RatingsError, match=r"'Kim', holds grades like.*--no-item if"):
        read(tmp_path, "Kim,Lee,Ann\n1,1,2\n2,2,1\n1,2,2\n2,2,2\n")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "patient,Kim,Lee\nid,level,level\nA,mild,mild\nB,mild,severe\n"
            "C,severe,severe\nD,mild,mild\n",
            "line 2 holds grades that occur nowhere else",
        ),
        (
            "item,rater,grade\nPatient,Observer,1\nA,Kim,1\nA,Lee,1\nB,Kim,2\nB,Lee,2\n",
            "line 2 names a rater and an item that occur nowhere else",
        ),
    ],
)
def test_a_second_line_of_names_is_warned_of(
    tmp_path: Path, text: str, words: str
) -> None:
    (warning,) = [w for w in read(tmp_path, text).warnings if "second line" in w]
    assert words in warning
    lines = text.splitlines(keepends=True)
    assert not any(
        "second line" in w
        for w in read(tmp_path, lines[0] + "".join(lines[2:])).warnings
    )


def test_qualtrics_lines_of_questions_are_left_out(tmp_path: Path) -> None:
    names = 'patient,Kim,Lee\n"Which patient?","How severe?","How severe?"\n'
    ids = '"{""ImportId"":""Q1""}","{""ImportId"":""Q2""}","{""ImportId"":""Q3""}"\n'
    file = read(tmp_path, f"{names}{ids}A,1,1\nB,2,1\nC,2,2\n")
    assert grades_of(file) == [["1", "1"], ["2", "1"], ["2", "2"]]
    assert file.read["dropped"] == {"second header": 2}
    assert any("Qualtrics" in w for w in file.warnings)


def test_a_cell_of_a_transposed_table_is_named_by_its_column(tmp_path: Path) -> None:
    text = "rater,A,B,C\nKim,1,2,n/a\nLee,1,2,2\n"
    with pytest.raises(RatingsError, match=r"r\.csv: column 4, column 'Kim'.*n/a"):
        read(tmp_path, text, transpose=True)


def test_an_encoding_that_is_given_outdoes_a_mark(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_bytes("ÿþ,Kim,Lee\nA,1,1\nB,2,1\n".encode("latin-1"))  # UTF-16's mark
    assert read_ratings(path, encoding="latin-1").read["item"] == ["ÿþ"]


def test_measurements_are_told_from_grades(tmp_path: Path) -> None:
    def measured(rows: list[tuple[float, float]], **options: Any) -> list[str]:
        text = "item,A,B\n" + "".join(
            f"i{k},{a},{b}\n" for k, (a, b) in enumerate(rows)
        )
        return [w for w in read(tmp_path, text, **options).warnings if "measure" in w]

    angles = [(k + 0.25, k + 0.5) for k in range(40)]
    (warning,) = measured(angles)
    assert warning.startswith(
        "80 different numbers in 80 ratings look like measurements"
    )
    long = "item,rater,grade\n" + "".join(
        f"i{k},{rater},{angle}\n"
        for k, pair in enumerate(angles)
        for rater, angle in zip("AB", pair, strict=True)
    )
    assert warning in read(tmp_path, long).warnings
    declared = [str(angle) for pair in angles for angle in pair]
    assert not measured(angles, categories=declared)
    # 15 grades of Borg's scale once or twice each, from 0 to 10, and 40 of 80 ratings
    assert not measured([(k, k + 1) for k in range(6, 20)])
    assert not measured([(k, 10 - k) for k in range(6)])
    assert not measured([(k, k) for k in range(40)])
    assert measured([(k, k) for k in range(40)] + [(100, 101)])

"""A study's table of ratings is read as text, or refused with file, line and column."""

import csv
import io
import math
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from masrel.errors import RatingsError
from masrel.lab.ratings import Ratings, read_study_ratings
from masrel.scales import MODIFIED_ASHWORTH, Scale

LONG = "rater,model,grade\nR1,HM1,1\nR1,HM2,1+\nR2,HM1,2\nR2,HM2,1+\n"


def read(folder: Path, text: str | bytes, scale: Scale = MODIFIED_ASHWORTH) -> Ratings:
    path = folder / "r.csv"
    path.write_bytes(text.encode("utf-8") if isinstance(text, str) else text)
    return read_study_ratings(path, scale)


def cells(ratings: Ratings) -> list[tuple[object, ...]]:
    return [(row.rater, row.model, row.grade) for row in ratings.rows]


EXPECTED = [
    ("R1", "HM1", "1"),
    ("R1", "HM2", "1+"),
    ("R2", "HM1", "2"),
    ("R2", "HM2", "1+"),
]


@pytest.mark.parametrize(
    "text",
    [
        LONG,
        "\ufeff" + LONG,
        LONG.replace("\n", "\r\n"),
        LONG.replace("\n", "\r"),
        LONG.replace("\n", "\n\n"),
        LONG.rstrip("\n"),
        "# source: a clinic\n#\n\n" + LONG,
        LONG.replace(",", " , "),
        LONG + ",,\n",
        '"rater","model","grade"\n' + LONG.split("\n", 1)[1],
        LONG.replace("rater,model,grade", "Rater,MODEL,Grade"),
        LONG.replace("rater,model,grade", "rater,subject,score"),
    ],
)
def test_grades_are_text_and_the_dress_of_a_file_does_not_matter(
    tmp_path: Path, text: str
) -> None:
    ratings = read(tmp_path, text)
    assert cells(ratings) == EXPECTED
    first = ratings.rows[0]
    assert (first.session, first.source) == ("test", "foreign")
    assert math.isnan(first.mean_speed_deg_s)
    assert not ratings.simulated


def test_a_quoted_cell_may_hold_commas_and_lines(tmp_path: Path) -> None:
    text = 'rater,item,grade,note\n"Kim, A",i,1,"two\nlines"\nLee,i,7,\n'
    with pytest.raises(RatingsError, match=r"line 4, column 'grade'.*got '7'"):
        read(tmp_path, text, Scale(name="two", grades=("1", "2")))
    scale = Scale(name="three", grades=("1", "2", "7"))
    assert cells(read(tmp_path, text, scale))[0] == ("Kim, A", "i", "1")


@pytest.mark.parametrize("missing", ["", "NA", "  ", " NA "])
def test_missing_is_an_empty_cell_or_na(tmp_path: Path, missing: str) -> None:
    text = f"rater,item,grade,note\nR1,a,{missing},x\nR1,b,1,x\n"
    assert read(tmp_path, text).table["grade"].tolist() == [None, "1"]


@pytest.mark.parametrize("mark", ["nan", "N/A", ".", "-", "null", "?"])
def test_other_marks_of_a_missing_grade_are_not_guessed(
    tmp_path: Path, mark: str
) -> None:
    text = f"rater,item,grade\nR1,a,{mark}\nR1,b,1\n"
    with pytest.raises(RatingsError, match=r"r\.csv: line 2, column 'grade'.*or NA"):
        read(tmp_path, text)
    scale = Scale(name="two", grades=("1", mark))
    assert read(tmp_path, text, scale).table["grade"][0] == mark


def test_the_columns_of_a_study_are_kept(tmp_path: Path) -> None:
    text = (
        "session,rater,model,repeat,grade,mean_speed_deg_s,source\n"
        "test,R1,HM1,1,1,81.25,published\ntest,R1,HM1,2,1+,,simulated\n"
    )
    ratings = read(tmp_path, text)
    assert ratings.table["repeat"].tolist() == [1, 2]
    assert ratings.table["mean_speed_deg_s"][0] == 81.25
    assert ratings.table["mean_speed_deg_s"].isna().tolist() == [False, True]
    assert ratings.table["source"].tolist() == ["published", "simulated"]
    assert ratings.simulated


@pytest.mark.parametrize(
    ("row", "where"),
    [
        ("R1,a,5,1,80,foreign", r"line 2, column 'grade': needed one of 0, 1, 1\+"),
        ("R1,a,1,0,80,foreign", "line 2, column 'repeat': needed a whole number"),
        ("R1,a,1,x,80,foreign", "line 2, column 'repeat': needed a whole number"),
        ("R1,a,1,1,fast,foreign", "line 2, column 'mean_speed_deg_s'.*got 'fast'"),
        ("R1,a,1,1,-1,foreign", "line 2, column 'mean_speed_deg_s'.*got '-1'"),
        ("R1,a,1,1,inf,foreign", "line 2, column 'mean_speed_deg_s'.*got 'inf'"),
        ("R1,a,1,1,80,guess", "line 2, column 'source': needed one of published"),
        (",a,1,1,80,foreign", "line 2, column 'rater': needed text"),
        ("R1,,1,1,80,foreign", "line 2, column 'item': needed text"),
        ("R1,a,1,1,80", "line 2: needed 6 cells, got 5"),
        ("R1,a,1,1,80,foreign,x", "line 2: needed 6 cells, got 7"),
    ],
)
def test_a_bad_cell_is_named_with_file_line_and_column(
    tmp_path: Path, row: str, where: str
) -> None:
    text = f"rater,item,grade,repeat,mean_speed_deg_s,source\n{row}\n"
    with pytest.raises(RatingsError, match=rf"r\.csv: {where}"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("cells", "where"),
    [
        ("2.5,,,", "'n_stretches': needed a whole number from 0, got '2.5'"),
        (
            "2,60,,",
            "'speeds_deg_s': needed one for each of 2 stretches, got \\(60.0,\\)",
        ),
        ("1,slow,,", "'speeds_deg_s': needed a speed of 0 or more, got 'slow'"),
        ("2,,3,", "'graded_stretch': needed one of 2 stretches, got 3"),
        (",,1,", "'graded_stretch': needed one of 0 stretches, got 1"),
        ("2,,0,", "'graded_stretch': needed a whole number from 1, got 0"),
        ("1,,,,0", "'position': needed a whole number from 1, got 0"),
        ("1,,,,,x", "'n_attempts': needed a whole number from 0, got 'x'"),
        ("1,,,,,,5", "'first_grade': needed one of 0, 1, .*an empty cell"),
        ("1,,,,,,,noon", "'graded_at': needed a time in UTC such as .*, got 'noon'"),
        ("1,,,no", "'felt': needed one of felt, below-threshold, no-catch, got 'no'"),
    ],
)
def test_a_bad_cell_of_a_presentation_is_named(
    tmp_path: Path, cells: str, where: str
) -> None:
    names = (
        "n_stretches,speeds_deg_s,graded_stretch,felt,"
        "position,n_attempts,first_grade,graded_at"
    )
    cells += "," * (names.count(",") - cells.count(","))
    with pytest.raises(RatingsError, match=rf"r\.csv: line 2, column {where}"):
        read(tmp_path, f"rater,item,grade,{names}\nR1,a,1,{cells}\n")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "needed a header and rows, the file has none"),
        ("# only a comment\n", "needed a header and rows"),
        ("#A\n# format: 3\nrater,item,grade\n", "needed format 1 to 2, got 3"),
        ("rater;item;grade\nR1;a;1\n", "separated by commas, got one, 'rater;item"),
        ("item,Kim,Lee\na,1,1\n", "column for the rater.*masrel agree reads other"),
        ("rater,item,,grade\nR1,a,x,1\n", "line 1: column 3 needs a name"),
        ("rater,item,grade,grade\nR1,a,1,1\n", "column 'grade': needed different"),
        ("rater,item\nR1,a\n", "line 1: needed a column for the grade"),
        ("item,grade\na,1\n", "line 1: needed a column for the rater"),
        ("item,subject,rater,grade\n", "one column for the model, got item and"),
        ("rater,grade\nR1,1\n", "line 1: needed a column for the model"),
        ('rater,item,grade\nR1,"a"b,1\n', "line 2: needed cells separated by commas"),
        ('rater,item,grade\nR1,"a,1\n', "line 2: needed cells separated by commas"),
        (b"rater,item,grade\nR\xe9my,a,1\n", "line 2: needed UTF-8 text.*0xe9"),
        ("rater,item,grade\n".encode("utf-16"), "line 1: needed UTF-8 text.*0xff"),
        ("rater,item,grade\nR1,a,\0\n", "line 2: needed text, got a zero byte"),
    ],
)
def test_what_is_no_table_is_said_clearly(
    tmp_path: Path, text: str | bytes, message: str
) -> None:
    with pytest.raises(RatingsError, match=rf"r\.csv: .*{message}"):
        read(tmp_path, text)


@pytest.mark.parametrize("grade", ["1", "NA"])
def test_a_duplicate_names_both_lines(tmp_path: Path, grade: str) -> None:
    twice = r"line 6, column 'grade'.*line 2 has one already"
    with pytest.raises(RatingsError, match=twice):
        read(tmp_path, f"{LONG}R1,HM1,{grade}\n")
    text = "session,rater,item,grade\ntest,R1,a,1\nretest,R1,a,1\n"
    assert len(read(tmp_path, text).rows) == 2  # two sessions


def test_every_problem_is_said_at_once_up_to_twenty(tmp_path: Path) -> None:
    rows = "".join(f"R1,{i},bad\n" for i in range(23))
    with pytest.raises(RatingsError) as caught:
        read(tmp_path, "rater,item,grade\n" + rows)
    lines = str(caught.value).split("\n")
    assert len(lines) == 21
    assert "line 2, column 'grade'" in lines[0]
    assert "line 21, column 'grade'" in lines[19]
    assert lines[20].endswith("r.csv: and 3 more")


NAMES = st.text(
    st.characters(codec="utf-8", exclude_categories=["Cs", "Cc", "Z"]),
    min_size=1,
    max_size=8,
).filter(lambda name: name != "NA" and not name.startswith("#"))


@settings(
    max_examples=60,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    deadline=None,
)
@given(
    items=st.lists(NAMES, min_size=1, max_size=4, unique=True),
    raters=st.lists(NAMES, min_size=1, max_size=4, unique=True),
    data=st.data(),
)
def test_every_rating_is_read_as_it_was_written(
    tmp_path: Path, items: list[str], raters: list[str], data: st.DataObject
) -> None:
    grade = st.sampled_from([*MODIFIED_ASHWORTH.grades, ""])
    rows = [[r, i, data.draw(grade)] for i in items for r in raters]
    rows[0][2] = "1+"  # one grade at least
    out = io.StringIO(newline="")
    csv.writer(out).writerows([["rater", "item", "grade"], *rows])
    expected = [(r, i, grade or None) for r, i, grade in rows]
    assert cells(read(tmp_path, out.getvalue())) == expected

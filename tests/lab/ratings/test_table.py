"""What is written is what is read, in the same bytes each time."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from masrel.errors import RatingsError
from masrel.lab.ratings import (
    RATING_COLUMNS,
    SOURCES,
    ratings_csv,
    ratings_from_rows,
    read_in_person,
    read_study_ratings,
    write_ratings,
)
from masrel.scales import MODIFIED_ASHWORTH

FELT = ["felt", "below-threshold", "no-catch", None]
ROW = {"rater": "R1", "model": "HM1", "grade": "1+"}

SPEEDS = st.floats(0, 1e6) | st.just(float("nan"))


@st.composite
def stretches(draw: st.DrawFn) -> dict[str, object]:
    """What a row may say of its stretches, or nothing."""
    n = draw(st.none() | st.integers(0, 4))
    row: dict[str, object] = {"felt": draw(st.sampled_from(FELT))}
    if n is not None:
        row |= {"n_stretches": n, "min_speed_deg_s": draw(SPEEDS)}
        speeds = st.floats(0, 1e6) | st.none()
        row["speeds_deg_s"] = tuple(draw(st.lists(speeds, min_size=n, max_size=n)))
    if n:
        row["graded_stretch"] = draw(st.none() | st.integers(1, n))
    return row


PRESENTED = st.fixed_dictionaries(
    {
        "position": st.none() | st.integers(1, 99),
        "code": st.none() | st.from_regex(r"[1-9A-Z]{3}", fullmatch=True),
        "n_attempts": st.none() | st.integers(0, 9),
        "first_grade": st.sampled_from([*MODIFIED_ASHWORTH.grades, None]),
        "graded_at": st.sampled_from([None, "2026-05-04T09:30:00.125Z"]),
        "grip_lost": st.sampled_from([None, False, True]),
    }
)


ROWS = st.lists(
    st.fixed_dictionaries(
        {
            "session": st.sampled_from(["test", "retest"]),
            "rater": st.sampled_from(["R1", 'R"2', "R,3"]),
            "model": st.sampled_from(["HM1", "HM2"]),
            "repeat": st.integers(1, 3),
            "grade": st.sampled_from([*MODIFIED_ASHWORTH.grades, None]),
            "mean_speed_deg_s": SPEEDS,
            "source": st.sampled_from(SOURCES),
            "stretches": st.just({}) | stretches(),
            "presented": st.just({}) | PRESENTED,
        }
    ).map(lambda row: {**row.pop("stretches"), **row.pop("presented"), **row}),
    unique_by=lambda row: (row["session"], row["rater"], row["model"], row["repeat"]),
    max_size=12,
)


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    deadline=None,
)
@given(rows=ROWS)
def test_written_and_read_back_nothing_has_changed(
    tmp_path: Path, rows: list[dict[str, object]]
) -> None:
    ratings = ratings_from_rows(rows, MODIFIED_ASHWORTH)
    path = tmp_path / "ratings" / "ratings.csv"
    write_ratings(ratings, path)
    first = path.read_bytes()
    again = read_study_ratings(path, MODIFIED_ASHWORTH)
    # Exact: a float's repr reads back as the same float.
    assert again.table.equals(ratings.table)
    assert again.simulated == ratings.simulated
    assert ratings_csv(again) == ratings_csv(ratings)
    write_ratings(again, path)
    assert path.read_bytes() == first


def test_the_file_is_what_the_documentation_says(tmp_path: Path) -> None:
    rows = [{**ROW, "mean_speed_deg_s": 81.25}, {**ROW, "model": "HM2", "grade": None}]
    write_ratings(ratings_from_rows(rows, MODIFIED_ASHWORTH), tmp_path / "r.csv")
    assert (tmp_path / "r.csv").read_bytes().splitlines()[1:] == [
        b"# format: 2",
        ",".join(RATING_COLUMNS[:7]).encode(),
        b"test,R1,HM1,1,1+,81.25,foreign",
        b"test,R1,HM2,1,NA,NA,foreign",
    ]


def test_what_is_known_of_stretches_is_in_the_file(tmp_path: Path) -> None:
    known = {
        "mean_speed_deg_s": 70.5,
        "n_stretches": 3,
        "min_speed_deg_s": 60.0,
        "max_speed_deg_s": 81.0,
        "speeds_deg_s": (60.0, None, 81.0),
        "graded_stretch": 3,
        "felt": "felt",
        "grades_from": "console",
        "device": "puck",
        "position": 2,
        "code": "K7Q",
        "n_attempts": 1,
        "first_grade": "2",
        "graded_at": "2026-05-04T09:30:00.125Z",
    }
    first = (
        "test,R1,HM1,1,1+,70.5,foreign,3,60.0,81.0,60.0;NA;81.0,3,felt,console,puck,"
        "2,K7Q,1,2,2026-05-04T09:30:00.125Z"
    )
    # where no log says whether a grip was lost, the table is what it always was
    for more, cell, n_columns in (({}, "", 20), ({"grip_lost": True}, ",yes", 21)):
        rows = [{**ROW, **known, **more}, {**ROW, "model": "HM2"}]
        write_ratings(ratings_from_rows(rows, MODIFIED_ASHWORTH), tmp_path / "r.csv")
        assert (tmp_path / "r.csv").read_text(encoding="utf-8").splitlines()[2:] == [
            ",".join(RATING_COLUMNS[:n_columns]),
            first + cell,
            "test,R1,HM2,1,1+,NA,foreign" + (n_columns - 7) * ",NA",
        ]


def test_a_file_of_simulated_ratings_says_so_first() -> None:
    simulated = ratings_from_rows([{**ROW, "source": "simulated"}], MODIFIED_ASHWORTH)
    assert ratings_csv(simulated).startswith("# SIMULATED")


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"n_stretches": -1}, "n_stretches: needed a whole number from 0, got -1"),
        ({"n_stretches": 2, "speeds_deg_s": (1.0,)}, "one for each of 2 stretches"),
        ({"graded_stretch": 1}, "graded_stretch: needed one of 0 stretches, got 1"),
        ({"felt": "maybe"}, "felt: needed one of felt, below-threshold, no-catch"),
        ({"grip_lost": "yes"}, "grip_lost: needed yes or no, got 'yes'"),
        ({"device": ""}, "device: needed text or None, got ''"),
        ({"position": 0}, "position: needed a whole number from 1, got 0"),
        ({"n_attempts": "1"}, "n_attempts: needed a whole number from 0, got '1'"),
        (
            {"first_grade": "5"},
            "first_grade: needed one of 0, .*, 4, or None",
        ),
        ({"graded_at": "09:30"}, "graded_at: needed a time in UTC such as 2026-"),
        ({"graded_at": "2026-05-04T09:30:00"}, "graded_at: needed a time in UTC"),
        (
            {"max_speed_deg_s": "fast"},
            "max_speed_deg_s: needed a speed of 0 or more, got 'fast'",
        ),
        ({"rater": ""}, "row 2: rater: needed text"),
        ({"model": 3}, "row 2: model: needed text, got 3"),
        ({"grade": "5"}, "row 2: grade: needed one of 0, 1"),
        ({"grade": 1}, "row 2: grade: needed one of .*, got 1"),
        ({"repeat": 0}, "row 2: repeat"),
        ({"repeat": True}, "row 2: repeat"),
        ({"source": "hearsay"}, "row 2: source: needed one of published"),
        ({"mean_speed_deg_s": "fast"}, "row 2: mean_speed_deg_s"),
        ({"speed": 3.0}, "row 2: speed: unknown column"),
        (
            {},
            "row 2: grade: needed one rating of 'HM1' by 'R1' in .*row 1 has",
        ),
    ],
)
def test_rows_are_checked(row: dict[str, object], message: str) -> None:
    with pytest.raises(RatingsError, match=message):
        ratings_from_rows([ROW, {**ROW, **row}], MODIFIED_ASHWORTH)


IN_PERSON = "source_table,rater,subject,model,in_person_grade,haptic_grade,note\n"


def test_in_person_grades_are_text_and_may_be_missing(tmp_path: Path) -> None:
    path = tmp_path / "in_person.csv"
    path.write_text(IN_PERSON + "IV,R1,1,HM1,1,1+,\nIV,R3,1,HM1,,NA,absent\n")
    first, second = read_in_person(path).rows
    assert (first.in_person_grade, first.haptic_grade) == ("1", "1+")
    assert (second.in_person_grade, second.haptic_grade) == (None, None)
    assert (second.line, second.note, second.subject) == (3, "absent", "1")

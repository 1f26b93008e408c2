"""Double entry: a sheet typed again by somebody else, and what differs."""

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import ParameterError, RatingsError, SessionLogError
from masrel.lab.paper import SheetDifference, compare_sheet
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import ratings_from_logs, study_remarks
from masrel.lab.run import read_log, record_answer, record_correction
from masrel.lab.verification import verify_study
from tests.lab.paper.conftest import QUESTIONS
from tests.lab.paper.test_entry import Rows, enter, filled, typed
from tests.lab.run.test_session import console, run

Small = tuple[StudyPaths, Protocol]
New = Callable[..., Small]


def compare(small: Small, file: Path, who: str = "JL") -> tuple[SheetDifference, ...]:
    return compare_sheet(*small, file, "R1", "test", who=who)


def entered_twice(small: Small, second: str) -> tuple[Rows, Path]:
    """A sheet 1+, 2, NA that was typed again with another first grade."""
    rows = filled(small, "1+", "2", "NA")
    enter(small, typed(small, rows))
    rows[1][3] = second
    return rows, typed(small, [*rows, [""]], name="second.csv")


def test_entries_that_agree_are_confirmed_and_change_nothing(small: Small) -> None:
    _, second = entered_twice(small, "1+")
    before = ratings_from_logs(*small).table
    assert compare(small, second) == ()
    assert ratings_from_logs(*small).table.equals(before)
    kinds = [e.kind for e in read_log(small[0].log_file("R1", "test"))]
    assert kinds[-4:] == ["complete", *["reentered"] * 3]
    assert verify_study(small[0]).is_whole
    assert study_remarks(*small) == ()


def test_a_difference_is_named_and_stays_a_remark_until_it_is_settled(
    small: Small,
) -> None:
    study, protocol = small
    rows, second = entered_twice(small, "1")  # as a spreadsheet may make of 1+
    code = rows[1][2]
    (difference,) = compare(small, second)
    assert (difference.code, difference.column, difference.row) == (code, "grade", 2)
    assert (difference.first, difference.second) == ("1+", "1")
    (remark,) = study_remarks(study, protocol)
    assert remark == (
        f"sessions/test_R1.jsonl: the two entries of its sheet differ, code {code}, "
        "grade: the first has 1+, the second 1 (second.csv, row 2). The first counts "
        "until one is mended."
    )
    # the first was wrong
    reasons = {"who": "MK", "why": "typed wrongly"}
    record_correction(study, protocol, "R1", "test", code=code, grade="1", **reasons)
    assert study_remarks(study, protocol) == ()


def test_a_second_entry_that_was_wrong_is_mended_and_compared_again(
    small: Small,
) -> None:
    rows, second = entered_twice(small, "1")
    assert len(compare(small, second)) == 1
    n_events = len(read_log(small[0].log_file("R1", "test")))
    compare(small, second)  # nothing new
    assert len(read_log(small[0].log_file("R1", "test"))) == n_events
    rows[1][3] = "1+"
    assert compare(small, typed(small, [*rows, [""]], name="mended.csv")) == ()
    assert study_remarks(*small) == ()


def test_answers_are_compared_with_the_log_they_are_in(
    new_study: New,
) -> None:
    about = QUESTIONS.replace('when = "session"', 'when = "study"')
    small = new_study(("[schedule]", about), ('raters = ["R1"]', 'raters = ["R2"]'))
    study, protocol = small
    rows = filled(small, "1", "2", "3")
    for row in rows[1:4]:
        row[4] = "7"
    rows[4][5:] = ["50", "more"]
    enter(small, typed(small, rows))
    code, rows[2][4], rows[4][5] = rows[2][2], "8", "50,5"
    second = typed(small, rows, name="b.csv", delimiter=";")
    differences = compare(small, second)
    assert [(d.code, d.column, d.first, d.second) for d in differences] == [
        (code, "arm.realism", "7", "8"),
        (None, "end.tired", "50", "50.5"),
    ]
    remarks = " ".join(study_remarks(study, protocol))  # an answer is private
    assert "arm.realism (b.csv, row 3)" in remarks
    assert "sheet differ, end.tired (b.csv, row 5)" in remarks
    assert "50" not in remarks
    # the first was wrong
    reasons = {"who": "MK", "why": "typed wrongly"}
    of_study = {"question": "end.tired", "answer": 50.5, **reasons}
    record_answer(study, protocol, "R1", "test", **of_study)
    of_model = {"question": "arm.realism", "answer": 8, "code": code, **reasons}
    record_answer(study, protocol, "R1", "test", **of_model)
    assert study_remarks(study, protocol) == ()
    assert compare(small, second) == ()
    assert verify_study(study).is_whole


def test_the_second_entry_is_of_another_file_and_another_person(small: Small) -> None:
    _, second = entered_twice(small, "1+")
    with pytest.raises(ParameterError, match="needed somebody else than who typed the"):
        compare(small, second, who=" mk ")
    with pytest.raises(
        RatingsError, match=r"got the file that was entered as typed\.csv"
    ):
        compare(small, small[0].root / "typed.csv")


def test_without_a_first_entry_there_is_no_second(small: Small) -> None:
    file = typed(small, filled(small, "1", "2", "3"))
    with pytest.raises(SessionLogError, match="needed a first entry of the sheet"):
        compare(small, file)
    assert not small[0].log_file("R1", "test").exists()
    run(small, console("\n1\n\n2\n\n3\n")[0])
    with pytest.raises(SessionLogError, match=r"got one with grades = console$"):
        compare(small, file)


def test_the_command_lists_differences_and_what_to_do(small: Small) -> None:
    rows, second = entered_twice(small, "3")
    call = ["paper", "again", str(small[0].root), str(second), "--rater", "R1"]
    call += ["--session", "test", "--who", "JL"]
    result = CliRunner().invoke(cli, call)
    assert result.exit_code == 1
    first, then = result.output.splitlines()
    assert first == f"second.csv: row 2: code {rows[1][2]}: grade: first 1+, second 3"
    assert "masrel record correct --code" in then
    rows[1][3] = "1+"
    typed(small, [*rows, [""]], name="second.csv")
    result = CliRunner().invoke(cli, call)
    assert (result.exit_code, result.output) == (
        0,
        "session test of R1: both entries agree\n",
    )

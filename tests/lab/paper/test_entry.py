"""Sheets that were filled in on paper, typed, and brought into logs, once and again."""

import csv
import io
import random
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import (
    MasrelError,
    MasrelWarning,
    ParameterError,
    RatingsError,
    SessionLogError,
)
from masrel.lab._event_log import read_log
from masrel.lab.analysis import analyze
from masrel.lab.paper._entry import compare_sheet, enter_sheet
from masrel.lab.paper._printing import write_sheets
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import (
    corrections_of,
    ratings_from_logs,
    read_study_data,
    study_remarks,
)
from masrel.lab.run._corrections import record_answer, record_correction
from masrel.lab.run._state import SheetDifference
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.verification import verify_study
from tests.lab.paper.conftest import QUESTIONS
from tests.lab.run.test_session import console, run

Small = tuple[StudyPaths, Protocol]
New = Callable[..., Small]
Rows = list[list[str]]


def blank(small: Small, rater: str = "R1", session: str = "test") -> Rows:
    """The rows of the file that a sheet is typed into."""
    write_sheets(*small)
    text = small[0].typed_file(rater, session).read_text(encoding="utf-8")
    return list(csv.reader(io.StringIO(text)))[1:]  # below the version


def filled(
    small: Small, *grades: str, rater: str = "R1", session: str = "test"
) -> Rows:
    rows = blank(small, rater, session)
    for row, grade in zip(rows[1:], grades, strict=False):
        row[3] = grade
    return rows


def answered_sheet(small: Small) -> Rows:
    """A sheet with grades and an answer to each question that needs one."""
    rows = filled(small, "1", "2", "3")
    for row in rows[1:4]:
        row[4] = "7"
    rows[4][5] = "50"
    return rows


def typed(
    small: Small,
    rows: Sequence[Sequence[str]],
    *,
    name: str = "typed.csv",
    delimiter: str = ",",
    begins: bytes = b"",
) -> Path:
    text = io.StringIO(newline="")
    csv.writer(text, delimiter=delimiter).writerows(rows)
    path = small[0].root / name
    path.write_bytes(begins + text.getvalue().encode())
    return path


def enter(small: Small, file: Path, rater: str = "R1", **options: object) -> object:
    study, protocol = small
    return enter_sheet(
        study,
        protocol,
        file,
        rater,
        "test",
        who="MK",
        **options,  # type: ignore[arg-type]
    )


def refusal(small: Small, rows: Sequence[Sequence[str]], **options: object) -> str:
    """What is said of a sheet that is refused, without the name of the file."""
    file = typed(small, rows)
    with pytest.raises(RatingsError) as caught:
        enter(small, file, **options)
    assert not small[0].log_file("R1", "test").exists()
    return str(caught.value).replace(f"{file}: ", "")


def test_a_sheet_becomes_a_complete_session_of_a_person(small: Small) -> None:
    study, protocol = small
    rows = filled(small, "1+", "NA", "3")
    file = typed(small, [row[1:] for row in rows])  # as masrel schedule writes it
    enter(small, file)
    log = read_log(study.log_file("R1", "test"))
    assert [event.kind for event in log] == ["session", *["entered"] * 3, "complete"]
    head, first = log[0].fields, log[1].fields
    assert (head["grades"], head["device"], head["simulated"]) == (
        *("paper", "none"),
        False,
    )
    assert (first["grade"], first["file"], first["row"], first["who"]) == (
        *("1+", "typed.csv"),
        *(2, "MK"),
    )
    ratings = ratings_from_logs(study, protocol)
    shown = read_schedule(study.schedule_file("R1", "test")).presentations
    assert dict(zip(ratings.table["model"], ratings.table["grade"], strict=True)) == {
        shown[0].model: "1+",
        shown[1].model: None,
        shown[2].model: "3",
    }
    assert set(ratings.table["source"]) == {"recorded"}
    assert (ratings.n_by_programs, ratings.simulated) == (0, False)
    reasons = {"who": "JL", "why": "typed wrongly"}
    for row, grade in zip(rows[1:3], ("1", "2"), strict=True):
        of_code = {"code": row[2], "grade": grade, **reasons}
        record_correction(study, protocol, "R1", "test", **of_code)
    corrections = [(c.first_grade, c.grade) for c in corrections_of(study, protocol)]
    assert corrections == [("1+", "1"), (None, "2")]
    verification = verify_study(study)
    assert verification.is_whole
    assert [s.stage for s in verification.sessions][:1] == ["complete"]
    analyze(protocol, read_study_data(study, protocol).ratings)


@pytest.mark.parametrize(
    ("delimiter", "begins"),
    [
        (",", b""),
        (";", b"\xef\xbb\xbf"),
        ("\t", b""),
        (";", b"sep=;\r\n"),
        ("\t", None),
    ],
)
def test_the_habits_of_spreadsheets_are_read(
    delimiter: str, begins: bytes | None, small: Small
) -> None:
    head, *rows = filled(small, "0", "1+", "2")
    untidy = [[*head, "", ""], *([*row, "", ""] for row in reversed(rows))]
    untidy[1][3] = " 2 "
    untidy += [[""] * 6, [], [""] * 6]
    file = typed(small, untidy, delimiter=delimiter, begins=begins or b"")
    if begins is None:  # what spreadsheets call Unicode text
        file.write_bytes(file.read_bytes().decode().encode("utf-16"))
    enter(small, file)
    log = read_log(small[0].log_file("R1", "test"))
    entered = [event.fields for event in log if event.kind == "entered"]
    assert [fields["grade"] for fields in entered] == ["0", "1+", "2"]
    below = 1 if begins and begins.startswith(b"sep") else 0  # as a spreadsheet has it
    assert [fields["row"] for fields in entered] == [4 + below, 3 + below, 2 + below]


ABOUT_THE_STUDY = """
[[questionnaires]]
id = "all"
title = "The study"
when = "study"

[[questionnaires.questions]]
id = "again"
text = "Would you take part again?"
type = "choice"
choices = ["yes", "no"]

[schedule]
"""


def test_a_rater_is_asked_about_the_study_on_the_sheet_of_the_last_session(
    new_study: New,
) -> None:
    small = study, protocol = new_study(("[schedule]", ABOUT_THE_STUDY))
    assert blank(small)[-1][1] == "3"  # R1 has a retest to come
    assert "After the study" in (study.sheets / "sheets.html").read_text("utf-8")
    enter(small, typed(small, filled(small, "1", "2", "3")))
    rows = filled(small, "1", "2", "3", session="retest")
    assert rows[-1][1] == "study"
    rows[-1][4] = "yes"
    file = typed(small, rows, name="b.csv")
    enter_sheet(study, protocol, file, "R1", "retest", who="MK")
    assert answered(study) == [("R1", "all", "again", "yes")]
    assert verify_study(study).is_whole
    again = typed(small, [*rows, [""]], name="c.csv")
    assert compare_sheet(study, protocol, again, "R1", "retest", who="JL") == ()


@pytest.mark.parametrize(
    ("row", "column", "cell", "message"),
    [
        (3, 4, "11", "row 4: arm.realism: needed a whole number, 1 to 10, got '11' "
         "(NA: was left out)"),
        (3, 4, "", "row 4: arm.realism: needed a whole number, 1 to 10, got none "
         "(NA: was left out)"),
        (1, 5, "3", "row 2: end.tired: needed an empty cell in this row, got '3'"),
        (4, 3, "2", "row 5: grade: needed only in rows of presentations, got '2'"),
        (4, 5, "101", "row 5: end.tired: needed a number, 0 to 100, got '101' (NA: was "
         "left out)"),
    ],
)  # fmt: skip
def test_a_wrong_cell_is_named_with_its_row(
    row: int, column: int, cell: str, message: str, new_study: New
) -> None:
    small = new_study(("[schedule]", QUESTIONS))
    rows = answered_sheet(small)
    rows[row][column] = cell
    assert refusal(small, rows) == message


def test_another_sheet_is_refused_with_whose_it_is(
    small: Small, new_study: New
) -> None:
    others = filled(small, "1", "2", "3", rater="R2")
    own = blank(small)
    assert refusal(small, others) == (
        f"row 2: needed {own[1][0]}, the sheet of rater R1 in session test, got "
        f"{others[1][0]}, that of rater R2 in session test"
    )
    assert refusal(small, [row[1:] for row in others]) == (
        "needed the sheet of rater R1 in session test, got that of rater R2 in session "
        "test"
    )
    other = new_study(('id = "three"', 'id = "four"'), name="other")
    rows = filled(other, "1", "2", "3")
    assert refusal(small, rows).endswith(
        f"got {rows[1][0]}, a sheet of another study or of a schedule that was drawn "
        "again"
    )


def test_a_sheet_is_entered_once_and_into_no_session_of_the_console(
    small: Small, new_study: New
) -> None:
    file = typed(small, filled(small, "1", "2", "3"))
    enter(small, file)
    before = small[0].log_file("R1", "test").read_bytes()
    for again in (file, typed(small, filled(small, "2", "2", "3"), name="b.csv")):
        with pytest.raises(SessionLogError) as caught:
            enter(small, again, on="2026-05-01")  # nor its day
        assert str(caught.value).startswith(
            f"{again}: row 2: needed a presentation that was not entered yet, got "
            "position 1, code "
        )
        assert "by MK from typed.csv, row 2" in str(caught.value)
    assert small[0].log_file("R1", "test").read_bytes() == before
    by_console = new_study(name="console")
    rows = filled(by_console, "1", "2", "3")
    file = typed(by_console, rows)
    with pytest.raises(SessionLogError, match="needed a first entry of the sheet"):
        compare(by_console, file)
    assert not by_console[0].log_file("R1", "test").exists()
    run(by_console, console("\n1\n\n2\n\n3\n")[0])
    with pytest.raises(SessionLogError, match="begun with grades = console: needed"):
        enter(by_console, file)
    with pytest.raises(SessionLogError, match=r"got one with grades = console$"):
        compare(by_console, file)


@pytest.mark.parametrize("n_events", [0, 2, 5, 9])
def test_a_process_that_dies_in_the_middle_goes_on(
    n_events: int, new_study: New
) -> None:
    small = new_study(("[schedule]", QUESTIONS))
    rows = answered_sheet(small)
    file = typed(small, rows)
    log = small[0].log_file("R1", "test")
    enter(small, file)
    kinds = [(e.kind, dict(e.fields)) for e in read_log(log)]
    assert len(kinds) == 10
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:n_events]))
    enter(small, file)
    assert [(e.kind, dict(e.fields)) for e in read_log(log)] == kinds


AFTER = 'id = "retest"\nraters = ["R1"]\nafter = "test"\nat_least_days = 14'


def test_days_between_sessions_are_counted_from_the_days_on_the_sheets(
    new_study: New,
) -> None:
    small = study, protocol = new_study(('id = "retest"\nraters = ["R1"]', AFTER))
    now = lambda: datetime(2026, 11, 22, 9, tzinfo=UTC)  # noqa: E731
    enter(small, typed(small, filled(small, "1", "2", "3")), on="2026-11-01", now=now)
    file = typed(small, filled(small, "1", "2", "3", session="retest"), name="b.csv")
    with pytest.warns(
        MasrelWarning, match="at least 14 days after session test, got 9"
    ):
        enter_sheet(
            study,
            protocol,
            file,
            "R1",
            "retest",
            who="MK",
            on="2026-11-10",
            now=now,
        )
    kinds = {e.kind: e.fields for e in read_log(study.log_file("R1", "retest"))}
    assert kinds["held"]["on"] == "2026-11-10"
    assert (kinds["interval"]["days"], kinds["interval"]["kept"]) == (9, False)
    assert verify_study(study).is_whole


def test_what_presented_the_models_is_named_and_never_simulated(small: Small) -> None:
    file = typed(small, filled(small, "1", "2", "3"))
    for name in ("simulated", "Simulated-arm", "", "two words"):
        with pytest.raises(ParameterError, match=r"^device: needed a name of "):
            enter(small, file, device=name)
    enter(small, file, device="wam-arm")
    assert set(ratings_from_logs(*small).table["device"]) == {"wam-arm"}


CELLS = ("", "NA", "1", "1,0", "11", "-1", "7", "x", "=1+1", "\u00e9", "1" * 200)


def mutated(sheet: Rows, rng: random.Random) -> bytes:
    """A sheet as hands that slip leave it, or as it was damaged on its way."""
    rows = [[*row] for row in sheet]
    for _ in range(rng.randint(0, 2)):
        row, other = rng.choice(rows), rng.choice(rows)
        match rng.randrange(6):
            case 0 | 1:
                row[3:4] = [rng.choice(("1", "2", "3", "NA"))]
            case 2:
                column = rng.randrange(len(row) + 1)
                row[column : column + 1] = [rng.choice((*CELLS, *other))]
            case 3:
                rows.insert(rng.randrange(len(rows) + 1), rng.choice((other[:], [])))
            case 4:
                rows = [each for each in rows if each is not row] or rows
            case _:
                rng.shuffle(rng.choice((rows, row)))
    text = io.StringIO(newline="")
    csv.writer(text, delimiter=rng.choice(",,,;\t")).writerows(rows)
    data = bytearray(text.getvalue().encode())
    for _ in range(rng.choice((0, 0, 1, 4))):
        start = rng.randrange(len(data) + 1)
        new = rng.choice([b",", b";", b'"', b"\n", b"\0", b"\xe4", b"NA", b""])
        data[start : start + rng.randint(0, 9)] = new
    return bytes(data)


@pytest.mark.parametrize(
    "seeds",
    [
        pytest.param(range(200)),
        pytest.param(range(200, 2200), marks=pytest.mark.long),
    ],
)
def test_a_mutated_sheet_is_entered_whole_or_refused_in_words(
    new_study: New, seeds: range
) -> None:
    small = study, _ = new_study(
        ("[schedule]", QUESTIONS.replace('"session"', '"study"')),
        ('raters = ["R1"]', 'raters = ["R2"]'),
    )
    rows = answered_sheet(small)
    log, file = study.log_file("R1", "test"), study.root / "mutated.csv"
    n_entered = 0
    for seed in seeds:
        rng = random.Random(seed)
        file.write_bytes(mutated(rows, rng))
        problem = None
        try:
            enter(small, file)
        except MasrelError as error:
            problem = str(error)
        if problem is not None:
            assert 0 < len(problem) < 5000, seed
            assert not log.exists(), seed
            assert not study.conduct_file.exists(), seed
            continue
        n_entered += 1
        kinds = [event.kind for event in read_log(log)]
        assert kinds == ["session", *["entered", "answered"] * 3, "complete"], seed
        assert {row[:3] for row in answered(study)} == {
            ("R1", "end", "tired"),
            ("R1", "end", "words"),
        }
        log.unlink()
        study.conduct_file.unlink()
    assert len(seeds) / 20 < n_entered < len(seeds) / 2  # both are met


def answered(study: StudyPaths) -> list[tuple[object, ...]]:
    """Return what the log of conduct has of answers about the study."""
    log = read_log(study.conduct_file)
    return [tuple(e.fields.values()) for e in log if e.kind == "answered"]


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
    with pytest.raises(ParameterError, match="needed somebody else than who typed the"):
        compare(small, second, who=" mk ")
    with pytest.raises(RatingsError, match=r"the file that was entered as typed\.csv"):
        compare(small, small[0].root / "typed.csv")


@pytest.mark.parametrize("wrong", ["the first", "the second"])
def test_a_difference_is_named_and_stays_a_remark_until_it_is_settled(
    small: Small, wrong: str
) -> None:
    study, protocol = small
    rows, second = entered_twice(small, "1")  # as a spreadsheet may make of 1+
    code, log = rows[1][2], study.log_file("R1", "test")
    (difference,) = compare(small, second)
    assert (difference.code, difference.column, difference.row) == (code, "grade", 2)
    assert (difference.first, difference.second) == ("1+", "1")
    (remark,) = study_remarks(study, protocol)
    assert remark == (
        f"sessions/test_R1.jsonl: the two entries of its sheet differ, code {code}, "
        "grade: the first has 1+, the second 1 (second.csv, row 2). The first counts "
        "until one is mended."
    )
    before = log.read_bytes()
    compare(small, second)  # nothing new
    assert log.read_bytes() == before
    if wrong == "the first":
        reasons = {"who": "MK", "why": "typed wrongly"}
        correction = {"code": code, "grade": "1", **reasons}
        record_correction(study, protocol, "R1", "test", **correction)
    else:
        rows[1][3] = "1+"
        assert compare(small, typed(small, [*rows, [""]], name="mended.csv")) == ()
    assert study_remarks(study, protocol) == ()


def test_answers_are_compared_with_the_log_they_are_in(
    new_study: New,
) -> None:
    about = QUESTIONS.replace('when = "session"', 'when = "study"')
    small = new_study(("[schedule]", about), ('raters = ["R1"]', 'raters = ["R2"]'))
    study, protocol = small
    rows = answered_sheet(small)
    rows[4][6] = "more"
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

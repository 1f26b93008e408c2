"""Who is due when, what is overdue, and a next step that is never refused."""

import io
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from masrel.errors import MasrelWarning, ParameterError
from masrel.lab._event_log import read_log
from masrel.lab.conduct import allot_schedules, record_amendment
from masrel.lab.paper._entry import enter_sheet
from masrel.lab.paper._printing import write_sheets
from masrel.lab.progress import (
    next_step,
    rater_progress,
    session_progress,
    study_status,
)
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol, scale_of
from masrel.lab.ratings import study_remarks
from masrel.lab.run._corrections import record_day
from masrel.lab.run.console import PaperGrades
from masrel.lab.run.session import run_session
from tests.files import edit
from tests.lab.script import ScriptGrades

Small = tuple[StudyPaths, Protocol]
TEST = datetime(2026, 5, 4, 12, tzinfo=UTC)  # the day of the first session
BY = {"who": "JL", "why": "misread"}


def after(days: float) -> Callable[[], datetime]:
    return lambda: TEST + timedelta(days)


@pytest.fixture
def spaced(small: Small) -> Small:
    """A retest one to two weeks after the test, which both raters have done."""
    study, _ = small
    edit(
        study.protocol,
        'id = "retest"\n',
        'id = "retest"\nafter = "test"\nat_least_days = 7\nat_most_days = 14\n',
    )
    protocol = read_protocol(study.protocol)
    for rater in ("R1", "R2"):
        run(study, protocol, rater, "test", 0)
    return study, protocol


def run(
    study: StudyPaths, protocol: Protocol, rater: str, session: str, days: float
) -> None:
    run_session(
        study,
        protocol,
        rater,
        session,
        grades=ScriptGrades(["1", "2", "3"]),
        clock="simulated",
        now=after(days),
    )


@pytest.mark.parametrize("policy", ["refuse", "warn"])
@pytest.mark.parametrize(
    ("days", "is_overdue", "verb"),
    [
        (0, False, "status"),
        (6, False, "status"),
        (7, False, "run"),
        (14, False, "run"),
        (15, True, "ratings"),
    ],
)
def test_a_retest_is_due_in_its_days_and_next_only_then(
    spaced: Small, days: int, is_overdue: bool, verb: str, policy: str
) -> None:
    study, _ = spaced
    order = f'after = "test"\norder_policy = "{policy}"\n'
    edit(study.protocol, 'after = "test"\n', order)
    protocol = read_protocol(study.protocol)
    sessions = session_progress(study, protocol, now=after(days))
    assert [each.held_on for each in sessions] == ["2026-05-04"] * 2 + [None]
    due = sessions[-1].due
    assert (due.first, due.last) == ("2026-05-11", "2026-05-18")
    assert due.is_overdue == is_overdue
    step = next_step(study, sessions, rater_progress(study, protocol, sessions))
    if policy == "warn" and is_overdue:  # late is better than never
        verb = "run"
    assert step.verb == verb
    if verb == "run":
        assert step.command.endswith("--rater R1 --session retest")
    elif policy == "refuse":  # and it is so: the session is refused on that day
        with pytest.raises(ParameterError, match="days after session test"):
            run(study, protocol, "R1", "retest", days)
    if verb == "ratings":
        assert step.why.startswith("1 of 3 sessions can no longer begin")
    assert due.not_today is None or str(days) in due.not_today


def test_before_the_test_nobody_knows_a_day(small: Small) -> None:
    study, _ = small
    edit(study.protocol, 'id = "retest"\n', 'id = "retest"\nafter = "test"\n')
    retest = session_progress(study, read_protocol(study.protocol))[-1]
    assert (retest.due.first, retest.due.last, retest.due.is_overdue) == (None,) * 2 + (
        False,
    )
    assert retest.due.not_today is not None


def following(study: StudyPaths) -> str:
    """The next command, without the study."""
    stands = study_status(study, read_protocol(study.protocol))
    return str(stands["next"]["command"])[7:].replace(f"{study.root}", "STUDY")


def fill(study: StudyPaths, rater: str, session: str) -> Path:
    """Type the grade 1 into every row of a sheet."""
    file = study.typed_file(rater, session)
    rows = file.read_text(encoding="utf-8").splitlines()
    filled = [f"{row}1" if row.startswith("S") else row for row in rows]
    file.write_text("\n".join(filled), encoding="utf-8")
    return file


def test_a_sheet_is_printed_presented_and_entered_in_this_order(small: Small) -> None:
    study, protocol = small
    of_r1, of_r2 = "--rater R1 --session test", "--rater R2 --session test"
    assert following(study) == f"run STUDY {of_r1}"  # nobody knows of paper yet
    write_sheets(study, protocol, raters=["R1"], sessions=["test"])
    assert following(study) == f"run STUDY --grades paper {of_r1}"
    enters = io.StringIO("\n" * 20)
    paper = PaperGrades(scale_of(protocol), answers=enters, questions=io.StringIO())
    run_session(study, protocol, "R1", "test", grades=paper, clock="simulated")
    enter = f"paper enter STUDY STUDY/sheets/test_R1.csv --who WHO {of_r1}"
    assert following(study) == enter
    file = fill(study, "R1", "test")
    assert following(study) == enter
    enter_sheet(study, protocol, file, "R1", "test", who="JL")
    # as whoever was there before
    assert following(study) == f"paper print STUDY {of_r2}"
    write_sheets(study, protocol, raters=["R2"], sessions=["test"])
    assert following(study) == f"run STUDY --grades paper {of_r2}"
    fill(study, "R2", "test")
    assert following(study).startswith("paper enter STUDY STUDY/sheets/test_R2.csv")


def test_what_another_program_presents_masrel_does_not(small: Small) -> None:
    study, protocol = small
    write_sheets(study, protocol, sessions=["test"])
    enter_sheet(study, protocol, fill(study, "R1", "test"), "R1", "test", who="JL")
    assert following(study).startswith("paper enter STUDY STUDY/sheets/test_R2.csv")


def test_a_change_of_the_plan_is_to_be_recorded_first(small: Small) -> None:
    study, _ = small
    study.schedule_file("R1", "test").unlink()  # drawn anew, the log has the draw
    allot_schedules(study, read_protocol(study.protocol))
    assert following(study) == "run STUDY --rater R1 --session test"
    edit(study.protocol, 'id = "retest"\n', 'id = "retest"\nafter = "test"\n')
    assert following(study) == "record amend STUDY --who WHO --why WHY"
    record_amendment(study, read_protocol(study.protocol), **BY)
    assert following(study) == "run STUDY --rater R1 --session test"


def test_a_wrong_day_is_corrected_and_the_days_are_counted_anew(small: Small) -> None:
    study, _ = small
    edit(
        study.protocol,
        'id = "retest"\n',
        'id = "retest"\nafter = "test"\nat_least_days = 7\n',
    )
    protocol = read_protocol(study.protocol)
    for session, day in (("test", 4), ("retest", 6)):
        write_sheets(study, protocol, raters=["R1"], sessions=[session])
        file, on = fill(study, "R1", session), f"2026-05-0{day}"
        if session == "test":
            enter_sheet(study, protocol, file, "R1", session, who="JL", on=on)
        else:
            with pytest.warns(MasrelWarning, match="at least 7 days"):
                enter_sheet(study, protocol, file, "R1", session, who="JL", on=on)
    record_day(study, protocol, "R1", "retest", on="2026-05-16", **BY)
    assert session_progress(study, protocol)[-1].held_on == "2026-05-16"
    assert "held on 2026-05-16, as was" in " ".join(study_remarks(study, protocol))
    log = study.log_file("R1", "retest")
    assert intervals(study) == [(2, False), (12, True)]
    assert [e.fields["on"] for e in read_log(log) if "on" in e.fields] == [
        "2026-05-06",
        "2026-05-16",
    ]
    # the day of the session before counts for the one after it
    for _ in range(2):  # the second as after a kill: it is in the logs once
        with pytest.warns(MasrelWarning, match="at least 7 days"):
            record_day(study, protocol, "R1", "test", on="2026-05-10", **BY)
    assert intervals(study)[2:] == [(6, False)]
    kinds = [event.kind for event in read_log(study.log_file("R1", "test"))]
    assert kinds.count("day-correction") == 1
    for on in ("2999-01-01", "16.5.2026"):
        with pytest.raises(ParameterError, match="on: needed a day up to"):
            record_day(study, protocol, "R1", "test", on=on, **BY)


def intervals(study: StudyPaths) -> list[tuple[object, object]]:
    events = read_log(study.log_file("R1", "retest"))
    fields = [event.fields for event in events if event.kind == "interval"]
    return [(each["days"], each["kept"]) for each in fields]

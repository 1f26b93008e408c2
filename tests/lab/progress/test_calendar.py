"""Who is due when, what is overdue, and a next step that is never refused."""

from collections.abc import Callable
from datetime import UTC, date, datetime, timedelta

import pytest

from masrel.errors import MasrelWarning, ParameterError
from masrel.lab.paper import enter_sheet, write_sheets
from masrel.lab.progress import next_step, rater_progress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.run import ScriptGrades, read_log, record_day, run_session
from tests.files import edit

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
    spaced: Small, days: int, is_overdue: bool, verb: str
) -> None:
    study, protocol = spaced
    sessions = session_progress(study, protocol, now=after(days))
    retest = sessions[-1]
    assert (retest.due_from, retest.due_to) == ("2026-05-11", "2026-05-18")
    assert retest.is_overdue == is_overdue
    step = next_step(study, sessions, rater_progress(study, protocol, sessions))
    assert step.verb == verb
    if verb == "run":
        assert step.command.endswith("--rater R1 --session retest")
    else:  # and it is so: the session is refused on that day
        with pytest.raises(ParameterError, match="days after session test"):
            run(study, protocol, "R1", "retest", days)
    assert retest.refused is None or str(days) in retest.refused


def test_before_the_test_nobody_knows_a_day(small: Small) -> None:
    study, _ = small
    edit(study.protocol, 'id = "retest"\n', 'id = "retest"\nafter = "test"\n')
    retest = session_progress(study, read_protocol(study.protocol))[-1]
    assert (retest.due_from, retest.due_to, retest.is_overdue) == (None, None, False)
    assert retest.refused is not None


def test_who_grades_on_paper_is_awaited_with_the_sheet(small: Small) -> None:
    study, protocol = small
    write_sheets(study, protocol, raters=["R1"], sessions=["test"])
    sessions = session_progress(study, protocol)
    step = next_step(study, sessions, rater_progress(study, protocol, sessions))
    assert step.command.startswith("masrel paper enter")


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
        file = study.typed_file("R1", session)
        rows = file.read_text(encoding="utf-8").splitlines()
        filled = [f"{row}1" if row.startswith("S") else row for row in rows]
        file.write_text("\n".join(filled), encoding="utf-8")
        on = date(2026, 5, day)
        if session == "test":
            enter_sheet(study, protocol, file, "R1", session, who="JL", on=on)
        else:
            with pytest.warns(MasrelWarning, match="at least 7 days"):
                enter_sheet(study, protocol, file, "R1", session, who="JL", on=on)
    record_day(study, protocol, "R1", "retest", on="2026-05-16", **BY)
    log = study.log_file("R1", "retest")
    assert intervals(study) == [(2, False), (12, True)]
    assert [e.fields["on"] for e in read_log(log) if "on" in e.fields] == [
        "2026-05-06",
        "2026-05-16",
    ]
    # the day of the session before counts for the one after it
    with pytest.warns(MasrelWarning, match="at least 7 days"):
        record_day(study, protocol, "R1", "test", on="2026-05-10", **BY)
    assert intervals(study)[2:] == [(6, False)]
    for on in ("2999-01-01", "16.5.2026"):
        with pytest.raises(ParameterError, match="on: needed a day up to"):
            record_day(study, protocol, "R1", "test", on=on, **BY)


def intervals(study: StudyPaths) -> list[tuple[object, object]]:
    events = read_log(study.log_file("R1", "retest"))
    fields = [event.fields for event in events if event.kind == "interval"]
    return [(each["days"], each["kept"]) for each in fields]

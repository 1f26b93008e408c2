"""What happens beside sessions is an event of a chain, and nothing happens without."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime

import pytest

from masrel.errors import (
    ParameterError,
    ScheduleError,
    SessionLogError,
    SessionLogInUseError,
)
from masrel.lab._event_log import SessionLog
from masrel.lab.conduct import (
    Note,
    excluded_raters,
    rater_values,
    read_conduct,
    record_new_rater,
    record_note,
    record_rater_values,
    record_standing,
    record_unblinding,
)
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.run._corrections import record_correction
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from tests.files import edit
from tests.lab.script import ScriptGrades

Small = tuple[StudyPaths, Protocol]
BY = {"who": " MK ", "why": "moved away"}


def codes(study: StudyPaths, rater: str) -> list[str]:
    schedule = read_schedule(study.schedule_file(rater, "test"))
    return [shown.code for shown in schedule.presentations]


def test_events_are_a_chain_with_a_head(small: Small) -> None:
    study, protocol = small
    record_standing(study, protocol, "R2", "withdrawn", **BY)
    record_unblinding(study, protocol, None, rater="R1", who="A", why="b")
    kinds = [event.kind for event in read_conduct(study)]
    assert kinds == ["withdrawn", "unblinded"]
    first, second, _ = study.conduct_file.read_text(encoding="utf-8").splitlines()
    head = json.loads(first)
    assert (head["event"], head["fields"]["format"]) == ("conduct", 1)
    assert json.loads(second)["fields"] == {
        "rater": "R2",
        "who": "MK",
        "why": "moved away",
        "on": None,
    }


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such permissions")
def test_what_happened_is_its_owners_alone(small: Small) -> None:
    study, protocol = small
    record_standing(study, protocol, "R2", "withdrawn", **BY)
    assert study.conduct_file.stat().st_mode & 0o077 == 0


def test_a_changed_line_is_found(small: Small) -> None:
    study, protocol = small
    record_standing(study, protocol, "R2", "withdrawn", **BY)
    record_unblinding(study, protocol, None, who="A", why="b")
    edit(study.conduct_file, '"R2"', '"R1"')
    with pytest.raises(SessionLogError, match="line 3: needed previous"):
        read_conduct(study)
    with pytest.raises(SessionLogError, match="line 3: needed previous"):
        record_standing(study, protocol, "R1", "withdrawn", **BY)


def test_a_session_log_in_its_place_is_refused(small: Small) -> None:
    study, protocol = small
    run(small, "R1")
    study.conduct_file.write_bytes(study.log_file("R1", "test").read_bytes())
    with pytest.raises(SessionLogError, match="needed an event of conduct, withdrawn"):
        read_conduct(study)
    with pytest.raises(SessionLogError, match="line 1: session: needed an event"):
        record_standing(study, protocol, "R2", "withdrawn", **BY)


def run(small: Small, rater: str) -> None:
    grades = ScriptGrades(["1", "2", "3"])
    run_session(*small, rater, "test", grades=grades, clock="simulated")


def test_a_withdrawn_rater_goes_on_with_no_session_but_is_corrected(
    small: Small,
) -> None:
    study, protocol = small
    run(small, "R1")
    before = study.log_file("R1", "test").read_bytes()
    record_standing(study, protocol, "R1", "withdrawn", **BY)
    assert study.log_file("R1", "test").read_bytes() == before
    with pytest.raises(ParameterError, match=r"R1 was withdrawn on [-\d]+$"):
        run(small, "R1")
    with pytest.raises(ParameterError, match="R1 was withdrawn"):
        record_standing(study, protocol, "R1", "withdrawn", **BY)
    record_correction(
        study, protocol, "R1", "test", code=codes(study, "R1")[0], grade="4", **BY
    )


def test_a_code_is_unblinded_after_the_event_is_on_disk(small: Small) -> None:
    study, protocol = small
    code = codes(study, "R2")[1]
    ((schedule, shown),) = record_unblinding(study, protocol, code, **BY)
    assert (schedule.rater, schedule.session, shown.position) == ("R2", "test", 2)
    (event,) = read_conduct(study)
    assert event.fields["code"] == code
    assert (event.fields["rater"], event.fields["session"]) == ("R2", "test")
    # the log says who asked for what, and names no model itself
    text = study.conduct_file.read_text(encoding="utf-8")
    assert not [model.id for model in protocol.models if f'"{model.id}"' in text]


def test_a_code_on_two_sheets_needs_its_rater(small: Small) -> None:
    study, protocol = small
    file = study.schedule_file("R2", "test")
    first, other = codes(study, "R1")[0], codes(study, "R2")[0]
    edit(file, other, first)
    with pytest.raises(ScheduleError, match=r"R1 in session test and R2 in .*--rater"):
        record_unblinding(study, protocol, first, **BY)
    assert not study.conduct_file.exists()
    ((schedule, _),) = record_unblinding(study, protocol, first, rater="R2", **BY)
    assert schedule.rater == "R2"


# What is known of raters, and who is analysed: the last event counts

NewStudy = Callable[..., Small]
FIELDS = """
[rater_fields.years]
type = "whole"
[rater_fields.job]
type = "choice"
choices = ["PT", "MD"]
"""
R1 = '[[raters]]\nid = "R1"\n'


@pytest.fixture
def fielded(new_study: NewStudy) -> Small:
    return new_study((R1, f"{FIELDS}\n{R1}[raters.fields]\nyears = 3\n"))


def test_what_is_recorded_last_goes_before_the_protocol(fielded: Small) -> None:
    study, protocol = fielded
    assert rater_values(study, protocol)["R1"] == {"years": 3, "job": None}
    record_rater_values(study, protocol, "R1", {"years": "4", "job": "MD"}, who="MK")
    record_rater_values(study, protocol, "R1", {"years": " 12 "}, who="AB")
    assert rater_values(study, protocol)["R1"] == {"years": 12, "job": "MD"}
    assert rater_values(study, protocol)["R2"] == {"years": None, "job": None}
    trail = [event.fields["value"] for event in read_conduct(study)]
    assert trail == [4, "MD", 12]
    record_rater_values(study, protocol, "R1", {"job": ""}, who="AB")
    assert rater_values(study, protocol)["R1"]["job"] is None


def test_a_value_that_the_protocol_no_longer_has_is_refused(fielded: Small) -> None:
    study, protocol = fielded
    record_rater_values(study, protocol, "R2", {"job": "PT"}, who="MK")
    edit(study.protocol, '"PT"', '"OT"')
    with pytest.raises(SessionLogError, match='job of R2: needed one of "OT", "MD"'):
        rater_values(study, read_protocol(study.protocol))


def test_an_exclusion_is_taken_back_by_another_event(small: Small) -> None:
    study, protocol = small
    record_standing(study, protocol, "R2", "excluded", **BY)
    assert excluded_raters(study) == ("R2",)
    with pytest.raises(ParameterError, match="needed one who is not excluded, R2 is"):
        record_standing(study, protocol, "R2", "excluded", **BY)
    record_standing(study, protocol, "R2", "included", **BY)
    assert excluded_raters(study) == ()
    with pytest.raises(ParameterError, match="needed one who is excluded, R2 is not"):
        record_standing(study, protocol, "R2", "included", **BY)
    assert [e.kind for e in read_conduct(study)] == ["excluded", "included"]


def test_an_adverse_event_has_what_a_note_has_not(small: Small) -> None:
    study, protocol = small
    record_note(
        study,
        protocol,
        Note(
            text="bruised thumb",
            who="MK",
            kind="adverse-event",
            rater="R1",
            session="test",
            on="2026-05-02",
            onset="2026-05-01",
            severity="mild",
            seriousness="not serious",
            relatedness="possible",
            action=" ice ",
        ),
    )
    (event,) = read_conduct(study)
    assert (event.fields["severity"], event.fields["action"]) == ("mild", "ice")
    assert (event.fields["on"], event.fields["onset"]) == ("2026-05-02", "2026-05-01")
    assert event.fields["outcome"] is None
    with pytest.raises(ParameterError, match="severity: needed with kind 'adverse-ev"):
        record_note(study, protocol, Note(text="late", who="MK", severity="mild"))
    for wrong, needed in (
        ({"seriousness": "grave"}, "needed one of serious, not serious"),
        ({"relatedness": "yes"}, "needed one of unrelated, unlikely"),
        ({"onset": "yesterday"}, "needed a day up to"),
        ({"on": "2999-01-01"}, "needed a day up to"),
    ):
        note = Note(text="a", who="MK", kind="adverse-event", **wrong)
        with pytest.raises(ParameterError, match=needed):
            record_note(study, protocol, note)


def test_a_late_rater_is_added_once_also_after_a_kill(small: Small) -> None:
    study, protocol = small
    for _ in range(2):
        record_new_rater(study, protocol, "R9", ["test"], who="MK")
        text = study.protocol.read_text(encoding="utf-8")
        assert text.count('"R9"') == 2
        (added,) = read_conduct(study)
        study.conduct_file.unlink()  # killed before the log had it
    assert (added.kind, added.fields["rater"]) == ("rater-added", "R9")
    protocol = read_protocol(study.protocol)
    record_new_rater(study, protocol, "R9", ["test"], who="MK")
    with pytest.raises(ParameterError, match="who was not added before, R9 was on"):
        record_new_rater(study, protocol, "R9", ["test"], who="MK")


def test_merged_logs_are_read_in_order_of_time(small: Small) -> None:
    # a clock that was set back changes no order within a log
    study, protocol = small
    for hour in (9, 8, 11):
        day = datetime(2026, 1, 1, hour, tzinfo=UTC)
        note = Note(text=f"A{hour}", who="MK")
        record_note(study, protocol, note, now=lambda day=day: day)
    study.merged_conduct.mkdir()
    study.conduct_file.rename(study.merged_conduct / "north.jsonl")
    day = datetime(2026, 1, 1, 10, tzinfo=UTC)
    record_note(study, protocol, Note(text="B10", who="MK"), now=lambda: day)
    texts = [event.fields["text"] for event in read_conduct(study)]
    assert texts == ["A9", "A8", "B10", "A11"]


def test_a_changed_line_of_a_merged_log_is_found(small: Small) -> None:
    study, protocol = small
    record_note(study, protocol, Note(text="a", who="MK"))
    record_note(study, protocol, Note(text="b", who="MK"))
    study.merged_conduct.mkdir()
    moved = study.conduct_file.rename(study.merged_conduct / "north.jsonl")
    edit(moved, '"a"', '"c"')
    with pytest.raises(SessionLogError, match=r"north.jsonl: line 3: needed previous"):
        read_conduct(study)
    assert json.loads(moved.read_text().splitlines()[1])["fields"]["text"] == "c"


EIGHT = """
import os, sys
from masrel.cli import cli
for number in range(8):
    if os.fork() == 0:
        call = ["record", "note", sys.argv[1], f"note {number}", "--who", "MK"]
        cli.main(call, standalone_mode=False)
        os._exit(0)
sys.exit(sum(os.wait()[1] != 0 for _ in range(8)))
"""


@pytest.mark.slow
def test_eight_notes_at_once_wait_for_each_other_and_no_longer_than_5_s(
    small: Small,
) -> None:
    study, protocol = small
    with SessionLog.open(study.conduct_file):
        process = subprocess.Popen([sys.executable, "-c", EIGHT, str(study.root)])
        time.sleep(2)  # by then all of them wait
    assert process.wait() == 0
    texts = [str(event.fields["text"]) for event in read_conduct(study)]
    assert sorted(texts) == [f"note {number}" for number in range(8)]
    needed = f"{study.conduct_file}: another process has this log open, still after 5 s"
    with (
        SessionLog.open(study.conduct_file),
        pytest.raises(SessionLogInUseError, match=needed),
    ):
        record_note(study, protocol, Note(text="a", who="MK"))

"""Withdrawals and unblindings are events of a chain, and nothing happens without."""

import json
import os

import pytest

from masrel.errors import ParameterError, ScheduleError, SessionLogError
from masrel.lab.conduct import read_conduct, record_standing, record_unblinding
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run import ScriptGrades, record_correction, run_session
from masrel.lab.schedule import read_schedule
from tests.files import edit

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
    with pytest.raises(ParameterError, match=r"R1 was withdrawn on \d{4}-.* by MK"):
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

"""What is known of raters, and who is analysed, is an event; the last one counts."""

import json
from collections.abc import Callable
from datetime import UTC, datetime

import pytest

from masrel.errors import ParameterError, SessionLogError
from masrel.lab.conduct import (
    excluded_raters,
    rater_values,
    read_conduct,
    record_note,
    record_rater_values,
    record_standing,
)
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from tests.files import edit

Small = tuple[StudyPaths, Protocol]
NewStudy = Callable[..., Small]
BY = {"who": "MK", "why": "knew the models"}
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
        "bruised thumb",
        who="MK",
        kind="adverse-event",
        rater="R1",
        session="test",
        severity="mild",
        action=" ice ",
    )
    (event,) = read_conduct(study)
    assert (event.fields["severity"], event.fields["action"]) == ("mild", "ice")
    assert event.fields["outcome"] is None
    with pytest.raises(ParameterError, match="severity: needed with kind 'adverse-ev"):
        record_note(study, protocol, "late", who="MK", severity="mild")


def test_merged_logs_are_read_in_order_of_time(small: Small) -> None:
    # a clock that was set back changes no order within a log
    study, protocol = small
    for hour in (9, 8, 11):
        day = datetime(2026, 1, 1, hour, tzinfo=UTC)
        record_note(study, protocol, f"A{hour}", who="MK", now=lambda day=day: day)
    study.merged_conduct.mkdir()
    study.conduct_file.rename(study.merged_conduct / "north.jsonl")
    day = datetime(2026, 1, 1, 10, tzinfo=UTC)
    record_note(study, protocol, "B10", who="MK", now=lambda: day)
    texts = [event.fields["text"] for event in read_conduct(study)]
    assert texts == ["A9", "A8", "B10", "A11"]


def test_a_changed_line_of_a_merged_log_is_found(small: Small) -> None:
    study, protocol = small
    record_note(study, protocol, "a", who="MK")
    record_note(study, protocol, "b", who="MK")
    study.merged_conduct.mkdir()
    moved = study.conduct_file.rename(study.merged_conduct / "north.jsonl")
    edit(moved, '"a"', '"c"')
    with pytest.raises(SessionLogError, match=r"north.jsonl: line 3: needed previous"):
        read_conduct(study)
    assert json.loads(moved.read_text().splitlines()[1])["fields"]["text"] == "c"

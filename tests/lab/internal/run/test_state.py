"""A log whose events make no session is refused with the line."""

from pathlib import Path

import pytest

from masrel.errors import SessionLogError
from masrel.lab.run import Event
from masrel.lab.run._state import EVENTS, SessionState, replay

Step = tuple[str, dict[str, str | int | float | bool | None]]


def step(kind: str, **facts: str | int | float | bool | None) -> Step:
    return kind, {**dict.fromkeys(EVENTS[kind]), **facts}


def replayed(*steps: Step) -> SessionState:
    events = [
        Event(line=number, kind=kind, time_utc="", fields=facts)
        for number, (kind, facts) in enumerate(steps, start=1)
    ]
    return replay(Path("a.jsonl"), events)


BEGUN = step("session", format=2, rater="R1")
A_SHOWN, A_GRADED = step("presented", code="A"), step("grade", code="A", grade="1")
B_SHOWN, B_GRADED = step("presented", code="B"), step("grade", code="B", grade="2")
FAULT = step("presented", code="A", fault="too fast")
CORRECTED = step("correction", code="A", grade="3")
TAKEN, SKIPPED = step("correction", code="A"), step("skipped", code="A")
OTHER_SOURCE = step("resumed", grades="script")
RECOVERED, DONE = step("recovered"), step("complete")


def test_a_log_says_where_its_session_stands() -> None:
    state = replayed(
        *(RECOVERED, BEGUN, FAULT, step("stopped"), step("resumed"), A_SHOWN),
        *(A_GRADED, CORRECTED, B_SHOWN),
    )
    assert state.first_grades == {"A": "1"}
    assert state.grades == {"A": "3"}
    assert [len(state.presented[code]) for code in "AB"] == [2, 1]
    assert not state.is_complete


def test_the_last_correction_counts_also_after_the_end() -> None:
    other = step("correction", code="A", grade="4")
    state = replayed(BEGUN, A_SHOWN, A_GRADED, CORRECTED, DONE, other)
    assert (state.grades, state.is_complete) == ({"A": "4"}, True)


def test_a_skipped_code_is_settled_and_may_get_its_grade_late() -> None:
    state = replayed(BEGUN, FAULT, SKIPPED, DONE)
    assert (state.grades, state.settled, state.is_complete) == ({}, {"A"}, True)
    late = replayed(BEGUN, FAULT, SKIPPED, DONE, CORRECTED)
    assert (late.first_grades, late.grades) == ({}, {"A": "3"})


def test_a_correction_to_missing_takes_the_grade_away() -> None:
    state = replayed(BEGUN, A_SHOWN, A_GRADED, TAKEN, B_SHOWN, CORRECTED, TAKEN)
    assert (state.first_grades, state.grades) == ({"A": "1"}, {})


def test_no_events_are_no_session() -> None:
    assert replayed() == SessionState()


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ([A_SHOWN], "line 1: presented: needed the event session once"),
        ([BEGUN, BEGUN], "line 2: session: needed the event session once"),
        ([("party", {})], "line 1: party: needed an event of session"),
        ([("grade", {"code": "A"})], "line 1: grade: needed the fields code, posit"),
        ([BEGUN, A_GRADED], "line 2: grade: needed a presentation of A"),
        ([BEGUN, FAULT, A_GRADED], "line 3: grade: .* without fault before"),
        ([BEGUN, A_SHOWN, FAULT, A_GRADED], "line 4: grade: .* without fault"),
        ([BEGUN, A_SHOWN, A_GRADED, A_GRADED], "line 4: grade: needed one grade"),
        ([BEGUN, A_SHOWN, A_GRADED, A_SHOWN], "line 4: presented: .* neither gr"),
        ([BEGUN, CORRECTED], "line 2: correction: needed a code that was presented"),
        (
            [step("session", format=2, grades="console"), A_SHOWN, OTHER_SOURCE],
            "line 3: resumed: needed a session that goes on with console, got script",
        ),
        ([BEGUN, A_SHOWN, TAKEN], "line 3: correction: needed a code that has a gra"),
        ([BEGUN, FAULT, SKIPPED, TAKEN], "line 4: correction: needed a code that has"),
        ([BEGUN, SKIPPED], "line 2: skipped: needed a presentation of A that a fault"),
        ([BEGUN, A_SHOWN, SKIPPED], "line 3: skipped: needed a presentation of A tha"),
        ([BEGUN, FAULT, SKIPPED, SKIPPED], "line 4: skipped: .* nor skipped, got A"),
        ([BEGUN, FAULT, SKIPPED, A_SHOWN], "line 4: presented: .* nor skipped, got A"),
        ([BEGUN, FAULT, step("skipped", code="A", who=3)], "line 3: .* value of who"),
        ([BEGUN, DONE, A_SHOWN], "line 3: presented: needed no event but a corr"),
    ],
)
def test_what_makes_no_session_is_refused_with_the_line(
    steps: list[Step], message: str
) -> None:
    with pytest.raises(SessionLogError, match=rf"a\.jsonl: {message}"):
        replayed(*steps)

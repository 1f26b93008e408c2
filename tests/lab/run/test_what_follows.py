"""A log whose events make no session is refused with the line."""

import re

import pytest

from masrel.lab.progress import SessionProgress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run import SessionLog

Small = tuple[StudyPaths, Protocol]
Step = tuple[str, dict[str, str | int | float | bool | None]]

FIELDS = {
    "session": "format study rater session protocol_sha256 presented_sha256 "
    "schedule_sha256 simulated grades device clock masrel_version rehearsal",
    "resumed": "protocol_sha256 n_graded clock masrel_version grades",
    "presented": "code position attempt recording sha256 facts_sha256 mean_speed_deg_s "
    "n_missed_ticks fault simulated stretches ended n_stretches felt r1_deg r2_deg "
    "grip_lost",
    "grade": "code position grade stretch",
    "correction": "code grade who why",
    "skipped": "code position who why",
    "stopped": "code position why",
    "recovered": "line n_bytes sha256 kept moved_to",
    "complete": "n_presentations",
}


def step(kind: str, **facts: str | int | float | bool | None) -> Step:
    return kind, {**dict.fromkeys(FIELDS[kind].split()), **facts}


def after(small: Small, *steps: Step) -> SessionProgress:
    with SessionLog.open(small[0].log_file("R1", "test")) as log:
        for kind, facts in steps:
            log.append(kind, facts)
    return session_progress(*small)[0]


BEGUN = step("session", format=2, rater="R1")
A_SHOWN, A_GRADED = step("presented", code="A"), step("grade", code="A", grade="1")
B_SHOWN, B_GRADED = step("presented", code="B"), step("grade", code="B", grade="2")
FAULT = step("presented", code="A", fault="too fast")
CORRECTED = step("correction", code="A", grade="3")
TAKEN, SKIPPED = step("correction", code="A"), step("skipped", code="A")
OTHER_SOURCE = step("resumed", grades="script")
RECOVERED, DONE = step("recovered"), step("complete")


@pytest.mark.parametrize(
    ("steps", "stage", "n_graded", "n_skipped"),
    [
        ([], "drawn", 0, 0),
        (
            [
                *(RECOVERED, BEGUN, FAULT, step("stopped"), step("resumed"), A_SHOWN),
                *(A_GRADED, CORRECTED, B_SHOWN),
            ],
            "begun",
            1,
            0,
        ),
        ([BEGUN, A_SHOWN, A_GRADED, CORRECTED, DONE, CORRECTED], "complete", 1, 0),
        ([BEGUN, FAULT, SKIPPED, DONE], "complete", 0, 1),
        ([BEGUN, FAULT, SKIPPED, DONE, CORRECTED], "complete", 1, 1),
        ([BEGUN, A_SHOWN, A_GRADED, TAKEN, B_SHOWN, CORRECTED, TAKEN], "begun", 0, 0),
    ],
)
def test_a_log_says_where_its_session_stands(
    small: Small, steps: list[Step], stage: str, n_graded: int, n_skipped: int
) -> None:
    stands = after(small, *steps)
    assert stands.problem is None
    assert (stands.stage, stands.n_graded, stands.n_skipped) == (
        stage,
        n_graded,
        n_skipped,
    )


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ([A_SHOWN], "line 1: presented: needed the event session once"),
        ([BEGUN, BEGUN], "line 2: session: needed the event session once"),
        ([("party", {})], "line 1: party: needed an event of session"),
        ([("grade", {"code": "A"})], "line 1: grade: needed the fields code, posit"),
        ([BEGUN, A_SHOWN, step("grade", code="A")], "line 3: grade: needed a grade of"),
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
    small: Small, steps: list[Step], message: str
) -> None:
    stands = after(small, *steps)
    assert stands.stage == "unreadable"
    assert re.search(rf"test_R1\.jsonl: {message}", str(stands.problem))

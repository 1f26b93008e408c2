"""What a session log says, event after event: where the session stands."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast, get_args

from masrel.errors import SessionLogError
from masrel.lab._bounded_files import format_problem
from masrel.lab._event_log import Event

if TYPE_CHECKING:
    from masrel.lab.protocol._questions import Answer
    from masrel.lab.recording import _Facts  # loads numpy

Felt = Literal["felt", "below-threshold", "no-catch"]
"""Whether a presentation let feel what its model has."""

FELT: tuple[Felt, ...] = get_args(Felt)

FROM_PAPER = "paper"
"""The source of grades that were written on a sheet."""

AT_THE_DEVICE = ("console", "browser")
"""Where a person grades while models are presented: a session begun at one goes on at
the other."""

FROM_PERSONS = (*AT_THE_DEVICE, FROM_PAPER)
"""Sources of grades, by the names that logs have them by, that are a person's."""

FORMAT = 2
"""Version of session logs; those of version 1 are read, and finished, too."""

_TYPED = ("file", "row", "file_sha256", "who")  # where it stood, and who typed it

_GRIP_LOST = "grip_lost"
"""A field that logs of earlier versions lack."""

_PRESENTED = (
    "code",
    "position",
    "attempt",
    "recording",
    "sha256",
    "facts_sha256",
    "mean_speed_deg_s",
    "n_missed_ticks",
    "fault",
    "simulated",
    "stretches",
    "ended",
    "n_stretches",
    "felt",
    "r1_deg",
    "r2_deg",
    _GRIP_LOST,
)

_RESUMED = ("protocol_sha256", "n_graded", "clock", "masrel_version", "grades")

EVENTS: dict[str, tuple[str, ...]] = {
    "session": (
        "format",
        "study",
        "rater",
        "session",
        "protocol_sha256",
        "presented_sha256",
        "schedule_sha256",
        "simulated",
        "grades",
        "device",
        "clock",
        "masrel_version",
        "rehearsal",
    ),
    "resumed": _RESUMED,
    "presented": _PRESENTED,
    "fault": (
        "code",
        "position",
        "attempt",
        "kind",
        "words",
        "time_s",
        "torque_nm",
        "last_200_ms",
    ),
    "grade": ("code", "position", "grade", "stretch"),
    "practised": (*_PRESENTED, "model"),  # no schedule says which it was
    "practice-grade": ("code", "position", "grade", "stretch"),
    "practice-skipped": ("code", "position", "who", "why"),
    "interval": ("after", "days", "at_least_days", "at_most_days", "kept"),
    "instructed": ("text",),
    "break": ("after", "minutes", "lasted_s"),
    "answered": ("questionnaire", "question", "code", "answer"),
    "answer-correction": (
        "questionnaire",
        "question",
        "code",
        "answer",
        "who",
        "why",
    ),
    "aged": ("last_event_utc", "days", "resume", "restart"),
    "restarted": _RESUMED,
    "entered": ("code", "position", "grade", *_TYPED),
    "reentered": ("code", "column", "value", *_TYPED),
    "held": ("on",),
    "correction": ("code", "grade", "who", "why"),
    "skipped": ("code", "position", "who", "why"),
    "stopped": ("code", "position", "why"),
    "recovered": ("line", "n_bytes", "sha256", "kept", "moved_to"),
    "complete": ("n_presentations",),
}
"""Every kind of event with the fields it has."""

_LATER = {
    "presented": {
        "facts_sha256",
        "stretches",
        "ended",
        "n_stretches",
        "felt",
        "r1_deg",
        "r2_deg",
    },
    "grade": {"stretch"},
    "session": {"rehearsal"},
    "resumed": {"grades"},
    "restarted": {"grades"},
}
"""Fields that events had not when every presentation was one stretch, none was
rehearsed, only the columns of a recording were hashed, and a session went on with the
source of grades that it was begun with."""


# Of practice the same can follow as of the presentations that are rated.
_OF_PRACTICE = {
    "practised": "presented",
    "practice-grade": "grade",
    "practice-skipped": "skipped",
}

_TEXTS = (
    *("code", "grade", "grades", "who", "why"),
    *("questionnaire", "question", "column", "file"),
)
"""Fields that hold text or null, whatever the event."""

_AFTER_COMPLETE = ("correction", "answer-correction", "reentered")

AnswerKey = tuple[str, str, str | None]
"""Questionnaire, question, and the code that it is about, if any."""


@dataclass(slots=True, kw_only=True)
class CodesState:
    """Where the presentations of a session stand, or those for practice."""

    # presentations of each code, in order; none of one that was entered from paper
    presented: dict[str, list[Event]] = field(default_factory=dict)
    # grade of each graded code as the rater gave it
    first_grades: dict[str, str] = field(default_factory=dict)
    # time of day of each of these, in UTC
    graded_at: dict[str, str] = field(default_factory=dict)
    # source of each of these, and of what was skipped
    graded_from: dict[str, str] = field(default_factory=dict)
    # grade of each code that has one, with corrections
    grades: dict[str, str] = field(default_factory=dict)
    # why each skipped code has no grade of the session
    skipped: dict[str, Event] = field(default_factory=dict)
    # codes that are not presented any more: graded, skipped, or corrected
    settled: set[str] = field(default_factory=set)
    # the stretch each grade rests on, where the rater said so
    graded_stretches: dict[str, int] = field(default_factory=dict)


@dataclass(slots=True, kw_only=True)
class SessionState(CodesState):
    """Where a session stands; what was before it began anew is set aside."""

    # fields of the event ``session``; empty when there is none yet
    header: "Mapping[str, _Facts]" = field(default_factory=dict)
    held_on: str | None = None  # day of a session on paper, ISO 8601
    is_complete: bool = False  # whether the session came to its end
    practice: CodesState = field(default_factory=CodesState)
    is_instructed: bool = False  # whether the rater has read the instructions
    # after how many presentations there were breaks
    breaks: set[object] = field(default_factory=set)
    answers: "dict[AnswerKey, Answer]" = field(default_factory=dict)  # with corrections
    answered_from: dict[AnswerKey, str] = field(default_factory=dict)
    source: str | None = None  # where grades and answers come from now
    # the last second entry of each column of each code, or of the session
    reentered: dict[tuple[str | None, str], Event] = field(default_factory=dict)
    # presentations, also for practice, and how many grades were set aside
    set_aside: list[Event] = field(default_factory=list)
    n_set_aside: int = 0

    @property
    def all_presented(self) -> list[Event]:
        """Every presentation that left a recording."""
        parts = (self.presented, self.practice.presented)
        now = (event for part in parts for events in part.values() for event in events)
        return [*self.set_aside, *now]


def replay(path: Path, events: Sequence[Event]) -> SessionState:
    """Return where a session stands after the events of its log."""
    state = SessionState()
    for event in events:
        fault = _contradiction(state, event)
        if fault is not None:
            raise SessionLogError(f"{path}: line {event.line}: {event.kind}: {fault}")
        _apply(state, event)
    return state


def _misshape(event: Event) -> str | None:
    # -> why it is no event of a session, or None
    if event.kind not in EVENTS:
        return f"needed an event of {', '.join(EVENTS)}"
    if event.kind == "session":  # first: another format has other fields
        problem = format_problem(event.fields.get("format"), newest=FORMAT)
        if problem is not None:
            return problem
    fields, got = set(EVENTS[event.kind]), set(event.fields)
    absent = fields - got - {_GRIP_LOST}
    if got - fields or absent not in (set(), _LATER.get(event.kind)):
        return (
            f"needed the fields {', '.join(EVENTS[event.kind])}, "
            f"got {', '.join(event.fields)}"
        )
    wrong = _of_another_type(event)
    if wrong is not None:
        return f"needed another value of {wrong}, got {event.fields[wrong]!r}"
    return None


def _contradiction(state: SessionState, event: Event) -> str | None:
    # -> why the event cannot follow, or None
    problem = _misshape(event)
    if problem is not None or event.kind == "recovered":
        return problem
    if (event.kind == "session") == bool(state.header):
        return "needed the event session once, before all others"
    if state.is_complete and event.kind not in _AFTER_COMPLETE:
        return "needed no event but a correction after complete"
    if event.kind in ("resumed", "restarted"):
        return _contradiction_of_source(state, event)
    if "question" in event.fields:
        return _contradiction_of_answer(state, event)
    if "file_sha256" in event.fields:
        return _contradiction_of_entry(state, event)
    return _contradiction_of_code(*_part(state, event))


def _part(state: SessionState, event: Event) -> tuple[CodesState, Event]:
    # what an event is about, and the event as one of that part
    if event.kind in _OF_PRACTICE:
        return state.practice, dataclasses.replace(event, kind=_OF_PRACTICE[event.kind])
    if event.kind == "fault" and event.fields["code"] in state.practice.presented:
        return state.practice, event
    return state, event


def _of_another_type(event: Event) -> str | None:
    # the field that has no value of its type, or None
    for name in _TEXTS:
        if not isinstance(event.fields.get(name), str | None):
            return name
    for name in ("after", "answer", "value"):
        if isinstance(event.fields.get(name), list):
            return name
    if event.kind == "held" and not _is_day(event.fields["on"]):
        return "on"
    if not isinstance(event.fields.get("row", 0), int):
        return "row"
    speed = event.fields.get("mean_speed_deg_s")
    if not isinstance(speed, float | int | None):
        return "mean_speed_deg_s"
    stretches = event.fields.get("stretches")
    are_stretches = stretches is None or (
        isinstance(stretches, list)
        and all(
            isinstance(stretch, Mapping)
            and isinstance(stretch.get("mean_speed_deg_s", ""), float | int | None)
            for stretch in stretches
        )
    )
    return None if are_stretches else "stretches"


def _is_day(value: object) -> bool:
    try:
        return date.fromisoformat(str(value)).isoformat() == value
    except ValueError:
        return False


def _answer_key(event: Event) -> AnswerKey:
    code = event.fields["code"]
    return (
        str(event.fields["questionnaire"]),
        str(event.fields["question"]),
        None if code is None else str(code),
    )


def may_go_on(begun: object, source: object) -> bool:
    """Return whether a session begun with one source of grades goes on with another."""
    return begun == source or (begun in AT_THE_DEVICE and source in AT_THE_DEVICE)


def _contradiction_of_source(state: SessionState, event: Event) -> str | None:
    begun, source = state.header["grades"], event.fields.get("grades")
    if source is not None and not may_go_on(begun, source):
        return f"needed a session that goes on with {begun}, got {source}"
    return None


def _contradiction_of_answer(state: SessionState, event: Event) -> str | None:
    key = _answer_key(event)
    name, code = f"{key[0]}.{key[1]}", key[2]
    if code is not None and code not in state.presented:
        return f"needed a code that was presented, got {code}"
    if event.kind == "answered" and key in state.answers:
        return f"needed one answer to {name}, got another"
    return None


def _contradiction_of_entry(state: SessionState, event: Event) -> str | None:
    code = event.fields["code"]
    if state.header["grades"] != FROM_PAPER:
        return f"needed a session on paper, got one with {state.header['grades']}"
    if event.kind == "entered" and code in (None, *state.settled):
        return f"needed one entry of each code, got another of {code}"
    if event.kind == "reentered" and code not in (None, *state.settled):
        return f"needed a code that was entered, got {code}"
    return None


def _contradiction_of_code(state: CodesState, event: Event) -> str | None:
    code = event.fields.get("code")
    before = state.presented.get(str(code), [])
    if event.kind in ("presented", "skipped") and code in state.settled:
        return f"needed a code that is neither graded nor skipped, got {code}"
    if event.kind in ("fault", "skipped"):
        if not before or before[-1].fields["fault"] is None:
            return f"needed a presentation of {code} that a fault stopped before it"
    if event.kind == "grade":
        if code in state.settled:
            return f"needed one grade of {code}, got another"
        if not before or before[-1].fields["fault"] is not None:
            return f"needed a presentation of {code} without fault before its grade"
    if event.kind == "correction" and code not in state.presented:
        return f"needed a code that was presented, got {code}"
    if event.kind == "correction" and event.fields["grade"] is None:
        if code not in state.grades:
            return f"needed a code that has a grade, got {code}"
    return None


def _apply(state: SessionState, event: Event) -> None:
    if event.kind == "restarted":
        _set_aside(state)
    if event.kind in ("session", "resumed", "restarted"):
        source = event.fields.get("grades")
        state.source = state.source if source is None else str(source)
    if event.kind == "session":
        state.header = event.fields
    elif event.kind == "complete":
        state.is_complete = True
    elif event.kind == "held":
        state.held_on = str(event.fields["on"])
    elif event.kind == "instructed":
        state.is_instructed = True
    elif event.kind == "break":
        state.breaks.add(event.fields["after"])
    elif "question" in event.fields:
        # no list, or the event would have been refused
        key = _answer_key(event)
        state.answers[key] = cast("Answer", event.fields["answer"])
        state.answered_from.setdefault(key, str(state.source))
    elif event.kind == "reentered":
        code = event.fields["code"]
        of = (None if code is None else str(code), str(event.fields["column"]))
        state.reentered[of] = event
    else:
        _apply_to_code(*_part(state, event), str(state.source))


def _set_aside(state: SessionState) -> None:
    # what was before the session begins anew: it stays in the log, and counts no more
    fresh = SessionState(
        header=state.header,
        source=state.source,
        set_aside=state.all_presented,
        n_set_aside=state.n_set_aside + len(state.grades),
    )
    for each in dataclasses.fields(fresh):
        setattr(state, each.name, getattr(fresh, each.name))


def _apply_to_code(state: CodesState, event: Event, source: str) -> None:
    code, grade = str(event.fields.get("code")), event.fields.get("grade")
    if event.kind in ("grade", "skipped", "correction", "entered"):
        state.settled.add(code)
    if event.kind == "presented":
        state.presented.setdefault(code, []).append(event)
    elif event.kind == "entered":
        state.presented[code] = []  # by what or whom is not known here
        if grade is not None:
            state.first_grades[code] = state.grades[code] = str(grade)
    elif event.kind == "grade":
        state.first_grades[code] = state.grades[code] = str(grade)
        state.graded_at[code] = event.time_utc
        state.graded_from[code] = source
        stretch = event.fields.get("stretch")
        if isinstance(stretch, int):
            state.graded_stretches[code] = stretch
    elif event.kind == "correction":
        state.grades.pop(code, None)
        if grade is not None:
            state.grades[code] = str(grade)
        state.graded_stretches.pop(code, None)  # what was felt was another grade's
    elif event.kind == "skipped":
        state.skipped[code] = event
        state.graded_from[code] = source

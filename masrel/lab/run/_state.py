"""What a session log says, event after event: where the session stands."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any, Literal, cast, get_args

import msgspec

from masrel.errors import SessionLogError
from masrel.lab._event_log import Event, check_kinds, read_log
from masrel.lab._study_files import Facts, once
from masrel.lab.protocol._values import Answer

Felt = Literal["felt", "below-threshold", "no-catch"]
"""Whether a presentation let feel what its model has."""

FELT: tuple[Felt, ...] = get_args(Felt)

FROM_PAPER = "paper"
"""The source of grades that were written on a sheet."""

NO_DEVICE = "none"
"""What logs call the device where nobody says what presented the models."""

AT_THE_DEVICE = ("console", "browser")
"""Where a person grades while models are presented: a session begun at one goes on at
the other."""

FROM_PERSONS = (*AT_THE_DEVICE, FROM_PAPER)
"""Sources of grades, by the names that logs have them by, that are a person's."""

NO_GRADE = "NA"
"""What is typed where a presentation has no grade."""

FORMAT = 2
"""Version of session logs; those of version 1 are read, and finished, too."""

_TYPED = ("file", "row", "file_sha256", "who")  # where it stood, and who typed it

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
    "grip_lost",
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
    "day-correction": ("on", "who", "why"),
    "correction": ("code", "grade", "who", "why"),
    "skipped": ("code", "position", "who", "why"),
    "stopped": ("code", "position", "why"),
    "recovered": ("line", "n_bytes", "sha256", "kept", "moved_to"),
    "complete": ("n_presentations",),
}
"""Every kind of event with the fields it has."""

LATER: dict[str, tuple[set[str], ...]] = {
    "presented": (
        {"grip_lost"},
        {
            *("facts_sha256", "stretches", "ended", "n_stretches"),
            *("felt", "r1_deg", "r2_deg"),
        },
    ),
    "practised": ({"grip_lost"},),
    "grade": ({"stretch"},),
    "session": ({"rehearsal"},),
    "resumed": ({"grades"},),
    "restarted": ({"grades"},),
}
"""Fields that events had not when every presentation was one stretch, none was
rehearsed, only the columns of a recording were hashed, a session went on with the
source of grades that it was begun with, and nobody looked whether the grip was lost."""

# Of practice the same can follow as of the presentations that are rated.
_OF_PRACTICE = {
    "practised": "presented",
    "practice-grade": "grade",
    "practice-skipped": "skipped",
}


class _Stretch(msgspec.Struct):
    """What is read of a stretch."""

    mean_speed_deg_s: float | None


# What a field that is read by its type holds, whatever the event
_TYPES: dict[str, object] = {
    **dict.fromkeys(("code", "grade", "grades", "who", "why", "file"), str | None),
    **dict.fromkeys(("questionnaire", "question", "column"), str | None),
    **dict.fromkeys(("after", "answer", "value"), str | float | bool | None),
    "on": date,
    "row": int,
    "position": int | None,
    **dict.fromkeys(("model", "intended"), str),
    "mean_speed_deg_s": float | None,
    "stretches": list[_Stretch] | None,
}

_AFTER_COMPLETE = (
    *("correction", "answer-correction", "reentered"),
    *("day-correction", "interval"),  # which is counted anew
)

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
    """The state of a session; what was before it started again is set aside."""

    # fields of the event ``session``; empty when there is none yet
    header: "Mapping[str, Facts]" = field(default_factory=dict)
    held_on: str | None = None  # its day where that is not the log's, ISO 8601
    is_complete: bool = False  # whether the session came to its end
    practice: CodesState = field(default_factory=CodesState)
    is_instructed: bool = False  # whether the rater has read the instructions
    # after how many presentations there were breaks
    breaks: set[object] = field(default_factory=set)
    answers: dict[AnswerKey, Answer] = field(default_factory=dict)  # with corrections
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


@once
def read_session(log: Path) -> tuple[tuple[Event, ...], SessionState]:
    """Return the verified events of a session's log, and where the session stands."""
    events = read_log(log)
    return events, replay(log, events)


def replay(path: Path, events: Sequence[Event]) -> SessionState:
    """Return where a session stands after the events of its log."""
    check_kinds(path, events, EVENTS, head="session", newest=FORMAT, later=LATER)
    state = SessionState()
    for event in events:
        problem = of_another_type(event) or _contradiction(state, event)
        if problem is not None:
            raise SessionLogError(f"{path}: line {event.line}: {event.kind}: {problem}")
        _apply(state, event)
    return state


def of_another_type(event: Event) -> str | None:
    """Return which field of an event holds what it cannot hold, or None."""
    for name, value in event.fields.items():
        try:
            msgspec.convert(value, _TYPES.get(name, Any))
        except msgspec.ValidationError:
            return f"needed another value of {name}, got {value!r}"
    return None


def _contradiction(state: SessionState, event: Event) -> str | None:
    """Return why the event cannot follow those before it, or None."""
    if event.kind == "recovered":
        return None
    if (event.kind == "session") == bool(state.header):
        return "needed the event session once, before all others"
    if state.is_complete and event.kind not in _AFTER_COMPLETE:
        return "needed no event but a correction after complete"
    part, kind = _part(state, event)
    fields = event.fields
    code, begun = fields.get("code"), state.header.get("grades")
    source = fields.get("grades")
    before = part.presented.get(str(code), [])
    is_settled = code in part.settled
    is_stopped = bool(before) and before[-1].fields["fault"] is not None
    is_known = code is None or code in state.presented
    is_missing = fields.get("grade") is None
    answered = _answer_key(event) if kind == "answered" else None
    # Events, whether this would be wrong of one of them, and what it needs
    rules: tuple[tuple[tuple[str, ...], bool, str], ...] = (
        (
            ("resumed", "restarted"),
            source is not None and not may_go_on(begun, source),
            f"a session that resumes with {begun}, got {source}",
        ),
        (
            ("answered", "answer-correction"),
            not is_known,
            f"a code that was presented, got {code}",
        ),
        (
            ("answered",),
            answered in state.answers,
            f"one answer to {'.'.join(answered[:2])}, got another" if answered else "",
        ),
        (
            ("entered", "reentered"),
            begun != FROM_PAPER,
            f"a session on paper, got one with {begun}",
        ),
        (
            ("entered",),
            code is None or is_settled,
            f"one entry of each code, got another of {code}",
        ),
        (
            ("reentered",),
            code is not None and not is_settled,
            f"a code that was entered, got {code}",
        ),
        (
            ("presented", "skipped"),
            is_settled,
            f"a code that is neither graded nor skipped, got {code}",
        ),
        (
            ("fault", "skipped"),
            not is_stopped,
            f"a presentation of {code} that a fault stopped before it",
        ),
        (("grade",), is_settled, f"one grade of {code}, got another"),
        (("grade",), is_missing, f"a grade of {code}, got none"),
        (
            ("grade",),
            is_stopped or not before,
            f"a presentation of {code} without fault before its grade",
        ),
        (
            ("correction",),
            code not in part.presented,
            f"a code that was presented, got {code}",
        ),
        (
            ("correction",),
            is_missing and code not in part.grades,
            f"a code that has a grade, got {code}",
        ),
        (
            ("complete",),
            fields.get("n_presentations") != len(state.settled),
            f"n_presentations {len(state.settled)}, as many as were graded or skipped, "
            f"got {fields.get('n_presentations')}",
        ),
    )
    broken = (needs for of, is_wrong, needs in rules if kind in of and is_wrong)
    needs = next(broken, None)
    return None if needs is None else f"needed {needs}"


def _part(state: SessionState, event: Event) -> tuple[CodesState, str]:
    # what an event is about, and the kind of event that it is there
    if event.kind in _OF_PRACTICE:
        return state.practice, _OF_PRACTICE[event.kind]
    if event.kind == "fault" and event.fields["code"] in state.practice.presented:
        return state.practice, event.kind
    return state, event.kind


def _answer_key(event: Event) -> AnswerKey:
    code = event.fields["code"]
    return (
        str(event.fields["questionnaire"]),
        str(event.fields["question"]),
        None if code is None else str(code),
    )


def may_go_on(begun: object, source: object) -> bool:
    """Return whether a session begun with one source of grades resumes with another."""
    return begun == source or (begun in AT_THE_DEVICE and source in AT_THE_DEVICE)


def _apply(state: SessionState, event: Event) -> None:
    fields, source = event.fields, event.fields.get("grades")
    if event.kind == "restarted":
        _set_aside(state)
    if source is not None:
        state.source = str(source)
    match event.kind:
        case "session":
            state.header = fields
        case "complete":
            state.is_complete = True
        case "held" | "day-correction":
            state.held_on = str(fields["on"])
        case "instructed":
            state.is_instructed = True
        case "break":
            state.breaks.add(fields["after"])
        case "answered" | "answer-correction":
            key = _answer_key(event)
            # no list, or the event would have been refused
            state.answers[key] = cast("Answer", fields["answer"])
            state.answered_from.setdefault(key, str(state.source))
        case "reentered":
            code = None if fields["code"] is None else str(fields["code"])
            state.reentered[code, str(fields["column"])] = event
        case _:
            _apply_to_code(*_part(state, event), event, str(state.source))


def _set_aside(state: SessionState) -> None:
    # what was before the session begins again: it stays in the log, and counts no more
    fresh = SessionState(
        header=state.header,
        source=state.source,
        set_aside=state.all_presented,
        n_set_aside=state.n_set_aside + len(state.grades),
    )
    for each in dataclasses.fields(fresh):
        setattr(state, each.name, getattr(fresh, each.name))


def _apply_to_code(state: CodesState, kind: str, event: Event, source: str) -> None:
    code, grade = str(event.fields.get("code")), event.fields.get("grade")
    match kind:
        case "presented":
            state.presented.setdefault(code, []).append(event)
        case "entered":
            state.presented.setdefault(code, [])  # unless masrel did, nobody knows how
            if grade is not None:
                state.first_grades[code] = str(grade)
        case "grade":
            state.first_grades[code] = str(grade)
            state.graded_at[code] = event.time_utc
        case "skipped":
            state.skipped[code] = event
    if kind in ("grade", "skipped"):
        state.graded_from[code] = source
    if kind in ("grade", "skipped", "correction", "entered"):
        state.settled.add(code)
        state.grades.pop(code, None)
        state.graded_stretches.pop(code, None)  # what was felt was another grade's
    if grade is not None:
        state.grades[code] = str(grade)
        if isinstance(stretch := event.fields.get("stretch"), int):
            state.graded_stretches[code] = stretch


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetDifference:
    """A cell in which the second entry of a sheet differs from the log.

    Attributes
    ----------
    code : str or None
        Of the presentation; None for a question about the session or the study.
    column : str
        ``"grade"``, or the column of a question.
    first, second : str
        What the log has and what the second file has; "NA" where that is nothing.
    file : str
        Name of the second file.
    row : int
        Its row.
    who : str
        Who typed it.
    """

    code: str | None
    column: str
    first: str
    second: str
    file: str
    row: int
    who: str


def sheet_differences(
    state: SessionState, of_study: Mapping[tuple[str, str], Answer]
) -> tuple[SheetDifference, ...]:
    """Return in what the last second entry of a sheet differs from the logs."""
    first: dict[tuple[str | None, str], object] = {
        **{(code, "grade"): grade for code, grade in state.grades.items()},
        **{(None, ".".join(key)): answer for key, answer in of_study.items()},
        **{
            (code, f"{questionnaire}.{question}"): answer
            for (questionnaire, question, code), answer in state.answers.items()
        },
    }
    differences = [
        SheetDifference(
            code=code,
            column=column,
            first=_shown(first.get((code, column))),
            second=_shown(event.fields["value"]),
            file=str(event.fields["file"]),
            row=int(str(event.fields["row"])),
            who=str(event.fields["who"]),
        )
        for (code, column), event in state.reentered.items()
        if event.fields["value"] != first.get((code, column))
    ]
    return tuple(sorted(differences, key=lambda each: each.row))


def _shown(value: object) -> str:
    return NO_GRADE if value is None else str(value)

"""What a session log says, event after event: where the session stands."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from masrel.errors import SessionLogError
from masrel.run._log import Event

if TYPE_CHECKING:
    from masrel.recording import _Facts  # loads numpy

Felt = Literal["felt", "below-threshold", "no-catch"]
"""Whether a presentation let feel what its model has."""

FELT: tuple[Felt, ...] = get_args(Felt)

FROM_PERSONS = ("console",)
"""Sources of grades, by the names that logs have them by, that are a person's."""

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
    "resumed": ("protocol_sha256", "n_graded", "clock", "masrel_version"),
    "presented": (
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
    ),
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
    "correction": ("code", "grade", "who", "why"),
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
}
"""Fields that events had not when every presentation was one stretch, none was
rehearsed, and only the columns of a recording were hashed."""


@dataclass(slots=True, kw_only=True)
class SessionState:
    """Where a session stands."""

    # fields of the event ``session``; empty when there is none yet
    header: "Mapping[str, _Facts]" = field(default_factory=dict)
    # presentations of each code, in order
    presented: dict[str, list[Event]] = field(default_factory=dict)
    # grade of each graded code as the rater gave it
    first_grades: dict[str, str] = field(default_factory=dict)
    grades: dict[str, str] = field(default_factory=dict)  # the same with corrections
    # the stretch each grade rests on, where the rater said so
    graded_stretches: dict[str, int] = field(default_factory=dict)
    is_complete: bool = False  # whether the session came to its end


def replay(path: Path, events: Sequence[Event]) -> SessionState:
    """Return where a session stands after the events of its log."""
    state = SessionState()
    for event in events:
        fault = _contradiction(state, event)
        if fault is not None:
            raise SessionLogError(f"{path}: line {event.line}: {event.kind}: {fault}")
        _apply(state, event)
    return state


def _contradiction(state: SessionState, event: Event) -> str | None:
    # -> why the event cannot follow, or None
    if event.kind not in EVENTS:
        return f"needed an event of {', '.join(EVENTS)}"
    fields = set(EVENTS[event.kind])
    if set(event.fields) not in (fields, fields - _LATER.get(event.kind, set())):
        return (
            f"needed the fields {', '.join(EVENTS[event.kind])}, "
            f"got {', '.join(event.fields)}"
        )
    wrong = _of_another_type(event)
    if wrong is not None:
        return f"needed another value of {wrong}, got {event.fields[wrong]!r}"
    if event.kind == "recovered":
        return None
    if (event.kind == "session") == bool(state.header):
        return "needed the event session once, before all others"
    if state.is_complete and event.kind != "correction":
        return "needed no event but a correction after complete"
    return _contradiction_of_code(state, event)


def _of_another_type(event: Event) -> str | None:
    # the field that has no value of its type, or None
    if not isinstance(event.fields.get("code"), str | None):
        return "code"
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


def _contradiction_of_code(state: SessionState, event: Event) -> str | None:
    code = event.fields.get("code")
    if event.kind == "presented" and code in state.first_grades:
        return f"needed a code that is not graded yet, got {code}"
    if event.kind == "fault":
        before = state.presented.get(str(code), [])
        if not before or before[-1].fields["fault"] is None:
            return f"needed a presentation of {code} that a fault stopped before it"
    if event.kind == "grade":
        if code in state.first_grades:
            return f"needed one grade of {code}, got another"
        before = state.presented.get(str(code), [])
        if not before or before[-1].fields["fault"] is not None:
            return f"needed a presentation of {code} without fault before its grade"
    if event.kind == "correction" and code not in state.first_grades:
        return f"needed a code that is graded, got {code}"
    return None


def _apply(state: SessionState, event: Event) -> None:
    code, grade = str(event.fields.get("code")), str(event.fields.get("grade"))
    if event.kind == "session":
        state.header = event.fields
    elif event.kind == "presented":
        state.presented.setdefault(code, []).append(event)
    elif event.kind == "grade":
        state.first_grades[code] = state.grades[code] = grade
        stretch = event.fields.get("stretch")
        if isinstance(stretch, int):
            state.graded_stretches[code] = stretch
    elif event.kind == "correction":
        state.grades[code] = grade
        state.graded_stretches.pop(code, None)  # what was felt was another grade's
    elif event.kind == "complete":
        state.is_complete = True

"""Notes, deviations from the protocol, and adverse events."""

from collections.abc import Callable
from datetime import datetime
from typing import TYPE_CHECKING, Literal, get_args

from masrel.errors import ParameterError
from masrel.lab._event_log import utc_now
from masrel.lab.conduct._study_log import append_event, check_rater, stated
from masrel.lab.protocol import Protocol, StudyPaths

if TYPE_CHECKING:
    from masrel.lab.recording import _Fact  # loads numpy

NoteKind = Literal["note", "adverse-event", "deviation"]
"""What a note is of."""

Severity = Literal["mild", "moderate", "severe"]
"""How severe an adverse event is."""

NOTE_KINDS: tuple[NoteKind, ...] = get_args(NoteKind)
SEVERITIES: tuple[Severity, ...] = get_args(Severity)


def record_note(
    study: StudyPaths,
    protocol: Protocol,
    text: str,
    *,
    who: str,
    kind: NoteKind = "note",
    rater: str | None = None,
    session: str | None = None,
    severity: Severity | None = None,
    action: str | None = None,
    outcome: str | None = None,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record a note, a deviation from the protocol, or an adverse event.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    text : str
        What happened.
    who : str
        Who says so.
    kind : {"note", "adverse-event", "deviation"}, optional
        What it is.
    rater, session : str, optional
        To whom and in which session it happened; to the study as a whole unless given.
    severity : {"mild", "moderate", "severe"}, optional
        Of an adverse event alone, as `action` and `outcome`.
    action, outcome : str, optional
        What was done, and what came of it.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If a text is blank, `kind` or `severity` is unknown, the protocol has no such
        rater or session, or something of an adverse event is said of anything else.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    _check_choice("kind", kind, NOTE_KINDS)
    if rater is not None:
        check_rater(protocol, rater)
    if session is not None:
        _check_choice("session", session, [each.id for each in protocol.sessions])
    details = {"severity": severity, "action": action, "outcome": outcome}
    for name, detail in details.items():
        if detail is not None and kind != "adverse-event":
            raise ParameterError(
                f"{name}: needed with kind 'adverse-event' only, got it with {kind!r}"
            )
    if severity is not None:
        _check_choice("severity", severity, SEVERITIES)
    facts = {name: detail for name, detail in details.items() if detail is not None}
    fields: dict[str, _Fact] = {
        "kind": kind,
        **stated(text=text, who=who),
        "rater": rater,
        "session": session,
        **details,
        **stated(**facts),
    }
    append_event(study, protocol, "noted", fields, now=now)


def _check_choice(name: str, value: str, choices: tuple[str, ...] | list[str]) -> None:
    if value not in choices:
        raise ParameterError(
            f"{name}: needed one of {', '.join(choices)}, got {value!r}"
        )
